"""The locator's rules: rooms, the user's position, the override and the status words."""

from __future__ import annotations

import math

import numpy as np
import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result
from florence_bt.core.sensing import OCCUPIED, UNKNOWN, OccupancyGrid
from florence_bt.skills.locator.bindings import BINDINGS
from florence_bt.skills.locator.hotspots import Hotspot, Hotspots
from florence_bt.skills.locator.locator import LastSeen, Locator
from florence_bt.trees.language.declarations import own_declarations

KITCHEN = Hotspot("kitchen", Pose2(1.0, 1.0, 0.5), "room", ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)))
BEDROOM = Hotspot("bedroom", Pose2(5.0, 1.0, 0.0))
HALL = Hotspot("hall", Pose2(5.0, 6.0, 0.0))
TV = Hotspot("tv", Pose2(9.0, 9.0, 0.0), "object")


@pytest.fixture
def locator() -> Locator:
    return Locator(Hotspots([KITCHEN, BEDROOM, HALL, TV]), ManualClock())


@pytest.mark.parametrize(
    ("x", "y", "room"),
    [
        (3.9, 0.9, "kitchen"),  # nearer to the bedroom's hotspot, but inside the kitchen
        (4.2, 1.0, "bedroom"),
        (5.0, 3.4, "bedroom"),
        (5.0, 3.6, "hall"),
        (9.0, 9.0, "hall"),  # objects never answer
        (-50.0, 1.0, "kitchen"),
    ],
)
def test_the_room_is_the_polygon_else_the_nearest_hotspot(
    locator: Locator, x: float, y: float, room: str
) -> None:
    assert locator.room_of(x, y) == room


def test_without_rooms_the_room_is_empty() -> None:
    locator = Locator(Hotspots([TV]), ManualClock())
    assert locator.room_of(0.0, 0.0) == ""
    assert locator.room_of_pose(None) == ""


def test_a_coordinate_always_replaces_and_a_room_only_when_it_differs(locator: Locator) -> None:
    assert locator.get_user_room().code == "user_unknown"
    assert locator.set_user_room("kitchen").succeeded
    assert locator.user == KITCHEN.pose
    assert locator.set_user_position(Pose2(3.0, 3.0, 1.0)).succeeded
    assert locator.set_user_room("kitchen").succeeded
    assert locator.user == Pose2(3.0, 3.0, 1.0), "the finer coordinate in the same room stays"
    assert locator.set_user_room("bedroom").succeeded
    assert locator.user == BEDROOM.pose
    assert locator.get_user_room().outputs == {"room": "bedroom", "source": "setUserPosRoom", "age": 0.0}


def test_an_unknown_room_changes_nothing_and_is_explained(locator: Locator) -> None:
    locator.set_user_position(Pose2(3.0, 3.0))
    result = locator.set_user_room("bed room")
    assert not result.succeeded and "bedroom" in result.reason
    assert locator.user == Pose2(3.0, 3.0)


def test_the_place_of_an_object_may_tell_where_the_user_is(locator: Locator) -> None:
    locator.set_user_position(Pose2(3.0, 3.0))
    assert locator.set_user_room("tv").succeeded
    assert locator.user == TV.pose


@pytest.mark.parametrize("pose", [Pose2(math.nan, 0.0), Pose2(0.0, math.inf), Pose2(0.0, 0.0, math.nan)])
def test_what_is_not_finite_is_refused(locator: Locator, pose: Pose2) -> None:
    assert locator.set_user_position(pose).code == "bad_input"
    assert locator.set_hotspot("kitchen", pose).code == "bad_input"
    assert locator.why_not_goto_pose(pose)
    assert locator.user is None


def test_who_sits_on_a_sofa_is_remembered_and_a_place_off_the_map_changes_nothing(locator: Locator) -> None:
    cells = np.zeros((4, 4), np.int8)
    cells[1, 2], cells[3, 3] = OCCUPIED, UNKNOWN
    sofa = Pose2(1.25, 0.75)
    assert locator.set_user_position(Pose2(9.0, -9.0)).succeeded, (
        "nothing is known about a place without a map"
    )
    locator.map = OccupancyGrid(0.5, Pose2(), cells)
    for place in (sofa, Pose2(0.75, 0.75), Pose2(1.75, 1.75), Pose2(2.5, 1.0), sofa):
        assert locator.set_user_position(place).succeeded, (
            "occupied, free, unknown, and just outside of the map"
        )
        assert locator.user == place
    for sources in ("setUserPosXYPhi", "detected_user"):
        refused = locator.set_user_position(Pose2(9.0, -9.0), sources)
        assert refused.code == "bad_input" and "outside the map (x 0 to 2 m, y 0 to 2 m)" in refused.reason
    assert locator.user == sofa


