"""An iRobot Create at the other end of the serial line, written from the Open Interface manual (REFERENCE 1).

Bytes and the time in, bytes out. It never imports the driver, so that a mistake in the driver's codec cannot
hide behind the same mistake here. Commands of the manual that are not acted on are read over and counted.
"""

from __future__ import annotations

import enum
import struct
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from florence_bt.simulation.base_noise import BasePlant, BaseSensors
from florence_bt.simulation.emulators._create_battery import CAPACITY_MAH, TEMPERATURE_C, Battery
from florence_bt.simulation.emulators._create_commands import CommandReader
from florence_bt.simulation.emulators._create_packets import FORMATS, MAX_STREAM_PACKETS, packets_of

STREAM_PERIOD_S = 0.015
TIME_DUST_S = 1e-9
"""What added-up floating point times may be off."""

BOOT_S = 3.0
"""How long the boot loader runs after a reset: input is ignored and the digital outputs are high."""

BOOT_TEXT = b"\r\nCreate boot loader\r\n"
STRAIGHT = (-0x8000, 0x7FFF)
SPIN_CLOCKWISE, SPIN_COUNTER_CLOCKWISE = -1, 1
WHEEL_SEPARATION_MM = 260.0
ROBOT_RADIUS_MM = 165.0
MAX_SPEED_MMPS, MAX_RADIUS_MM = 500, 2000
FLOOR_SIGNAL, CLIFF_SIGNAL = 1400, 20
NO_INFRARED = 255
DEVICE_DETECT_HIGH = 0x10


class Mode(enum.IntEnum):
    """Packet 35."""

    OFF = 0
    PASSIVE = 1
    SAFE = 2
    FULL = 3


@dataclass(slots=True)
class CreateFaults:
    """What goes wrong and what happens to the robot; set any of it at any time.

    Attributes:
        silent: Nothing arrives at the host, what is sent meanwhile is lost; commands are still obeyed.
        noise: Bytes put before the next frame, once.
        bad_checksums: How many of the next frames get a wrong checksum.
        partial_frames: How many of the next frames lose their second half.
        wheel_drops: Bits as in packet 7: 4 right, 8 left, 16 caster.
        left_bumper: Pressed, whatever the plant says.
        right_bumper: Pressed, whatever the plant says.
        cliffs: Left, front left, front right, right.
        charger: The charger is plugged in and powered.
    """

    silent: bool = False
    noise: bytes = b""
    bad_checksums: int = 0
    partial_frames: int = 0
    wheel_drops: int = 0
    left_bumper: bool = False
    right_bumper: bool = False
    cliffs: tuple[bool, bool, bool, bool] = (False, False, False, False)
    charger: bool = False


