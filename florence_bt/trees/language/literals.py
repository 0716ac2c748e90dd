"""Values without keys, read by their kind: defaults and limits of ports, and what a caller gives."""

from __future__ import annotations

from typing import Any

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.geometry import Pose2
from florence_bt.core.plain_yaml import Position, YamlMapping, YamlNode, YamlScalar, YamlSequence
from florence_bt.trees.language.quantities import example_of, read_value
from florence_bt.trees.language.vocabulary import OTHER_YAWS

POSE_PARTS = {"x": Kind.LENGTH, "y": Kind.LENGTH, "yaw": Kind.ANGLE}


def read_literal(source: YamlNode, kind: Kind) -> Any:
    """Read a value of a kind.

    Returns:
        The value in SI units.

    Raises:
        ConfigError: It is not a value of that kind; with line and column.
    """
    if kind is Kind.POSE and isinstance(source, YamlMapping):
        return _pose(source)
    if kind.item is not None and isinstance(source, YamlSequence):
        return tuple(read_literal(item, kind.item) for item in source.items)
    if not isinstance(source, YamlScalar):
        raise _wrong(source.position, f"a single {kind.value} is needed", example_of(kind))
    if source.empty and not source.quoted and kind is not Kind.TEXT:
        some = ("[]",) if kind.item is not None else ()
        raise _wrong(source.position, "it has no value", *some, example_of(kind))
    try:
        return read_value(source.text, kind)
    except ConfigError as error:
        raise _wrong(source.position, error.problem, *error.valid) from error


def _pose(source: YamlMapping) -> Pose2:
    parts = {}
    for key, item in source.entries:
        if key.text not in POSE_PARTS:
            meant = ("yaw",) if key.text in OTHER_YAWS else closest_first(key.text, POSE_PARTS)
            raise _wrong(key.position, f"unknown part of a pose {key.text!r}", *meant)
        parts[key.text] = read_literal(item, POSE_PARTS[key.text])
    missing = [name for name in POSE_PARTS if name not in parts]
    if missing:
        raise _wrong(source.position, f"the pose lacks {', '.join(missing)}", example_of(Kind.POSE))
    return Pose2(**parts)


def _wrong(position: Position, problem: str, *valid: str) -> ConfigError:
    return ConfigError(problem, line=position.line, column=position.column, valid=valid)
