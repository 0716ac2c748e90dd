"""From an open port to the moment before the first scan. Source: REFERENCE 4.2, 4.6, 4.9."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

from florence_bt.core.errors import DeviceError, DeviceTimeout, FrameError
from florence_bt.drivers.hokuyo.codec import serial_speed
from florence_bt.drivers.hokuyo.conversation import Ask, Retune, Script
from florence_bt.drivers.hokuyo.geometry import SensorGeometry
from florence_bt.drivers.hokuyo.status import ACCEPTED

HEALTHY = ("Sensor works well.", "Stable 000 no error.", "sensor is working normally")
"""The texts of STAT of a sensor that is well: URG (REFERENCE 4.5), UTM, UST; urg_node knows these three."""

STABLE = "Stable"
"""The beginning of STAT on any UTM that is well (urg_library)."""

ANY = (*(f"0{letter}" for letter in "0123456789ABCDEFGHI"), "10")
POWER_ON_RATE = 19200
"""Bit rate of a sensor on a real serial line after power on and after ``RS`` (REFERENCE 4.2, 4.6)."""

SEARCHED = (POWER_ON_RATE, 115200, 38400, 57600)
"""Speeds that such a sensor is looked for at."""

SPEED_KEPT = ("03", "04")
"""SS: it has this speed already, or knows no others."""

ATTEMPTS = 3
"""Times that a sensor is asked before it counts as silent. Chosen: a line may be disturbed."""
UNKNOWN = "unknown"
IDENTIFIES = {"VV": ("VEND", "PROD", "FIRM", "PROT", "SERI"), "II": ("STAT",)}
"""Fields that VV and II must tell so that nobody is warned (REFERENCE 4.5); measuring needs none of them."""
LASER_ON = Ask("BM", (ACCEPTED, "02"), 10)


@dataclass(frozen=True, slots=True)
class Sensor:
    """The sensor's identity and abilities.

    Attributes:
        version: What could be read of the answer to VV: VEND, PROD, FIRM, PROT, SERI.
        parameters: The answer to PP, with MODL.
        geometry: The numbers of PP.
        state: What could be read of the answer to II: STAT.
        warnings: What could not be read of VV and II, for people.
    """

    version: Mapping[str, str]
    parameters: Mapping[str, str]
    geometry: SensorGeometry
    state: Mapping[str, str]
    warnings: tuple[str, ...] = ()

    @property
    def stat(self) -> str:
        """The sensor's own statement of its health."""
        return self.state.get("STAT", UNKNOWN)

    @property
    def ill(self) -> bool:
        """Tell whether the sensor says that it is not well."""
        return "STAT" in self.state and not is_healthy(self.stat)

    @property
    def device_id(self) -> str:
        """Its serial number."""
        return self.version.get("SERI", UNKNOWN)


def is_healthy(stat: str) -> bool:
    """Tell whether the text of STAT is that of a sensor that is well."""
    return stat in HEALTHY or stat.startswith(STABLE)


def rates_to_try(wanted: int | None, last: int | None, misses: int) -> tuple[int, ...]:
    """Return the speeds at which one start looks for a sensor, the likely ones first.

    A sensor that was never found may have any. One that was has the speed that it was left with (its cable
    was out) or that of power on (its power was); so only these are tried, and after each miss one
    more, in case somebody has brought another sensor.

    Args:
        wanted: The speed that the line shall have; None for a line without speed.
        last: The speed at which the sensor was heard last; None when it was never.
        misses: How many starts in a row heard nothing.

    Returns:
        Bits per second; none for a line without speed.
    """
    if wanted is None:
        return ()
    if last is None:
        return _each_once(wanted, *SEARCHED)
    likely = _each_once(last, POWER_ON_RATE)
    others = [rate for rate in _each_once(wanted, *SEARCHED) if rate not in likely]
    return likely if misses == 0 else (*likely, others[(misses - 1) % len(others)])


