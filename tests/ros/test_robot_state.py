"""The state of the robot as commands hear it: what came, how old it is, and what hangs."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("rclpy")

from diagnostic_msgs.msg import DiagnosticArray
from florence_interfaces.msg import StopReason
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState

from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.core.heard import MISSED_PERIODS, Freshness
from florence_bt.core.topic_names import DIAGNOSTICS, SERVERS_STATUS, SUPERVISOR
from florence_bt.ros.conversions import header_to_ros, stamp_to_ros
from florence_bt.ros.diagnostics import diagnostics_publisher, diagnostics_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.present_time import PresentTimeOfStamps
from florence_bt.ros.qos import LATCHED, RELIABLE
from florence_bt.ros.robot_state import (
    BATTERY,
    DIAGNOSIS_PERIOD_S,
    HELD,
    LATENESS_PERIOD_S,
    SERVERS_PERIOD_S,
    RobotState,
)
from tests.ros.conftest import GENEROUS_S

pytestmark = pytest.mark.ros


@pytest.mark.parametrize(("behind_s", "worth"), [(1.0, Freshness.FRESH), (60.0, Freshness.OLD)])
def test_a_battery_that_was_kept_is_as_old_as_its_stamp(ros: Any, behind_s: float, worth: Freshness) -> None:
    base, listener = ros.add(FlorenceNode("base")), ros.add(FlorenceNode("listener"))
    stamp = base.stamp() - behind_s
    publisher = base.create_publisher(BatteryState, BATTERY.topic, LATCHED)
    publisher.publish(BatteryState(header=header_to_ros("base_link", stamp), percentage=0.5))
    battery = RobotState(listener).listen(BATTERY)
    assert battery.freshness is Freshness.NEVER
    ros.spin_until(lambda: battery.last is not None)
    assert battery.last.charge == 0.5 and battery.freshness is worth
    assert battery.age == pytest.approx(behind_s, abs=GENEROUS_S)


def test_stamps_are_of_the_simulated_time_once_it_is_told(ros: Any) -> None:
    base, listener = ros.add(FlorenceNode("base")), ros.add(FlorenceNode("listener"))
    clock = base.create_publisher(Clock, "/clock", RELIABLE)
    time = PresentTimeOfStamps(listener)
    assert time.of_stamp(100.0) is None, "a clock that nobody tells"
    assert time.of_stamp(base.stamp() - 60.0) == pytest.approx(base.stamp(), abs=GENEROUS_S)

    def told(simulated: float) -> bool:
        clock.publish(Clock(clock=stamp_to_ros(simulated)))
        return time.of_stamp(base.stamp()) == time.simulated() == simulated

    ros.spin_until(lambda: told(100.0))
    ros.spin_until(lambda: told(100.5))


class HandTime:
    """A clock of steady time that a test sets; stamps tell nothing."""

    def __init__(self) -> None:
        self.now = 50.0

    def steady(self) -> float:
        return self.now

    def of_stamp(self, stamp: float) -> None:
        return None


def test_what_nodes_say_of_themselves_comes_at_once_and_gets_old(ros: Any) -> None:
    up, busy, listener = (ros.add(FlorenceNode(name)) for name in (SUPERVISOR, "busy", "listener"))
    found = {
        "process hardware": Diagnosis(Severity.ERROR, "has not answered for 3 s"),
        "process people": Diagnosis(Severity.OK, "runs"),
    }
    publisher, server_publisher = diagnostics_publisher(up), diagnostics_publisher(up)
    publisher.publish(diagnostics_to_ros(found, SUPERVISOR, "", up.stamp()))
    lacks = {SERVERS_STATUS: Diagnosis(Severity.WARN, "missions fail", {"scan": "service /cart/scan"})}
    server_publisher.publish(diagnostics_to_ros(lacks, "florence_bt", "", up.stamp()))
    busy.health.count_late(3.2)
    time = HandTime()
    state = RobotState(listener, time)
    state.listen_to_diagnostics()
    ros.spin_until(
        lambda: state.late() and state.processes_in_trouble() and any(state.diagnoses(about=SERVERS_STATUS)),
        what="what was told before",
    )
    assert state.late() == ["the process of busy is 3.2 s behind: the machine is too busy"]
    assert state.processes_in_trouble() == {"process hardware": "has not answered for 3 s"}
    assert (SUPERVISOR, "process people", found["process people"]) in state.fresh_diagnoses()
    time.now += MISSED_PERIODS * DIAGNOSIS_PERIOD_S + 0.1
    assert state.processes_in_trouble() == {} and state.late(), "who is late tells that late, too"
    time.now += MISSED_PERIODS * LATENESS_PERIOD_S
    assert any(state.fresh_diagnoses(about=SERVERS_STATUS)), "it is told every 5 s"
    time.now += MISSED_PERIODS * SERVERS_PERIOD_S
    assert not any(state.fresh_diagnoses(about=SERVERS_STATUS))
    heard = state.diagnosis(SUPERVISOR, "process hardware")
    assert state.late() == [] and heard is not None and heard.freshness is Freshness.OLD


def test_the_diagnostics_of_others_are_heard_too(ros: Any) -> None:
    other, listener = ros.add(FlorenceNode("other")), ros.add(FlorenceNode("listener"))
    state = RobotState(listener)
    state.listen_to_diagnostics()
    publisher = other.create_publisher(DiagnosticArray, DIAGNOSTICS, RELIABLE)  # nothing is kept

    def told() -> Any:
        hot = {"motor": Diagnosis(Severity.WARN, "hot")}
        publisher.publish(diagnostics_to_ros(hot, "cart", "", other.stamp() - 30.0))
        return state.diagnosis("cart", "motor")

    assert ros.spin_until(told).freshness is Freshness.OLD


def test_what_a_node_told_goes_with_it(ros: Any) -> None:
    base, listener = ros.add(FlorenceNode("base")), ros.add(FlorenceNode("listener"))
    state = RobotState(listener)
    held = state.listen(HELD)
    base.create_publisher(StopReason, HELD.topic, LATCHED).publish(
        StopReason(code="bumper", text="it touches")
    )

    def told() -> bool:
        state.look_who_is_left()
        return held.last == "it touches"

    ros.spin_until(told)
    ros.close_node(base)

    def gone() -> bool:
        state.look_who_is_left()
        return held.last is None

    ros.spin_until(gone, what="that nobody is left")
