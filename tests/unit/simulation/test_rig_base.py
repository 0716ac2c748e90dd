"""The base of the rig is the robot's: it obeys, is held and is stopped by hand as the real one."""

from __future__ import annotations

import math
from typing import Any

from florence_bt.app.demo.rigs import make_rig
from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.core.ports import Topic
from florence_bt.core.topic_names import OVERRIDE_STATE, SWITCH_OVERRIDE
from florence_bt.core.topics import BASE_STOP, ODOMETRY
from florence_bt.drivers.turtlebot.messages import STATE
from florence_bt.drivers.turtlebot.parameters import TurtlebotNodeParameters, TurtlebotParameters
from florence_bt.simulation.home.flat import load_flat
from florence_bt.simulation.rig.rig import Rig
from florence_bt.simulation.rig.robot import FILTERED_VELOCITY

TOLD = TurtlebotNodeParameters()


def hear(rig: Rig, name: str) -> list[Any]:
    heard: list[Any] = []
    rig.topics[name].subscribe(heard.append)
    return heard


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


def test_odometry_and_sensor_states_come_as_often_as_on_the_robot() -> None:
    rig = make_rig(person="absent", seed=1)
    odometry, states = hear(rig, ODOMETRY.name), hear(rig, STATE.name.replace("~", "turtlebot_node"))
    rig.clock.advance(10.0)
    assert len(odometry) == round(10.0 * TOLD.update_rate)
    assert len(states) == round(10.0 * TOLD.sensor_state_rate)


def test_a_wall_presses_the_bumper_which_holds_the_way_ahead_and_not_the_way_back() -> None:
    flat = load_flat()
    rig = make_rig(person="absent", seed=1)
    stops = hear(rig, BASE_STOP.name)
    command = rig.wires.ports("hand").output(FILTERED_VELOCITY)
    rig.world.carry_robot(Pose2(flat.start.x, flat.start.y, math.pi / 2))
    while not stops and rig.clock.now() < 30.0:
        command.send(Twist2(0.3, 0.0))
        rig.clock.advance(0.02)
    assert stops[0].code == "bumper" and "bumper" in stops[0].text
    assert rig.world.wheels == (0.0, 0.0)
    command.send(Twist2(-0.2, 0.0))
    rig.clock.advance(0.1)
    assert max(rig.world.wheels) < 0.0
    rig.clock.advance(1.0)
    assert stops[-1].code == ""


def test_the_override_stops_the_wheels_and_leaves_them_to_the_hand() -> None:
    rig = make_rig(person="absent", seed=1)
    states = hear(rig, OVERRIDE_STATE)
    program = rig.wires.ports("hand").output(FILTERED_VELOCITY)
    hand = rig.wires.ports("hand").output(Topic("filtered_manual_cmd_vel", Twist2))
    switch = rig.wires.ports("hand").output(Topic(SWITCH_OVERRIDE, bool))
    program.send(Twist2(0.2, 0.0))
    rig.clock.advance(0.3)
    switch.send(True)
    rig.clock.advance(1.0)
    stood = rig.world.robot_pose
    program.send(Twist2(0.2, 0.0))
    rig.clock.advance(1.0)
    assert rig.world.robot_pose.distance_to(stood) < 1e-6
    assert (states[-1].on, states[-1].standing, states[-1].problem) == (True, True, "")
    hand.send(Twist2(0.2, 0.0))
    rig.clock.advance(0.5)
    assert rig.world.robot_pose.distance_to(stood) > 0.02


def test_an_empty_battery_holds_the_base() -> None:
    rig = make_rig(person="absent", seed=1)
    stops = hear(rig, BASE_STOP.name)
    rig.robot.base.charge_fraction = 0.0
    rig.clock.advance(0.5)
    assert stops[-1].code == "battery"
    stood = rig.world.robot_pose
    rig.wires.ports("hand").output(FILTERED_VELOCITY).send(Twist2(0.2, 0.0))
    rig.clock.advance(0.5)
    assert rig.world.robot_pose.distance_to(stood) < 1e-6
