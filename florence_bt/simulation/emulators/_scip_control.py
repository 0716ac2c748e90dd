"""Lines of text that make things go wrong with an emulated scanner, and tell how it is."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable, Sequence

from florence_bt.core.errors import ConfigError
from florence_bt.simulation.emulators._fault_lines import FaultLines, Plug, Verb, integer, number, switch
from florence_bt.simulation.emulators.scip import ScipEmulator, ScipFaults

HELP = """\
silent on|off             what the scanner sends is lost
deaf on|off               what the host sends is lost
noise COUNT               so many random bytes before what is sent next
bad_checksums COUNT       the next scans have a wrong check sum
bad_replies COUNT         the next answers to commands have a wrong check sum
partial BYTES             the next scan ends after so many bytes
scan_status STATUS        the next scan is replaced by this status (50: hardware trouble) and measuring ends
every_scan_status STATUS  every scan is replaced by this status and measuring goes on; none ends that
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


class ScipControl(FaultLines):
    """Obeys lines of text about a scanner."""

    def __init__(self, scanner: ScipEmulator, plug: Plug, clock: Callable[[], float], seed: int) -> None:
        self._scanner = scanner
        self._clock = clock
        self._random = random.Random(seed)
        verbs: dict[str, Verb] = {
            "silent": lambda words: setattr(self._faults, "silent", switch(words)),
            "deaf": lambda words: setattr(self._faults, "deaf", switch(words)),
            "laser_broken": lambda words: setattr(self._faults, "laser_broken", switch(words)),
            "noise": self._noise,
            "bad_checksums": lambda words: setattr(self._faults, "bad_checksums", _count(words)),
            "bad_replies": lambda words: setattr(self._faults, "bad_replies", _count(words)),
            "partial": lambda words: setattr(self._faults, "cut_scan_at", _count(words)),
            "scan_status": lambda words: setattr(self._faults, "scan_status", _status(words)),
            "every_scan_status": self._every_scan_status,
            "status_of": self._status_of,
            "stat": lambda words: setattr(self._faults, "stat", " ".join(words) or None),
            "freeze_timer": self._freeze_timer,
            "delay": lambda words: setattr(self._faults, "delay_s", number(words, 0.0, 60.0)),
            "speed": self._speed,
            "power": lambda words: self._scanner.set_power(switch(words), self._clock()),
            "clear": self._clear,
            "status": lambda _words: self._status(),
        }
        super().__init__(verbs, plug, HELP)

    @property
    def _faults(self) -> ScipFaults:
        return self._scanner.faults

    def _noise(self, words: Sequence[str]) -> None:
        self._faults.noise += self._random.randbytes(_count(words))

    def _every_scan_status(self, words: Sequence[str]) -> None:
        self._faults.every_scan_status = None if list(words) == ["none"] else _status(words)

    def _status_of(self, words: Sequence[str]) -> None:
        if len(words) != 2:
            raise ConfigError("a command and a status are needed", valid=["PP 0A", "PP none"])
        if words[1] == "none":
            self._faults.statuses.pop(words[0], None)
        else:
            self._faults.statuses[words[0]] = _status(words[1:])

    def _freeze_timer(self, words: Sequence[str]) -> None:
        now = self._scanner.state.timer(self._clock())
        self._faults.frozen_timer_ms = now if switch(words) else None

    def _speed(self, words: Sequence[str]) -> None:
        self._faults.bytes_per_second = number(words, 0.0, 1e7) or None

    def _clear(self, _words: Sequence[str]) -> None:
        self._scanner.faults = ScipFaults()
        self._scanner.set_power(True, self._clock())
        self._plug.plug()

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


def _count(words: Sequence[str]) -> int:
    return integer(words, 0, 1_000_000)


def _status(words: Sequence[str]) -> str:
    if len(words) != 1 or not _STATUS.fullmatch(words[0]):
        raise ConfigError(
            f"{' '.join(words)!r} is no status", valid=["a digit and a digit or letter: 50, 0A"]
        )
    return words[0]
