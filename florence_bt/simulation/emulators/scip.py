"""A Hokuyo scanner that speaks SCIP 2.0, written from the manual: bytes and the time in, bytes out.

It never imports the driver, so that an error of one cannot hide in the other. The world is asked through
:class:`LaserPlant`. Where the manual leaves something open, the docstring says what was chosen.

Source: REFERENCE 4.1 to 4.8, 13.
"""

from __future__ import annotations

import math
import re
from collections import deque
from collections.abc import Iterable, Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from florence_bt.simulation.emulators.scip_models import (
    ALLOWED_IN_TIME_MODE,
    ARGUMENT_LENGTHS,
    BIT_RATES,
    URG_04LX,
    ScannerModel,
    ScanRequest,
    ScipFaults,
    parse_measurement,
)

LONGEST_REQUEST = 64
TWO_CHARACTER_LIMIT = 4095
"""Two characters carry 12 bits. Source: REFERENCE 4.4."""

TROUBLE = "50"
"""Hardware trouble, the first status of its range."""

TIMER_WRAP_MS = 1 << 24
LONGEST_NOTE = 16
"""Characters that may stand behind a request. Source: REFERENCE 4.3."""
BY_DEFAULT = "<-Default setting by user"
"""Stands behind a setting of II that was never changed."""

STATES = {
    "000": "Idle",
    "002": "Time adjustment",
    "003": "Single scan",
    "004": "Multi scan",
    "005": "Sleep",
}
"""The answers to %ST."""

WAKING = ("BM", "QT", "TM")

_USER_STRING = re.compile(r"[A-Za-z0-9 ._+@]*")

Answer = tuple[str, list[str]]


