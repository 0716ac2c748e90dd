"""An iRobot Create at the other end of the serial line, written from the Open Interface manual (REFERENCE 1).

Bytes and the time in, bytes out. It never imports the driver, so that a mistake in the driver's codec cannot
hide behind the same mistake here. ``docs/emulators.md`` tells what it does and how to run it alone.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Callable

from florence_bt.simulation.emulators._create_battery import Battery
from florence_bt.simulation.emulators._create_body import Body, Mode
from florence_bt.simulation.emulators._create_boot import BOOT_S, BootLoader
from florence_bt.simulation.emulators._create_commands import CommandReader
from florence_bt.simulation.emulators._create_faults import CreateFaults
from florence_bt.simulation.emulators._create_models import MODELS, EmulatedModel
from florence_bt.simulation.emulators._create_motion import (
    COVER,
    COVER_AND_DOCK,
    MAX_PWM,
    MAX_SPEED_MMPS,
    SPOT,
    Demo,
    clamp,
    cliff_matters,
    wheels_on_arc,
)
from florence_bt.simulation.emulators._create_packets import packets_of
from florence_bt.simulation.emulators._create_scripts import WAITS, ScriptPlayer, World
from florence_bt.simulation.emulators._create_songs import Songs
from florence_bt.simulation.emulators._create_stream import Stream
from florence_bt.simulation.sensors.base_noise import BasePlant, BaseSensors

__all__ = ["BOOT_S", "CreateEmulator", "CreateFaults", "Mode"]

BAUD_RATES = (300, 600, 1200, 2400, 4800, 9600, 14400, 19200, 28800, 38400, 57600, 115200)
FULL_DUTY = 128

Handler = Callable[[bytes, float], None]


class CreateEmulator:
    """Obeys commands, streams sensors, and protects itself as the firmware does.

    Attributes:
        model: Which base.
        baud_rate: What the line should run at.
        powered: Whether it is switched on.
        infrared_sent: The bytes sent as infrared light, in order.
        unobeyed: How often each opcode came that is not acted on, or not in the mode of the moment.
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
            keeps_input: What comes while a wait runs is obeyed after it, not ignored (REFERENCE 1.4).
        """
        self.model: EmulatedModel = MODELS[model]
        self.baud_rate = self.model.baud_rate
        self.powered = True
        self.infrared_sent: list[int] = []
        self.unobeyed: Counter[int] = Counter()
        self._body = Body(self.model, plant, sensors)
        self._stream = Stream(
            self._body,
            self.model.header_in_checksum if header_in_checksum is None else header_in_checksum,
        )
        self._commands = CommandReader(self.model.commands, keeps_input)
        self._scripts = ScriptPlayer(
            self.model.commands, World(self._body.value, self._body.distance_mm, self._body.angle_deg)
        )
        self._output = bytearray()
        self._boot_loader = BootLoader(self.model.boot_texts)
        self._demo: Demo | None = None
        self._was_docked = False
        self._handlers = self._make_handlers()

    def _make_handlers(self) -> dict[int, tuple[Mode, Handler]]:
        """Opcode -> the lowest mode that obeys it, and what it does."""
        off, passive, safe = Mode.OFF, Mode.PASSIVE, Mode.SAFE
        common: dict[int, tuple[Mode, Handler]] = {
            7: (off, self._reset),
            128: (off, lambda _a, _n: self._enter(Mode.PASSIVE)),
            129: (passive, self._on_baud),
            130: (passive, lambda _a, _n: self._enter(Mode.SAFE)),
            131: (passive, lambda _a, _n: self._enter(Mode.SAFE)),
            132: (passive, lambda _a, _n: self._enter(Mode.FULL)),
            134: (passive, lambda _a, now: self._play(SPOT, now)),
            135: (passive, lambda _a, now: self._play(COVER, now)),
            137: (safe, self._on_drive),
            138: (safe, self._on_low_side_drivers),
            139: (safe, self._on_leds),
            140: (passive, self._on_song),
            141: (safe, self._on_play_song),
            142: (passive, lambda arguments, _n: self._answer(arguments)),
            143: (passive, lambda _a, now: self._play(COVER_AND_DOCK, now)),
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
            136: (passive, lambda _a, now: self._play(COVER, now)),
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
    def faults(self) -> CreateFaults:
        """What goes wrong, on command."""
        return self._body.faults

    @property
    def battery(self) -> Battery:
        """The battery."""
        return self._body.battery

    @property
    def songs(self) -> Songs:
        """The songs."""
        return self._body.songs

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
        """Whether frames are sent by themselves."""
        return self._stream.running

    @property
    def unknown_bytes(self) -> int:
        """How many bytes came that are no opcode."""
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
        if self.powered and not self._boot_loader.running and not self.faults.deaf:
            self._commands.feed(data, waiting=self._scripts.waiting)
            self._obey_all(now)
        return self._flush()

    def _obey_all(self, now: float) -> None:
        """Obey what was heard, in order; while a wait runs, it waits too."""
        while not self._scripts.waiting and (command := self._commands.take()) is not None:
            self._obey(command, now)
            self._scripts.step(now, lambda scripted: self._obey(scripted, now))
            self._protect()

    def next_frame(self) -> float | None:
        """When :meth:`poll` has the next frame of the stream; None while nothing is streamed."""
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
        self._scripts.step(now, lambda command: self._obey(command, now))
        if self._demo is not None:
            wheels = self._demo.wheels(now, bumped=any(body.bumpers()), docked=body.powered)
            if wheels is None:
                self._end_demo()
            else:
                body.set_wheels(*wheels)
        self._protect()
        self._obey_all(now)

    def _flush(self) -> bytes:
        out = bytes(self._output)
        self._output.clear()
        if out and self.faults.noise:
            out, self.faults.noise = self.faults.noise + out, b""
        return b"" if self.faults.silent else out

    # -- modes ---------------------------------------------------------------------------------------------

    def _obey(self, command: bytes, now: float) -> None:
        if command[0] in WAITS and self.mode >= Mode.PASSIVE:
            self._scripts.wait(command, now)
            return
        lowest_mode, handler = self._handlers.get(command[0], (None, None))
        if handler is None or lowest_mode is None or self.mode < lowest_mode:
            self.unobeyed[command[0]] += 1
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
        """Safe mode's automatic way to Passive (REFERENCE 1.2).

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
            self.unobeyed[129] += 1

    # -- behaviours ----------------------------------------------------------------------------------------

    def _on_demo(self, arguments: bytes, now: float) -> None:
        number = int.from_bytes(arguments, "big", signed=True)
        if number < 0:
            self._enter(Mode.PASSIVE)
        elif number <= 9:
            self._play(number, now)
        else:
            self.unobeyed[136] += 1

    def _play(self, number: int, now: float) -> None:
        self._enter(Mode.PASSIVE)
        self._demo = Demo(number, now)

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
            self.unobeyed[140] += 1

    def _on_play_song(self, arguments: bytes, now: float) -> None:
        if not self._body.songs.play(arguments[0], now):
            self.unobeyed[141] += 1

    # -- answers -------------------------------------------------------------------------------------------

    def _answer(self, numbers: bytes) -> None:
        for number in numbers:
            if packets_of(number, self.model) is None:
                self.unobeyed[142] += 1
            answer = self._body.pack(number)
            if self.faults.partial_frames:
                self.faults.partial_frames -= 1
                answer = answer[: len(answer) // 2]
            self._output += answer

    def _on_show_script(self, _arguments: bytes, now: float) -> None:
        self._stream.pause(True, now)
        script = self._scripts.script
        self._output += bytes([len(script)]) + script