class CreateEmulator:
    """Obeys commands, streams sensors, and protects itself as the firmware does.

    Attributes:
        mode: The operating mode.
        faults: What goes wrong, on command.
        digital_outputs: Bits of the three outputs.
        leds: Bits, power colour and power intensity as last set.
        unobeyed: How often each opcode came that is not acted on, or not in the mode of the moment.
    """

    def __init__(self, plant: BasePlant, sensors: BaseSensors, *, header_in_checksum: bool = False) -> None:
        """Stand there, switched on, in mode Off.

        Args:
            plant: What the wheels move, and what presses the bumpers.
            sensors: What measures that plant.
            header_in_checksum: The Create 2's form of the checksum (REFERENCE 1.6).
        """
        self._plant = plant
        self._sensors = sensors
        self._header_in_checksum = header_in_checksum
        self._commands = CommandReader()
        self._output = bytearray()
        self._stream: list[int] = []
        self._paused = False
        self._next_frame = 0.0
        self._boot_end: float | None = None
        self._wheels = (0, 0)
        self._drive = (0, 0)
        self._battery = Battery()
        self.mode = Mode.OFF
        self.faults = CreateFaults()
        self.digital_outputs = 0
        self.leds = (0, 0, 0)
        self.unobeyed: Counter[int] = Counter()
        self._handlers: dict[int, tuple[Mode, Callable[[bytes, float], None]]] = {
            7: (Mode.OFF, self._reset),
            128: (Mode.OFF, lambda _arguments, _now: self._enter(Mode.PASSIVE)),
            130: (Mode.PASSIVE, lambda _arguments, _now: self._enter(Mode.SAFE)),
            131: (Mode.PASSIVE, lambda _arguments, _now: self._enter(Mode.SAFE)),
            132: (Mode.PASSIVE, lambda _arguments, _now: self._enter(Mode.FULL)),
            137: (Mode.SAFE, self._on_drive),
            139: (Mode.SAFE, self._on_leds),
            142: (Mode.PASSIVE, lambda arguments, _now: self._answer(arguments)),
            145: (Mode.SAFE, self._on_drive_direct),
            147: (Mode.SAFE, self._on_digital_outputs),
            148: (Mode.PASSIVE, self._on_stream),
            149: (Mode.PASSIVE, lambda arguments, _now: self._answer(arguments[1:])),
            150: (Mode.PASSIVE, self._on_pause),
        }

    @property
    def unknown_bytes(self) -> int:
        """How many bytes came that are no opcode."""
        return self._commands.unknown_bytes

    def receive(self, data: bytes, now: float) -> bytes:
        """Obey commands.

        Args:
            data: Bytes from the line, in pieces of any size.
            now: Seconds.

        Returns:
            The answers.
        """
        self._advance(now)
        if self._boot_end is not None:
            return self._flush()
        self._commands.feed(data)
        while (command := self._commands.take()) is not None:
            self._obey(command, now)
            self._protect()
        return self._flush()

    def poll(self, now: float) -> bytes:
        """Let the time pass: measure, protect, and send the stream's frame when it is due."""
        self._advance(now)
        late = now - self._next_frame
        if self._stream and not self._paused and late >= -TIME_DUST_S and self.mode is not Mode.OFF:
            # A late call does not cause a burst: the base would have sent those frames earlier.
            self._next_frame += (1 + int(max(0.0, late) / STREAM_PERIOD_S)) * STREAM_PERIOD_S
            self._output += self._frame()
        return self._flush()

    def _advance(self, now: float) -> None:
        self._sensors.update(now)
        self._battery.update(now, load=max(abs(speed) for speed in self._wheels) / MAX_SPEED_MMPS)
        if self._boot_end is not None and now >= self._boot_end:
            self._boot_end = None
            self.digital_outputs = 0
            self._output += BOOT_TEXT
        self._protect()

    def _flush(self) -> bytes:
        out = bytes(self._output)
        self._output.clear()
        return b"" if self.faults.silent else out

    # -- commands ----------------------------------------------------------------------------------------

    def _obey(self, command: bytes, now: float) -> None:
        lowest_mode, handler = self._handlers.get(command[0], (None, None))
        if handler is None or lowest_mode is None or self.mode < lowest_mode:
            self.unobeyed[command[0]] += 1
        else:
            handler(command[1:], now)

    def _enter(self, mode: Mode) -> None:
        if mode is Mode.PASSIVE:
            self._set_wheels(0, 0)
        self.mode = mode

    def _reset(self, _arguments: bytes, now: float) -> None:
        self._enter(Mode.PASSIVE)
        self.mode = Mode.OFF
        self._stream = []
        self._commands.clear()
        self._drive = (0, 0)
        self.leds = (0, 0, 0)
        self.digital_outputs = 7
        self._boot_end = now + BOOT_S

    def _on_drive(self, arguments: bytes, _now: float) -> None:
        velocity, radius = struct.unpack(">hh", arguments)
        if radius == 0:
            self.unobeyed[137] += 1
            return
        velocity = _clamp(velocity, MAX_SPEED_MMPS)
        self._drive = (velocity, radius)
        self._set_wheels(*_wheels_on_arc(velocity, radius))

    def _on_drive_direct(self, arguments: bytes, _now: float) -> None:
        right, left = struct.unpack(">hh", arguments)
        self._set_wheels(left, right)

    def _on_leds(self, arguments: bytes, _now: float) -> None:
        self.leds = (arguments[0], arguments[1], arguments[2])

    def _on_digital_outputs(self, arguments: bytes, _now: float) -> None:
        self.digital_outputs = arguments[0] & 7

    def _answer(self, numbers: bytes) -> None:
        for number in numbers:
            for packet in packets_of(number) or ():
                self._output += FORMATS[packet].pack(self._value(packet))

    def _on_stream(self, arguments: bytes, now: float) -> None:
        known = [number for number in arguments[1:] if packets_of(number) is not None]
        self._stream = known[:MAX_STREAM_PACKETS]
        self._paused = False
        self._next_frame = now + STREAM_PERIOD_S

    def _on_pause(self, arguments: bytes, now: float) -> None:
        if self._paused and arguments[0]:
            self._next_frame = now + STREAM_PERIOD_S
        self._paused = arguments[0] == 0

    # -- motion and protection -----------------------------------------------------------------------------

    def _set_wheels(self, left_mmps: int, right_mmps: int) -> None:
        self._wheels = (_clamp(left_mmps, MAX_SPEED_MMPS), _clamp(right_mmps, MAX_SPEED_MMPS))
        self._plant.set_wheels(self._wheels[0] / 1000.0, self._wheels[1] / 1000.0)

    def _protect(self) -> None:
        """Safe mode's automatic way to Passive (REFERENCE 1.2), and charging in the modes that allow it."""
        if self.mode is Mode.SAFE and (
            self.faults.wheel_drops
            or self.faults.charger
            or (any(self.faults.cliffs) and self._cliff_matters())
        ):
            self._enter(Mode.PASSIVE)
        self._battery.charging = self.faults.charger and self.mode <= Mode.PASSIVE

    def _cliff_matters(self) -> bool:
        """Driving forward, or backward around a point within the robot."""
        left, right = self._wheels
        if left + right >= 0:
            return left + right > 0
        radius = WHEEL_SEPARATION_MM / 2.0 * abs(left + right) / max(1, abs(right - left))
        return radius < ROBOT_RADIUS_MM

    # -- sensors -------------------------------------------------------------------------------------------

    def _frame(self) -> bytes:
        body = bytearray()
        for number in self._stream:
            body.append(number)
            for packet in packets_of(number) or ():
                body += FORMATS[packet].pack(self._value(packet))
        frame = bytes([19, len(body)]) + body
        checksum = -sum(frame if self._header_in_checksum else frame[1:]) % 256
        faults = self.faults
        if faults.bad_checksums:
            faults.bad_checksums -= 1
            checksum = (checksum + 1) % 256
        frame += bytes([checksum])
        if faults.partial_frames:
            faults.partial_frames -= 1
            frame = frame[: len(frame) // 2]
        noise, faults.noise = faults.noise, b""
        return noise + frame

    def _value(self, packet: int) -> int:
        """The count that a packet shows now. Reading distance or angle resets it, whoever reads."""
        match packet:
            case 7:
                left, right = self._plant.bumpers()
                left, right = left or self.faults.left_bumper, right or self.faults.right_bumper
                return right | left << 1 | self.faults.wheel_drops
            case 9 | 10 | 11 | 12:
                return int(self.faults.cliffs[packet - 9])
            case 17:
                return NO_INFRARED
            case 19:
                return self._sensors.take_distance_mm()
            case 20:
                return self._sensors.take_angle_deg()
            case 21:
                return self._battery.charging_state
            case 22:
                return self._battery.voltage_mv
            case 23:
                return round(self._battery.current_ma)
            case 24:
                return TEMPERATURE_C
            case 25:
                return round(self._battery.charge_mah)
            case 26:
                return round(CAPACITY_MAH)
            case 28 | 29 | 30 | 31:
                return CLIFF_SIGNAL if self.faults.cliffs[packet - 28] else FLOOR_SIGNAL
            case 32:
                return DEVICE_DETECT_HIGH
            case 33:
                return self._sensors.gyro_adc()
            case 34:
                return int(self.faults.charger)
            case 35:
                return self.mode
            case 38:
                return len(self._stream)
            case 39 | 40:
                return self._drive[packet - 39]
            case 41:
                return self._wheels[1]
            case 42:
                return self._wheels[0]
            case _:
                return 0


def _wheels_on_arc(velocity: int, radius: int) -> tuple[int, int]:
    """Left and right speed in mm/s for the Drive command; the radius is never 0 here."""
    if radius in STRAIGHT:
        return velocity, velocity
    if radius == SPIN_CLOCKWISE:
        return velocity, -velocity
    if radius == SPIN_COUNTER_CLOCKWISE:
        return -velocity, velocity
    share = WHEEL_SEPARATION_MM / (2.0 * _clamp(radius, MAX_RADIUS_MM))
    return round(velocity * (1.0 - share)), round(velocity * (1.0 + share))


def _clamp(value: int, limit: int) -> int:
    return max(-limit, min(limit, value))