def start_up(bit_rate: int | None = None, rates: Sequence[int] = ()) -> Script:
    """Wake the sensor, end what it is about, and ask who it is; the laser is on at the end.

    Args:
        bit_rate: The wanted speed of a serial line, one of ``BIT_RATES``; the sensor is set to it, as
            after power on and after ``RS`` it has its own. None where the line has no speed (USB, network).
        rates: Speeds at which the sensor is looked for, see :func:`rates_to_try`; none for such a line.

    Returns:
        The :class:`Sensor`, well or ill.
    """
    _, found = yield from _at_some_speed(_greet, rates)
    yield Ask("QT")
    yield Ask("RS")
    # Its own speed is tried again at the end: it may not have been ready.
    after_reset = () if found is None else (*_each_once(POWER_ON_RATE, found, *SEARCHED), POWER_ON_RATE)
    shape, found = yield from _at_some_speed(_ask_parameters, after_reset)
    if bit_rate is not None and found != bit_rate:
        answer = yield Ask(serial_speed(bit_rate), (ACCEPTED, *SPEED_KEPT))
        if answer.reply.status == ACCEPTED:
            yield Retune(bit_rate)
    try:
        parameters = shape.reply.information()
        geometry = SensorGeometry.from_information(parameters)
    except FrameError as error:
        raise DeviceError(str(error)) from error
    version, problem = yield from _identify("VV")
    state, another = yield from _identify("II")
    warnings = tuple(text for text in (problem, another) if text)
    sensor = Sensor(version, parameters, geometry, state, warnings)
    if not sensor.ill:
        yield LASER_ON
    return sensor


def _identify(command: str) -> Script:
    """Ask VV or II, again while something of the answer is missing: a line may have been disturbed.

    Returns:
        What could be read, by its tags; and what is wrong with the answer, for people, else empty.
    """
    fields: dict[str, str] = {}
    problem = ""
    for _ in range(ATTEMPTS):
        try:
            answer = yield Ask(command)
        except DeviceError as error:
            problem = str(error)
            break
        found, unreadable = answer.reply.identification()
        fields |= found
        missing = [tag for tag in IDENTIFIES[command] if tag not in fields]
        if not missing and not unreadable:
            return fields, ""
        problem = f"{unreadable} lines of its answer to {command} cannot be read" if unreadable else ""
        if missing:
            problem = f"{problem or f'its answer to {command} is not whole'}; unknown: {', '.join(missing)}"
    return fields, f"the sensor is not known for sure, but it measures: {problem}"


def _greet(attempts: int) -> Script:
    with suppress(DeviceTimeout):
        # Old firmware wakes up in SCIP 1.1; a sensor that speaks 2.0 already answers 0E, or nothing.
        yield Ask("SCIP2.0", ANY, 1)
    # In time mode everything else is refused. Any answer will do, as with hokuyo_node: a UTM-30LX-EW that
    # streams refuses TM2 with 10, and QT and RS, which follow, end the stream.
    return (yield Ask("TM2", ANY, attempts))


def _ask_parameters(attempts: int) -> Script:
    return (yield Ask("PP", attempts=attempts))


def _each_once(*rates: int) -> tuple[int, ...]:
    return tuple(dict.fromkeys(rates))


def _at_some_speed(question: Callable[[int], Script], rates: Sequence[int]) -> Script:
    """Ask at one speed after the other until the sensor answers; on a line without speeds, several times.

    Returns:
        The answer, and the speed; None for a line without.
    """
    for rate in rates:
        yield Retune(rate)
        with suppress(DeviceTimeout):
            answer = yield from question(1)
            return answer, rate
    if rates:
        tried = ", ".join(str(rate) for rate in _each_once(*rates))
        raise DeviceTimeout(f"no answer at {tried} baud; check the sensor's power and its cable")
    return (yield from question(ATTEMPTS)), None
