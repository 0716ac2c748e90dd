"""Runs of components in this process: preemption, cancel, late results."""

from __future__ import annotations

import itertools

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Outcome, cancelled, failure, success
from florence_bt.core.transforms import Transform3
from florence_bt.simulation.rig.skills import rig_skills
from florence_bt.simulation.rig.wires import ExclusiveComponent, Wires
from florence_bt.skills.locator.hotspots import Hotspot, Hotspots
from florence_bt.skills.locator.locating import Locating, LocatorParameters


class Component:
    """Something that can be started and told to stop, and that says when it has stopped."""

    def __init__(self):
        self.exclusive = ExclusiveComponent()
        self.stops = 0

    def begin(self):
        return self.exclusive.begin("working", self._stop)

    def _stop(self):
        self.stops += 1


@pytest.fixture
def component():
    return Component()


def test_a_run_lasts_until_the_component_is_done(component):
    run = component.begin()
    woken = []
    run.on_change(lambda: woken.append(run.poll()))
    assert run.poll() is None and run.feedback == "working"
    component.exclusive.finish(success(pay=3))
    assert run.poll() == success(pay=3) and woken == [success(pay=3)]
    component.exclusive.finish(failure("late", "too late"))
    assert run.poll() == success(pay=3) and len(woken) == 1


def test_a_newer_run_ends_the_older_one_and_keeps_its_own_result(component):
    older = component.begin()
    newer = component.begin()
    assert older.poll().outcome is Outcome.CANCELLED and "newer" in older.poll().reason
    assert newer.poll() is None and component.stops == 0
    older.cancel()
    assert component.stops == 0  # the newer one goes on
    component.exclusive.finish(success())
    assert newer.poll() == success()


def test_a_cancel_reaches_the_component_once_and_its_end_counts(component):
    run = component.begin()
    run.cancel()
    run.cancel()
    assert component.stops == 1 and run.poll() is None
    component.exclusive.finish(cancelled())
    assert run.poll().outcome is Outcome.CANCELLED
    run.cancel()
    assert component.stops == 1


def test_a_newer_run_while_the_older_one_is_being_cancelled(component):
    older = component.begin()
    older.cancel()
    newer = component.begin()
    component.exclusive.finish(success())
    assert older.poll().outcome is Outcome.CANCELLED and newer.poll() == success()


def test_a_component_that_stops_within_the_cancel():
    exclusive = ExclusiveComponent()
    run = exclusive.begin("working", lambda: exclusive.finish(cancelled()))
    run.cancel()
    assert run.poll().outcome is Outcome.CANCELLED


def test_any_order_of_begin_cancel_and_finish_leaves_at_most_one_open_run():
    for steps in itertools.product("bcf", repeat=6):
        component, runs = Component(), []
        for step in steps:
            if step == "b":
                runs.append(component.begin())
            elif step == "c" and runs:
                runs[-1].cancel()
            elif step == "f":
                component.exclusive.finish(success())
        assert [run for run in runs if run.poll() is None] in ([], runs[-1:])


def answers_of(wires, ports):
    """The skills of the locator, called one after the other."""
    skills = rig_skills(wires)

    def call(name, **inputs):
        ports.clock.advance(0.0)
        return skills[name].start(inputs).poll()

    return call


def test_the_locator_as_skills():
    wires = Wires(ManualClock(), [("base_footprint", "base_link", Transform3.identity())])
    hotspots = Hotspots([Hotspot("kitchen", Pose2(1.0, 2.0, 0.5))])
    Locating(wires.ports("florenceLocator"), hotspots, LocatorParameters(initial_user_room="kitchen"))
    hardware = wires.ports("hardware")
    call = answers_of(wires, hardware)
    assert call("get_user_room").outputs["room"] == "kitchen"
    assert call("get_hotspot", label="kitchen").outputs["pose"] == Pose2(1.0, 2.0, 0.5)
    assert call("get_hotspot", label="kitchn").code == "unknown_hotspot"
    assert call("get_robot_pose").code == "no_pose"
    hardware.send_frame("map", "odom", 0.0, Pose2(1.0, 1.0))
    hardware.send_frame("odom", "base_footprint", 0.0, Pose2())
    assert call("get_robot_pose").outputs["pose"] == Pose2(1.0, 1.0, 0.0)
    assert call("robot_in_room", room="kitchen").succeeded
    assert call("robot_in_room", room="attic").code == "elsewhere"
    (view,) = call("get_views", room="kitchen").outputs["poses"]
    assert view.distance_to(Pose2(1.0, 2.0)) == 0.0 and view.yaw == pytest.approx(0.5)
    assert call("get_rooms", rooms=()).outputs == {"rooms": ("kitchen",)}
    assert call("get_rooms", rooms=("attic",)).code == "unknown_room"
    assert call("set_user_position", user=Pose2(3.0, 3.0)).succeeded
    assert call("get_user_room").outputs["source"] == "setUserPosXYPhi"


def test_what_is_left_to_chance_is_the_same_with_the_same_seed():
    def picks(seed):
        pick = rig_skills(Wires(ManualClock(), []), seed)["pick_random"]
        return [pick.start({"items": tuple(range(9))}).poll().outputs["item"] for _ in range(20)]

    assert picks(1) == picks(1) != picks(2)


def test_conditions_judge_the_messages_of_the_topics_of_the_rig():
    wires, heard = Wires(ManualClock(), []), []
    battery = rig_skills(wires)["battery_above"]
    assert battery.start({"charge": 0.2}).poll().code == "server_lost"
    battery.watch({"charge": 0.2}, lambda: heard.append(battery.start({"charge": 0.2}).poll().code))
    for charge in (0.5, 0.4, 0.1):
        wires.topics["battery_state"].publish(percentage=charge)
    assert heard == ["ok", "battery_low"]
