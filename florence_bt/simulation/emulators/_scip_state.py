"""Modes, timer and settings of the emulated scanner, and every answer that needs no measurement."""

from __future__ import annotations

import re
from collections.abc import Callable

from florence_bt.simulation.emulators._scip_device import (
    ALLOWED_IN_TIME_MODE,
    ARGUMENT_LENGTHS,
    BIT_RATES,
    ScannerModel,
    ScipFaults,
)
from florence_bt.simulation.emulators._scip_malfunction import PretendedError
from florence_bt.simulation.emulators._scip_wire import encode_number, information_lines, summed

TIMER_WRAP_MS = 1 << 24
LONGEST_NOTE = 16
BY_DEFAULT = "<-Default setting by user"
"""Stands behind a setting of II that was never changed."""

STATES = {
    "000": "Idle",
    "002": "Time adjustment",
    "003": "Single scan",
    "004": "Multi scan",
    "005": "Sleep",
}
"""What %ST tells."""

WAKING = ("BM", "QT", "TM")

_USER_STRING = re.compile(r"[A-Za-z0-9 ._+@]*")

Answer = tuple[str, list[str]]


class ScipState:
    """What the scanner remembers.

    Attributes:
        laser_on: Whether the laser is on.
        speaks_scip1: Whether it still waits for ``SCIP2.0``.
        restarts: How often RB restarted it.
        pretended: The error that DB asked for.
    """

    def __init__(self, model: ScannerModel, faults: Callable[[], ScipFaults], wakes_in_scip1: bool) -> None:
        """Prepare; :meth:`wake` begins.

        Args:
            model: The device data.
            faults: Gives what goes wrong now.
            wakes_in_scip1: Whether it wakes up in SCIP 1.1.
        """
        self._model = model
        self._faults = faults
        self._wakes_in_scip1 = wakes_in_scip1
        self.laser_on = False
        self.speaks_scip1 = wakes_in_scip1
        self.restarts = 0

    def wake(self, now: float) -> None:
        """Begin as after power on."""
        self.speaks_scip1 = self._wakes_in_scip1
        self._restart_asked = False
        self.pretended = PretendedError()
        self._bit_rate = BIT_RATES[0]
        self._reset(now)

    def set_timer(self, milliseconds: int, now: float) -> None:
        """Set the timer."""
        self._timer_zero = now - milliseconds / 1000.0

    def timer(self, now: float) -> int:
        """The timer: milliseconds, 24 bits."""
        frozen = self._faults().frozen_timer_ms
        if frozen is not None:
            return frozen
        return round((now - self._timer_zero) * 1000.0) % TIMER_WRAP_MS

    @property
    def period(self) -> float:
        """Seconds a turn; each step of CR is taken as one hundredth slower."""
        return 60.0 / self._model.number("SCAN") / (1.0 - 0.01 * self._slowness)

    @property
    def bit_rate(self) -> int:
        """Bits a second of its RS-232 line."""
        return int(self._bit_rate)

    @property
    def laser_broken(self) -> bool:
        """Whether the laser cannot be switched on."""
        return self._faults().laser_broken or self.pretended.trouble

    def objection(self, letters: str, arguments: str, note: str) -> str | None:
        """The status that refuses a command, None when there is nothing against it."""
        length = ARGUMENT_LENGTHS.get(letters)
        known = letters in self._model.commands
        if len(note) > LONGEST_NOTE:
            return "0G"
        if not _USER_STRING.fullmatch(note):
            return "0H"
        if letters != "RB":
            self._restart_asked = False
        if letters == "CR" and not known:
            return "04"
        if not known or length is None or len(arguments) > length:
            return "0E"
        if self._time_mode and letters not in ALLOWED_IN_TIME_MODE and not self._leaves_time_mode(letters):
            return "10" if self._model.denies_time_mode else "0E"
        return "0C" if len(arguments) < length else None

    def _leaves_time_mode(self, letters: str) -> bool:
        return self._model.denies_time_mode and letters == "RS"

    def answer(self, letters: str, arguments: str, measuring: bool, now: float) -> Answer:
        """Carry a command out that measures nothing; the caller has stopped what must be stopped.

        Returns:
            Status and lines.
        """
        if letters in WAKING:
            self._asleep = False
        match letters:
            case "VV":
                return "00", information_lines(self._model.version)
            case "PP":
                return "00", information_lines(self._model.parameters)
            case "II":
                return "00", information_lines(self._information(measuring, now))
            case "%ST":
                return "00", [summed(self._state_code(measuring))]
            case "BM":
                return self._switch_on(), []
            case "RS" | "RT":
                self._reset(now, keep_speeds=letters == "RT")
            case "%SL":
                self._asleep = True
            case "RB":
                return self._restart(), []
            case "TM":
                return self._time(arguments, now)
            case "SS":
                return self._set_bit_rate(arguments), []
            case "CR":
                return self._set_slowness(arguments), []
            case "HS":
                return self._set_sensitivity(arguments), []
            case "DB":
                return self._pretend(arguments), []
        return "00", []

    def _reset(self, now: float, keep_speeds: bool = False) -> None:
        """RT is the UTM's reset that leaves the speeds of motor and line."""
        self._time_mode = False
        self._asleep = False
        self._sensitive = False
        self._timer_zero = now
        if not keep_speeds:
            self._slowness = 0
            self._bit_rate = BIT_RATES[0]

    def _information(self, measuring: bool, now: float) -> dict[str, str]:
        """The fields of II, in the words of the sensors whose replies are published.

        The state that a UTM tells as MESM is made up of what %ST tells.
        """
        rate = f"{int(self._bit_rate)}[bps]"
        code, trouble = self._state_code(measuring), self.pretended.trouble
        idle = "Measuring by Sensitive Mode" if self._sensitive else "Measuring by Normal Mode"
        return {
            "MODL": self._model.parameters["MODL"],
            "LASR": "ON" if self.laser_on else "OFF",
            "SCSP": self._speed(),
            "MESM": f"{code} {STATES[code]}"
            if "%ST" in self._model.commands
            else idle
            if measuring
            else "IDLE",
            "SBPS": rate + BY_DEFAULT if self._bit_rate == BIT_RATES[0] else rate,
            "TIME": f"{self.timer(now):06X}",
            "STAT": f"Simulated error {self.pretended.mode}." if trouble else self._healthy(),
        }

    def _healthy(self) -> str:
        stat = self._faults().stat
        return self._model.healthy if stat is None else stat

    def _speed(self) -> str:
        """SCSP: the usual speed, or how much slower it is; hosts such as hokuyoaist read both."""
        rpm = f"({round(60.0 / self.period)}[rpm])"
        return f"{self._slowness}%down{rpm}" if self._slowness else f"Initial{rpm}{BY_DEFAULT}"

    def _state_code(self, measuring: bool) -> str:
        """Standby, time adjustment, sleep, single scan or multi scan."""
        if self._time_mode:
            return "002"
        if self._asleep:
            return "005"
        if not self.laser_on:
            return "000"
        return "004" if measuring else "003"

    def _switch_on(self) -> str:
        if self.laser_broken:
            return "01"
        if self.laser_on:
            return "02"
        self.laser_on = True
        return "00"

    def _restart(self) -> str:
        """The first RB is answered 01; the second in a row restarts."""
        if not self._restart_asked:
            self._restart_asked = True
            return "01"
        self.restarts += 1
        return "00"

    def _time(self, argument: str, now: float) -> Answer:
        match argument, self._time_mode:
            case "0", False:
                self._time_mode = True
                return "00", []
            case "0", True:
                return "02", []
            case "1", True:
                return "00", [summed(encode_number(self.timer(now), 4))]
            case "1", False:
                return "04", []
            case "2", True:
                self._time_mode = False
                return "00", []
            case "2", False:
                return "03", []
            case _:
                return "01", []

    def _set_bit_rate(self, digits: str) -> str:
        """Counts from the next command on; over USB and TCP it has no effect."""
        if not digits.isdecimal():
            return "01"
        if digits not in BIT_RATES:
            return "02"
        if digits == self._bit_rate:
            return "03"
        self._bit_rate = digits
        return "00"

    def _set_slowness(self, digits: str) -> str:
        if not digits.isdecimal():
            return "01"
        slowness = 0 if digits == "99" else int(digits)
        if slowness > 10:
            return "02"
        if slowness == self._slowness and digits != "99":
            return "03"
        self._slowness = slowness
        return "00"

    def _set_sensitivity(self, digit: str) -> str:
        if digit not in ("0", "1"):
            return "01"
        if self._sensitive == (digit == "1"):
            return "02"
        self._sensitive = digit == "1"
        return "00"

    def _pretend(self, digits: str) -> str:
        status = self.pretended.set(digits)
        self.laser_on = self.laser_on and not self.pretended.trouble
        return status