class LaserPlant(Protocol):
    """The world as the scanner sees it."""

    def measure(self, first_step: int, last_step: int) -> NDArray[np.int32]:
        """Measure the distances of the steps first..last (inclusive) at this moment.

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
        laser_on: Whether the laser is on.
        speaks_scip1: Whether it still waits for ``SCIP2.0``.
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
        self._wakes_in_scip1 = speaks_scip1
        self._short_status = short_status
        self._powered = True
        self._input = b""
        self._line = SlowLine()
        self._stream: ScanRequest | None = None
        self._snapshot: NDArray[np.int32] | None = None
        self._wake(0.0)

    @property
    def model(self) -> ScannerModel:
        """The device data."""
        return self._model

    @property
    def powered(self) -> bool:
        """Tell whether the scanner has power."""
        return self._powered

    @property
    def measuring(self) -> bool:
        """Tell whether a stream of scans runs."""
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
        if not self._powered or self.faults.commands_lost:
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
        """Return when :meth:`poll` has something to do next, or None."""
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
        self.speaks_scip1 = self._wakes_in_scip1
        self._restart_asked = False
        self._bit_rate = BIT_RATES[0]
        self._reset(now)
        self._turn_start = now
        self._stop()

    def _stop(self) -> None:
        self.laser_on = False
        self._stream = None
        self._head, self._note = "", ""
        self._remaining: int | None = None
        self._snapshot = None

    def _sweep(self, steps: int) -> float:
        return steps * self._period / self._model.number("ARES")

    def _moments(self, stream: ScanRequest) -> tuple[float, float]:
        """Return when the beam looks ahead (or the scan ends, if earlier), and when the last step is over."""
        done = self._turn_start + self._sweep(stream.last + 1)
        return min(self._turn_start + self._sweep(self._model.number("AFRT")), done), done

    # --- measuring --------------------------------------------------------------------------------------

    def _measure(self, wanted: ScanRequest) -> NDArray[np.int32]:
        """Return the values of a window; steps outside of AMIN..AMAX count as not measurable."""
        first = max(wanted.first, self._model.number("AMIN"))
        last = min(wanted.last, self._model.number("AMAX"))
        values = np.full(wanted.last - wanted.first + 1, self._model.no_measurement, np.int32)
        if first <= last:
            values[first - wanted.first : last - wanted.first + 1] = self._plant.measure(first, last)
        values = group(values, wanted.cluster, self._model.number("DMIN"))
        if wanted.intensity:
            return with_intensities(values, self._model.number("DMIN"))
        return np.minimum(values, TWO_CHARACTER_LIMIT) if wanted.width == 2 else values

    def _scan(self, stream: ScanRequest, values: NDArray[np.int32], started: float) -> bytes:
        if self._remaining is not None:
            self._remaining -= 1
        echo = f"{self._head}{self._remaining or 0:02d}{self._note}"
        asked_for, self.faults.scan_status = self.faults.scan_status, None
        broken = TROUBLE if self.faults.laser_broken else None
        ending = asked_for or broken
        status = ending or self.faults.every_scan_status
        if status is not None:
            if ending is not None or self._remaining == 0:
                self._stop()
            return reply(echo, status)
        if self._remaining == 0:
            self._stop()
        lines = scan_lines(self.timer(started), self._encode(stream, values))
        return self._spoil(reply(echo, "99", lines))

    def _encode(self, wanted: ScanRequest, values: NDArray[np.int32]) -> str:
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
        if self.speaks_scip1:
            return self._answer_scip1(line)
        length = 3 if command.startswith("%") else 2
        letters, arguments = command[:length], command[length:]
        status = self._objection(letters, arguments, text)
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
        """Answer in SCIP 1.1 (one-character statuses without sum): who it is, and the way to SCIP 2.0."""
        lines: list[str] = []
        status = "0"
        if line == "SCIP2.0":
            self.speaks_scip1 = False
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
        return self._set_or_report(letters, arguments, now)

    def _start_stream(self, letters: str, arguments: str, note: str, now: float) -> str:
        """Begin with the next turn; a second stream is refused while one runs."""
        wanted = parse_measurement(letters, arguments, self._model.outermost_step)
        if isinstance(wanted, str):
            return wanted
        if self._stream is not None:
            return "0B"
        if self.faults.laser_broken:
            return TROUBLE
        self.laser_on = True
        self._stream, self._remaining = wanted, wanted.count
        self._head, self._note = letters + arguments[:11], note
        self._turn_start += max(0, math.ceil((now - self._turn_start) / self._period)) * self._period
        return "00"

    def _single(self, letters: str, arguments: str, now: float) -> tuple[str, list[str]]:
        """Measure one scan at once; the real sensor lets the turn end first."""
        wanted = parse_measurement(letters, arguments, self._model.outermost_step)
        if isinstance(wanted, str):
            return wanted, []
        if self.faults.laser_broken:
            return TROUBLE, []
        if not self.laser_on:
            return "10", []
        return "00", scan_lines(self.timer(now), self._encode(wanted, self._measure(wanted)))

    # --- settings, timer and state ----------------------------------------------------------------------

    def timer(self, now: float) -> int:
        """Return the timer in milliseconds, 24 bits."""
        frozen = self.faults.frozen_timer_ms
        if frozen is not None:
            return frozen
        return round((now - self._timer_zero) * 1000.0) % TIMER_WRAP_MS

    @property
    def _period(self) -> float:
        """Seconds a turn; each step of CR is taken as one hundredth slower."""
        return 60.0 / self._model.number("SCAN") / (1.0 - 0.01 * self._slowness)

    @property
    def bit_rate(self) -> int:
        """Bits per second of its RS-232 line."""
        return int(self._bit_rate)

    def _objection(self, letters: str, arguments: str, note: str) -> str | None:
        """Return the status that refuses a command, None when there is nothing against it."""
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

    def _set_or_report(self, letters: str, arguments: str, now: float) -> Answer:
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
                return "00", information_lines(self._information(now))
            case "%ST":
                return "00", [summed(self._state_code())]
            case "BM":
                return self._switch_on(), []
            case "RS" | "RT":
                self._reset(now, keep_speeds=letters == "RT")
            case "%SL":
                self._asleep = True
            case "RB":
                return self._restart(now), []
            case "TM":
                return self._time(arguments, now)
            case "SS":
                return self._set_bit_rate(arguments), []
            case "CR":
                return self._set_slowness(arguments), []
            case "HS":
                return self._set_sensitivity(arguments), []
        return "00", []

    def _reset(self, now: float, keep_speeds: bool = False) -> None:
        """Reset; RT is the UTM's reset, which leaves the speeds of motor and line as they are."""
        self._time_mode = False
        self._asleep = False
        self._sensitive = False
        self._timer_zero = now
        if not keep_speeds:
            self._slowness = 0
            self._bit_rate = BIT_RATES[0]

    def _information(self, now: float) -> dict[str, str]:
        """Return the fields of II, in the words of the sensors whose replies are published.

        The MESM of a UTM is made up of the answer to %ST.
        """
        rate = f"{int(self._bit_rate)}[bps]"
        code = self._state_code()
        idle = "Measuring by Sensitive Mode" if self._sensitive else "Measuring by Normal Mode"
        return {
            "MODL": self._model.parameters["MODL"],
            "LASR": "ON" if self.laser_on else "OFF",
            "SCSP": self._speed(),
            "MESM": f"{code} {STATES[code]}"
            if "%ST" in self._model.commands
            else idle
            if self.measuring
            else "IDLE",
            "SBPS": rate + BY_DEFAULT if self._bit_rate == BIT_RATES[0] else rate,
            "TIME": f"{self.timer(now):06X}",
            "STAT": self._healthy(),
        }

    def _healthy(self) -> str:
        stat = self.faults.stat
        return self._model.healthy if stat is None else stat

    def _speed(self) -> str:
        """Return SCSP: the usual speed, or how much slower it is; hosts such as hokuyoaist read both."""
        rpm = f"({round(60.0 / self._period)}[rpm])"
        return f"{self._slowness}%down{rpm}" if self._slowness else f"Initial{rpm}{BY_DEFAULT}"

    def _state_code(self) -> str:
        """Return the code of standby, time adjustment, sleep, single scan or multi scan."""
        if self._time_mode:
            return "002"
        if self._asleep:
            return "005"
        if not self.laser_on:
            return "000"
        return "004" if self.measuring else "003"

    def _switch_on(self) -> str:
        if self.faults.laser_broken:
            return "01"
        if self.laser_on:
            return "02"
        self.laser_on = True
        return "00"

    def _restart(self, now: float) -> str:
        """Restart at the second RB in a row; the first is answered 01."""
        if not self._restart_asked:
            self._restart_asked = True
            return "01"
        self._wake(now)
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
        """Set the bit rate, which counts from the next command on; over USB and TCP it has no effect."""
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


