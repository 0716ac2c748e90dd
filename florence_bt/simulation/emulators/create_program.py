"""The emulated Create alone, on a pseudo-terminal or a TCP port, for any client; ``python -m`` runs it."""

from __future__ import annotations

import json
import random
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.simulation.emulators.create import CreateEmulator, CreateFaults
from florence_bt.simulation.emulators.create_body import CAPACITY_MAH
from florence_bt.simulation.emulators.create_models import MODELS
from florence_bt.simulation.emulators.kinematic_base import KinematicBase
from florence_bt.simulation.emulators.standalone import (
    FaultLines,
    Plug,
    StandaloneEmulator,
    Verb,
    integer,
    number,
    some_of,
    switch,
)
from florence_bt.simulation.sensors.base_noise import PERFECT_BASE, BaseNoiseParameters, BaseSensors

LONGEST_WAIT_S, LONGEST_WAIT_MOVING_S = 0.02, 0.005
"""How often the base looks around while nothing is streamed: scripts, songs, behaviours."""


@dataclass(frozen=True, slots=True)
class CreateOptions:
    """How to run it.

    Attributes:
        link: Where to put a link to the device file; None for none.
        model: ``create`` or ``create2``.
        header_in_checksum: The form of the stream's checksum; None for the model's own.
        seed: Start of the sensors' noise; None for perfect sensors.
        strict_baud: A client at the wrong speed understands nothing and is not understood.
        control: Where to put the socket of the control channel; None for none.
        tcp_port: Listen on this TCP port of this machine instead (0: any); None for a pseudo-terminal.
        latency_s: How much later everything leaves. A real base needs 10 to 20 ms for an answer (REFERENCE
            1.6), and some clients throw away what came before they begin to listen.
        keeps_input: What comes while a wait runs is obeyed after it, not ignored.
    """

    link: Path | None = None
    model: str = "create"
    header_in_checksum: bool | None = None
    seed: int | None = None
    strict_baud: bool = False
    control: Path | None = None
    tcp_port: int | None = None
    latency_s: float = 0.0
    keeps_input: bool = False


class CreateProgram(StandaloneEmulator):
    """Line, base and control channel.

    Attributes:
        create: The base.
        control: Obeys lines of text.
    """

    def __init__(
        self, options: CreateOptions, clock: Callable[[], float], console: int | None = None
    ) -> None:
        """Open the line and the control channel.

        Args:
            options: How to run it.
            clock: Seconds, never running backwards.
            console: A file descriptor that brings lines of text, such as standard input; None for none.

        Raises:
            DeviceLost: The link, the TCP port or the socket cannot be made.
        """
        super().__init__(options.link, options.tcp_port, options.strict_baud)
        self._latency_s = options.latency_s
        self._leaving: deque[tuple[float, bytes]] = deque()
        self._clock = clock
        separation_m = MODELS[options.model].wheel_separation_mm / 1000.0
        noise = PERFECT_BASE if options.seed is None else BaseNoiseParameters()
        self._passed = clock()
        self._base = KinematicBase(separation_m)
        self.create = CreateEmulator(
            self._base,
            BaseSensors(self._base, options.seed or 0, replace(noise, wheel_separation=separation_m)),
            model=options.model,
            header_in_checksum=options.header_in_checksum,
            keeps_input=options.keeps_input,
        )
        self.control = CreateControl(self.create, self._base, self, clock, options.seed or 0)
        self._listen(self.control, options.control, console)

    def step(self) -> None:
        """Serve the line and let the time pass, once."""
        now = self._clock()
        answer = self._pass_time(now)
        self._base.advance_to(now)
        line = self._line
        received = (
            self._received_at_other_end(line.read(), self.create.baud_rate) if line is not None else b""
        )
        answer += (self.create.receive(received, now) if received else b"") + self.create.poll(now)
        if answer:
            self._leaving.append((now + self._latency_s, answer))
        while self._leaving and now >= self._leaving[0][0]:
            leaves = self._leaving.popleft()[1]
            if line is not None:
                line.write(self._received_at_other_end(leaves, self.create.baud_rate))

    def _pass_time(self, now: float) -> bytes:
        """Let the time since the last step pass, in short pieces while the base moves: scripts watch it."""
        said = b""
        while self.create.wheels != (0, 0) and now - self._passed > LONGEST_WAIT_MOVING_S:
            self._passed += LONGEST_WAIT_MOVING_S
            self._base.advance_to(self._passed)
            said += self.create.poll(self._passed)
        self._passed = now
        return said

    def _longest_wait(self) -> float:
        due = [LONGEST_WAIT_S if self.create.wheels == (0, 0) else LONGEST_WAIT_MOVING_S]
        now, frame = self._clock(), self.create.next_frame()
        if frame is not None:
            due.append(frame - now)
        if self._leaving:
            due.append(self._leaving[0][0] - now)
        return max(0.0, min(due))


WHEELS = {"right": 4, "left": 8, "caster": 16}
CLIFFS = ("left", "front_left", "front_right", "right")
BUTTONS = {"play": 1, "advance": 4}

