import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.core.declaration import Kind, Port
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.trees.language.quantities import (
    NUMERIC_KINDS,
    UNITS,
    example_of,
    format_value,
    guess_value,
    out_of_range,
    read_value,
)


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("30 s", Kind.DURATION, 30.0),
        ("2 min", Kind.DURATION, 120.0),
        ("500ms", Kind.DURATION, 0.5),
        ("1 h", Kind.DURATION, 3600.0),
        ("45 deg", Kind.ANGLE, math.pi / 4),
        ("-90°", Kind.ANGLE, -math.pi / 2),
        ("1.5 rad", Kind.ANGLE, 1.5),
        ("0.5 m", Kind.LENGTH, 0.5),
        ("50 cm", Kind.LENGTH, 0.5),
        (".5m", Kind.LENGTH, 0.5),
        ("1e-3 km", Kind.LENGTH, 1.0),
        ("0.3 m/s", Kind.SPEED, 0.3),
        ("3.6 km/h", Kind.SPEED, 1.0),
        ("0", Kind.LENGTH, 0.0),
        ("-0.0", Kind.SPEED, 0.0),
        ("2.5", Kind.NUMBER, 2.5),
        ("+3", Kind.INTEGER, 3),
        (" 7 ", Kind.INTEGER, 7),
        ("true", Kind.BOOLEAN, True),
        ("false", Kind.BOOLEAN, False),
        ("30 s", Kind.TEXT, "30 s"),
        (" x ", Kind.TEXT, " x "),
    ],
)
def test_reading(text, kind, value):
    assert read_value(text, kind) == (value if isinstance(value, str) else pytest.approx(value))


@pytest.mark.parametrize(
    ("text", "kind", "problem", "valid"),
    [
        ("30", Kind.DURATION, "a duration needs a unit: '30'", ("30 s", "30 ms", "30 min", "30 h")),
        ("45", Kind.ANGLE, "an angle needs a unit", ("45 deg", "45 °", "45 rad")),
        ("45 degrees", Kind.ANGLE, "'degrees' is not a unit of an angle", ("45 deg",)),
        ("1.5 hours", Kind.DURATION, "'hours' is not a unit of a duration", ("1.5 h",)),
        ("5m", Kind.DURATION, "'m' is not a unit of a duration", ("5 min",)),
        ("5 m", Kind.ANGLE, "'m' is not a unit of an angle", ("5 deg", "5 °", "5 rad")),
        ("10 Min", Kind.DURATION, "'Min' is not a unit of a duration", ("10 min",)),
        ("1:30 h", Kind.DURATION, "a duration is needed", ("1 h 30 min",)),
        ("2:15 min", Kind.DURATION, "a duration is needed", ("2 min 15 s",)),
        ("2 days", Kind.DURATION, "'days' is not a unit of a duration", ("48 h",)),
        ("90 secnds", Kind.DURATION, "'secnds' is not a unit of a duration", ("90 s",)),
        ("5 metres", Kind.LENGTH, "'metres' is not a unit of a length", ("5 m",)),
        ("5 feet", Kind.LENGTH, "'feet' is not a unit of a length", ("1.524 m",)),
        ("2 turns", Kind.ANGLE, "'turns' is not a unit of an angle", ("720 deg",)),
        ("3 kmh", Kind.SPEED, "'kmh' is not a unit of a speed", ("3 km/h",)),
        ("3 s", Kind.LENGTH, "'s' is not a unit of a length", ("3 m", "3 cm", "3 mm", "3 km")),
        ("far", Kind.LENGTH, "a length is needed, not 'far'", ("0.5 m",)),
        ("nan m", Kind.LENGTH, "a length is needed", ("0.5 m",)),
        ("inf s", Kind.DURATION, "a duration is needed", ("30 s",)),
        ("1e999 m", Kind.LENGTH, "too large", ("0.5 m",)),
        ("1e308 m", Kind.LENGTH, "'1e308 m' is too large", ("-10 km to 10 km",)),
        ("-10.1 km", Kind.LENGTH, "'-10.1 km' is too large", ("-10 km to 10 km",)),
        ("1e30 rad", Kind.ANGLE, "'1e30 rad' is too large", ("-360000 deg to 360000 deg",)),
        ("30000 h", Kind.DURATION, "'30000 h' is too large", ("-1e+08 s to 1e+08 s",)),
        ("2.5", Kind.INTEGER, "a whole number is needed, not '2.5'", ("3",)),
        ("2 m", Kind.NUMBER, "a plain number is needed, not '2 m'", ("2",)),
        ("yes", Kind.BOOLEAN, "true or false is needed", ("true",)),
        ("Off", Kind.BOOLEAN, "true or false is needed", ("false",)),
        ("1", Kind.BOOLEAN, "true or false is needed", ("true", "false")),
        ("1 2 3", Kind.POSE, "a pose is needed", ("{x: 1 m, y: 2 m, yaw: 90 deg}", "$key")),
        ("", Kind.LENGTH, "a length is needed", ("0.5 m",)),
    ],
)
def test_refusing(text, kind, problem, valid):
    with pytest.raises(ConfigError, match=problem.replace("(", r"\(")) as error:
        read_value(text, kind)
    assert error.value.valid == valid


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("true", Kind.BOOLEAN, True),
        ("3", Kind.INTEGER, 3),
        ("3.5", Kind.NUMBER, 3.5),
        ("30 s", Kind.DURATION, 30.0),
        ("2 m", Kind.LENGTH, 2.0),
        ("1 m/s", Kind.SPEED, 1.0),
        ("30 sheep", Kind.TEXT, "30 sheep"),
        ("kitchen", Kind.TEXT, "kitchen"),
    ],
)
def test_guessing(text, kind, value):
    assert guess_value(text) == (kind, value)


