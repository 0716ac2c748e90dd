"""Values as the author of a test writes them: ``3 s``, ``45 deg``, ``{x: 1 m, y: 2 m, yaw: 90 deg}``."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from florence_bt.core.declaration import Kind, Port
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.trees.language.quantities import example_of, guess_value, out_of_range, range_of, read_value

_POSE_PARTS = {"x": Kind.LENGTH, "y": Kind.LENGTH, "yaw": Kind.ANGLE}
_PAIR = re.compile(r"\s*(\w+)\s*[:=]\s*(.+?)\s*")
_BRACKETED = re.compile(r"\([^()]*\)|\{[^{}]*\}")
_POSES = re.compile(rf"\[\s*(?:(?:{_BRACKETED.pattern})\s*(?:,\s*|(?=\])))*\]")


def read_duration(value: Any, what: str = "a duration") -> float:
    """Read seconds from ``3 s``, ``2 min`` or a plain number of seconds.

    Raises:
        ConfigError: It is not a duration of zero or more.
    """
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    seconds = float(value) if number else read_value(str(value), Kind.DURATION)
    if not math.isfinite(seconds) or seconds < 0.0:
        raise ConfigError(f"{what} cannot be {value!r}", valid=["3 s", "500 ms", "2 min"])
    return seconds


def read_port(value: Any, port: Port) -> Any:
    """Read a value that must fit a port.

    Args:
        value: A text as in a mission file, a table or three texts for a pose, or a value in SI units.
        port: What it must fit.

    Returns:
        The value in SI units.

    Raises:
        ConfigError: It is of another kind, or outside the limits.
    """
    read = read_kind(value, port.kind)
    problem = out_of_range(read, port) if isinstance(value, str) else None
    problem = problem or port.problem_with(read)
    if problem:
        raise ConfigError(problem, valid=range_of(port))
    return read


def read_kind(value: Any, kind: Kind) -> Any:
    """Read a value of a kind; the limits of :func:`read_port` are not checked.

    Raises:
        ConfigError: It is of another kind.
    """
    if kind is Kind.POSE:
        return read_pose(value)
    if kind.item is not None and isinstance(value, Sequence) and not isinstance(value, str):
        return tuple(read_kind(item, kind.item) for item in value)
    if kind.item is Kind.POSE and isinstance(value, str) and _POSES.fullmatch(value.strip()):
        return tuple(read_pose(item) for item in _BRACKETED.findall(value))
    if isinstance(value, str):
        return read_value(value, kind)
    whole = isinstance(value, int) and not isinstance(value, bool)
    read = float(value) if whole and float in kind.python_types else value
    problem = Port(kind, "").problem_with(read)
    if problem:
        raise ConfigError(problem, valid=[example_of(kind)])
    return read


def read_pose(value: Any) -> Pose2:
    """Read a pose: a :class:`Pose2`, a table with x, y and yaw, three values, or either of these as a text.

    Raises:
        ConfigError: It is none of these.
    """
    if isinstance(value, Pose2):
        return value
    parts = _pose_parts(value)
    if parts is None:
        raise ConfigError(
            f"a pose is needed, not {value!r}", valid=[example_of(Kind.POSE), "(1 m, 2 m, 90 deg)"]
        )
    for name in parts:
        if name not in _POSE_PARTS:
            raise ConfigError(f"a pose has no part {name!r}", valid=closest_first(name, _POSE_PARTS))
    missing = [name for name in _POSE_PARTS if name not in parts]
    if missing:
        raise ConfigError(f"the pose lacks {', '.join(missing)}", valid=[example_of(Kind.POSE)])
    return Pose2(*(read_kind(parts[name], kind) for name, kind in _POSE_PARTS.items()))


def _pose_parts(value: Any) -> Mapping[str, Any] | None:
    if isinstance(value, Mapping):
        return value
    if isinstance(value, str):
        text = value.strip()
        if text[:1] + text[-1:] not in ("()", "{}", "[]"):
            return None
        pieces = text[1:-1].split(",")
        pairs = [_PAIR.fullmatch(piece) for piece in pieces]
        if all(pair is not None for pair in pairs):
            return {pair[1]: pair[2] for pair in pairs if pair is not None}
        value = [piece.strip() for piece in pieces]
    if isinstance(value, Sequence) and len(value) == len(_POSE_PARTS):
        return dict(zip(_POSE_PARTS, value, strict=True))
    return None


def same(expected: Any, actual: Any) -> bool:
    """Tell whether a value is what was expected; lengths, angles and the like may differ by rounding."""
    if isinstance(expected, Pose2) and isinstance(actual, Pose2):
        turned = abs(normalize_angle(expected.yaw - actual.yaw))
        return same(expected.x, actual.x) and same(expected.y, actual.y) and turned < 1e-6
    numbers = (int, float)
    if isinstance(expected, bool) or isinstance(actual, bool):
        return expected is actual
    if isinstance(expected, numbers) and isinstance(actual, numbers):
        return math.isclose(expected, actual, rel_tol=1e-9, abs_tol=1e-6)
    if isinstance(expected, tuple | list) and isinstance(actual, tuple | list):
        return len(expected) == len(actual) and all(map(same, expected, actual))
    return bool(expected == actual)


def expected_like(expected: Any, actual: Any) -> Any:
    """Read an expected value where only the actual one gives its kind (the keys of a mission).

    Raises:
        ConfigError: It cannot be read as that kind.
    """
    if isinstance(actual, Pose2):
        return read_pose(expected)
    if not isinstance(expected, str) or isinstance(actual, str):
        return expected
    return guess_value(expected)[1]
