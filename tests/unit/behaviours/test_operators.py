"""What the operators of expressions compute, and what has no value."""

import math

import pytest

from florence_bt.behaviours.expressions import BadExpression, junction, operation, pose_part
from florence_bt.behaviours.keys import KeyStore
from florence_bt.core.geometry import Pose2


def value(name, *operands):
    return operation(name, *((lambda keys, each=each: each) for each in operands))(KeyStore())


@pytest.mark.parametrize(
    ("name", "operands", "result"),
    [
        ("+", (1, 2), 3),
        ("-", (1.5, 2), -0.5),
        ("*", (2, 3.0), 6.0),
        ("/", (3, 2), 1.5),
        ("negate", (2,), -2),
        ("abs", (-2.5,), 2.5),
        ("min", (3, 1, 2), 1),
        ("max", (3, 1, 2), 3),
        ("not", (False,), True),
        ("==", ("a", "a"), True),
        ("!=", ("a", "b"), True),
        ("==", (0.7, 0.1 * 7), True),
        ("<", (0.7, 0.1 * 7), False),
        ("<=", (0.1 * 7, 0.7), True),
        (">", (2, 1), True),
        (">=", (1, 1.0), True),
        ("distance", (Pose2(0.0, 0.0, 1.0), Pose2(3.0, 4.0, 2.0)), 5.0),
    ],
)
def test_an_operator_computes(name, operands, result):
    assert value(name, *operands) == pytest.approx(result)
    assert type(value(name, *operands)) is type(result)


@pytest.mark.parametrize(
    ("name", "operands", "problem"),
    [
        ("/", (1, 0), "1 is divided by zero"),
        ("+", ("a", 1), "'+' has no value for a and 1: numbers are needed"),
        ("+", (True, 1), "numbers are needed"),
        ("==", ("1", 1), "two values of one kind are needed"),
        ("*", (2**62, 4), "the number is too large"),
        ("*", (1e200, 1e200), "the number is too large"),
        ("not", (1,), "1 is neither true nor false"),
        ("distance", (Pose2(), 1.0), "two poses are needed"),
    ],
)
def test_what_has_no_value_says_why(name, operands, problem):
    with pytest.raises(BadExpression) as raised:
        value(name, *operands)
    assert problem in str(raised.value)


def test_the_right_side_is_looked_at_only_when_the_left_does_not_decide():
    def never(keys):
        raise AssertionError("not to be asked")

    for decisive in (False, True):
        assert junction(decisive, lambda keys, left=decisive: left, never)(KeyStore()) is decisive
        other = junction(decisive, lambda keys, left=decisive: not left, lambda keys: False)
        assert other(KeyStore()) is False


def test_a_part_of_a_pose():
    keys = KeyStore({"pose": Pose2(1.0, 2.0, math.pi / 2), "room": "hall"})
    parts = [pose_part(lambda keys: keys.read("pose"), part)(keys) for part in ("x", "y", "yaw")]
    assert parts == [1.0, 2.0, math.pi / 2]
    with pytest.raises(BadExpression, match="'hall' is not a pose and has no x"):
        pose_part(lambda keys: keys.read("room"), "x")(keys)
