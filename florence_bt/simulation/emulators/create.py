"""An iRobot Create at the other end of the serial line, written from the Open Interface manual (REFERENCE 1).

Bytes and the time in, bytes out. It never imports the driver, so that a mistake in the driver's codec cannot
hide behind the same mistake here. ``docs/notes/emulators.md`` describes what it does and how to run it alone.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Callable, Sequence

from florence_bt.simulation.emulators.create_body import MAX_SPEED_MMPS, Body, Mode, clamp
from florence_bt.simulation.emulators.create_models import MODELS, EmulatedModel, packets_of, size_of
from florence_bt.simulation.emulators.create_scripts import WAITS, CommandReader, ScriptPlayer
from florence_bt.simulation.sensors.base_noise import BasePlant, BaseSensors

BAUD_RATES = (300, 600, 1200, 2400, 4800, 9600, 14400, 19200, 28800, 38400, 57600, 115200)
FULL_DUTY = 128
"""Codes of Baud, by their places, and the duty of a driver that is wholly on. Source: REFERENCE 1.3."""

Handler = Callable[[bytes, float], None]


class CreateEmulator:
    """Obeys commands, streams sensors, and protects itself as the firmware does.

    Attributes:
        model: Which base.
        baud_rate: What the line should run at.
        powered: Whether it is switched on.
        infrared_sent: The bytes sent as infrared light, in order.
        faults: What goes wrong, on command.
        battery: The battery.
        songs: The songs.
        rejected: How often each opcode came that is not acted on, or not in the mode of the moment.
    """

    def __init__(
        self,
        plant: BasePlant,
        sensors: BaseSensors,
        *,
        model: str = "create",
        header_in_checksum: bool | None = None,
        keeps_input: bool = False,
    ) -> None:
        """Stand there, switched on, in mode Off.

        Args:
            plant: What the wheels move, and what presses the bumpers.
            sensors: What measures that plant.
            model: ``create`` or ``create2``.
            header_in_checksum: The form of the checksum (REFERENCE 1.6); None for the model's own.
            keeps_input: What comes while a wait runs is executed after it, not ignored (REFERENCE 1.4).
        """
        self.model: EmulatedModel = MODELS[model]
        self.baud_rate = self.model.baud_rate
        self.powered = True
        self.infrared_sent: list[int] = []
        self.rejected: Counter[int] = Counter()
        self._body = Body(self.model, plant, sensors)
        self.faults, self.battery, self.songs = self._body.faults, self._body.battery, self._body.songs
        self._stream = FrameStream(
            self._body,
            self.model.header_in_checksum if header_in_checksum is None else header_in_checksum,
        )
        self._commands = CommandReader(self.model.commands, keeps_input)
        self._scripts = ScriptPlayer(self.model.commands, self._body)
        self._output = bytearray()
        self._boot_loader = BootLoader(self.model.boot_texts)
        self._demo: Demo | None = None
        self._was_docked = False
        self._handlers = self._make_handlers()

    def _make_handlers(self) -> dict[int, tuple[Mode, Handler]]:
        """Map each opcode to the lowest mode that obeys it, and what it does."""
        off, passive, safe = Mode.OFF, Mode.PASSIVE, Mode.SAFE
        common: dict[int, tuple[Mode, Handler]] = {
            7: (off, self._reset),
            128: (off, lambda _a, _n: self._enter(Mode.PASSIVE)),
            129: (passive, self._on_baud),
            130: (passive, lambda _a, _n: self._enter(Mode.SAFE)),
            131: (passive, lambda _a, _n: self._enter(Mode.SAFE)),
            132: (passive, lambda _a, _n: self._enter(Mode.FULL)),
            134: (passive, lambda _a, _n: self._play(SPOT)),
            135: (passive, lambda _a, _n: self._play(COVER)),
            137: (safe, self._on_drive),
            138: (safe, self._on_low_side_drivers),
            139: (safe, self._on_leds),
            140: (passive, self._on_song),
            141: (safe, self._on_play_song),
            142: (passive, lambda arguments, _n: self._answer(arguments)),
            143: (passive, lambda _a, _n: self._play(COVER_AND_DOCK)),
            144: (safe, self._on_pwm_low_side_drivers),
            145: (safe, self._on_drive_direct),
            148: (passive, lambda arguments, now: self._stream.request(arguments[1:], now)),
            149: (passive, lambda arguments, _n: self._answer(arguments[1:])),
            150: (passive, lambda arguments, now: self._stream.pause(arguments[0] == 0, now)),
        }
        create: dict[int, tuple[Mode, Handler]] = {
            136: (passive, self._on_demo),
            147: (safe, self._on_digital_outputs),
            151: (safe, lambda arguments, _n: self.infrared_sent.append(arguments[0])),
            152: (passive, lambda arguments, _n: self._scripts.define(arguments[1:])),
            153: (passive, lambda _a, _n: self._scripts.begin()),
            154: (passive, self._on_show_script),
        }
        create_2: dict[int, tuple[Mode, Handler]] = {
            133: (passive, lambda _a, _n: self._enter(Mode.PASSIVE)),
            136: (passive, lambda _a, _n: self._play(COVER)),
            146: (safe, self._on_drive_pwm),
            173: (passive, self._on_stop),
        }
        return common | (create if self.model.metres_per_tick is None else create_2)

    # -- what others may look at and change ----------------------------------------------------------------

    @property
    def mode(self) -> Mode:
        """The operating mode."""
        return self._body.mode

    @property
    def wheels(self) -> tuple[int, int]:
        """Left and right speed in mm/s."""
        return self._body.wheels

    @property
    def digital_outputs(self) -> int:
        """Bits of the three outputs."""
        return self._body.digital_outputs

    @property
    def leds(self) -> tuple[int, int, int]:
        """Bits, power colour and power intensity as last set."""
        return self._body.leds

    @property
    def low_side_drivers(self) -> tuple[int, int, int]:
        """Duty of the drivers 0, 1 and 2, 0 to 128."""
        return self._body.low_side_drivers

    @property
    def streaming(self) -> bool:
        """Tell whether frames are sent by themselves."""
        return self._stream.running

    @property
    def unknown_bytes(self) -> int:
        """Count the bytes that came and are not an opcode."""
        return self._commands.unknown_bytes

    def set_power(self, on: bool, now: float) -> None:
        """Switch it off, so that it forgets everything, or on again; nothing happens when it is so already.

        Args:
            on: Whether it shall be on.
            now: Seconds.
        """
        if on == self.powered:
            return
        self.powered = on
        self._boot(now)
        if not on:
            self._body.digital_outputs = 0
            self._boot_loader.stop()

    # -- bytes and time ------------------------------------------------------------------------------------

    def receive(self, data: bytes, now: float) -> bytes:
        """Obey commands.

        Args:
            data: Bytes from the line, in pieces of any size.
            now: Seconds.

        Returns:
            The answers.
        """
        self._advance(now)
        if self.powered and not self._boot_loader.running and not self.faults.commands_lost:
            self._commands.feed(data, waiting=self._scripts.waiting)
            self._execute_all(now)
        return self._flush()

    def _execute_all(self, now: float) -> None:
        """Execute what was received, in order, up to the next wait."""
        while not self._scripts.waiting and (command := self._commands.take()) is not None:
            self._execute(command, now)
            self._scripts.step(now, lambda scripted: self._execute(scripted, now))
            self._protect()

    def next_frame(self) -> float | None:
        """Return when :meth:`poll` has the next frame of the stream; None while nothing is streamed."""
        return self._stream.next_due

    def poll(self, now: float) -> bytes:
        """Let the time pass: measure, protect, and send the stream's frame when it is due."""
        self._advance(now)
        if self.mode is not Mode.OFF:
            self._output += self._stream.take(now)
        return self._flush()

    def _advance(self, now: float) -> None:
        body = self._body
        body.update(now)
        if self._boot_loader.ends(now):
            body.digital_outputs = 0
        self._output += self._boot_loader.take(now)
        self._scripts.step(now, lambda command: self._execute(command, now))
        if self._demo is not None:
            wheels = self._demo.wheels(now, bumped=any(body.bumpers()), docked=body.powered)
            if wheels is None:
                self._end_demo()
            else:
                body.set_wheels(*wheels)
        self._protect()
        self._execute_all(now)

    def _flush(self) -> bytes:
        out = bytes(self._output)
        self._output.clear()
        if out and self.faults.noise:
            out, self.faults.noise = self.faults.noise + out, b""
        return b"" if self.faults.silent else out

    # -- modes ---------------------------------------------------------------------------------------------

    def _execute(self, command: bytes, now: float) -> None:
        if command[0] in WAITS and self.mode >= Mode.PASSIVE:
            self._scripts.wait(command, now)
            return
        lowest_mode, handler = self._handlers.get(command[0], (None, None))
        if handler is None or lowest_mode is None or self.mode < lowest_mode:
            self.rejected[command[0]] += 1
        else:
            handler(command[1:], now)

    def _enter(self, mode: Mode) -> None:
        self._end_demo()
        if mode <= Mode.PASSIVE:
            self._body.set_wheels(0, 0)
            self._body.drive = (0, 0)
            self._body.low_side_drivers = (0, 0, 0)
        elif mode is Mode.SAFE:
            self._body.leds = (0, 0, 0)
        self._body.mode = mode

    def _reset(self, _arguments: bytes, now: float) -> None:
        self._boot(now)

    def _boot(self, now: float) -> None:
        """Forget everything, as without a battery, and start the boot loader."""
        self._forget()
        self._body.restart()
        self._scripts.define(b"")
        self.baud_rate = self.model.baud_rate
        self._boot_loader.start(now)

    def _on_stop(self, _arguments: bytes, _now: float) -> None:
        self._forget()

    def _forget(self) -> None:
        self._enter(Mode.OFF)
        self._stream.clear()
        self._scripts.end()
        self._commands.clear()

    def _protect(self) -> None:
        """Enter Passive as Safe mode does by itself (REFERENCE 1.2).

        The plug of the charger allows no Safe mode at all; the dock ends it on arrival, and can be left.
        """
        body, faults = self._body, self.faults
        docks = faults.dock and not self._was_docked
        self._was_docked = faults.dock
        over_cliff = any(faults.cliffs) and cliff_matters(*body.wheels, self.model.wheel_separation_mm)
        if body.mode is Mode.SAFE and (faults.wheel_drops or faults.charger or docks or over_cliff):
            self._enter(Mode.PASSIVE)
        elif self._demo is not None and (faults.wheel_drops or faults.charger):
            self._end_demo()

    def _on_baud(self, arguments: bytes, _now: float) -> None:
        if arguments[0] < len(BAUD_RATES):
            self.baud_rate = BAUD_RATES[arguments[0]]
        else:
            self.rejected[129] += 1

    # -- behaviours ----------------------------------------------------------------------------------------

    def _on_demo(self, arguments: bytes, _now: float) -> None:
        number = int.from_bytes(arguments, "big", signed=True)
        if number < 0:
            self._enter(Mode.PASSIVE)
        elif number <= 9:
            self._play(number)
        else:
            self.rejected[136] += 1

    def _play(self, number: int) -> None:
        self._enter(Mode.PASSIVE)
        self._demo = Demo(number)

    def _end_demo(self) -> None:
        if self._demo is not None:
            self._demo = None
            self._body.set_wheels(0, 0)

    # -- actuators -----------------------------------------------------------------------------------------

    def _on_drive(self, arguments: bytes, _now: float) -> None:
        velocity, radius = struct.unpack(">hh", arguments)
        velocity = clamp(velocity, MAX_SPEED_MMPS)
        self._body.drive = (velocity, radius)
        self._body.set_wheels(*wheels_on_arc(velocity, radius, self.model.wheel_separation_mm))

    def _on_drive_direct(self, arguments: bytes, _now: float) -> None:
        right, left = struct.unpack(">hh", arguments)
        self._body.drive = (0, 0)
        self._body.set_wheels(left, right)

    def _on_drive_pwm(self, arguments: bytes, _now: float) -> None:
        right, left = struct.unpack(">hh", arguments)
        share = MAX_SPEED_MMPS / MAX_PWM
        self._body.set_wheels(round(clamp(left, MAX_PWM) * share), round(clamp(right, MAX_PWM) * share))

    def _on_leds(self, arguments: bytes, _now: float) -> None:
        self._body.leds = (arguments[0], arguments[1], arguments[2])

    def _on_digital_outputs(self, arguments: bytes, _now: float) -> None:
        self._body.digital_outputs = arguments[0] & 7

    def _on_low_side_drivers(self, arguments: bytes, _now: float) -> None:
        bits = arguments[0]
        self._body.low_side_drivers = (
            FULL_DUTY * (bits & 1),
            FULL_DUTY * (bits >> 1 & 1),
            FULL_DUTY * (bits >> 2 & 1),
        )

    def _on_pwm_low_side_drivers(self, arguments: bytes, _now: float) -> None:
        self._body.low_side_drivers = (arguments[2], arguments[1], arguments[0])

    def _on_song(self, arguments: bytes, _now: float) -> None:
        if not self._body.songs.define(arguments):
            self.rejected[140] += 1

    def _on_play_song(self, arguments: bytes, now: float) -> None:
        if not self._body.songs.play(arguments[0], now):
            self.rejected[141] += 1

    # -- answers -------------------------------------------------------------------------------------------

    def _answer(self, numbers: bytes) -> None:
        for number in numbers:
            if packets_of(number, self.model) is None:
                self.rejected[142] += 1
            answer = self._body.pack(number)
            if self.faults.partial_frames:
                self.faults.partial_frames -= 1
                answer = answer[: len(answer) // 2]
            self._output += answer

    def _on_show_script(self, _arguments: bytes, now: float) -> None:
        self._stream.pause(True, now)
        script = self._scripts.script
        self._output += bytes([len(script)]) + script


BOOT_S = 3.0
"""Time of its start after a reset: input is ignored and the digital outputs are high."""


class BootLoader:
    """Runs after power-on and after a reset."""

    def __init__(self, texts: Sequence[tuple[float, bytes]]) -> None:
        """Take what it prints.

        Args:
            texts: Each with the seconds from the start until it is printed.
        """
        self._texts = texts
        self._end: float | None = None
        self._waiting: list[tuple[float, bytes]] = []

    @property
    def running(self) -> bool:
        """Tell whether the base ignores its input because of it."""
        return self._end is not None

    def start(self, now: float) -> None:
        """Begin."""
        self._end = now + BOOT_S
        self._waiting = [(now + after_s, text) for after_s, text in self._texts]

    def stop(self) -> None:
        """Stop, as the power went."""
        self._end = None
        self._waiting = []

    def ends(self, now: float) -> bool:
        """Tell whether it has come to its end by now; true once."""
        over = self._end is not None and now >= self._end
        if over:
            self._end = None
        return over

    def take(self, now: float) -> bytes:
        """Return what it has printed since the last call."""
        due = [text for when, text in self._waiting if now >= when]
        self._waiting = self._waiting[len(due) :]
        return b"".join(due)


STREAM_PERIOD_S = 0.015
"""Source: REFERENCE 1.6."""
LONGEST_STREAM_BODY = 255
"""Largest number in the length byte; packets that find no room are left out."""

TIME_TOLERANCE_S = 1e-9
"""Error of added-up floating point times."""

STREAM_HEADER = 19
"""The first byte of a frame. Source: REFERENCE 1.6."""


class FrameStream:
    """Makes frames of what was asked for, when they are due."""

    def __init__(self, body: Body, header_in_checksum: bool) -> None:
        self._body = body
        self._header_in_checksum = header_in_checksum
        self._numbers: list[int] = []
        self._paused = False
        self._next = 0.0

    @property
    def running(self) -> bool:
        """Tell whether frames are sent."""
        return bool(self._numbers) and not self._paused

    @property
    def next_due(self) -> float | None:
        """Return the time at which the next frame is due; None while nothing is sent."""
        return self._next if self.running else None

    def request(self, numbers: bytes, now: float) -> None:
        """Stream these packets and groups from now on; none end the stream."""
        model = self._body.model
        chosen: list[int] = []
        room = LONGEST_STREAM_BODY
        for number in numbers:
            size = 1 + size_of(number, model)
            if packets_of(number, model) is not None and size <= room and len(chosen) < model.longest_stream:
                chosen.append(number)
                room -= size
        self._numbers = chosen
        self._body.stream_length = len(chosen)
        self._paused = False
        self._next = now + STREAM_PERIOD_S

    def pause(self, paused: bool, now: float) -> None:
        """Be silent, or go on; the list is kept."""
        if self._paused and not paused:
            self._next = now + STREAM_PERIOD_S
        self._paused = paused

    def clear(self) -> None:
        """Forget the list."""
        self._numbers = []
        self._body.stream_length = 0
        self._paused = False

    def take(self, now: float) -> bytes:
        """Return the frame that is due by now, or nothing."""
        late = now - self._next
        if not self.running or late < -TIME_TOLERANCE_S:
            return b""
        # A late call does not cause a burst: the base would have sent those frames earlier.
        self._next += (1 + int(max(0.0, late) / STREAM_PERIOD_S)) * STREAM_PERIOD_S
        return self._frame()

    def _frame(self) -> bytes:
        body = b"".join(bytes([number]) + self._body.pack(number) for number in self._numbers)
        frame = bytes([STREAM_HEADER, len(body)]) + body
        checksum = -sum(frame if self._header_in_checksum else frame[1:]) % 256
        faults = self._body.faults
        if faults.bad_checksums:
            faults.bad_checksums -= 1
            checksum = (checksum + 1) % 256
        frame += bytes([checksum])
        if faults.partial_frames:
            faults.partial_frames -= 1
            frame = frame[: len(frame) // 2]
        return frame


STRAIGHT = (-0x8000, 0x7FFF, 0)
"""Radii. That 0 is one of them is chosen here: PyRobot and others stop with velocity 0 and radius 0."""

SPIN_CLOCKWISE, SPIN_COUNTER_CLOCKWISE = -1, 1
"""Radii that turn it on the spot. Source: REFERENCE 1.3."""
ROBOT_RADIUS_MM = 165.0
MAX_RADIUS_MM, MAX_PWM = 2000, 255
"""Source: REFERENCE 1.3."""
COVER, COVER_AND_DOCK, SPOT = 0, 1, 2
"""Demo numbers; the base stands still in all but the first two."""

COVER_MMPS, TURN_MMPS = 300, 150
BACK_S, TURN_S = 0.5, 1.5
"""Speeds of Cover, and the times of its turn away from what it has hit; chosen, the manual has none."""


def wheels_on_arc(velocity: int, radius: int, separation_mm: float) -> tuple[int, int]:
    """Return the left and right speed in mm/s for the Drive command.

    Args:
        velocity: mm/s.
        radius: mm or one of the special values.
        separation_mm: Between the wheels.
    """
    if radius in STRAIGHT:
        return velocity, velocity
    if radius == SPIN_CLOCKWISE:
        return velocity, -velocity
    if radius == SPIN_COUNTER_CLOCKWISE:
        return -velocity, velocity
    share = separation_mm / (2.0 * clamp(radius, MAX_RADIUS_MM))
    return round(velocity * (1.0 - share)), round(velocity * (1.0 + share))


def cliff_matters(left: int, right: int, separation_mm: float) -> bool:
    """Tell whether Safe mode stops at a cliff: forward, or backward around a point within the robot."""
    if left + right >= 0:
        return left + right > 0
    radius = separation_mm / 2.0 * abs(left + right) / max(1, abs(right - left))
    return radius < ROBOT_RADIUS_MM


class Demo:
    """A behaviour that the base plays by itself: roughly what the manual says it does."""

    def __init__(self, number: int) -> None:
        self._number = number
        self._bumped: float | None = None

    def wheels(self, now: float, *, bumped: bool, docked: bool) -> tuple[int, int] | None:
        """Return the left and right speed in mm/s now; None when the behaviour is over.

        Args:
            now: Seconds.
            bumped: A bumper is pressed.
            docked: The base stands on its home base.
        """
        if self._number == COVER_AND_DOCK and docked:
            return None
        if self._number in (COVER, COVER_AND_DOCK):
            return self._cover(now, bumped)
        return 0, 0

    def _cover(self, now: float, bumped: bool) -> tuple[int, int]:
        """Drive straight on; back and turn away from what is hit."""
        if bumped:
            self._bumped = now
        since = None if self._bumped is None else now - self._bumped
        if since is None or since > BACK_S + TURN_S:
            return COVER_MMPS, COVER_MMPS
        return (-TURN_MMPS, -TURN_MMPS) if since < BACK_S else (-TURN_MMPS, TURN_MMPS)
