"""The body of an emulated base: wheels, sensors, battery, and what each sensor packet says."""

from __future__ import annotations

import enum
import math

from florence_bt.simulation.emulators._create_battery import CAPACITY_MAH, Battery
from florence_bt.simulation.emulators._create_faults import NO_INFRARED, CreateFaults
from florence_bt.simulation.emulators._create_models import EmulatedModel
from florence_bt.simulation.emulators._create_motion import MAX_SPEED_MMPS, clamp
from florence_bt.simulation.emulators._create_packets import FORMATS, packets_of
from florence_bt.simulation.emulators._create_songs import Songs
from florence_bt.simulation.sensors.base_noise import ADC_MAX, BasePlant, BaseSensors

FLOOR_SIGNAL, CLIFF_SIGNAL, WALL_SIGNAL = 1400, 20, 300
DEVICE_DETECT_HIGH = 0x10
LIGHT_BUMP_THRESHOLD = 100
ENCODER_ROUND = 65536
MOTOR_MA_PER_MMPS = 0.6


class Mode(enum.IntEnum):
    """Packet 35."""

    OFF = 0
    PASSIVE = 1
    SAFE = 2
    FULL = 3


class Body:
    """Everything of the base but its ears and its mouth.

    Attributes:
        model: Which base.
        mode: The operating mode.
        faults: What goes wrong, on command.
        battery: The battery.
        songs: The songs.
        wheels: Left and right speed in mm/s.
        drive: Velocity and radius of the last Drive command.
        digital_outputs: Bits of the three outputs.
        leds: Bits, power colour and power intensity as last set.
        low_side_drivers: Duty of drivers 0, 1 and 2, 0 to 128.
        stream_length: Packets in the stream.
    """

    def __init__(self, model: EmulatedModel, plant: BasePlant, sensors: BaseSensors) -> None:
        self.model = model
        self.mode = Mode.OFF
        self.faults = CreateFaults()
        self.battery = Battery()
        self.songs = Songs(model.songs)
        self.wheels = (0, 0)
        self.drive = (0, 0)
        self.digital_outputs = 0
        self.leds = (0, 0, 0)
        self.low_side_drivers = (0, 0, 0)
        self.stream_length = 0
        self._plant = plant
        self._sensors = sensors
        self._time: float | None = None
        self._drift = 0.0
        self._encoders_from = (0.0, 0.0)

    def restart(self) -> None:
        """Begin like at power-on: the outputs are high for a while, and everything counts from nothing."""
        self.digital_outputs = 7
        self.leds = (0, 0, 0)
        self.songs.forget()
        self._encoders_from = self._plant.travel()
        self._sensors.take_distance_mm()
        self._sensors.take_angle_deg()

    def update(self, now: float) -> None:
        """Let the time pass."""
        elapsed = 0.0 if self._time is None else max(0.0, now - self._time)
        self._time = now
        self._drift += self.faults.gyro_drift * elapsed
        self._sensors.update(now)
        self.battery.faulty = self.faults.charging_fault
        self.battery.charging = self.powered and self.mode <= Mode.PASSIVE
        self.battery.update(now, load=max(abs(speed) for speed in self.wheels) / MAX_SPEED_MMPS)
        self.songs.update(now)

    @property
    def powered(self) -> bool:
        """Whether a charger of any kind is there."""
        return self.faults.charger or self.faults.dock

    def set_wheels(self, left_mmps: int, right_mmps: int) -> None:
        """Turn the wheels at these speeds, clamped, until the next call."""
        self.wheels = (clamp(left_mmps, MAX_SPEED_MMPS), clamp(right_mmps, MAX_SPEED_MMPS))
        self._plant.set_wheels(self.wheels[0] / 1000.0, self.wheels[1] / 1000.0)

    def distance_mm(self) -> float:
        """How far the base has gone since the start."""
        left, right = self._plant.travel()
        return 500.0 * (left + right)

    def angle_deg(self) -> float:
        """How far it has turned since the start, counter-clockwise positive."""
        left, right = self._plant.travel()
        return math.degrees(1000.0 * (right - left) / self.model.wheel_separation_mm)

    def bumpers(self) -> tuple[bool, bool]:
        """Whether the left and the right bumper are pressed."""
        left, right = self._plant.bumpers()
        return left or self.faults.left_bumper, right or self.faults.right_bumper

    def pack(self, number: int) -> bytes:
        """The data of a packet or group as they stand on the wire; none of one that does not exist."""
        return b"".join(
            FORMATS[packet].pack(self.value(packet)) for packet in packets_of(number, self.model) or ()
        )

    def value(self, packet: int) -> int:
        """The count that a packet shows now. Reading distance or angle resets it, whoever reads."""
        if packet <= 18:
            return self._contact_value(packet)
        if packet <= 26:
            return self._motion_and_battery_value(packet)
        if packet <= 42:
            return self._signal_and_state_value(packet)
        return self._create_2_value(packet)

    def _contact_value(self, packet: int) -> int:
        faults = self.faults
        match packet:
            case 7:
                left, right = self.bumpers()
                return right | left << 1 | faults.wheel_drops & 0x1C
            case 8:
                return int(faults.wall)
            case 9 | 10 | 11 | 12:
                return int(faults.cliffs[packet - 9])
            case 13:
                return int(faults.virtual_wall)
            case 14:
                return faults.overcurrents & 0x1F
            case 17:
                return self._infrared()
            case 18:
                return faults.buttons & 0xFF
            case _:
                return 0

    def _motion_and_battery_value(self, packet: int) -> int:
        match packet:
            case 19:
                return self._sensors.take_distance_mm()
            case 20:
                return self._sensors.take_angle_deg()
            case 21:
                return self.battery.charging_state
            case 22:
                return self.battery.voltage_mv
            case 23:
                return round(self.battery.current_ma)
            case 24:
                return round(self.battery.temperature_c)
            case 25:
                return round(self.battery.charge_mah)
            case _:
                return round(CAPACITY_MAH)

    def _signal_and_state_value(self, packet: int) -> int:
        match packet:
            case 27:
                return WALL_SIGNAL if self.faults.wall else 0
            case 28 | 29 | 30 | 31:
                return CLIFF_SIGNAL if self.faults.cliffs[packet - 28] else FLOOR_SIGNAL
            case 32:
                return self._digital_inputs()
            case 33:
                return self._analog()
            case 34:
                return int(self.faults.charger) | int(self.faults.dock) << 1
            case 35:
                return self.mode + self.faults.oi_mode_offset & 0xFF
            case 36:
                return self.songs.number
            case 37:
                return int(self.songs.playing)
            case 38:
                return self.stream_length
            case 39 | 40:
                return self.drive[packet - 39]
            case 41:
                return self.wheels[1]
            case _:
                return self.wheels[0]

    def _create_2_value(self, packet: int) -> int:
        match packet:
            case 43 | 44:
                travel_m = self._plant.travel()[packet - 43] - self._encoders_from[packet - 43]
                return math.floor(travel_m / (self.model.metres_per_tick or 1.0)) % ENCODER_ROUND
            case 45:
                lit = (signal >= LIGHT_BUMP_THRESHOLD for signal in self.faults.light_bumps)
                return sum(1 << place for place, on in enumerate(lit) if on)
            case 46 | 47 | 48 | 49 | 50 | 51:
                return max(0, min(4095, self.faults.light_bumps[packet - 46]))
            case 52 | 53:
                return self._infrared()
            case 54 | 55:
                return round(abs(self.wheels[packet - 54]) * MOTOR_MA_PER_MMPS)
            case 58:
                return int(sum(self.wheels) > 0)
            case _:
                return 0

    def _infrared(self) -> int:
        if self.faults.infrared != NO_INFRARED:
            return self.faults.infrared & 0xFF
        return self.model.dock_infrared if self.faults.dock else NO_INFRARED

    def _digital_inputs(self) -> int:
        return DEVICE_DETECT_HIGH | self.faults.digital_inputs & 0x0F if self.model.cargo_bay else 0

    def _analog(self) -> int:
        if self.faults.gyro_dead or not self.model.cargo_bay:
            return 0
        return max(0, min(ADC_MAX, self._sensors.gyro_adc() + round(self._drift)))
