"""Lines of text that make things go wrong with an emulated base, and tell how it is."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Sequence
from typing import Protocol

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.simulation.emulators._create_battery import CAPACITY_MAH
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


class Plug(Protocol):
    """The plug of the serial line."""

    @property
    def plugged(self) -> bool:
        """Whether the line is there."""

    def plug(self) -> None:
        """Put it in."""

    def unplug(self) -> None:
        """Pull it out."""


class CreateControl:
    """Obeys lines of text.

    Attributes:
        ended: Whether ``quit`` was said.
    """

    def __init__(self, create: CreateEmulator, base: KinematicBase, plug: Plug, seed: int) -> None:
        self._create = create
        self._base = base
        self._plug = plug
        self._random = random.Random(seed)
        self.ended = False
        self._verbs: dict[str, Callable[[Sequence[str]], str | None]] = {
            **{name: self._switch(name) for name in _SWITCHES},
            **{name: self._number(name, *limits) for name, limits in _NUMBERS.items()},
            "noise": self._noise,
            "unplug": lambda _w: self._plug.unplug(),
            "plug": lambda _w: self._plug.plug(),
            "wheel_drop": self._wheel_drop,
            "bump": self._bump,
            "cliff": self._cliff,
            "battery": self._battery,
            "buttons": self._buttons,
            "gyro_drift": self._gyro_drift,
            "gyro": self._gyro,
            "light_bumps": self._light_bumps,
            "clear": self._clear,
            "status": lambda _w: self._status(),
            "help": lambda _w: HELP,
            "quit": self._quit,
        }

    def run(self, line: str) -> str:
        """Obey one line.

        Returns:
            ``ok``, what was asked for, or ``error:`` and what would have worked.
        """
        words = line.split()
        if not words:
            return "ok"
        verb = self._verbs.get(words[0])
        try:
            if verb is None:
                raise ConfigError(
                    f"there is no command {words[0]!r}", valid=closest_first(words[0], self._verbs)
                )
            return verb(words[1:]) or "ok"
        except ConfigError as error:
            return f"error: {error}"

    # -- verbs ---------------------------------------------------------------------------------------------

    @property
    def _faults(self) -> CreateFaults:
        return self._create.faults

    def _switch(self, name: str) -> Callable[[Sequence[str]], None]:
        return lambda words: setattr(self._faults, name, _on(words))

    def _number(self, name: str, lowest: int, highest: int) -> Callable[[Sequence[str]], None]:
        field = _FIELDS.get(name, name)
        return lambda words: setattr(self._faults, field, _integer(words, lowest, highest))

    def _noise(self, words: Sequence[str]) -> None:
        self._faults.noise += self._random.randbytes(_integer(words, 0, 10_000))

    def _wheel_drop(self, words: Sequence[str]) -> None:
        self._faults.wheel_drops = sum(WHEELS[word] for word in _some(words, WHEELS))

    def _bump(self, words: Sequence[str]) -> None:
        pressed = _some(words, ("left", "right"))
        self._faults.left_bumper, self._faults.right_bumper = "left" in pressed, "right" in pressed

    def _cliff(self, words: Sequence[str]) -> None:
        seen = CLIFFS if list(words) == ["all"] else _some(words, CLIFFS)
        left, front_left, front_right, right = (place in seen for place in CLIFFS)
        self._faults.cliffs = (left, front_left, front_right, right)

    def _battery(self, words: Sequence[str]) -> None:
        self._create.battery.charge_mah = CAPACITY_MAH * _number(words, 0.0, 100.0) / 100.0

    def _buttons(self, words: Sequence[str]) -> None:
        self._faults.buttons = sum(BUTTONS[word] for word in _some(words, BUTTONS))

    def _gyro_drift(self, words: Sequence[str]) -> None:
        self._faults.gyro_drift = _number(words, -100.0, 100.0)

    def _gyro(self, words: Sequence[str]) -> None:
        self._faults.gyro_dead = not _on(words)

    def _light_bumps(self, words: Sequence[str]) -> None:
        if len(words) != 6:
            raise ConfigError(f"six numbers are needed, not {len(words)}")
        a, b, c, d, e, f = (_integer([word], 0, 4095) for word in words)
        self._faults.light_bumps = (a, b, c, d, e, f)

    def _clear(self, _words: Sequence[str]) -> None:
        fresh = CreateFaults()
        for name in CreateFaults.__slots__:
            setattr(self._faults, name, getattr(fresh, name))
        self._plug.plug()

    def _quit(self, _words: Sequence[str]) -> None:
        self.ended = True

    def _status(self) -> str:
        create, pose = self._create, self._base.pose
        return json.dumps(
            {
                "model": create.model.name,
                "mode": create.mode.name.lower(),
                "plugged": self._plug.plugged,
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


def _on(words: Sequence[str]) -> bool:
    if list(words) not in (["on"], ["off"]):
        raise ConfigError(f"cannot understand {' '.join(words)!r}", valid=("on", "off"))
    return words[0] == "on"


def _number(words: Sequence[str], lowest: float, highest: float) -> float:
    try:
        value = float(words[0]) if len(words) == 1 else None
    except ValueError:
        value = None
    if value is None or not lowest <= value <= highest:
        raise ConfigError(f"a number from {lowest:g} to {highest:g} is needed, not {' '.join(words)!r}")
    return value


def _integer(words: Sequence[str], lowest: int, highest: int) -> int:
    value = _number(words, lowest, highest)
    if value != int(value):
        raise ConfigError(f"a whole number is needed, not {words[0]!r}")
    return int(value)


def _some(words: Sequence[str], known: Sequence[str] | dict[str, int]) -> Sequence[str]:
    """The words, each of them known; ``none`` stands for no word."""
    if list(words) == ["none"]:
        return ()
    wrong = [word for word in words if word not in known]
    if wrong or not words:
        raise ConfigError(f"cannot understand {' '.join(words)!r}", valid=(*known, "none"))
    return words
