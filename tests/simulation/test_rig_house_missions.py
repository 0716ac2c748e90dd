"""The missions that go through the whole flat, in the rig."""

from __future__ import annotations

import pytest

from florence_bt.app.demo.rigs import make_rig
from florence_bt.runtime.run import RunStatus

pytestmark = pytest.mark.slow


def test_a_patrol_tells_who_was_seen_where():
    rig = make_rig(seed=1, person="kitchen", user_room="hall")
    run = rig.run("patrol", {"rooms": "hall, kitchen"})
    assert run.status is RunStatus.SUCCEEDED, run.reason
    assert run.outputs["report"].startswith("hall: nobody was seen. kitchen: a person was seen at (x ")
    assert rig.found[0].distance_to(rig.world.person_pose("user")) < 0.3


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
    rig.clock.call_at(rig.clock.now() + 3.0, lambda: setattr(rig, "charge_fraction", 0.1))
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
