"""From payloads to reports: good ones, and whatever else may come."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.skills.home_sensors.home_sensors import BadReport, Report
from florence_bt.skills.home_sensors.payload import MAX_PAYLOAD_BYTES, read_payload
from florence_bt.skills.home_sensors.settings import HomeSensor, SensorKind

PLAIN = HomeSensor("kitchen")
JSON = HomeSensor("kitchen", value="occupancy", time="last_seen")
BUTTON = HomeSensor("bedroom", SensorKind.BUTTON, value="action", on=frozenset({"single"}))
NOW, WALL = 100.0, 1_790_000_000.0
"""The node's time (simulated, say) and that of the sensors."""


def read(sensor: HomeSensor, payload: bytes | str, retained: bool = False) -> Report | None:
    data = payload.encode() if isinstance(payload, str) else payload
    return read_payload("pir", sensor, data, retained=retained, now=NOW, wall_now=WALL)


@pytest.mark.parametrize(
    ("payload", "active"),
    [("ON", True), ("off", False), (" true\n", True), ("0", False), ("motion", True), ("Clear", False)],
)
def test_a_plain_payload_is_the_state(payload: str, active: bool) -> None:
    assert read(PLAIN, payload) == Report("pir", active, NOW)


@pytest.mark.parametrize(
    ("state", "active"), [("true", True), ("false", False), ("1", True), ('"OFF"', False), ('"open"', True)]
)
def test_a_member_of_the_object_is_the_state(state: str, active: bool) -> None:
    assert read(JSON, f'{{"battery": 80, "occupancy": {state}}}') == Report("pir", active, NOW)


def test_words_of_the_sensor_itself() -> None:
    assert read(BUTTON, '{"action": "single"}') == Report("pir", True, NOW)
    assert read(BUTTON, '{"action": ""}') == Report("pir", False, NOW)
    with pytest.raises(BadReport, match="single"):
        read(BUTTON, '{"action": "triple"}')


def test_an_object_without_the_member_is_about_something_else() -> None:
    assert read(JSON, '{"battery": 80}') is None


@pytest.mark.parametrize(
    "time",
    [
        str(WALL - 30.0),
        str(int((WALL - 30.0) * 1000)),
        '"2026-09-21T14:12:50Z"',
        '"2026-09-21T16:12:50+02:00"',
    ],
)
def test_a_time_in_the_object_counts_also_of_what_was_retained(time: str) -> None:
    for retained in (False, True):
        report = read(JSON, f'{{"occupancy": true, "last_seen": {time}}}', retained)
        assert report is not None and report.at == pytest.approx(NOW - 30.0)


def test_nobody_knows_how_old_a_retained_message_without_a_time_is() -> None:
    assert read(PLAIN, "ON", retained=True) == Report("pir", True, None)


@pytest.mark.parametrize(
    "time", ["NaN", "Infinity", "1e400", "true", "null", "[1]", '"soon"', '"2026-09-21T14:12:50"']
)
def test_a_time_that_is_none_is_refused(time: str) -> None:
    with pytest.raises(BadReport, match="seconds since 1970"):
        read(JSON, f'{{"occupancy": true, "last_seen": {time}}}')


@pytest.mark.parametrize(
    ("payload", "problem"),
    [
        (b"\xff\xfe", "not UTF-8"),
        (b"x" * (MAX_PAYLOAD_BYTES + 1), "16385 bytes"),
        (b"{", "not JSON"),
        (b"[" * 16_000, "not JSON"),
        (b"[true]", "not a JSON object"),
        (b'{"occupancy": ' + b"9" * 9000 + b"}", "not JSON"),
        (b'{"occupancy": NaN}', "nan"),
        (b'{"occupancy": null}', "None"),
        (b'{"occupancy": {"a": 1}}', "a dict"),
        (b'{"occupancy": ' + b"[" * 900 + b"]" * 900 + b"}", "a list|not JSON"),
        (b'{"occupancy": "maybe"}', "maybe"),
    ],
)
def test_a_bad_payload_is_refused_with_what_would_have_worked(payload: bytes, problem: str) -> None:
    with pytest.raises(BadReport, match=problem) as error:
        read(JSON, payload)
    assert "would have worked" in str(error.value) and len(str(error.value)) < 400


@given(
    st.binary()
    | st.recursive(st.none() | st.booleans() | st.floats() | st.text(), st.lists).map(
        lambda v: json.dumps({"occupancy": v, "last_seen": v}).encode()
    )
)
def test_whatever_comes_it_is_a_report_or_refused(payload: bytes) -> None:
    for sensor in (PLAIN, JSON, BUTTON):
        try:
            report = read(sensor, payload)
        except BadReport:
            continue
        assert report is None or isinstance(report.active, bool)
