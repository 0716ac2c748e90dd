"""The emulated Create alone, on a pseudo-terminal or a TCP port, for any client; ``python -m`` runs it.

The clock is given.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2, Twist2, integrate_twist
from florence_bt.simulation.emulators.create import CreateEmulator
from florence_bt.simulation.emulators.create_body import CAPACITY_MAH
from florence_bt.simulation.emulators.create_models import MODELS
from florence_bt.simulation.sensors.base_noise import PERFECT_BASE, BaseNoiseParameters, BaseSensors
from tools.emulators.standalone import (
    COUNT,
    ControlCommand,
    StandaloneEmulator,
    StandaloneOptions,
    bits,
    integer,
    number,
    some_of,
    switch,
)

LONGEST_WAIT_S, LONGEST_WAIT_MOVING_S = 0.02, 0.005
"""Period in which the base looks around while nothing is streamed: scripts, songs, behaviours."""

WHEELS = {"right": 4, "left": 8, "caster": 16}
CLIFFS = ("left", "front_left", "front_right", "right")
BUTTONS = {"play": 1, "advance": 4}


@dataclass(frozen=True, slots=True)
class CreateOptions(StandaloneOptions):
    """The options of the program.

    Attributes:
        model: ``create`` or ``create2``.
        header_in_checksum: The form of the stream's checksum; None for the model's own.
        latency_s: How much later everything leaves. A real base needs 10 to 20 ms for an answer (REFERENCE
            1.6), and some clients throw away what came before they begin to listen.
        keeps_input: What comes while a wait runs is executed after it, not ignored.
    """

    model: str = "create"
    header_in_checksum: bool | None = None
    latency_s: float = 0.0
    keeps_input: bool = False


class CreateProgram(StandaloneEmulator):
    """Line, base and control channel.

    Attributes:
        create: The base.
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
        super().__init__(options)
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
        self.faults = self.create.faults
        self._listen(console)

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

    # -- the control channel -------------------------------------------------------------------------------

    def control_commands(self) -> Sequence[ControlCommand]:
        """Return commands for all that goes wrong with a base, and what people and rooms do to it."""
        return (
            self.fault("partial_frames NUMBER", "the next frames and answers are cut in half", COUNT),
            self.fault("wheel_drop left|right|caster...|none", "", bits(WHEELS), field="wheel_drops"),
            ControlCommand("bump left|right...|none", "", self._bump),
            self.fault("cliff left|front_left|front_right|right...|all|none", "", _cliffs, field="cliffs"),
            self.fault("wall on|off", "", switch),
            self.fault("virtual_wall on|off", "", switch),
            self.fault("charger on|off", "the plug of the charger", switch),
            self.fault("dock on|off", "the base stands on its home base", switch),
            self.fault("charging_fault on|off", "dirty contacts", switch),
            ControlCommand("battery PERCENT", "the charge now", self._battery),
            self.fault("buttons play|advance...|none", "", bits(BUTTONS)),
            self.fault("infrared NUMBER", "255 for nothing", integer(0, 255)),
            self.fault("inputs NUMBER", "the digital inputs as bits", integer(0, 15), field="digital_inputs"),
            self.fault("overcurrents NUMBER", "as bits", integer(0, 31)),
            self.fault("gyro_drift COUNTS", "per second", number(-100.0, 100.0)),
            self.fault("gyro on|off", "its power", lambda words: not switch(words), field="gyro_dead"),
            self.fault("light_bumps SIX NUMBERS", "Create 2: 0 to 4095, left to right", _light_bumps),
            self.fault(
                "drops_fractions on|off", "readings drop what is below a millimetre or degree", switch
            ),
            self.fault("oi_mode_offset NUMBER", "how much too high packet 35 is", integer(0, 252)),
        )

    def set_power(self, on: bool) -> None:
        """Switch the base on or off."""
        self.create.set_power(on, self._clock())

    def _bump(self, words: list[str]) -> None:
        pressed = some_of(words, ("left", "right"))
        self.faults.left_bumper, self.faults.right_bumper = "left" in pressed, "right" in pressed

    def _battery(self, words: list[str]) -> None:
        self.create.battery.charge_mah = CAPACITY_MAH * number(0.0, 100.0)(words) / 100.0

    def status(self) -> str:
        """Describe the base as one line of JSON."""
        create, pose = self.create, self._base.pose
        return json.dumps(
            {
                "model": create.model.name,
                "mode": create.mode.name.lower(),
                "plugged": self.plugged,
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
                "unobeyed": {str(opcode): count for opcode, count in sorted(create.rejected.items())},
            }
        )


def _cliffs(words: list[str]) -> tuple[bool, ...]:
    seen = CLIFFS if words == ["all"] else some_of(words, CLIFFS)
    return tuple(place in seen for place in CLIFFS)


def _light_bumps(words: list[str]) -> tuple[int, ...]:
    if len(words) != 6:
        raise ConfigError(f"six numbers are needed, not {len(words)}")
    return tuple(integer(0, 4095)([word]) for word in words)


class KinematicBase:
    """Wheels without mass; a ``BasePlant`` for an emulator that runs alone.

    Attributes:
        pose: Where it stands, from its start.
    """

    def __init__(self, wheel_separation_m: float) -> None:
        """Stand at the start.

        Args:
            wheel_separation_m: Metres between the wheels.
        """
        self._separation_m = wheel_separation_m
        self._wheels = (0.0, 0.0)
        self._travel = (0.0, 0.0)
        self._time: float | None = None
        self.pose = Pose2()

    def advance_to(self, now: float) -> None:
        """Roll on until now, in seconds."""
        elapsed = 0.0 if self._time is None else max(0.0, now - self._time)
        self._time = now
        left, right = self._wheels
        self._travel = (self._travel[0] + left * elapsed, self._travel[1] + right * elapsed)
        self.pose = integrate_twist(self.pose, Twist2((left + right) / 2.0, self.yaw_rate()), elapsed)

    def set_wheels(self, left_mps: float, right_mps: float) -> None:
        """Turn the wheels at these speeds in m/s."""
        self._wheels = (left_mps, right_mps)

    def travel(self) -> tuple[float, float]:
        """Return the metres that the left and the right wheel have rolled."""
        return self._travel

    def yaw_rate(self) -> float:
        """Return the turning rate in rad/s, counter-clockwise positive."""
        return (self._wheels[1] - self._wheels[0]) / self._separation_m

    def bumpers(self) -> tuple[bool, bool]:
        """Return no contacts: there is nothing to bump into."""
        return (False, False)