class SlowLine:
    """Bytes leave in their order, each not before its time."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[float, bytes]] = deque()
        self._free = 0.0

    def put(self, data: bytes, now: float, delay_s: float, bytes_per_second: float | None) -> None:
        """Send bytes.

        Args:
            data: The bytes.
            now: The time.
            delay_s: They leave so much later.
            bytes_per_second: How fast they leave; None for all at once.
        """
        if not data:
            return
        self._free = max(self._free, now + delay_s)
        if bytes_per_second is None:
            self._waiting.append((self._free, data))
            return
        for byte in data:
            self._free += 1.0 / bytes_per_second
            self._waiting.append((self._free, bytes([byte])))

    def take(self, now: float) -> bytes:
        """Return what leaves now."""
        out = []
        while self._waiting and self._waiting[0][0] <= now:
            out.append(self._waiting.popleft()[1])
        return b"".join(out)

    def take_all(self) -> bytes:
        """Return everything that waits: the line is fast again."""
        out = b"".join(data for _, data in self._waiting)
        self.clear()
        return out

    def next_time(self) -> float | None:
        """Return when something leaves next, or None."""
        return self._waiting[0][0] if self._waiting else None

    def clear(self) -> None:
        """Lose what waits."""
        self._waiting.clear()
        self._free = 0.0


def group(values: NDArray[np.int32], cluster: int, minimum_mm: int) -> NDArray[np.int32]:
    """Return the smallest valid value of each group; a group without one gives its smallest code.

    Args:
        values: Shape (n,), millimetres or error codes.
        cluster: Steps per group; 0 and 1 both mean one.
        minimum_mm: DMIN; smaller values are codes.

    Returns:
        Shape (ceil(n / cluster),).

    Source: REFERENCE 4.7.
    """
    if cluster <= 1:
        return values
    groups = np.pad(values, (0, -len(values) % cluster), mode="edge").reshape(-1, cluster)
    valid = groups >= minimum_mm
    best = np.where(valid, groups, np.iinfo(np.int32).max).min(axis=1)
    return np.where(valid.any(axis=1), best, groups.min(axis=1)).astype(np.int32)


def with_intensities(values: NDArray[np.int32], minimum_mm: int) -> NDArray[np.int32]:
    """Add an intensity to each distance, as ME and GE send them.

    No manual gives the scale. Here a white wall at 1 m gives 4000, falling with the distance; a step without
    a distance gives 0.

    Returns:
        Shape (2 n,).
    """
    pairs = np.zeros((len(values), 2), np.int32)
    pairs[:, 0] = values
    valid = values >= minimum_mm
    pairs[valid, 1] = np.minimum(4_000_000 // np.maximum(values[valid], 1), 60_000)
    return pairs.reshape(-1)


DATA_LINE = 64
"""Characters of a line of data. Source: REFERENCE 4.3."""
SECOND_ECHO_MM = 500
"""Distance of a second echo behind the first. Chosen."""


def summed(line: str) -> str:
    """Add its check character to a line: the low six bits of the sum of its bytes, plus 0x30."""
    return line + chr((sum(line.encode("latin-1")) & 0x3F) + 0x30)


def encode_number(value: int, width: int) -> str:
    """Encode a number as ``width`` characters of six bits, most significant first."""
    return "".join(chr(((value >> (6 * place)) & 0x3F) + 0x30) for place in reversed(range(width)))


def encode_numbers(values: NDArray[np.int32], width: int) -> str:
    """Encode many numbers in a row, each as by :func:`encode_number`."""
    shifts = np.arange(6 * (width - 1), -1, -6)
    digits = ((values[:, np.newaxis] >> shifts) & 0x3F) + 0x30
    return digits.astype(np.uint8).tobytes().decode("ascii")


def reply(echo: str, status: str, lines: Iterable[str] = ()) -> bytes:
    """Write a whole reply: echo, status with its sum, lines that are ready to send, a blank line."""
    return "\n".join([echo, summed(status), *lines, "", ""]).encode("latin-1")


def information_lines(fields: Mapping[str, str]) -> list[str]:
    """Return the lines of VV, PP and II: the check character is that of the text before the semicolon."""
    return [f"{text};{summed(text)[-1]}" for text in (f"{tag}:{value}" for tag, value in fields.items())]


def encode_echoes(values: NDArray[np.int32], numbers: int, minimum_mm: int) -> str:
    """Encode every echo of each step: what follows an ampersand belongs to the step before it.

    Each tenth step that measures something has a second echo half a metre behind the first, as of a pane of
    glass; the world itself has one distance a step.

    Args:
        values: Shape (steps * numbers,).
        numbers: Numbers per echo: 1, or 2 with intensities.
        minimum_mm: DMIN; smaller distances are codes.
    """
    echoes = []
    for step, echo in enumerate(values.reshape(-1, numbers)):
        echoes.append(encode_numbers(echo, 3))
        if step % 10 == 0 and echo[0] >= minimum_mm:
            echo = echo.copy()
            echo[0] += SECOND_ECHO_MM
            echoes.append("&" + encode_numbers(echo, 3))
    return "".join(echoes)


def scan_lines(timestamp_ms: int, text: str) -> list[str]:
    """Return the time stamp and the encoded values in lines of at most 64 characters."""
    blocks = [text[start : start + DATA_LINE] for start in range(0, len(text), DATA_LINE)]
    return [summed(encode_number(timestamp_ms, 4)), *map(summed, blocks)]


def spoil_last_sum(data: bytes) -> bytes:
    """Spoil the check character of a reply's last line, which stands before the two closing LF."""
    return data[:-3] + bytes([0x30 + (data[-3] - 0x30 + 1) % 64]) + data[-2:]