def test_the_robot_is_not_sent_where_the_map_knows_nothing(locator: Locator) -> None:
    cells = np.zeros((4, 4), np.int8)
    cells[3, 3] = UNKNOWN
    assert locator.why_not_goto_pose(Pose2(9.0, 9.0)) is None, "nothing is known without a map"
    locator.set_hotspot("kitchen", Pose2(9.0, 9.0))
    locator.map = OccupancyGrid(0.5, Pose2(), cells)
    assert locator.why_not_goto_pose(Pose2(0.25, 0.25)) is None
    assert "where the map knows nothing" in (locator.why_not_goto_pose(Pose2(1.75, 1.75)) or "")
    assert "outside the map" in (locator.why_not_goto_pose(Pose2(9.0, 9.0)) or "")
    assert "the hotspot 'kitchen'" in (locator.why_not_goto_room("kitchen") or "")


@pytest.mark.parametrize("pose", [Pose2(1.25, 0.75), Pose2(1.75, 1.75), Pose2(9.0, 9.0), Pose2(-0.1, 0.5)])
def test_no_hotspot_is_stored_where_the_map_has_no_place_for_a_robot(locator: Locator, pose: Pose2) -> None:
    cells = np.zeros((4, 4), np.int8)
    cells[1, 2], cells[3, 3] = OCCUPIED, UNKNOWN
    locator.map = OccupancyGrid(0.5, Pose2(), cells)
    for label in ("kitchen", "a new one"):
        refused = locator.set_hotspot(label, pose)
        assert refused.code == "bad_input" and f"({pose.x:.2f} m, {pose.y:.2f} m)" in refused.reason
    assert locator.hotspots.get("a new one") is None
    assert locator.hotspots.get("kitchen") == KITCHEN
    assert locator.set_hotspot("kitchen", Pose2(0.25, 0.25)).succeeded


def test_the_initial_room_must_exist() -> None:
    assert Locator(Hotspots([KITCHEN]), ManualClock(), "kitchen").user == KITCHEN.pose
    with pytest.raises(ConfigError, match="kitchen"):
        Locator(Hotspots([KITCHEN]), ManualClock(), "kitchn")


def test_hotspots_can_be_moved_and_added(locator: Locator) -> None:
    assert locator.set_hotspot("kitchen", Pose2(2.0, 2.0)).succeeded
    assert locator.get_hotspot("kitchen").outputs["pose"] == Pose2(2.0, 2.0)
    assert locator.room_of(3.9, 0.9) == "kitchen", "the polygon stays"
    assert locator.set_hotspot("study", Pose2(9.0, 1.0)).succeeded
    assert locator.room_of(9.0, 1.2) == "study"
    assert not locator.set_hotspot("  ", Pose2()).succeeded


def test_the_likely_rooms_begin_where_the_user_was_last_and_go_on_with_the_nearest(locator: Locator) -> None:
    assert locator.likely_rooms() == ("kitchen", "bedroom", "hall"), "as in the file, without objects"
    locator.robot = Pose2(5.0, 5.0)
    assert locator.likely_rooms() == ("hall", "bedroom", "kitchen")
    locator.set_user_position(Pose2(3.0, 3.0))
    assert locator.likely_rooms() == ("kitchen", "bedroom", "hall"), "the bedroom is nearer to the kitchen"


def test_the_override_refuses_every_goto_and_nothing_else(locator: Locator) -> None:
    locator.set_user_room("kitchen")
    assert locator.why_not_goto_user() is None
    assert locator.why_not_goto_room("kitchen") is None
    assert locator.why_not_goto_pose(Pose2()) is None
    locator.override = True
    for refusal in (
        locator.why_not_goto_user(),
        locator.why_not_goto_room("kitchen"),
        locator.why_not_goto_pose(Pose2()),
    ):
        assert refusal is not None and "override" in refusal
    assert locator.set_user_position(Pose2(1.0, 1.0)).succeeded
    locator.override = False
    assert locator.why_not_goto_user() is None


def test_goto_needs_a_known_user_and_a_known_room(locator: Locator) -> None:
    refusal = locator.why_not_goto_user()
    assert refusal is not None and "where the user is" in refusal
    refusal = locator.why_not_goto_room("kichen")
    assert refusal is not None and "kitchen" in refusal
    assert locator.why_not_goto_room("tv") is None


