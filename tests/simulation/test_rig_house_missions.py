"""The missions that go through the whole flat, in the rig."""

from __future__ import annotations

from itertools import pairwise

import pytest

from florence_bt.app.demo.rigs import make_rig
from florence_bt.core.clock import call_every
from florence_bt.core.geometry import Pose2
from florence_bt.core.zones import KEEP_OUT, Zone
from florence_bt.runtime.run import RunStatus
from florence_bt.simulation.home.people import PersonSpec

pytestmark = pytest.mark.slow


def test_a_patrol_tells_who_was_seen_where():
    rig = make_rig(seed=1, person="kitchen", user_room="hall")
    run = rig.run("patrol", {"rooms": "hall, kitchen"})
    assert run.status is RunStatus.SUCCEEDED, run.reason
    assert run.outputs["report"].startswith("hall: nobody was seen. kitchen: a person was seen at (x ")
    assert rig.found[0].distance_to(rig.world.person_pose("user")) < 0.3


def test_a_room_behind_a_closed_zone_is_not_reached_and_the_zone_is_named():
    hall = ((4.2, 2.3), (5.5, 2.3), (5.5, 3.6), (4.2, 3.6))
    rig = make_rig(seed=1, person="absent", zones=[Zone("wet floor", KEEP_OUT, hall)])
    run = rig.run("goto_room", {"room": "kitchen"})
    assert (run.status, run.code) == (RunStatus.FAILED, "no_path")
    assert "'wet floor' closes every way" in run.reason
    inside = rig.run("goto_pose", {"x": "5 m", "y": "3 m", "phi": "0 deg"})
    assert inside.code == "goal_occupied" and "'wet floor'" in inside.reason


def test_the_user_is_found_where_they_usually_are_at_this_hour():
    rig = make_rig(seed=1, person="kitchen", user_room="hall")
    rig.locator.habits.saw("kitchen", rig.clock.now())
    run = rig.run("find_user")
    assert run.status is RunStatus.SUCCEEDED, run.reason
    assert run.outputs["report"] == "hall: nobody was seen. kitchen: the user was seen."
    assert run.outputs["user"].distance_to(rig.world.person_pose("user")) < 0.3
    assert rig.locator.get_user_room().outputs["room"] == "kitchen"


def test_a_patrol_with_a_low_battery_goes_home():
    rig = make_rig(seed=1, person="absent", user_room="hall")
    rig.clock.call_at(rig.clock.now() + 3.0, lambda: setattr(rig.robot.base, "charge_fraction", 0.1))
    run = rig.run("patrol", {"rooms": "living_room"})
    assert (run.status, run.code) == (RunStatus.FAILED, "battery_low")
    rig.clock.advance(1.0)
    assert rig.world.robot_pose.distance_to(rig.world.flat.start) < 0.15
    assert rig.world.contacts == []


def test_a_reminder_is_said_in_front_of_the_user_until_it_is_confirmed():
    rig = make_rig(seed=1, person="kitchen")
    said = []

    def hear(message):
        said.append((message.data, rig.world.robot_pose.distance_to(rig.world.person_pose("user"))))
        if len(said) == 2:
            rig.clock.call_at(rig.clock.now() + 3.0, lambda: rig.topics["answer"].publish(data="yes"))

    rig.topics["say"].subscribe(hear)
    run = rig.run("remind", {"text": "Please drink something.", "pause": "5 s"})
    assert run.status is RunStatus.SUCCEEDED, run.reason
    assert run.outputs["answer"] == "yes"
    assert [text for text, _ in said] == ["Please drink something."] * 2
    assert all(0.8 < distance < 1.5 for _, distance in said)


@pytest.mark.parametrize(
    ("pose", "surface", "code"),
    [(Pose2(3.0, 6.2, 0.5), 0.0, "user_lying"), (Pose2(7.7, 6.9, -1.57), 0.52, "ok")],
    ids=["on the floor", "in bed"],
)
def test_a_night_check_is_slow_and_raises_help_for_who_lies_on_the_floor(pose, surface, code):
    rig = make_rig(seed=2, person=PersonSpec("user", pose, "lying", surface=surface))
    helped, places, lying = [], [], []
    rig.topics["user_lying"].subscribe(lambda message: lying.append(message.data))
    rig.topics["help"].subscribe(lambda message: helped.append(message.data))
    call_every(rig.clock, 0.5, lambda: places.append(rig.world.robot_pose))
    run = rig.run("night_check")
    assert run.code == code, run.reason
    assert helped == ([] if code == "ok" else ["The user is lying on the floor: living_room."])
    assert (True in lying) == (code == "user_lying")
    assert 0.1 < fastest(places) < 0.17
    rig.run("goto_room", {"room": "hall"})
    assert fastest(places) > 0.3, "the limit was taken back"


def fastest(places):
    """The highest speed between places of every half second, m/s."""
    return max(here.distance_to(before) / 0.5 for before, here in pairwise(places))
