"""Lines of text that make things go wrong with an emulated scanner, and tell how it is."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable, Sequence

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.simulation.emulators._create_control import Plug
from florence_bt.simulation.emulators.scip import ScipEmulator, ScipFaults

HELP = """\
silent on|off             what the scanner sends is lost
deaf on|off               what the host sends is lost
noise COUNT               so many random bytes before what is sent next
bad_checksums COUNT       the next scans have a wrong check sum
bad_replies COUNT         the next answers to commands have a wrong check sum
partial BYTES             the next scan ends after so many bytes
scan_status STATUS        the next scan is replaced by this status (50: hardware trouble) and measuring ends
status_of COMMAND STATUS  every COMMAND (PP, TM1, ...) is answered with this status; none ends that
laser_broken on|off       BM is refused, measuring ends with 50
stat TEXT                 the text of STAT; without one the healthy one
freeze_timer on|off       every time stamp is the same
delay SECONDS             everything leaves so much later
speed BYTES               bytes per second that leave; 0 for at once
power on|off              off forgets everything, on wakes it up as new
unplug                    pull the plug: the device file (or the TCP port) is gone
plug                      put the plug back in
clear                     all of the above undone
status                    the scanner as one line of JSON
help                      this list
quit                      end the program"""

_STATUS = re.compile(r"[0-9][0-9A-Z]")


class ScipControl:
    """Obeys lines of text.

    Attributes:
        ended: Whether ``quit`` was said.
    """

    def __init__(self, scanner: ScipEmulator, plug: Plug, clock: Callable[[], float], seed: int) -> None:
        self._scanner = scanner
        self._plug = plug
        self._clock = clock
        self._random = random.Random(seed)
        self.ended = False
        self._verbs: dict[str, Callable[[Sequence[str]], str | None]] = {
            "silent": lambda words: setattr(self._faults, "silent", _on(words)),
            "deaf": lambda words: setattr(self._faults, "deaf", _on(words)),
            "laser_broken": lambda words: setattr(self._faults, "laser_broken", _on(words)),
            "noise": self._noise,
            "bad_checksums": lambda words: setattr(self._faults, "bad_checksums", _count(words)),
            "bad_replies": lambda words: setattr(self._faults, "bad_replies", _count(words)),
            "partial": lambda words: setattr(self._faults, "cut_scan_at", _count(words)),
            "scan_status": lambda words: setattr(self._faults, "scan_status", _status(words)),
            "status_of": self._status_of,
            "stat": lambda words: setattr(self._faults, "stat", " ".join(words) or ScipFaults().stat),
            "freeze_timer": self._freeze_timer,
            "delay": lambda words: setattr(self._faults, "delay_s", _number(words, 60.0)),
            "speed": self._speed,
            "power": lambda words: self._scanner.set_power(_on(words), self._clock()),
            "unplug": lambda _w: self._plug.unplug(),
            "plug": lambda _w: self._plug.plug(),
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

    @property
    def _faults(self) -> ScipFaults:
        return self._scanner.faults

    def _noise(self, words: Sequence[str]) -> None:
        self._faults.noise += self._random.randbytes(_count(words))

    def _status_of(self, words: Sequence[str]) -> None:
        if len(words) != 2:
            raise ConfigError("a command and a status are needed", valid=["PP 0A", "PP none"])
        if words[1] == "none":
            self._faults.statuses.pop(words[0], None)
        else:
            self._faults.statuses[words[0]] = _status(words[1:])

    def _freeze_timer(self, words: Sequence[str]) -> None:
        now = self._scanner.state.timer(self._clock())
        self._faults.frozen_timer_ms = now if _on(words) else None

    def _speed(self, words: Sequence[str]) -> None:
        self._faults.bytes_per_second = _number(words, 1e7) or None

    def _clear(self, _words: Sequence[str]) -> None:
        self._scanner.faults = ScipFaults()
        self._scanner.set_power(True, self._clock())
        self._plug.plug()

    def _quit(self, _words: Sequence[str]) -> None:
        self.ended = True

    def _status(self) -> str:
        scanner = self._scanner
        return json.dumps(
            {
                "model": scanner.model.name,
                "plugged": self._plug.plugged,
                "powered": scanner.powered,
                "laser": scanner.laser_on,
                "measuring": scanner.measuring,
                "scip": "1.1" if scanner.state.speaks_scip1 else "2.0",
                "timer_ms": scanner.state.timer(self._clock()),
            }
        )


def _on(words: Sequence[str]) -> bool:
    if list(words) not in (["on"], ["off"]):
        raise ConfigError(f"cannot understand {' '.join(words)!r}", valid=("on", "off"))
    return words[0] == "on"


def _number(words: Sequence[str], highest: float) -> float:
    try:
        value = float(words[0]) if len(words) == 1 else -1.0
    except ValueError:
        value = -1.0
    if not 0.0 <= value <= highest:
        raise ConfigError(f"a number from 0 to {highest:g} is needed, not {' '.join(words)!r}")
    return value


def _count(words: Sequence[str]) -> int:
    value = _number(words, 1e6)
    if value != int(value):
        raise ConfigError(f"a whole number is needed, not {words[0]!r}")
    return int(value)


def _status(words: Sequence[str]) -> str:
    if len(words) != 1 or not _STATUS.fullmatch(words[0]):
        raise ConfigError(
            f"{' '.join(words)!r} is no status", valid=["a digit and a digit or letter: 50, 0A"]
        )
    return words[0]
