"""From the payload of an MQTT message to a report. Whatever a payload holds, the only error is BadReport."""

from __future__ import annotations

import json
from datetime import datetime
from typing import Any

from florence_bt.skills.home_sensors.home_sensors import BadReport, Report
from florence_bt.skills.home_sensors.settings import HomeSensor

MAX_PAYLOAD_BYTES = 16_384
MAX_PAYLOAD_SHOWN = 60
"""Characters of a payload in a message about it."""
MILLISECONDS_FROM = 1e11
"""A larger number of a time counts milliseconds: in seconds it would be after the year 5000."""


def read_payload(
    name: str, sensor: HomeSensor, payload: bytes, *, retained: bool, now: float, wall_now: float
) -> Report | None:
    """Read a message.

    Args:
        name: The name of the sensor.
        sensor: How it reports.
        payload: What came.
        retained: Whether the broker had kept it; then it is as old as the time in it, or nobody knows.
        now: The present time of the reports, seconds.
        wall_now: The same moment in seconds since 1970 UTC, as sensors count.

    Returns:
        The report; None when the message is about something else than the state, such as the battery.

    Raises:
        BadReport: It cannot be used; says what would have worked.
    """
    if len(payload) > MAX_PAYLOAD_BYTES:
        raise _bad(f"{len(payload)} bytes", f"at most {MAX_PAYLOAD_BYTES}")
    try:
        text = payload.decode("utf-8")
    except UnicodeDecodeError as error:
        raise _bad("the payload is not UTF-8", "a text") from error
    members = _object(text) if sensor.value else {}
    if sensor.value and sensor.value not in members:
        return None
    active = _state(sensor, members[sensor.value] if sensor.value else text)
    if sensor.time and sensor.time in members:
        return Report(name, active, now - (wall_now - _time(members[sensor.time])))
    return Report(name, active, None if retained else now)


def _object(text: str) -> dict[str, Any]:
    try:
        members = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise _bad(f"{_short(text)} is not JSON", '{"occupancy": true}') from error
    if not isinstance(members, dict):
        raise _bad(f"{_short(text)} is not a JSON object", '{"occupancy": true}')
    return members


def _state(sensor: HomeSensor, value: Any) -> bool:
    if isinstance(value, bool | int | float | str):
        word = str(value).strip().lower()
        if word in sensor.on or word in sensor.off:
            return word in sensor.on
    raise _bad(f"the state is {_shown(value)}", ", ".join(sorted((sensor.on | sensor.off) - {""})))


def _time(value: Any) -> float:
    """Read seconds since 1970 from a number or ISO 8601."""
    wrong = _bad(f"the time is {_shown(value)}", "seconds since 1970, or 2026-01-31T08:00:00Z")
    if isinstance(value, str):
        try:
            moment = datetime.fromisoformat(value)
            if moment.tzinfo is not None:
                return moment.timestamp()
        except (ValueError, OverflowError) as error:
            raise wrong from error
    elif isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e15:
        return value / 1000.0 if value > MILLISECONDS_FROM else float(value)
    raise wrong


def _shown(value: Any) -> str:
    """Show a value to people; of a nested one only its type, as it may be nested as deep as Python allows."""
    return f"a {type(value).__name__}" if isinstance(value, list | dict) else _short(str(value))


def _short(text: str) -> str:
    return repr(text if len(text) <= MAX_PAYLOAD_SHOWN else f"{text[:MAX_PAYLOAD_SHOWN]}...")


def _bad(problem: str, valid: str) -> BadReport:
    return BadReport(f"{problem} (would have worked: {valid})")
