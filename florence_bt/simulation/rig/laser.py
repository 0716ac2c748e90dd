"""The laser of the rig: the driver and the component of the robot before a simulated sensor without bytes.

A scan is of one moment, that at which a real sensor is in the middle of its sweep, and comes when that ends.
"""

from __future__ import annotations

import math
from functools import partial

from florence_bt.core.clock import ManualClock, call_every
from florence_bt.core.geometry import Twist2
from florence_bt.core.ports import Ports
from florence_bt.core.sensing import Odometry
from florence_bt.core.topics import ODOMETRY
from florence_bt.drivers.hokuyo.codec import ScanReply
from florence_bt.drivers.hokuyo.driver import HokuyoDriver
from florence_bt.drivers.hokuyo.geometry import URG_04LX
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters
from florence_bt.drivers.hokuyo.scan_clock import TIMER_MS
from florence_bt.drivers.hokuyo.scanning import LaserScanning
from florence_bt.drivers.hokuyo.start_up import Sensor
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.sensors.laser_sensor import LaserSensor
from florence_bt.skills.navigation.navigate.navigation import VELOCITY

IDLE_SCAN_PERIOD_S = 0.5
"""While the robot stands and drives nowhere, scans are as rare as those that navigation takes then."""
SETTLED_S = 0.5
"""After so long without motion the robot stands. Chosen."""
COMMANDED_S = 0.5
"""So long after a velocity command the robot counts as driven, whether it moves or not."""
SENSOR = Sensor({"SERI": "rig"}, {"MODL": "URG-04LX"}, URG_04LX, {})


class SimulatedLaser:
    """Gives the driver what a sensor would measure from where the robot truly is.

    Attributes:
        device: Itself: it is always connected.
        problem: None, in words.
    """

    def __init__(
        self, world: SimulatedWorld, sensor: LaserSensor, driver: HokuyoDriver, ports: Ports
    ) -> None:
        self.device, self.problem = self, ""
        self._world, self._sensor, self._driver, self._clock = world, sensor, driver, ports.clock
        self._moved = self._next_scan = self._clock.now()
        self._commanded = -math.inf
        ports.listen(VELOCITY, self._note_command)
        ports.listen(ODOMETRY, self._note_motion)
        driver.begin_with(SENSOR)

    def pump(self) -> None:
        """Say nothing: it measures already."""

    def works(self) -> None:
        """Know that already."""

    def measure(self) -> ScanReply | None:
        """Return what is measured now; None when no scan is wanted."""
        now, wanted = self._clock.now(), self._driver.measurement
        assert wanted is not None, "it has begun"
        if now < self._next_scan:
            return None
        if now - self._moved >= SETTLED_S:
            self._next_scan = now + IDLE_SCAN_PERIOD_S - URG_04LX.scan_period / 2
        self._world.step_to(now)
        first, last = wanted.first_step, wanted.last_step
        began = now - (first + last) / 2 * URG_04LX.time_increment
        distances = self._sensor.measure(first, last)
        return ScanReply(first, 1, 0, round(1000.0 * began) % TIMER_MS, distances)

    @property
    def delay(self) -> float:
        """Seconds from the middle of a sweep to its end."""
        wanted = self._driver.measurement
        assert wanted is not None, "it has begun"
        return self._driver.latency - (wanted.first_step + wanted.last_step) / 2 * URG_04LX.time_increment

    def _note_command(self, _: Twist2) -> None:
        self._commanded = self._clock.now()

    def _note_motion(self, odometry: Odometry) -> None:
        """Scan more often again from the first motion or command on."""
        now = self._clock.now()
        if not odometry.twist.is_zero() or now - self._commanded < COMMANDED_S:
            self._moved = self._next_scan = now


def connect_laser(
    ports: Ports, sensor: LaserSensor, world: SimulatedWorld, parameters: HokuyoParameters, clock: ManualClock
) -> None:
    """Connect the laser.

    Args:
        ports: Its connections.
        sensor: What it would measure.
        world: Where.
        parameters: The driver's.
        clock: Drives it.
    """
    driver = HokuyoDriver(parameters)
    laser = SimulatedLaser(world, sensor, driver, ports)
    scanning = LaserScanning(ports, driver, laser, parameters, "the rig", lambda limits: None)

    def come(reply: ScanReply) -> None:
        scan = driver.measured(reply, clock.now())
        scanning.take([] if scan is None else [scan])

    def turn() -> None:
        reply = laser.measure()
        if reply is not None:
            clock.call_at(clock.now() + laser.delay, partial(come, reply))

    call_every(clock, URG_04LX.scan_period * (parameters.skip + 1), turn)
