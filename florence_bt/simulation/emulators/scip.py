"""A Hokuyo URG-04LX that speaks SCIP 2.0, written from the manual: bytes and the time in, bytes out.

It never imports the driver, so that an error of one cannot hide in the other. The world is asked through
:class:`LaserPlant`. Where the manual leaves something open, the docstring says what was chosen.

Source: REFERENCE 4.1 to 4.8, 13.
"""

from __future__ import annotations

import math
import re
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from florence_bt.simulation.emulators._scip_device import (
    ARGUMENT_LENGTHS,
    BIT_RATES,
    Measurement,
    ScannerModel,
    ScipFaults,
    parse_measurement,
)
from florence_bt.simulation.emulators._scip_wire import (
    encode_number,
    information_lines,
    reply,
    scan_lines,
    spoil_last_sum,
    summed,
)

__all__ = ["LaserPlant", "ScannerModel", "ScipEmulator", "ScipFaults"]

TIMER_WRAP_MS = 1 << 24
LONGEST_REQUEST = 64
NOT_MEASURABLE = 19
TWO_CHARACTER_LIMIT = 4095

_USER_STRING = re.compile(r"[A-Za-z0-9 ._+@]*")

Answer = tuple[str, list[str]]


class LaserPlant(Protocol):
    """The world as the scanner sees it."""

    def measure(self, first_step: int, last_step: int) -> NDArray[np.int32]:
        """Distances of the steps first..last (inclusive) at this moment.

        Returns:
            Shape (last - first + 1,), millimetres; values below DMIN are error codes.
        """


