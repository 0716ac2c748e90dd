"""``florence teleop`` in a terminal, and with a gamepad, against the velocity filter and a played driver."""

from __future__ import annotations

import os
import signal
from typing import Any

import pytest

pytest.importorskip("rclpy")
pytest.importorskip("pyte")
from florence_interfaces.msg import StopReason
from geometry_msgs.msg import Twist
from sensor_msgs.msg import BatteryState, Joy

from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE
from florence_bt.skills.filters.velocity_filter.node import VelocityFilterNode
from tests.ros.conftest import GENEROUS_S
from tests.ros.override_driver import OverrideDriver
from tools.terminal import Terminal

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]

TELEOP = ("-m", "florence_bt.cli", "teleop")


class Base(OverrideDriver):
    """Plays the base's driver behind the velocity filter."""

    def __init__(self, overridden: bool = False) -> None:
        super().__init__("turtlebot_node", on=overridden)
        self.speed = 0.0
        self._stop_reason = self.create_publisher(StopReason, "~/stop_reason", LATCHED)
        self._battery = self.create_publisher(BatteryState, "battery_state", RELIABLE)
        self.create_subscription(Twist, "filtered_manual_cmd_vel", self._on_velocity, RELIABLE)

    def bump(self) -> None:
        self._stop_reason.publish(StopReason(code="bumper", text="the left bumper is pressed"))
        self._battery.publish(BatteryState(percentage=0.87))

    def _on_velocity(self, message: Twist) -> None:
        self.speed = message.linear.x


class Rig:
    """A base, its filter, and a terminal in which somebody drives."""

    def __init__(self, ros: Any, *, overridden: bool = False) -> None:
        self.ros = ros
        self.base = ros.add(Base(overridden))
        ros.add(VelocityFilterNode())

    def see(self, terminal: Terminal, pattern: str) -> str:
        return terminal.wait_for(pattern, meanwhile=lambda: self.ros.loop.spin_once(0.01))

    def hold(self, terminal: Terminal, key: str) -> None:
        """Keep a key pressed until the base drives: a terminal repeats it."""

        def driving() -> bool:
            terminal.press(key)
            terminal.look(0.03)
            return self.base.speed != 0.0

        self.ros.spin_until(driving, what="the base to drive")

    def stands(self) -> None:
        self.ros.spin_until(lambda: self.base.speed == 0.0, what="the base to stand")

    def ended(self, terminal: Terminal) -> None:
        def over() -> bool:
            terminal.look(0.01)
            return terminal.code is not None

        self.ros.spin_until(over, what="the end of the command")


@pytest.mark.parametrize(("key", "sign"), [("i", 1), ("\x1b[B", -1)])
def test_keys_drive_until_they_are_let_go_and_ctrl_c_gives_the_robot_back(ros, key, sign):
    rig = Rig(ros)
    with Terminal(TELEOP) as terminal:
        screen = rig.see(terminal, r"(?m)^drives +stands still")
        assert "0.7 s after the last key" in screen and set(rig.base.switched) == {True}
        rig.hold(terminal, key)
        assert rig.base.speed * sign > 0.0
        rig.stands()
        rig.base.bump()
        rig.see(terminal, r"held +the left bumper is pressed")
        rig.see(terminal, r"battery +87%")
        rig.hold(terminal, key)
        terminal.press("\x03")
        rig.ended(terminal)
        assert terminal.code == 130 and "given back" in terminal.look()
    assert rig.base.switched[-1] is False
    rig.stands()


def test_a_closed_terminal_gives_the_robot_back(ros):
    rig = Rig(ros)
    with Terminal(TELEOP) as terminal:
        rig.see(terminal, "you have the robot")
        rig.hold(terminal, "i")
        terminal.hang_up()
        ros.spin_until(lambda: rig.base.switched[-1] is False, what="the release")
        rig.stands()


def test_a_killed_teleop_leaves_a_base_that_stands_and_the_override(ros):
    rig = Rig(ros)
    with Terminal(TELEOP) as terminal:
        rig.see(terminal, "you have the robot")
        rig.hold(terminal, "i")
        os.kill(terminal.pid, signal.SIGKILL)
        rig.stands()
        assert rig.base.switched == [True] * len(rig.base.switched)


