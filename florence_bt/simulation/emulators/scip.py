"""A Hokuyo scanner that speaks SCIP 2.0, written from the manual: bytes and the time in, bytes out.

It never imports the driver, so that an error of one cannot hide in the other. The world is asked through
:class:`LaserPlant`. Where the manual leaves something open, the docstring says what was chosen.

Source: REFERENCE 4.1 to 4.8, 13.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from florence_bt.simulation.emulators._scip_device import (
    MODELS,
    URG_04LX,
    UST_10LX,
    UTM_30LX,
    UTM_30LX_EW,
    Measurement,
    ScannerModel,
    ScipFaults,
    parse_measurement,
)
from florence_bt.simulation.emulators._scip_line import SlowLine
from florence_bt.simulation.emulators._scip_malfunction import TROUBLE
from florence_bt.simulation.emulators._scip_state import ScipState
from florence_bt.simulation.emulators._scip_values import group, with_intensities
from florence_bt.simulation.emulators._scip_wire import (
    encode_echoes,
    encode_numbers,
    reply,
    scan_lines,
    spoil_last_sum,
)

__all__ = [
    "MODELS",
    "URG_04LX",
    "UST_10LX",
    "UTM_30LX",
    "UTM_30LX_EW",
    "LaserPlant",
    "ScannerModel",
    "ScipEmulator",
    "ScipFaults",
]

LONGEST_REQUEST = 64
TWO_CHARACTER_LIMIT = 4095


class LaserPlant(Protocol):
    """The world as the scanner sees it."""

    def measure(self, first_step: int, last_step: int) -> NDArray[np.int32]:
        """Distances of the steps first..last (inclusive) at this moment.

        Returns:
            Shape (last - first + 1,), millimetres; values below DMIN are error codes.
        """


class ScipEmulator:
    """The scanner. A scan's time stamp is the moment at step 0 of its turn.

    The world is measured when the beam looks ahead, and the reply leaves when the last step has passed, as
    with the real one. Call :meth:`poll` at :meth:`next_deadline` or every few milliseconds; turns that
    nobody polled for are left out.

    Attributes:
        faults: What shall go wrong.
        state: Modes, laser, timer and the answers that need no measurement.
    """

    def __init__(
        self,
        plant: LaserPlant,
        *,
        model: ScannerModel = URG_04LX,
        speaks_scip1: bool = False,
        short_status: bool = False,
    ) -> None:
        """Switch it on at the time 0.

        Args:
            plant: The world.
            model: The device data.
            speaks_scip1: Wake up in SCIP 1.1, as old firmware does: all but V and ``SCIP2.0`` is answered
                with E.
            short_status: Answer the ``SCIP2.0`` that ends that with a status of SCIP 1.1, ``0`` without a sum
                (manual, section 2), not with ``00`` (REFERENCE 4.6).
        """
        self._plant = plant
        self._model = model
        self.faults = ScipFaults()
        self.state = ScipState(model, lambda: self.faults, speaks_scip1)
        self._short_status = short_status
        self._powered = True
        self._input = b""
        self._line = SlowLine()
        self._stream: Measurement | None = None
        self._snapshot: NDArray[np.int32] | None = None
        self._wake(0.0)

    @property
    def model(self) -> ScannerModel:
        """The device data."""
        return self._model

    @property
    def laser_on(self) -> bool:
        """Whether the laser is on."""
        return self.state.laser_on

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
        self.state.set_timer(milliseconds, now)

    def receive(self, data: bytes, now: float) -> bytes:
        """Take bytes from the host and return the answers."""
        if not self._powered or self.faults.deaf:
            return b""
        *lines, rest = (self._input + data).replace(b"\r", b"\n").split(b"\n")
        self._input = rest[-LONGEST_REQUEST:]
        return self._send(b"".join(self._answer(line.decode("latin-1"), now) for line in lines if line), now)

    def poll(self, now: float) -> bytes:
        """Return what leaves now: the scan that has become complete, if any, and what was slow."""
        if self._stream is None:
            return self._leave(now)
        late_turns = math.floor((now - self._turn_start - self._sweep(self._stream.last + 1)) / self._period)
        if late_turns > 0:
            self._turn_start += late_turns * self._period
            self._snapshot = None
        looks_ahead, done = self._moments(self._stream)
        if self._snapshot is None and now >= looks_ahead:
            self._snapshot = self._measure(self._stream)
        if now < done or self._snapshot is None:
            return self._leave(now)
        values, started = self._snapshot, self._turn_start
        self._snapshot = None
        self._turn_start += self._period * (1 + self._stream.skip)
        return self._send(self._scan(self._stream, values, started), now)

    def next_deadline(self) -> float | None:
        """When :meth:`poll` has something to do next, or None."""
        slow = self._line.next_time()
        if self._stream is None:
            return slow
        looks_ahead, done = self._moments(self._stream)
        scan = looks_ahead if self._snapshot is None else done
        return scan if slow is None else min(slow, scan)

    # --- state ------------------------------------------------------------------------------------------

    def _wake(self, now: float) -> None:
        self._input = b""
        self._line.clear()
        self.state.wake(now)
        self._turn_start = now
        self._stop()

    def _stop(self) -> None:
        self.state.laser_on = False
        self._stream = None
        self._head, self._note = "", ""
        self._remaining: int | None = None
        self._snapshot = None

    @property
    def _period(self) -> float:
        """Seconds a turn; each step of CR is taken as one hundredth slower."""
        return self.state.period

    def _sweep(self, steps: int) -> float:
        return steps * self._period / self._model.number("ARES")

    def _moments(self, stream: Measurement) -> tuple[float, float]:
        """When the beam looks ahead (or ends, should that be earlier), and when the last step has passed."""
        done = self._turn_start + self._sweep(stream.last + 1)
        return min(self._turn_start + self._sweep(self._model.number("AFRT")), done), done

    # --- measuring --------------------------------------------------------------------------------------

    def _measure(self, wanted: Measurement) -> NDArray[np.int32]:
        """The values of a window; steps outside of AMIN..AMAX count as not measurable."""
        first = max(wanted.first, self._model.number("AMIN"))
        last = min(wanted.last, self._model.number("AMAX"))
        values = np.full(wanted.last - wanted.first + 1, self._model.no_measurement, np.int32)
        if first <= last:
            values[first - wanted.first : last - wanted.first + 1] = self._plant.measure(first, last)
        values = group(values, wanted.cluster, self._model.number("DMIN"))
        if wanted.intensity:
            return with_intensities(values, self._model.number("DMIN"))
        return np.minimum(values, TWO_CHARACTER_LIMIT) if wanted.width == 2 else values

    def _scan(self, stream: Measurement, values: NDArray[np.int32], started: float) -> bytes:
        if self._remaining is not None:
            self._remaining -= 1
        echo = f"{self._head}{self._remaining or 0:02d}{self._note}"
        told, self.faults.scan_status = self.faults.scan_status, None
        broken = TROUBLE if self.faults.laser_broken else None
        pretended = self.state.pretended.instead_of_scan()
        ending = told or broken or (pretended if pretended == TROUBLE else None)
        status = ending or self.faults.every_scan_status or pretended
        if status is not None:
            if ending is not None or self._remaining == 0:
                self._stop()
            return reply(echo, status)
        if self._remaining == 0:
            self._stop()
        lines = scan_lines(self.state.timer(started), self._encode(stream, values))
        return self._spoil(reply(echo, "99", lines))

    def _encode(self, wanted: Measurement, values: NDArray[np.int32]) -> str:
        if wanted.every_echo:
            return encode_echoes(values, 2 if wanted.intensity else 1, self._model.number("DMIN"))
        return encode_numbers(values, wanted.width)

    def _spoil(self, data: bytes) -> bytes:
        if self.faults.bad_checksums > 0:
            self.faults.bad_checksums -= 1
            data = spoil_last_sum(data)
        if self.faults.cut_scan_at is not None:
            data, self.faults.cut_scan_at = data[: self.faults.cut_scan_at], None
        return data

    def _send(self, data: bytes, now: float) -> bytes:
        if self.faults.silent:
            data = b""
        if data:
            noise, self.faults.noise = self.faults.noise, b""
            data = noise + data
        self._line.put(data, now, self.faults.delay_s, self.faults.bytes_per_second)
        return self._leave(now)

    def _leave(self, now: float) -> bytes:
        if not self.faults.delay_s and self.faults.bytes_per_second is None:
            return self._line.take_all()
        return self._line.take(now)

    # --- answers ----------------------------------------------------------------------------------------

    def _answer(self, line: str, now: float) -> bytes:
        command, semicolon, text = line.partition(";")
        if self.state.speaks_scip1:
            return self._answer_scip1(line)
        length = 3 if command.startswith("%") else 2
        letters, arguments = command[:length], command[length:]
        status = self.state.objection(letters, arguments, text)
        forced = self.faults.statuses.get(letters) or self.faults.statuses.get(command)
        lines: list[str] = []
        if forced is not None:
            status = forced
        elif status is None:
            status, lines = self._carry_out(letters, arguments, semicolon + text, now)
        answer = reply(line, status, lines)
        if self.faults.bad_replies > 0:
            self.faults.bad_replies -= 1
            return spoil_last_sum(answer)
        return answer

    def _answer_scip1(self, line: str) -> bytes:
        """SCIP 1.1, whose statuses are one character without a sum: who it is, and the way to SCIP 2.0."""
        lines: list[str] = []
        status = "0"
        if line == "SCIP2.0":
            self.state.speaks_scip1 = False
            if not self._short_status:
                return reply(line, "00")
        elif line == "V":
            lines = [f"{tag}:{value}" for tag, value in self._model.version.items()]
        else:
            status = "E"
        return "\n".join([line, status, *lines, "", ""]).encode("latin-1")

    def _carry_out(self, letters: str, arguments: str, note: str, now: float) -> tuple[str, list[str]]:
        match letters:
            case "MD" | "MS" | "ME" | "ND" | "NE":
                return self._start_stream(letters, arguments, note, now), []
            case "GD" | "GS" | "GE" | "HD" | "HE":
                return self._single(letters, arguments, now)
            case "TM" if self._stream is not None and self._model.denies_time_mode:
                return "10", []
            case "QT" | "RS" | "RT" | "%SL":
                self._stop()
            case "TM" if arguments == "0":
                self._stop()
        before = self.state.restarts
        answer = self.state.answer(letters, arguments, self._stream is not None, now)
        if self.state.restarts > before:
            self._wake(now)
        return answer

    def _start_stream(self, letters: str, arguments: str, note: str, now: float) -> str:
        """Begin with the next turn; a second stream is refused while one runs."""
        wanted = parse_measurement(letters, arguments, self._model.outermost_step)
        if isinstance(wanted, str):
            return wanted
        if self._stream is not None:
            return "0B"
        if self.state.laser_broken:
            return TROUBLE
        self.state.pretended.begin_stream()
        self.state.laser_on = True
        self._stream, self._remaining = wanted, wanted.count
        self._head, self._note = letters + arguments[:11], note
        self._turn_start += max(0, math.ceil((now - self._turn_start) / self._period)) * self._period
        return "00"

    def _single(self, letters: str, arguments: str, now: float) -> tuple[str, list[str]]:
        """One scan at once; the real sensor lets the turn end first."""
        wanted = parse_measurement(letters, arguments, self._model.outermost_step)
        if isinstance(wanted, str):
            return wanted, []
        if self.state.laser_broken:
            return TROUBLE, []
        if not self.laser_on:
            return "10", []
        return "00", scan_lines(self.state.timer(now), self._encode(wanted, self._measure(wanted)))
