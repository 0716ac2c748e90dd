"""The base of the rig: it obeys as the driver of the real one does."""

from __future__ import annotations

import math

from florence_bt.app.demo.rigs import make_rig
from florence_bt.core.geometry import Twist2
from florence_bt.drivers.turtlebot.parameters import TurtlebotParameters
from florence_bt.simulation.rig.robot import FILTERED_VELOCITY


def test_a_base_that_hears_no_more_commands_stops_by_itself() -> None:
    rig = make_rig(person="absent", seed=1)
    command = rig.wires.ports("hand").output(FILTERED_VELOCITY)
    command.send(Twist2(0.2, 0.0))
    rig.clock.advance(0.3)
    assert rig.robot.odometry.twist.linear > 0.1
    rig.clock.advance(TurtlebotParameters().cmd_vel_timeout + 1.0)
    stood = rig.world.robot_pose
    rig.clock.advance(1.0)
    assert rig.world.robot_pose.distance_to(stood) < 1e-6


def test_a_command_that_is_no_number_stops_the_base() -> None:
    rig = make_rig(person="absent", seed=1)
    command = rig.wires.ports("hand").output(FILTERED_VELOCITY)
    command.send(Twist2(0.2, 0.0))
    rig.clock.advance(0.2)
    command.send(Twist2(math.nan, 0.0))
    rig.clock.advance(0.3)
    stood = rig.world.robot_pose
    assert math.isfinite(stood.x)
    rig.clock.advance(0.5)
    assert rig.world.robot_pose.distance_to(stood) < 1e-6
