"""What the locator answers, as skills: each answer of a server, and the limits of what is stored."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result
from florence_bt.core.serving import ServiceBinding
from florence_bt.skills.locator.bindings import BINDINGS
from florence_bt.skills.locator.habits import RoomHabits
from florence_bt.skills.locator.hotspots import Hotspot, Hotspots
from florence_bt.skills.locator.locator import MAX_AHEAD_S, MAX_HOTSPOTS, LastSeen, Locator

KITCHEN, HALL = Hotspot("kitchen", Pose2(1.0, 1.0, 0.5)), Hotspot("hall", Pose2(5.0, 6.0))


def binding(skill: str) -> ServiceBinding:
    (found,) = (each for each in BINDINGS if each.skill == skill)
    return found


def answered(skill: str, **fields: Any) -> Result:
    """The result of a skill whose server answers with these fields."""
    return binding(skill).result(SimpleNamespace(**fields))


def test_an_answer_that_is_valid_becomes_a_success_with_its_values() -> None:
    seen = answered("get_user_room", valid=True, room="hall", age=3.5, source="pir")
    assert (seen.succeeded, seen.outputs) == (True, {"room": "hall", "age": 3.5, "source": "pir"})
    for skill in ("get_hotspot", "get_robot_pose"):
        found = answered(skill, valid=True, x=1.0, y=2.0, phi=0.5, message="")
        assert found.outputs == {"pose": Pose2(1.0, 2.0, 0.5)}
    assert answered("robot_in_room", valid=True, room="hall").outputs == {"room": "hall"}
    assert answered("set_user_position", success=True, message="").succeeded


def test_an_answer_that_is_not_valid_becomes_a_failure_with_its_reason() -> None:
    nothing: dict[str, Any] = {
        "room": "",
        "age": 0.0,
        "source": "",
        "x": 0.0,
        "y": 0.0,
        "phi": 0.0,
        "poses": [],
    }
    said = {"valid": False, "success": False, "message": "as the server says"}
    for skill, code, reason in (
        ("get_user_room", "user_unknown", "where the user is"),
        ("get_hotspot", "unknown_hotspot", "as the server says"),
        ("get_views", "unknown_room", "as the server says"),
        ("robot_in_room", "no_pose", "does not know where it is"),
        ("get_robot_pose", "no_pose", "does not know where it is"),
        ("set_user_position", "bad_input", "as the server says"),
    ):
        result = answered(skill, **nothing, **said)
        assert (result.succeeded, result.code) == (False, code)
        assert reason in result.reason


def test_views_are_poses_in_the_plane() -> None:
    half = math.sqrt(0.5)
    poses = [
        SimpleNamespace(
            position=SimpleNamespace(x=1.0, y=2.0, z=0.0),
            orientation=SimpleNamespace(x=0.0, y=0.0, z=half, w=half),
        ),
        SimpleNamespace(
            position=SimpleNamespace(x=3.0, y=4.0, z=0.0),
            orientation=SimpleNamespace(x=0.0, y=0.0, z=0.0, w=1.0),
        ),
    ]
    first, second = answered("get_views", valid=True, message="", poses=poses).outputs["poses"]
    assert (first.x, first.y, first.yaw) == pytest.approx((1.0, 2.0, math.pi / 2))
    assert second == Pose2(3.0, 4.0)


def test_requests_carry_the_inputs() -> None:
    request = binding("set_user_position").request
    assert request is not None
    assert request({"user": Pose2(1.0, 2.0, 0.5)}) == {"x": 1.0, "y": 2.0, "phi": 0.5}
    for skill, inputs in (("get_hotspot", {"label": "hall"}), ("get_views", {"room": "hall"})):
        ask = binding(skill).request
        assert ask is not None
        assert ask(inputs) == inputs


def test_the_room_that_was_asked_for_is_compared_with_the_one_where_the_robot_is() -> None:
    judge, there = binding("robot_in_room").judge, answered("robot_in_room", valid=True, room="hall")
    assert judge is not None
    assert judge({"room": "hall"}, there).succeeded
    elsewhere = judge({"room": "kitchen"}, there)
    assert (elsewhere.code, elsewhere.reason) == ("elsewhere", "the robot is in 'hall', not in 'kitchen'")


@pytest.mark.parametrize(
    ("wanted", "rooms"),
    [
        ((), ("kitchen", "hall")),
        (("hall",), ("hall",)),
        ((" hall ", "", "hall", "kitchen"), ("hall", "kitchen")),
        ((" ",), ("kitchen", "hall")),
    ],
)
def test_rooms_are_those_that_are_wanted_each_once_or_all(
    wanted: tuple[str, ...], rooms: tuple[str, ...]
) -> None:
    judge = binding("get_rooms").judge
    assert judge is not None
    found = answered("get_rooms", message=" kitchen, hall,, kitchen", success=True)
    assert judge({"rooms": wanted}, found).outputs == {"rooms": rooms}


def test_a_room_that_is_not_there_is_named_with_those_that_look_like_it() -> None:
    judge = binding("get_rooms").judge
    assert judge is not None
    refused = judge({"rooms": ("hall", "kichen")}, answered("get_rooms", message="kitchen, hall"))
    assert refused.code == "unknown_room"
    assert refused.reason == "there is no room 'kichen' (would have worked: kitchen)"


# ---- what is stored ------------------------------------------------------------------------------------


def test_there_are_at_most_so_many_hotspots_and_known_ones_still_move() -> None:
    spots = Hotspots(Hotspot(f"h{n}", Pose2(), "object") for n in range(MAX_HOTSPOTS - 1))
    locator = Locator(spots, ManualClock())
    assert locator.set_hotspot("last", Pose2(1.0, 1.0)).succeeded
    refused = locator.set_hotspot("one more", Pose2())
    assert refused.code == "bad_input" and f"there are {MAX_HOTSPOTS} hotspots already" in refused.reason
    assert len(locator.hotspots) == MAX_HOTSPOTS
    assert locator.set_hotspot("h0", Pose2(2.0, 2.0)).succeeded


def test_a_stored_hotspot_is_answered_with_its_kind() -> None:
    locator = Locator(Hotspots([HALL]), ManualClock(), room_names=["den"])
    assert locator.set_hotspot("Den 2", Pose2(1.0, 2.0)).outputs["hotspot"] == Hotspot(
        "Den 2", Pose2(1.0, 2.0)
    )
    assert locator.set_hotspot("desk", Pose2()).outputs["hotspot"].kind == "object"
    moved = locator.set_hotspot("hall", Pose2(0.0, 1.0)).outputs["hotspot"]
    assert moved == Hotspot("hall", Pose2(0.0, 1.0)), "its kind stays, whatever new ones are called"


@pytest.mark.parametrize("which", ["since", "at"])
def test_a_sighting_may_be_so_far_ahead_and_no_further(which: str) -> None:
    clock = ManualClock(100.0)
    locator = Locator(Hotspots([KITCHEN]), clock)
    moment = {"since": 90.0, "at": 100.0}
    late = locator.take_sighting("kitchen", LastSeen("pir", **(moment | {which: 100.1 + MAX_AHEAD_S})))
    assert late.code == "bad_input" and "in the future" in late.reason
    assert locator.user is None
    assert locator.take_sighting(
        "kitchen", LastSeen("pir", **(moment | {which: 100.0 + MAX_AHEAD_S}))
    ).succeeded
    assert locator.user == KITCHEN.pose


def test_the_same_sensor_may_take_back_how_long_it_saw_somebody_and_another_may_not() -> None:
    clock = ManualClock(100.0)
    locator = Locator(Hotspots([KITCHEN, HALL]), clock)
    locator.take_sighting("kitchen", LastSeen("pir", 50.0, 95.0))
    locator.take_sighting("kitchen", LastSeen("pir", 50.0, 80.0))
    assert locator.get_user_room().outputs["age"] == 20.0
    locator.take_sighting("kitchen", LastSeen("door", 50.0, 70.0))
    assert locator.get_user_room().outputs == {"room": "kitchen", "source": "door", "age": 20.0}
    locator.take_sighting("hall", LastSeen("pir", 49.0, 99.0))
    assert locator.get_user_room().outputs["room"] == "kitchen", "that began before"
    locator.take_sighting("hall", LastSeen("pir", 50.0, 99.0))
    assert locator.get_user_room().outputs["room"] == "hall", "that began as late"


def test_somebody_who_was_seen_in_the_future_is_as_old_as_now() -> None:
    locator = Locator(Hotspots([KITCHEN]), ManualClock(100.0))
    locator.take_sighting("kitchen", LastSeen("pir", 90.0, 105.0))
    assert locator.get_user_room().outputs["age"] == 0.0


def test_where_the_user_is_believed_at_the_start_is_no_habit() -> None:
    habits = RoomHabits()
    clock = ManualClock(1e9)
    locator = Locator(Hotspots([KITCHEN, HALL]), clock, "kitchen", habits)
    assert habits.count("kitchen", 1e9) == 0
    locator.set_user_room("hall")
    assert habits.count("hall", 1e9) == 1
    locator.set_user_position(Pose2(1.0, 1.0))
    assert habits.count("kitchen", 1e9) == 1


def test_rooms_are_looked_into_by_habit_before_distance() -> None:
    habits = RoomHabits()
    now = 1e9
    study, attic = Hotspot("study", Pose2(2.0, 1.0)), Hotspot("attic", Pose2(9.0, 9.0))
    for day in range(3):
        habits.saw("attic", now + 86400.0 * day)
    habits.saw("hall", now)
    locator = Locator(Hotspots([KITCHEN, study, HALL, attic]), ManualClock(now), habits=habits)
    locator.robot = Pose2(0.0, 0.0)
    assert locator.likely_rooms() == ("attic", "hall", "study", "kitchen"), (
        "from the hall the study is nearer"
    )
    locator.set_user_room("study")
    assert locator.likely_rooms() == ("study", "attic", "hall", "kitchen")