@pytest.mark.parametrize(
    ("state", "status"),
    [
        ("IDLE", "LOST"),
        ("ACTIVE", "ACTIVE"),
        ("SUCCEEDED", "SUCCEEDED"),
        ("ABORTED", "ABORTED"),
        ("PREEMPTED", "PREEMPTED"),
        ("REJECTED", "REJECTED"),
    ],
)
def test_the_status_speaks_as_move_base(locator: Locator, state: str, status: str) -> None:
    assert locator.status == "LOST"
    locator.take_run_state(state)
    assert locator.status == status


def check(skill: str, result: Result) -> None:
    """A result keeps what the declaration promises."""
    declared = own_declarations()[skill]
    if result.succeeded:
        assert set(result.outputs) == set(declared.outputs)
        for name, value in result.outputs.items():
            assert declared.outputs[name].problem_with(value) is None
    else:
        assert result.code in declared.failures


def test_the_skills_keep_their_declarations(locator: Locator) -> None:
    for known in (False, True):
        if known:
            locator.robot = Pose2(1.0, 1.0)
            locator.set_user_room("hall")
        check("get_user_room", locator.get_user_room())
        check("get_hotspot", locator.get_hotspot("hall" if known else "hull"))
        check("get_views", locator.get_views("hall" if known else "hull"))
        check("set_user_position", locator.set_user_position(Pose2(1.0, 2.0)))
    assert len({served.skill for served in BINDINGS}) == 7


def test_the_room_has_its_source_and_age() -> None:
    clock = ManualClock(100.0)
    locator = Locator(Hotspots([KITCHEN, BEDROOM]), clock, "kitchen")
    clock.advance(5.0)
    assert locator.get_user_room().outputs == {"room": "kitchen", "source": "initial_user_room", "age": 5.0}
    locator.set_user_position(Pose2(5.0, 1.0))
    clock.advance(7.0)
    assert locator.get_user_room().outputs == {"room": "bedroom", "source": "setUserPosXYPhi", "age": 7.0}


def test_a_sighting_replaces_what_began_before_it() -> None:
    clock = ManualClock(100.0)
    locator = Locator(Hotspots([KITCHEN, BEDROOM]), clock, "kitchen")
    assert locator.take_sighting("bedroom", LastSeen("pir", 40.0, 50.0)).succeeded
    assert locator.get_user_room().outputs == {"room": "bedroom", "source": "pir", "age": 50.0}, (
        "the room at the start is only believed"
    )
    locator.set_user_position(Pose2(3.0, 3.0))
    clock.advance(10.0)
    assert locator.take_sighting("bedroom", LastSeen("pir", 99.0, 110.0)).succeeded
    assert locator.get_user_room().outputs["room"] == "kitchen", "the motion began before"
    locator.take_sighting("bedroom", LastSeen("pir", 100.0, 110.0))
    assert locator.user == BEDROOM.pose


def test_a_sighting_in_the_same_room_leaves_the_finer_position() -> None:
    clock = ManualClock(100.0)
    locator = Locator(Hotspots([KITCHEN, BEDROOM]), clock)
    locator.set_user_position(Pose2(3.0, 3.0, 1.0))
    clock.advance(10.0)
    locator.take_sighting("kitchen", LastSeen("pir", 90.0, 110.0))
    assert locator.user == Pose2(3.0, 3.0, 1.0)
    assert locator.get_user_room().outputs == {"room": "kitchen", "source": "pir", "age": 0.0}
    locator.take_sighting("bedroom", LastSeen("door", 99.0, 99.0))
    assert locator.get_user_room().outputs["room"] == "kitchen", "it was seen here since"
    locator.take_sighting("kitchen", LastSeen("switch", 50.0, 50.0))
    assert locator.get_user_room().outputs["age"] == 0.0, "an older sighting makes it no older"


def test_a_sighting_that_cannot_be_is_refused() -> None:
    locator = Locator(Hotspots([KITCHEN]), ManualClock(100.0))
    assert locator.take_sighting("kichen", LastSeen("pir", 90.0, 95.0)).code == "unknown_hotspot"
    assert locator.take_sighting("kitchen", LastSeen("pir", 90.0, 200.0)).code == "bad_input"
    assert locator.user is None


def test_a_clock_that_was_set_back_does_not_keep_the_future() -> None:
    clock = ManualClock(9_000.0)
    locator = Locator(Hotspots([KITCHEN, BEDROOM]), clock)
    locator.set_user_room("kitchen")
    clock._now = 10.0
    locator.take_sighting("bedroom", LastSeen("pir", 9.0, 10.0))
    assert locator.get_user_room().outputs["room"] == "bedroom"
