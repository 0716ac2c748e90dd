"""Lines of text that make things go wrong with an emulated base, and tell how it is."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Sequence

from florence_bt.core.errors import ConfigError
from florence_bt.simulation.emulators._create_battery import CAPACITY_MAH
from florence_bt.simulation.emulators._fault_lines import (
    FaultLines,
    Plug,
    Verb,
    integer,
    number,
    some_of,
    switch,
)
from florence_bt.simulation.emulators.create import CreateEmulator, CreateFaults
from florence_bt.simulation.emulators.kinematic_base import KinematicBase

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