def test_no_unit_belongs_to_two_kinds():
    units = [unit for table in UNITS.values() for unit in table]
    assert len(units) == len(set(units))


@pytest.mark.parametrize("kind", sorted(NUMERIC_KINDS - {Kind.INTEGER}, key=lambda kind: kind.value))
@given(number=st.floats(-6e3, 6e3))
def test_what_is_formatted_can_be_read_again(kind, number):
    assert read_value(format_value(number, kind), kind) == pytest.approx(number, rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("kind", [kind for kind in Kind if Kind.POSE not in (kind, kind.item)])
def test_every_example_can_be_read(kind):
    assert Port(kind, "").problem_with(read_value(example_of(kind), kind)) is None


@given(st.text(max_size=30), st.sampled_from(list(Kind)))
def test_any_text_is_read_or_refused(text, kind):
    try:
        value = read_value(text, kind)
    except ConfigError:
        return
    assert Port(kind, "").problem_with(value) is None


def test_limits_speak_in_units():
    port = Port(Kind.ANGLE, "", minimum=0.0, maximum=math.pi)
    assert out_of_range(2 * math.pi, port) == "360 deg is above the maximum of 180 deg"
    assert out_of_range(-math.pi, port) == "-180 deg is below the minimum of 0 deg"
    assert out_of_range(1.0, port) is None
    assert format_value(Pose2(1, 2, math.pi / 2), Kind.POSE) == "{x: 1 m, y: 2 m, yaw: 90 deg}"


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("1 h 30 min", 5400.0),
        ("30 min 10 s", 1810.0),
        ("1h30min", 5400.0),
        ("2 h 0.5 s", 7200.5),
        ("1 h 2 min 3 s", 3723.0),
    ],
)
def test_a_duration_of_several_parts(text, seconds):
    assert read_value(text, Kind.DURATION) == seconds
    assert guess_value(text) == (Kind.DURATION, seconds)


@pytest.mark.parametrize("text", ["10 s 30 min", "1 h 2 h", "1 h 30", "-1 h 30 min", "1.5 h 10 s"])
def test_parts_of_a_duration_come_in_order(text):
    with pytest.raises(ConfigError):
        read_value(text, Kind.DURATION)
    assert guess_value(text)[0] is Kind.TEXT


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (60, "1 min"),
        (90, "90 s"),
        (120, "2 min"),
        (3600, "1 h"),
        (5400, "90 min"),
        (7200, "2 h"),
        (9000, "2 h 30 min"),
        (3605, "1 h 5 s"),
        (0.05, "50 ms"),
        (0.5, "0.5 s"),
        (130.5, "130.5 s"),
        (-7260, "-121 min"),
        (0, "0 s"),
        (1e8, "1e+08 s"),
    ],
)
def test_a_duration_is_written_in_the_units_that_people_take(seconds, text):
    assert format_value(float(seconds), Kind.DURATION) == text
    assert read_value(text, Kind.DURATION) == pytest.approx(seconds)


@given(st.integers(-100_000, 10_000_000))
def test_whole_seconds_are_read_as_they_are_written(seconds):
    assert read_value(format_value(float(seconds), Kind.DURATION), Kind.DURATION) == pytest.approx(seconds)