HELP = """\
silent on|off             what the base sends is lost
deaf on|off               what the host sends is lost
noise COUNT               so many random bytes before what is sent next
bad_checksums COUNT       the next frames have a wrong checksum
partial_frames COUNT      the next frames and answers are cut in half
power on|off              off forgets everything; on starts the boot loader
unplug                    pull the plug: the device file is gone
plug                      put the plug back in
wheel_drop left|right|caster...|none
bump left|right...|none
cliff left|front_left|front_right|right...|all|none
wall on|off, virtual_wall on|off
charger on|off            the plug of the charger
dock on|off               the base stands on its home base
charging_fault on|off     dirty contacts
battery PERCENT           the charge now
buttons play|advance...|none
infrared CODE             0 to 255; 255 for nothing
inputs BITS, overcurrents BITS
gyro_drift COUNTS         per second
gyro on|off               its power
light_bumps SIX NUMBERS   Create 2: 0 to 4095, left to right
oi_mode_offset NUMBER     what packet 35 tells too much
clear                     all of the above undone
status                    the base as one line of JSON
help                      this list
quit                      end the program"""


class CreateControl(FaultLines):
    """Obeys lines of text about a base."""

    def __init__(
        self, create: CreateEmulator, base: KinematicBase, plug: Plug, clock: Callable[[], float], seed: int
    ) -> None:
        self._create = create
        self._base = base
        self._clock = clock
        self._random = random.Random(seed)
        verbs: dict[str, Verb] = {
            **{name: self._switch(name) for name in _SWITCHES},
            **{name: self._number(name, *limits) for name, limits in _NUMBERS.items()},
            "noise": self._noise,
            "wheel_drop": self._wheel_drop,
            "bump": self._bump,
            "cliff": self._cliff,
            "battery": self._battery,
            "buttons": self._buttons,
            "gyro_drift": self._gyro_drift,
            "gyro": self._gyro,
            "light_bumps": self._light_bumps,
            "power": self._power,
            "clear": self._clear,
            "status": lambda _words: self._status(),
        }
        super().__init__(verbs, plug, HELP)

    # -- verbs ---------------------------------------------------------------------------------------------

    @property
    def _faults(self) -> CreateFaults:
        return self._create.faults

    def _switch(self, name: str) -> Verb:
        return lambda words: setattr(self._faults, name, switch(words))

    def _number(self, name: str, lowest: int, highest: int) -> Verb:
        field = _FIELDS.get(name, name)
        return lambda words: setattr(self._faults, field, integer(words, lowest, highest))

    def _noise(self, words: Sequence[str]) -> None:
        self._faults.noise += self._random.randbytes(integer(words, 0, 10_000))

    def _wheel_drop(self, words: Sequence[str]) -> None:
        self._faults.wheel_drops = sum(WHEELS[word] for word in some_of(words, WHEELS))

    def _bump(self, words: Sequence[str]) -> None:
        pressed = some_of(words, ("left", "right"))
        self._faults.left_bumper, self._faults.right_bumper = "left" in pressed, "right" in pressed

    def _cliff(self, words: Sequence[str]) -> None:
        seen = CLIFFS if list(words) == ["all"] else some_of(words, CLIFFS)
        left, front_left, front_right, right = (place in seen for place in CLIFFS)
        self._faults.cliffs = (left, front_left, front_right, right)

    def _battery(self, words: Sequence[str]) -> None:
        self._create.battery.charge_mah = CAPACITY_MAH * number(words, 0.0, 100.0) / 100.0

    def _buttons(self, words: Sequence[str]) -> None:
        self._faults.buttons = sum(BUTTONS[word] for word in some_of(words, BUTTONS))

    def _gyro_drift(self, words: Sequence[str]) -> None:
        self._faults.gyro_drift = number(words, -100.0, 100.0)

    def _gyro(self, words: Sequence[str]) -> None:
        self._faults.gyro_dead = not switch(words)

    def _light_bumps(self, words: Sequence[str]) -> None:
        if len(words) != 6:
            raise ConfigError(f"six numbers are needed, not {len(words)}")
        a, b, c, d, e, f = (integer([word], 0, 4095) for word in words)
        self._faults.light_bumps = (a, b, c, d, e, f)

    def _power(self, words: Sequence[str]) -> None:
        self._create.set_power(switch(words), self._clock())

    def _clear(self, _words: Sequence[str]) -> None:
        fresh = CreateFaults()
        for name in CreateFaults.__slots__:
            setattr(self._faults, name, getattr(fresh, name))
        self._create.set_power(True, self._clock())
        self._plug.plug()

    def _status(self) -> str:
        create, pose = self._create, self._base.pose
        return json.dumps(
            {
                "model": create.model.name,
                "mode": create.mode.name.lower(),
                "plugged": self._plug.plugged,
                "powered": create.powered,
                "baud": create.baud_rate,
                "streaming": create.streaming,
                "wheels_mmps": list(create.wheels),
                "pose": [round(pose.x, 4), round(pose.y, 4), round(pose.yaw, 4)],
                "charge_mah": round(create.battery.charge_mah),
                "charging_state": create.battery.charging_state,
                "digital_outputs": create.digital_outputs,
                "low_side_drivers": list(create.low_side_drivers),
                "leds": list(create.leds),
                "songs_played": create.songs.played,
                "infrared_sent": create.infrared_sent,
                "unknown_bytes": create.unknown_bytes,
                "unobeyed": {str(opcode): count for opcode, count in sorted(create.unobeyed.items())},
            }
        )


_SWITCHES = ("silent", "deaf", "wall", "virtual_wall", "charger", "dock", "charging_fault")
_NUMBERS = {
    "bad_checksums": (0, 1_000_000),
    "partial_frames": (0, 1_000_000),
    "infrared": (0, 255),
    "inputs": (0, 15),
    "overcurrents": (0, 31),
    "oi_mode_offset": (0, 252),
}
_FIELDS = {"inputs": "digital_inputs"}
