"""The simulator as a node: what goes wrong in its thread ends the process; it waits for slow readers."""

from __future__ import annotations

import itertools
from types import SimpleNamespace

import pytest
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.drivers.turtlebot.parameters import TurtlebotNodeParameters
from florence_bt.drivers.turtlebot.report import RateLimiter
from florence_bt.ros.conversions import stamp_from_ros, stamp_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE, SENSOR
from florence_bt.ros.tf import TransformBroadcaster
from florence_bt.simulation.hardware import node as simulator_node
from florence_bt.simulation.hardware.node import (
    LONGEST_BURST_S,
    MOST_BASE_LAG_S,
    MOST_LAG_S,
    MOST_NAVIGATION_LAG_S,
    RESTING_CLOCK_PERIOD_S,
    SimulatorNode,
)
from florence_bt.simulation.hardware.server import STEP_S

pytestmark = pytest.mark.ros


def test_a_world_that_cannot_be_made_is_reported_and_not_a_silent_standstill(ros):
    def broken():
        raise ConfigError("the flat has no floor")

    ros.add(SimulatorNode(broken))
    with pytest.raises(ConfigError, match="no floor"):
        ros.spin_until(lambda: False)


class EmptyWorld:
    """Hardware that does nothing but count."""

    def __init__(self):
        self.time = self.laser_sent_at = 0.0
        self.laser_speaks = True
        self.served = 0
        self.world = SimpleNamespace(resting=False)
        self.motion = ((0.0, 0.0), False)

    def open(self):
        pass

    close = open

    def step(self):
        self.time += STEP_S
        if self.laser_speaks:
            self.laser_sent_at = self.time

    def serve(self):
        self.served += 1

    def truth(self):
        return {}


def simulator_beside_a_driver(ros, monkeypatch):
    """The world, the simulator over it, a driver's publisher of scans, and what publishes one of a stamp."""
    monkeypatch.setattr(simulator_node, "READER_TIMEOUT_S", 600.0)  # whatever holds this machine up
    hardware = EmptyWorld()
    scans = ros.add(FlorenceNode("driver")).create_publisher(LaserScan, "scan", SENSOR)
    simulator = ros.add(SimulatorNode(lambda: hardware, parameters={"speed": 20.0}))

    def told(stamp: float) -> None:
        message = LaserScan(ranges=[1.0], range_max=4.0)
        message.header.stamp = stamp_to_ros(stamp)
        scans.publish(message)

    return hardware, simulator, scans, told


def test_the_simulated_time_waits_for_the_drivers(ros, monkeypatch):
    hardware, simulator, scans, told = simulator_beside_a_driver(ros, monkeypatch)
    slow = itertools.count()

    def waits_for(stamp: float) -> bool:
        """The driver is alive, but hardly comes further; it stands between two steps of the world."""
        told(stamp + STEP_S / 2 + 1e-9 * next(slow))
        served = hardware.served
        ros.loop.spin_once(0.02)
        return hardware.served > served

    ros.spin_until(lambda: scans.get_subscription_count() and hardware.time > 1.0)
    reached = hardware.time
    ros.spin_until(lambda: waits_for(reached))
    stands_at = hardware.time
    for _ in range(20):
        assert waits_for(reached) or hardware.time == stands_at
    assert hardware.time == stands_at
    reached = stands_at
    ros.spin_until(lambda: waits_for(reached) and hardware.time > stands_at)
    assert reached + MOST_LAG_S < hardware.time <= reached + MOST_LAG_S + 2 * LONGEST_BURST_S
    ros.close_node(simulator)


@pytest.mark.parametrize(
    ("slow_one", "most_lag"), [("odom", MOST_NAVIGATION_LAG_S), ("base_footprint", MOST_BASE_LAG_S)]
)
def test_the_simulated_time_waits_for_navigation_and_the_driver_of_the_base(
    ros, monkeypatch, slow_one, most_lag
):
    monkeypatch.setattr(simulator_node, "TRANSFORM_TIMEOUT_S", 600.0)
    hardware = EmptyWorld()
    localiser = ros.add(FlorenceNode("localiser"))
    transforms = TransformBroadcaster(localiser)
    simulator = ros.add(SimulatorNode(lambda: hardware, parameters={"speed": 20.0}))
    slow = itertools.count()

    def waits_for(stamp: float) -> bool:
        for parent, child in (("map", "odom"), ("odom", "base_footprint")):
            transforms.send(parent, child, stamp + 1e-6 * next(slow) if child == slow_one else 1e6, Pose2())
        served = hardware.served
        ros.loop.spin_once(0.02)
        return hardware.served > served

    ros.spin_until(lambda: localiser.count_subscribers("/tf") and hardware.time > 1.0)
    reached = hardware.time
    ros.spin_until(lambda: waits_for(reached))
    stands_at = hardware.time
    for _ in range(20):
        assert waits_for(reached) or hardware.time == stands_at
    assert hardware.time == stands_at
    ros.spin_until(lambda: waits_for(stands_at) and hardware.time > stands_at)
    assert hardware.time <= stands_at + most_lag + 2 * LONGEST_BURST_S
    ros.close_node(simulator)


