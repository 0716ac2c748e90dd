"""The body of an emulated base: wheels, sensors, battery, songs, and what each sensor packet says."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from florence_bt.simulation.emulators.create_models import FORMATS, EmulatedModel, packets_of
from florence_bt.simulation.sensors.base_noise import ADC_MAX, BasePlant, BaseSensors

MAX_SPEED_MMPS = 500
"""Source: REFERENCE 1.1."""
FLOOR_SIGNAL, CLIFF_SIGNAL, WALL_SIGNAL = 1400, 20, 300
DEVICE_DETECT_HIGH = 0x10
LIGHT_BUMP_THRESHOLD = 100
ENCODER_ROUND = 65536
"""The encoders count in 16 bits."""
MOTOR_MA_PER_MMPS = 0.6
"""Current of a wheel's motor by its speed. Chosen."""


def clamp(value: int, limit: int) -> int:
    """Clamp a number within +-limit."""
    return max(-limit, min(limit, value))


class Mode(enum.IntEnum):
    """Packet 35."""

    OFF = 0
    PASSIVE = 1
    SAFE = 2
    FULL = 3


class Body:
    """The base but for its serial interface.

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
        self._readers = self._make_readers()

    def restart(self) -> None:
        """Begin as at power-on: the outputs are high for a while, and everything counts from nothing."""
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
        """Tell whether a charger of any kind is there."""
        return self.faults.charger or self.faults.dock

    def set_wheels(self, left_mmps: int, right_mmps: int) -> None:
        """Turn the wheels at these speeds, clamped, until the next call."""
        self.wheels = (clamp(left_mmps, MAX_SPEED_MMPS), clamp(right_mmps, MAX_SPEED_MMPS))
        self._plant.set_wheels(self.wheels[0] / 1000.0, self.wheels[1] / 1000.0)

    def distance_mm(self) -> float:
        """Return how far the base has gone since the start."""
        left, right = self._plant.travel()
        return 500.0 * (left + right)

    def angle_deg(self) -> float:
        """Return how far it has turned since the start, counter-clockwise positive."""
        left, right = self._plant.travel()
        return math.degrees(1000.0 * (right - left) / self.model.wheel_separation_mm)

    def bumpers(self) -> tuple[bool, bool]:
        """Tell whether the left and the right bumper are pressed."""
        left, right = self._plant.bumpers()
        return left or self.faults.left_bumper, right or self.faults.right_bumper

    def pack(self, number: int) -> bytes:
        """Return the data of a packet or group as they stand on the wire; none of one that does not exist."""
        return b"".join(
            FORMATS[packet].pack(self.value(packet)) for packet in packets_of(number, self.model) or ()
        )

    def value(self, packet: int) -> int:
        """Return the count that a packet shows now. Reading distance or angle resets it, whoever reads."""
        reader = self._readers.get(packet)
        return reader() if reader is not None else 0

    def _make_readers(self) -> dict[int, Callable[[], int]]:
        """Map each packet to what it shows; those that are missing show 0."""
        faults, battery, songs = self.faults, self.battery, self.songs
        readers: dict[int, Callable[[], int]] = {
            7: self._bumps_and_wheel_drops,
            8: lambda: int(faults.wall),
            13: lambda: int(faults.virtual_wall),
            14: lambda: faults.overcurrents & 0x1F,
            17: self._infrared,
            18: lambda: faults.buttons & 0xFF,
            19: lambda: self._sensors.take_distance_mm(keep=not faults.drops_fractions),
            20: lambda: self._sensors.take_angle_deg(keep=not faults.drops_fractions),
            21: lambda: battery.charging_state,
            22: lambda: battery.voltage_mv,
            23: lambda: round(battery.current_ma),
            24: lambda: round(battery.temperature_c),
            25: lambda: round(battery.charge_mah),
            26: lambda: round(CAPACITY_MAH),
            27: lambda: WALL_SIGNAL if faults.wall else 0,
            32: self._digital_inputs,
            33: self._analog,
            34: lambda: int(faults.charger) | int(faults.dock) << 1,
            35: lambda: self.mode + faults.oi_mode_offset & 0xFF,
            36: lambda: songs.number,
            37: lambda: int(songs.playing),
            38: lambda: self.stream_length,
            39: lambda: self.drive[0],
            40: lambda: self.drive[1],
            41: lambda: self.wheels[1],
            42: lambda: self.wheels[0],
            45: self._light_bumper,
            52: self._infrared,
            53: self._infrared,
            58: lambda: int(sum(self.wheels) > 0),
        }
        for place in range(4):
            readers[9 + place] = partial(self._cliff, place)
            readers[28 + place] = partial(self._cliff_signal, place)
        for side in range(2):
            readers[43 + side] = partial(self._encoder, side)
            readers[54 + side] = partial(self._motor_current, side)
        for place in range(6):
            readers[46 + place] = partial(self._light_bump, place)
        return readers

    def _bumps_and_wheel_drops(self) -> int:
        left, right = self.bumpers()
        return right | left << 1 | self.faults.wheel_drops & 0x1C

    def _cliff(self, place: int) -> int:
        return int(self.faults.cliffs[place])

    def _cliff_signal(self, place: int) -> int:
        return CLIFF_SIGNAL if self.faults.cliffs[place] else FLOOR_SIGNAL

    def _encoder(self, side: int) -> int:
        travel_m = self._plant.travel()[side] - self._encoders_from[side]
        return math.floor(travel_m / (self.model.metres_per_tick or 1.0)) % ENCODER_ROUND

    def _motor_current(self, side: int) -> int:
        return round(abs(self.wheels[side]) * MOTOR_MA_PER_MMPS)

    def _light_bumper(self) -> int:
        lit = (signal >= LIGHT_BUMP_THRESHOLD for signal in self.faults.light_bumps)
        return sum(1 << place for place, on in enumerate(lit) if on)

    def _light_bump(self, place: int) -> int:
        return max(0, min(4095, self.faults.light_bumps[place]))

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


NO_INFRARED = 255
"""Packet 17 while nothing is received. Source: REFERENCE 1.5."""


@dataclass(slots=True)
class CreateFaults:
    """The faults and events that befall the robot; set any of it at any time.

    Attributes:
        silent: Nothing arrives at the host, what is sent meanwhile is lost; commands are still obeyed.
        commands_lost: Commands are lost on the line; what the base sends still arrives.
        noise: Bytes put before what is sent next, once.
        bad_checksums: How many of the next frames get a wrong checksum.
        partial_frames: How many of the next frames and answers lose their second half.
        wheel_drops: Bits as in packet 7: 4 right, 8 left, 16 caster.
        left_bumper: Pressed, whatever the plant says.
        right_bumper: Pressed, whatever the plant says.
        cliffs: Left, front left, front right, right.
        wall: A wall to the right.
        virtual_wall: The beam of a virtual wall.
        charger: The charger is plugged in and powered.
        dock: The base stands on its home base.
        charging_fault: The contacts are dirty: it cannot charge.
        infrared: The code that is received (packet 17, of a Create 2 also 52 and 53); 255 is nothing.
        buttons: Bits of packet 18.
        overcurrents: Bits of packet 14.
        digital_inputs: Bits 0 to 3 of packet 32.
        gyro_drift: Counts per second that the gyro's rest offset moves from now on.
        gyro_dead: The gyro has no power.
        light_bumps: Create 2: the six signals from left to right, 0 to 4095.
        oi_mode_offset: By how much packet 35 is too high, as some Create 2 firmware does.
        drops_fractions: Each reading of distance or angle drops what is below a millimetre or degree, as some
            firmware does.
    """

    silent: bool = False
    commands_lost: bool = False
    noise: bytes = b""
    bad_checksums: int = 0
    partial_frames: int = 0
    wheel_drops: int = 0
    left_bumper: bool = False
    right_bumper: bool = False
    cliffs: tuple[bool, bool, bool, bool] = (False, False, False, False)
    wall: bool = False
    virtual_wall: bool = False
    charger: bool = False
    dock: bool = False
    charging_fault: bool = False
    infrared: int = NO_INFRARED
    buttons: int = 0
    overcurrents: int = 0
    digital_inputs: int = 0
    gyro_drift: float = 0.0
    gyro_dead: bool = False
    light_bumps: tuple[int, int, int, int, int, int] = (0, 0, 0, 0, 0, 0)
    oi_mode_offset: int = 0
    drops_fractions: bool = False


NOT_CHARGING, RECONDITIONING, FULL_CHARGING, TRICKLE, WAITING, FAULT = range(6)
"""The values of packet 21 (REFERENCE 1.5)."""

CAPACITY_MAH = 2700.0
"""Packet 26, of a whole battery."""
IDLE_MA, MOTORS_MA = 250.0, 600.0
CHARGER_MA, TRICKLE_MA, RECONDITIONING_MA = 1250.0, 60.0, 200.0
EMPTY_MV, FULL_MV, CHARGING_LIFT_MV = 13200.0, 16400.0, 600.0
ROOM_C, TOO_WARM_C, COOL_AGAIN_C = 26.0, 45.0, 40.0
WARMING_C_PER_S = 0.006
"""While charging; with the cooling below that ends at 38 degrees."""
COOLING_S = 2000.0
DEEPLY_EMPTY = 0.02
"""Charge below which the charger begins gently, as a fraction of the capacity."""


class Battery:
    """The charge over time.

    Attributes:
        charge_mah: What is left.
        current_ma: Negative while it drains.
        charging: Whether a charger is there and may charge.
        faulty: The charger's contacts or the battery are bad.
        temperature_c: Of the battery.
    """

    def __init__(self) -> None:
        self.charge_mah = 0.9 * CAPACITY_MAH
        self.current_ma = -IDLE_MA
        self.charging = False
        self.faulty = False
        self.temperature_c = ROOM_C
        self._too_warm = False
        self._time: float | None = None

    def update(self, now: float, *, load: float) -> None:
        """Drain or charge up to now.

        Args:
            now: Seconds.
            load: How much the motors are asked for, 0 to 1.
        """
        elapsed = 0.0 if self._time is None else max(0.0, now - self._time)
        self._time = now
        self.charge_mah += self.current_ma * elapsed / 3600.0
        self.charge_mah = max(0.0, min(CAPACITY_MAH, self.charge_mah))
        warming = WARMING_C_PER_S if self.charging_state == FULL_CHARGING else 0.0
        settled = ROOM_C + warming * COOLING_S
        self.temperature_c += (settled - self.temperature_c) * min(1.0, elapsed / COOLING_S)
        self._too_warm = self.temperature_c > (COOL_AGAIN_C if self._too_warm else TOO_WARM_C)
        self.current_ma = self._current(load)

    def _current(self, load: float) -> float:
        drain = -(IDLE_MA + load * MOTORS_MA)
        return {
            RECONDITIONING: RECONDITIONING_MA,
            FULL_CHARGING: CHARGER_MA,
            TRICKLE: TRICKLE_MA,
        }.get(self.charging_state, drain)

    @property
    def charging_state(self) -> int:
        """Packet 21."""
        if not self.charging:
            return NOT_CHARGING
        if self.faulty:
            return FAULT
        if self._too_warm:
            return WAITING
        if self.charge_mah >= CAPACITY_MAH:
            return TRICKLE
        return RECONDITIONING if self.charge_mah < DEEPLY_EMPTY * CAPACITY_MAH else FULL_CHARGING

    @property
    def voltage_mv(self) -> int:
        """Packet 22: rises with the charge, and while current flows in."""
        lift = CHARGING_LIFT_MV if self.current_ma > 0.0 else 0.0
        return round(EMPTY_MV + (FULL_MV - EMPTY_MV) * self.charge_mah / CAPACITY_MAH + lift)


LONGEST_SONG = 16
TICKS_PER_S = 64.0
"""Durations of notes are in parts of 1/64 s. Source: REFERENCE 1.3."""


class Songs:
    """Stores songs and plays one at a time.

    Attributes:
        number: The song that was played last.
        played: Every song that was begun, by its number, in order.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._notes: dict[int, bytes] = {}
        self._end: float | None = None
        self.number = 0
        self.played: list[int] = []

    @property
    def playing(self) -> bool:
        """Tell whether a song plays now."""
        return self._end is not None

    def define(self, arguments: bytes) -> bool:
        """Store a song: its number, its length, notes and durations alternating.

        Returns:
            Whether it was stored: the number and the length must be possible.
        """
        number, length = arguments[0], arguments[1]
        if number >= self._count or not 1 <= length <= LONGEST_SONG:
            return False
        self._notes[number] = arguments[2:]
        return True

    def notes(self, number: int) -> bytes:
        """Return the notes and durations of a song, alternating; none when it is not stored."""
        return self._notes.get(number, b"")

    def play(self, number: int, now: float) -> bool:
        """Play a song; nothing happens while another one plays, or when there is none of that number."""
        if self.playing or number not in self._notes:
            return False
        self.number = number
        self.played.append(number)
        self._end = now + sum(self._notes[number][1::2]) / TICKS_PER_S
        return True

    def update(self, now: float) -> None:
        """Let the time pass."""
        if self._end is not None and now >= self._end:
            self._end = None

    def forget(self) -> None:
        """Forget the songs, as the power went."""
        self._notes.clear()
        self._end = None
        self.number = 0