def test_an_override_of_somebody_else_stays_on(ros):
    rig = Rig(ros, overridden=True)
    with Terminal(TELEOP) as terminal:
        rig.see(terminal, "on already")
        rig.hold(terminal, "i")
        terminal.press("\x03")
        rig.ended(terminal)
    assert rig.base.switched == []


def test_a_release_by_somebody_else_ends_it(ros):
    rig = Rig(ros)
    with Terminal(TELEOP) as terminal:
        rig.see(terminal, "you have the robot")
        rig.base.override.release()
        rig.see(terminal, "released by somebody else")
        rig.ended(terminal)
        assert terminal.code == 3
    assert rig.base.switched[-1] is False and rig.base.switched.count(False) == 1


def test_a_stop_by_somebody_else_outlives_it(ros):
    rig = Rig(ros)
    with Terminal(TELEOP) as terminal:
        rig.see(terminal, "you have the robot")
        rig.base.override.stop()
        terminal.press("\x03")
        rig.see(terminal, "somebody has stopped the robot meanwhile")
        rig.ended(terminal)
    assert False not in rig.base.switched


def test_a_stop_by_somebody_else_takes_the_robot_out_of_the_hand(ros):
    rig = Rig(ros)
    with Terminal(TELEOP) as terminal:
        rig.see(terminal, r"(?m)^drives +stands still")
        rig.hold(terminal, "i")
        rig.base.override.stop()

        def held() -> bool:
            terminal.press("i")
            return "let go, and begin anew" in terminal.look(0.03)

        ros.spin_until(held, what="the word")
        rig.stands()
        for _ in range(20):
            held()
            ros.spin_for(0.02)
            assert rig.base.speed == 0.0, "the key is held as before"
        rig.see(terminal, r"held +no")
        rig.hold(terminal, "i")
        terminal.press("\x03")
        rig.ended(terminal)


def test_what_a_base_that_hangs_told_last_is_not_shown_as_of_now(ros):
    rig = Rig(ros)
    with Terminal(TELEOP) as terminal:
        rig.see(terminal, r"(?m)^drives +stands still")
        rig.base.bump()
        rig.see(terminal, r"held +the left bumper is pressed")
        rig.see(terminal, r"battery +87%")
        # Nobody serves the base's node: it is there, and says nothing.
        terminal.wait_for(r"held +the base's driver has said nothing for \d+ s; does the base obey")
        terminal.wait_for(r"battery +not known")
        rig.see(terminal, r"held +the left bumper is pressed")
        terminal.press("\x03")
        rig.ended(terminal)


def test_without_a_terminal_it_says_so(start_process):
    child = start_process(*TELEOP)
    assert child.process.wait(GENEROUS_S) == 2
    assert "terminal" in child.output and "--joy" in child.output


def test_a_gamepad_drives_while_its_button_is_held_and_needs_no_terminal(ros, start_process):
    rig = Rig(ros)
    child = start_process(*TELEOP, "--joy", "--speed", "0.3")
    ros.spin_until(
        lambda: True in rig.base.switched and "nobody publishes /joy" in child.output, what="teleop"
    )
    pads = FlorenceNode("joy_node")
    ros.add(pads)
    topic = pads.create_publisher(Joy, "joy", RELIABLE)

    def push(held: int, *, beyond: float) -> bool:
        topic.publish(Joy(axes=[0.0, 1.0], buttons=[0, 0, 0, 0, held]))
        ros.spin_for(0.05)
        return rig.base.speed > beyond

    ros.spin_until(lambda: push(1, beyond=0.29), what="the base to drive")
    ros.spin_until(lambda: not push(0, beyond=0.0), what="the base to stand")
    ros.spin_until(lambda: push(1, beyond=0.29), what="the base to drive")
    rig.stands()  # the pad says nothing any more
    child.process.send_signal(signal.SIGTERM)
    ros.spin_until(lambda: child.process.poll() is not None, what="the end")
    assert rig.base.switched[-1] is False
