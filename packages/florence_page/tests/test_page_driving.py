"""Driving by hand on the page: who drives, when the robot stops, what a viewer may say."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

pytest.importorskip("nicegui")
pytest.importorskip("rclpy")

from florence_page.access import ROLE, Role
from florence_page.driving import HAND_SILENT_S, HandDriving
from florence_page.parts import LiveParts
from florence_page.presses import beat
from florence_page.server import RobotViewers

from florence_bt.app.teleop.hands import TeleopParameters
from florence_bt.core.clock import ManualClock
from florence_bt.core.geometry import STANDSTILL, Twist2


class Bench:
    def __init__(self):
        self.clock = ManualClock()
        self.override = True
        self.sent = []
        self.speeds = []
        self.driving = HandDriving(self.clock, lambda: self.override, self.sent.append, self.speeds.append)

    def take(self):
        taken, self.sent[:] = list(self.sent), []
        return taken


@pytest.fixture
def bench():
    return Bench()


FULL = TeleopParameters()


def test_a_held_pad_drives_and_the_robot_stops_when_it_is_let_go(bench):
    for _ in range(10):
        bench.driving.push("a", 1.0, -0.5)
        bench.clock.advance(0.1)
    assert set(bench.take()) == {Twist2(FULL.speed, -0.5 * FULL.turn)}
    bench.driving.push("a", 0.0, 0.0)
    bench.clock.advance(5.0)
    assert bench.take() == [STANDSTILL], "nothing is commanded by a hand that is not there"


def test_a_hand_that_is_silent_stops_the_robot(bench):
    bench.driving.push("a", 1.0, 0.0)
    bench.clock.advance(HAND_SILENT_S + 0.1)
    assert bench.take()[-1] == STANDSTILL
    bench.clock.advance(5.0)
    assert bench.take() == []


def test_a_viewer_that_is_gone_stops_the_robot_at_once_and_no_other_does(bench):
    bench.driving.push("a", 1.0, 0.0)
    bench.take()
    bench.driving.let_go("b")
    assert bench.take() == []
    bench.driving.let_go("a")
    assert bench.take() == [STANDSTILL]


def test_a_stop_takes_the_robot_out_of_the_hand_until_it_has_let_go(bench):
    bench.driving.push("a", 1.0, 0.0)
    bench.driving.stop()
    assert bench.take()[-1] == STANDSTILL
    for _ in range(20):
        bench.driving.push("a", 1.0, 0.0)
        bench.clock.advance(0.1)
    assert bench.take() == [], "the hand still pushes as before"
    bench.driving.push("a", 0.0, 0.0)
    bench.driving.push("a", 1.0, 0.0)
    assert bench.take()[0].linear > 0.0
    bench.driving.let_go("a")
    bench.take()
    bench.driving.stop()
    bench.driving.push("b", 1.0, 0.0)
    assert bench.take()[0].linear > 0.0, "nobody drove: who begins now has not been stopped"


def test_one_drives_at_a_time(bench):
    bench.driving.push("a", 1.0, 0.0)
    bench.driving.push("b", -1.0, 0.0)
    bench.clock.advance(0.1)
    assert all(twist.linear > 0.0 for twist in bench.take())
    bench.driving.let_go("a")
    bench.take()
    bench.driving.push("b", -1.0, 0.0)
    assert bench.take()[0].linear < 0.0


def test_without_the_override_nothing_is_commanded(bench):
    bench.override = False
    bench.driving.push("a", 1.0, 0.0)
    bench.clock.advance(1.0)
    assert bench.take() == []
    bench.override = True
    bench.driving.push("a", 1.0, 0.0)
    bench.take()
    bench.override = False
    bench.clock.advance(1.0)
    assert bench.take() == []


def test_keys_change_the_speed_within_limits(bench):
    for _ in range(100):
        bench.driving.step("a", "q")
    assert bench.speeds[-1].linear == 0.5
    bench.driving.step("a", "?")
    bench.driving.push("a", 1.0, 0.0)
    assert bench.take() == [Twist2(0.5, 0.0)]


class Ros:
    """Runs what is for the node's thread at once."""

    def __init__(self, driving):
        self.driving = driving
        self.node = SimpleNamespace(parts=LiveParts(), get_logger=lambda: SimpleNamespace(info=print))
        self.wanted = frozenset()
        self.node = SimpleNamespace(parts=LiveParts(), get_logger=lambda: SimpleNamespace(info=print))

    def on_thread(self, work):
        work()

    def look(self, wanted):
        self.wanted = wanted


@pytest.mark.parametrize(
    ("said", "drives"),
    [
        ("drive 1 0 {now} 0", True),
        ("drive 0.5 -0.5 {now} 0", True),
        ("drive 0.5 -0.5 {old} 1", True),
        ("drive 0.5 -0.5 {old} 0", False),
        ("drive 0.5 -0.5 {now} 5", False),
        ("drive 0.5 -0.5 {now} -1", False),
        ("drive 0.5 -0.5 nan 0", False),
        ("drive 0.5 -0.5 null 0", False),
        ("drive 1 0", False),
        ("drive 2 0 {now} 0", False),
        ("drive nan 0 {now} 0", False),
        ("drive inf 0 {now} 0", False),
        ("drive 1 {now} 0", False),
        ("drive 1 0 0 {now} 0", False),
        ("drive x y {now} 0", False),
        ("drive 1e-400 1e400 {now} 0", False),
        ("", False),
    ],
)
def test_a_hand_that_says_something_else_does_not_drive(bench, said, drives):
    viewers = RobotViewers(Ros(bench.driving))
    viewers.heed(SimpleNamespace(scope={ROLE: Role.RUN}), said.format(now=beat(), old=beat() - 1.5).split())
    assert bool(bench.take()) is drives


def test_who_may_only_look_does_not_drive(bench):
    viewers = RobotViewers(Ros(bench.driving))
    viewers.heed(SimpleNamespace(scope={ROLE: Role.LOOK}), ["drive", "1", "0", str(beat()), "0"])
    viewers.heed(SimpleNamespace(scope={}), ["drive", "1", "0", str(beat()), "0"])
    assert bench.take() == []


def test_what_somebody_wants_to_see_is_heard_and_no_more():
    ros = Ros(None)
    viewers = RobotViewers(ros)
    first, second = object(), object()
    viewers.heed(first, ["want", "scene", "camera", "/etc/passwd"])
    viewers.heed(second, ["want", "local_costmap"])
    assert ros.wanted == {"scene", "camera", "local_costmap"}
    viewers.heed(first, ["want"])
    assert ros.wanted == {"local_costmap"}