class ScipEmulator:
    """The scanner. One turn lasts 100 ms, and a scan's time stamp is the moment at step 0 of its turn.

    The world is measured when the beam looks ahead, and the reply leaves when the last step has passed, as
    with the real one. Call :meth:`poll` at :meth:`next_deadline` or every few milliseconds; turns that
    nobody polled for are left out.

    Args:
        plant: The world.
        model: The device data.
        speaks_scip1: Wake up in SCIP 1.1, as old firmware does: all but ``SCIP2.0`` is answered with an E.

    Attributes:
        faults: What shall go wrong.
        laser_on: Whether the laser is on.
    """

    def __init__(
        self, plant: LaserPlant, *, model: ScannerModel | None = None, speaks_scip1: bool = False
    ) -> None:
        self._plant = plant
        self._model = model or ScannerModel()
        self._wakes_in_scip1 = speaks_scip1
        self.faults = ScipFaults()
        self.laser_on = False
        self._powered = True
        self._input = b""
        self._stream: Measurement | None = None
        self._snapshot: NDArray[np.int32] | None = None
        self._wake(0.0)

    @property
    def powered(self) -> bool:
        """Whether the scanner has power."""
        return self._powered

    @property
    def measuring(self) -> bool:
        """Whether a stream of scans runs."""
        return self._stream is not None

    def set_power(self, on: bool, now: float) -> None:
        """Cut the power or give it back; the scanner then wakes up as new."""
        if on != self._powered:
            self._wake(now)
        self._powered = on

    def set_timer(self, milliseconds: int, now: float) -> None:
        """Set the sensor's clock, e.g. to shortly before it wraps."""
        self._timer_zero = now - milliseconds / 1000.0

    def receive(self, data: bytes, now: float) -> bytes:
        """Take bytes from the host and return the answers."""
        if not self._powered:
            return b""
        *lines, rest = (self._input + data).replace(b"\r", b"\n").split(b"\n")
        self._input = rest[-LONGEST_REQUEST:]
        return self._send(b"".join(self._answer(line.decode("latin-1"), now) for line in lines if line))

    def poll(self, now: float) -> bytes:
        """Return the scan that has become complete, if any."""
        if self._stream is None:
            return b""
        late_turns = math.floor((now - self._turn_start - self._sweep(self._stream.last + 1)) / self._period)
        if late_turns > 0:
            self._turn_start += late_turns * self._period
            self._snapshot = None
        looks_ahead, done = self._moments(self._stream)
        if self._snapshot is None and now >= looks_ahead:
            self._snapshot = self._measure(self._stream)
        if now < done or self._snapshot is None:
            return b""
        values, started = self._snapshot, self._turn_start
        self._snapshot = None
        self._turn_start += self._period * (1 + self._stream.skip)
        return self._send(self._scan(self._stream, values, started))

    def next_deadline(self) -> float | None:
        """When :meth:`poll` has something to do next, or None."""
        if self._stream is None:
            return None
        looks_ahead, done = self._moments(self._stream)
        return looks_ahead if self._snapshot is None else done

    # --- state ------------------------------------------------------------------------------------------

    def _wake(self, now: float) -> None:
        self._scip1 = self._wakes_in_scip1
        self._input = b""
        self._bit_rate = BIT_RATES[0]
        self._reset(now)

    def _reset(self, now: float) -> None:
        self._time_mode = False
        self._sensitive = False
        self._slowness = 0
        self._turn_start = self._timer_zero = now
        self._stop()

    def _stop(self) -> None:
        self.laser_on = False
        self._stream = None
        self._head, self._note = "", ""
        self._remaining: int | None = None
        self._snapshot = None

    @property
    def _period(self) -> float:
        """Seconds a turn; each step of CR is taken as one hundredth slower."""
        return 60.0 / self._model.number("SCAN") / (1.0 - 0.01 * self._slowness)

    def _sweep(self, steps: int) -> float:
        return steps * self._period / self._model.number("ARES")

    def _moments(self, stream: Measurement) -> tuple[float, float]:
        """When the beam looks ahead (or ends, should that be earlier), and when the last step has passed."""
        done = self._turn_start + self._sweep(stream.last + 1)
        return min(self._turn_start + self._sweep(self._model.number("AFRT")), done), done

    def _timer(self, now: float) -> int:
        if self.faults.frozen_timer_ms is not None:
            return self.faults.frozen_timer_ms
        return round((now - self._timer_zero) * 1000.0) % TIMER_WRAP_MS

    # --- measuring --------------------------------------------------------------------------------------

    def _measure(self, wanted: Measurement) -> NDArray[np.int32]:
        """The values of a window; steps outside of AMIN..AMAX count as not measurable."""
        first = max(wanted.first, self._model.number("AMIN"))
        last = min(wanted.last, self._model.number("AMAX"))
        values = np.full(wanted.last - wanted.first + 1, NOT_MEASURABLE, np.int32)
        if first <= last:
            values[first - wanted.first : last - wanted.first + 1] = self._plant.measure(first, last)
        values = self._group(values, wanted.cluster)
        return np.minimum(values, TWO_CHARACTER_LIMIT) if wanted.width == 2 else values

    def _group(self, values: NDArray[np.int32], cluster: int) -> NDArray[np.int32]:
        """The smallest valid value of each group; a group without one gives its smallest code."""
        if cluster <= 1:
            return values
        groups = np.pad(values, (0, -len(values) % cluster), mode="edge").reshape(-1, cluster)
        valid = groups >= self._model.number("DMIN")
        best = np.where(valid, groups, np.iinfo(np.int32).max).min(axis=1)
        return np.where(valid.any(axis=1), best, groups.min(axis=1)).astype(np.int32)

    def _scan(self, stream: Measurement, values: NDArray[np.int32], started: float) -> bytes:
        if self._remaining is not None:
            self._remaining -= 1
        echo = f"{self._head}{self._remaining or 0:02d}{self._note}"
        if self.faults.scan_status is not None:
            status, self.faults.scan_status = self.faults.scan_status, None
            self._stop()
            return reply(echo, status)
        if self._remaining == 0:
            self._stop()
        return self._spoil(reply(echo, "99", scan_lines(self._timer(started), values, stream.width)))

    def _spoil(self, data: bytes) -> bytes:
        if self.faults.bad_checksums > 0:
            self.faults.bad_checksums -= 1
            data = spoil_last_sum(data)
        if self.faults.cut_scan_at is not None:
            data, self.faults.cut_scan_at = data[: self.faults.cut_scan_at], None
        return data

    def _send(self, data: bytes) -> bytes:
        if not data or self.faults.silent:
            return b""
        noise, self.faults.noise = self.faults.noise, b""
        return noise + data

    # --- answers ----------------------------------------------------------------------------------------

    def _answer(self, line: str, now: float) -> bytes:
        command, semicolon, text = line.partition(";")
        if self._scip1:
            self._scip1 = command != "SCIP2.0"
            return f"{line}\nE\n\n".encode("latin-1") if self._scip1 else reply(line, "00")
        letters, arguments = command[:2], command[2:]
        length = ARGUMENT_LENGTHS.get(letters)
        if len(text) > 16:
            return reply(line, "0G")
        if not _USER_STRING.fullmatch(text):
            return reply(line, "0H")
        if length is None or len(arguments) > length or (self._time_mode and letters != "TM"):
            return reply(line, "0E")
        if len(arguments) < length:
            return reply(line, "0C")
        status, lines = self._carry_out(letters, arguments, semicolon + text, now)
        return reply(line, status, lines)

    def _carry_out(self, letters: str, arguments: str, note: str, now: float) -> Answer:
        match letters:
            case "VV":
                return "00", information_lines(self._model.version)
            case "PP":
                return "00", information_lines(self._model.parameters)
            case "II":
                return "00", information_lines(self._information(now))
            case "BM":
                return self._switch_on(), []
            case "QT":
                self._stop()
                return "00", []
            case "RS":
                self._reset(now)
                return "00", []
            case "TM":
                return self._time(arguments, now)
            case "SS":
                return self._set_bit_rate(arguments), []
            case "CR":
                return self._set_slowness(arguments), []
            case "HS":
                return self._set_sensitivity(arguments), []
            case "MD" | "MS":
                return self._start_stream(letters, arguments, note, now), []
            case _:
                return self._single(letters, arguments, now)

    def _information(self, now: float) -> dict[str, str]:
        """The fields of II; the manual gives no format for SCSP, MESM and TIME."""
        return {
            "MODL": self._model.parameters["MODL"],
            "LASR": "ON" if self.laser_on else "OFF",
            "SCSP": f"{round(60.0 / self._period)}[rpm]",
            "MESM": "Measuring" if self.measuring else "Idle",
            "SBPS": f"{int(self._bit_rate)}[bps]",
            "TIME": f"{self._timer(now):06X}",
            "STAT": self.faults.stat,
        }

    def _switch_on(self) -> str:
        if self.faults.laser_broken:
            return "01"
        if self.laser_on:
            return "02"
        self.laser_on = True
        return "00"

    def _time(self, argument: str, now: float) -> Answer:
        match argument, self._time_mode:
            case "0", False:
                self._stop()
                self._time_mode = True
                return "00", []
            case "0", True:
                return "02", []
            case "1", True:
                return "00", [summed(encode_number(self._timer(now), 4))]
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
        """Has no further effect: the emulated line is USB."""
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

    def _start_stream(self, letters: str, arguments: str, note: str, now: float) -> str:
        """Begin with the next turn; a second stream is refused while one runs."""
        wanted = parse_measurement(letters, arguments, self._model.outermost_step)
        if isinstance(wanted, str):
            return wanted
        if self._stream is not None:
            return "0B"
        if self.faults.laser_broken:
            return "50"
        self.laser_on = True
        self._stream, self._remaining = wanted, wanted.count
        self._head, self._note = letters + arguments[:11], note
        self._turn_start += max(0, math.ceil((now - self._turn_start) / self._period)) * self._period
        return "00"

    def _single(self, letters: str, arguments: str, now: float) -> Answer:
        """One scan at once; the real sensor lets the turn end first."""
        wanted = parse_measurement(letters, arguments, self._model.outermost_step)
        if isinstance(wanted, str):
            return wanted, []
        if not self.laser_on:
            return "10", []
        return "00", scan_lines(self._timer(now), self._measure(wanted), wanted.width)
