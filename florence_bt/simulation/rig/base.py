"""The base of the rig: the driver and the component of the robot before a simulated base without bytes.

What the base measures is given to the driver as values, and of what the driver would send only the speeds
reach the wheels: a base of the rig is always in the mode that is wanted. All that is above is the robot's.
"""

from __future__ import annotations

import math

from florence_bt.core.clock import ManualClock, call_every
from florence_bt.core.ports import Ports
from florence_bt.drivers.turtlebot.codec.packets import BUMP_LEFT, BUMP_RIGHT
from florence_bt.drivers.turtlebot.codec.state import SensorState
from florence_bt.drivers.turtlebot.driver import STREAM_PERIOD_S, BaseReading, TurtlebotDriver
from florence_bt.drivers.turtlebot.driving import BaseDriving
from florence_bt.drivers.turtlebot.override_file import OverrideFile
from florence_bt.drivers.turtlebot.parameters import TurtlebotNodeParameters, TurtlebotParameters
from florence_bt.simulation.emulators.create_body import CAPACITY_MAH
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.sensors.base_noise import BaseNoiseParameters, BaseSensors

VOLTAGE_MV, CURRENT_MA, TEMPERATURE_C = 16_000, -600, 25
"""Of the battery while the base drives (packets 22 to 24, REFERENCE 1.5). Chosen."""


class SimulatedBase:
    """Gives the driver what the base measures, as often as a base sends a frame.

    Attributes:
        charge_fraction: How full the battery is, 0 to 1; it stays as it is set.
        reading: What the driver made of what was measured last; None before the second time.
        device: Itself: it is always connected.
        problem: None, in words.
    """

    def __init__(
        self, world: SimulatedWorld, driver: TurtlebotDriver, clock: ManualClock, sensors: BaseSensors
    ) -> None:
        self.charge_fraction = 1.0
        self.reading: BaseReading | None = None
        self.device, self.problem = self, ""
        self._world, self._driver, self._clock = world, driver, clock
        self._sensors = sensors
        driver.start(clock.now())

    def works(self) -> None:
        """Know that already."""

    def pump(self) -> None:
        """Give the wheels the speeds that the driver wants now; its bytes go nowhere."""
        self._driver.poll(self._clock.now())
        wheels = self._driver.wheels
        self._world.set_wheels(wheels.left_mmps / 1000.0, wheels.right_mmps / 1000.0)

    def measure(self) -> list[BaseReading]:
        """Let the world go on until now, and return what the driver makes of what the base measures then."""
        now = self._clock.now()
        self._world.step_to(now)
        self._sensors.update(now)
        reading = self._driver.measured(self._state(), now)
        if reading is None:
            return []
        self.reading = reading
        return [reading]

    def _state(self) -> SensorState:
        left, right = self._world.bumpers()
        wheels = self._driver.wheels
        return SensorState(
            bumps_wheeldrops=left * BUMP_LEFT | right * BUMP_RIGHT,
            distance=self._sensors.take_distance_mm() / 1000.0,
            angle=math.radians(self._sensors.take_angle_deg()),
            voltage=VOLTAGE_MV,
            current=CURRENT_MA,
            temperature=TEMPERATURE_C,
            charge=round(self.charge_fraction * CAPACITY_MAH),
            capacity=round(CAPACITY_MAH),
            user_digital_outputs=self._driver.digital_outputs,
            user_analog_input=self._sensors.gyro_adc(),
            oi_mode=self._driver.wanted_mode,
            requested_left_velocity=wheels.left_mmps / 1000.0,
            requested_right_velocity=wheels.right_mmps / 1000.0,
        )


def connect_base(
    ports: Ports,
    world: SimulatedWorld,
    parameters: TurtlebotParameters,
    settings: TurtlebotNodeParameters,
    clock: ManualClock,
    *,
    seed: int,
    noise: BaseNoiseParameters | None = None,
) -> SimulatedBase:
    """Connect the base, and return what simulates it.

    Args:
        ports: Its connections.
        world: What it stands in.
        parameters: The driver's.
        settings: The component's.
        clock: Drives it.
        seed: Start of its noise.
        noise: How wrong its sensors are.
    """
    driver = TurtlebotDriver(parameters)
    base = SimulatedBase(world, driver, clock, BaseSensors(world, seed, noise))
    driving = BaseDriving(ports, driver, base, settings, OverrideFile(None))
    call_every(clock, STREAM_PERIOD_S, lambda: driving.take(base.measure()))
    return base
