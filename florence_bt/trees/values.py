"""Values of a mission file to values of the tree: literals are read, references become value sources."""

from __future__ import annotations

from typing import Any

from florence_bt.behaviours.keys import KeyReference, PoseFromParts, TextTemplate
from florence_bt.core.declaration import Kind, Port
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.trees.model import Literal, PoseParts, Reference, Template, Value
from florence_bt.trees.quantities import example_of, guess_value, out_of_range, read_value, with_article


def tree_value(value: Value, kind: Kind | None) -> Any:
    """What a node of the tree is given for a value.

    Args:
        value: The value as written.
        kind: What it must be; None when anything that can be held by a key will do.

    Returns:
        A value in SI units, or a value source where keys are needed.

    Raises:
        ConfigError: The value is of another kind. The error has no position.
    """
    match value:
        case Reference(key=key):
            return KeyReference(key)
        case Literal():
            return literal_value(value, kind)
        case Template(parts=parts):
            if kind is not None and kind is not Kind.TEXT:
                raise ConfigError(
                    f"{with_article(kind)} cannot be a text with keys in it", valid=_written(kind)
                )
            return TextTemplate(tuple(p if isinstance(p, str) else KeyReference(p.key) for p in parts))
        case PoseParts(x=x, y=y, yaw=yaw):
            if kind is not None and kind is not Kind.POSE:
                raise ConfigError(f"{with_article(kind)} is needed, not a pose", valid=_written(kind))
            numbers = tree_value(x, Kind.LENGTH), tree_value(y, Kind.LENGTH), tree_value(yaw, Kind.ANGLE)
            if all(isinstance(number, (int, float)) for number in numbers):
                return Pose2(*numbers)
            return PoseFromParts(*numbers)


def port_value(value: Value, port: Port) -> Any:
    """As :func:`tree_value`, and a literal is held against the port's limits.

    Raises:
        ConfigError: The value is of another kind or outside the limits. The error has no position.
    """
    result = tree_value(value, port.kind)
    if isinstance(value, Literal):
        problem = out_of_range(result, port)
        if problem:
            raise ConfigError(problem)
    return result


def literal_value(literal: Literal, kind: Kind | None) -> Any:
    """Read a literal; a quoted one where no kind is asked for is a text."""
    if kind is None:
        return literal.text if literal.quoted else guess_value(literal.text)[1]
    return read_value(literal.text, kind)


def template_of(value: Value) -> TextTemplate:
    """A text, with keys or without, as a template."""
    source = tree_value(value, Kind.TEXT)
    if isinstance(source, TextTemplate):
        return source
    return TextTemplate((source,))


def _written(kind: Kind | None) -> tuple[str, ...]:
    return (example_of(kind), "$key") if kind is not None else ("$key",)