def test_who_is_waited_for_knows_the_time(ros, monkeypatch):
    """A driver takes no bytes before it knows that it is as late as they are: else both would wait."""
    monkeypatch.setattr(simulator_node, "CLOCK_PERIOD_S", 600.0)
    hardware, simulator, _, told = simulator_beside_a_driver(ros, monkeypatch)
    times = []
    reader = ros.add(FlorenceNode("reader"))
    reader.create_subscription(Clock, "/clock", lambda message: times.append(message.clock), RELIABLE)

    def knows() -> bool:
        told(0.0)
        return hardware.served and times and stamp_from_ros(times[-1]) == pytest.approx(hardware.time)

    ros.spin_until(knows, what="the time at which the simulation stands")
    ros.close_node(simulator)


def test_the_simulated_time_waits_for_the_filters(ros, monkeypatch):
    """What the driver has read is of no use before navigation is given it."""
    monkeypatch.setattr(simulator_node, "READER_TIMEOUT_S", 600.0)
    hardware = EmptyWorld()
    filters = ros.add(FlorenceNode("filters"))
    scans = {name: filters.create_publisher(LaserScan, name, SENSOR) for name in ("scan", "filtered_scan")}
    simulator = ros.add(SimulatorNode(lambda: hardware, parameters={"speed": 20.0}))
    slow = itertools.count()

    def waits_for(stamp: float) -> bool:
        for name, when in (("scan", 1e6), ("filtered_scan", stamp)):
            message = LaserScan(ranges=[1.0])
            message.header.stamp = stamp_to_ros(when + 1e-6 * next(slow))
            scans[name].publish(message)
        served = hardware.served
        ros.loop.spin_once(0.02)
        return hardware.served > served

    ros.spin_until(lambda: scans["filtered_scan"].get_subscription_count() and hardware.time > 1.0)
    reached = hardware.time
    ros.spin_until(lambda: waits_for(reached))
    stands_at = hardware.time
    for _ in range(20):
        assert waits_for(reached) or hardware.time == stands_at
    assert hardware.time == stands_at
    ros.close_node(simulator)


def test_navigation_that_hangs_holds_nothing_up_for_long(ros):
    hardware = EmptyWorld()
    localiser = ros.add(FlorenceNode("localiser"))
    transforms = TransformBroadcaster(localiser)
    simulator = ros.add(SimulatorNode(lambda: hardware, parameters={"speed": 20.0}))
    ros.spin_until(lambda: localiser.count_subscribers("/tf"))
    transforms.send("map", "odom", 0.0, Pose2())
    ros.spin_until(lambda: hardware.served)
    stood_at = hardware.time
    ros.spin_until(lambda: hardware.time > stood_at + 20.0)
    ros.close_node(simulator)


def test_a_silent_laser_holds_up_nothing(ros, monkeypatch):
    """Also one that turns slowly: no scan is late that was not sent."""
    hardware, simulator, _, told = simulator_beside_a_driver(ros, monkeypatch)

    def waits() -> bool:
        told(0.0)
        return hardware.served > 0

    ros.spin_until(waits)  # for what the laser says and nobody makes a scan of
    hardware.laser_speaks = False
    last = hardware.laser_sent_at

    def goes_on() -> bool:
        told(last)
        return hardware.time > last + 20.0

    ros.spin_until(goes_on)
    ros.close_node(simulator)


def test_the_odometry_keeps_its_rate_while_the_clock_rests():
    limiter, told = RateLimiter(TurtlebotNodeParameters().update_rate), 0
    for frame in range(667):  # ten seconds, a frame every 15 ms, stamped with the newest message on /clock
        told += limiter.is_due(frame * 0.015 // RESTING_CLOCK_PERIOD_S * RESTING_CLOCK_PERIOD_S)
    assert told == pytest.approx(300, abs=2)
