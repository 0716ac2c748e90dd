"""From ROS parameters to the frozen dataclass of a component, and the other way round."""

from __future__ import annotations

import ast
import dataclasses
import enum
import functools
import types
import typing
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from florence_bt.core.errors import ConfigError, closest_first, raise_all
from florence_bt.core.limits import outside_limits

T = TypeVar("T")
USE_SIM_TIME = "use_sim_time"
"""The parameter that every node of ROS has."""


def fill_dataclass(cls: type[T], read: Callable[[str, Any], Any], prefix: str = "") -> T:
    """Make a dataclass from named values.

    Args:
        cls: The dataclass; a field that is a dataclass is read with its name and a dot before its fields.
        read: Given a parameter's name and its default as ROS knows it (None when there is no default), the
            value that was set, or the default.
        prefix: What stands before each name.

    Raises:
        ConfigError: Values do not fit their fields, or are missing; the message names each parameter.
    """
    wrong: list[ConfigError] = []
    hints = _type_hints(cls)  # type: ignore[arg-type]
    values: dict[str, Any] = {}
    for field in dataclasses.fields(cls):  # type: ignore[arg-type]
        name, kind, default = prefix + field.name, hints[field.name], _default(field)
        try:
            if isinstance(kind, type) and dataclasses.is_dataclass(kind):
                values[field.name] = fill_dataclass(kind, read, name + ".")
                continue
            value = read(name, None if default is dataclasses.MISSING else to_parameter(default))
            if value is None and default is dataclasses.MISSING and not _allows_none(kind):
                raise ConfigError(f"parameter {name!r} is not set, and it has no default", parameters=[name])
            values[field.name] = from_parameter(name, kind, value)
        except ConfigError as error:
            wrong.append(error)
    if wrong:
        raise_all([*wrong, *_with_prefix(outside_limits(cls, values), prefix)])
    try:
        return cls(**values)
    except ConfigError as error:
        _with_prefix([error, *error.mistakes], prefix)
        raise
    except ValueError as error:
        raise ConfigError(f"parameters of {cls.__name__}: {error}") from error


def _with_prefix(errors: Sequence[ConfigError], prefix: str) -> Sequence[ConfigError]:
    """Put what stands before the names of parameters into errors about them, and return these."""
    for error in {id(error): error for error in errors}.values():
        error.parameters = tuple(prefix + name for name in error.parameters)
    return errors


@functools.cache  # they are texts, which Python evaluates anew each time
def _type_hints(cls: Hashable) -> dict[str, Any]:
    return typing.get_type_hints(cls)


def check_parameters(classes: Sequence[type], given: Mapping[str, Any], replaced: Mapping[str, str]) -> None:
    """Refuse values that a node would refuse, before there is a node.

    Args:
        classes: The dataclasses that the node reads.
        given: The values by name; those that are None are not given.
        replaced: Parameters of other programs -> what to use instead.

    Raises:
        ConfigError: Names are unknown, or values do not fit; has the names in ``parameters``.
    """
    known = parameter_names(classes)
    fields = (field for cls in classes for field in dataclasses.fields(cls))
    needed = {field.name for field in fields if _default(field) is dataclasses.MISSING}

    def read(name: str, default: Any) -> Any:
        value = given.get(name)
        # What has no default is given by the bring-up itself: any text will do here.
        return value if value is not None else "-" if name in needed else default

    wrong: list[ConfigError] = []
    for cls in classes:
        try:
            fill_dataclass(cls, read)
        except ConfigError as error:
            wrong.append(error)
    for name in given:
        if name in replaced:
            problem = f"there is no parameter {name!r}: {replaced[name]}"
            wrong.append(ConfigError(problem, parameters=[name]))
        elif name == USE_SIM_TIME and not isinstance(given[name], bool):
            wrong.append(_wrong(name, given[name], [_KIND_NAMES[bool]]))
        elif name not in known:
            valid = closest_first(name, known)
            wrong.append(ConfigError(f"there is no parameter {name!r}", valid=valid, parameters=[name]))
    raise_all(wrong)


def parameter_names(classes: Sequence[type]) -> set[str]:
    """Return the names of the parameters of a node that reads these dataclasses."""

    def below(cls: type, prefix: str) -> Iterator[str]:
        hints = _type_hints(cls)
        for field in dataclasses.fields(cls):
            name, kind = prefix + field.name, hints[field.name]
            nested = isinstance(kind, type) and dataclasses.is_dataclass(kind)
            yield from below(kind, name + ".") if nested else (name,)

    return {USE_SIM_TIME, *(name for cls in classes for name in below(cls, ""))}


def to_parameter(value: Any) -> Any:
    """Convert a field's value to a ROS parameter: tuples as lists, paths and enumerations as text."""
    if isinstance(value, enum.Enum):
        return value.value
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, tuple | list):
        return [to_parameter(item) for item in value]
    return value


def from_parameter(name: str, kind: Any, value: Any) -> Any:
    """Convert a ROS parameter's value to what the field wants.

    Args:
        name: The parameter's name, for messages.
        kind: The annotation of the field.
        value: What the parameter holds; None when it is not set.

    Raises:
        ConfigError: The value does not fit.
    """
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        if value is None and type(None) in arguments:
            return None
        choices = [choice for choice in arguments if choice is not type(None)]
        return _first_that_fits(name, choices, value)
    if origin is typing.Literal:
        if value not in arguments:
            raise _wrong(name, value, [repr(choice) for choice in arguments])
        return value
    if origin in (tuple, list, Sequence):
        return _sequence(name, kind, value)
    return _scalar(name, kind, value)


def _first_that_fits(name: str, choices: Sequence[Any], value: Any) -> Any:
    problem: ConfigError | None = None
    for choice in choices:
        try:
            return from_parameter(name, choice, value)
        except ConfigError as error:
            problem = problem or error
    raise problem or _wrong(name, value, [])


def _pairs_in(text: str) -> Any:
    """Read a polygon's numbers in Nav2's form, ``"[[0.2, 0.2], ...]"``, in turn; else return the text."""
    try:
        pairs = ast.literal_eval(text)
        return [number for x, y in pairs for number in (x, y)]
    except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError):
        return text


def _sequence(name: str, kind: Any, value: Any) -> Any:
    if isinstance(value, str) and kind == tuple[float, ...]:
        value = _pairs_in(value)
    if isinstance(value, str | bytes) or not hasattr(value, "__iter__"):
        raise _wrong(name, value, ["a list"])
    items, arguments = list(value), typing.get_args(kind)
    if typing.get_origin(kind) is tuple and Ellipsis not in arguments:
        if len(items) != len(arguments):
            raise _wrong(name, value, [f"a list of {len(arguments)} values"])
        return tuple(from_parameter(name, part, item) for part, item in zip(arguments, items, strict=True))
    converted = [from_parameter(name, arguments[0], item) for item in items]
    return converted if typing.get_origin(kind) is list else tuple(converted)


def _scalar(name: str, kind: Any, value: Any) -> Any:
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        known = [str(member.value) for member in kind]
        if str(value) not in known:
            raise _wrong(name, value, closest_first(str(value), known))
        return next(member for member in kind if str(member.value) == str(value))
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if kind is Path and isinstance(value, str):
        return Path(value)
    fits = isinstance(value, kind) and not (isinstance(value, bool) and kind is not bool)
    if not fits:
        raise _wrong(name, value, [_KIND_NAMES.get(kind, kind.__name__)])
    return value


_KIND_NAMES = {bool: "true or false", int: "a whole number", float: "a number", str: "a text", Path: "a path"}


def _wrong(name: str, value: Any, valid: Sequence[str]) -> ConfigError:
    return ConfigError(f"parameter {name!r} cannot be {value!r}", valid=valid, parameters=[name])


def _allows_none(kind: Any) -> bool:
    return type(None) in typing.get_args(kind)


def _default(field: dataclasses.Field[Any]) -> Any:
    if field.default is not dataclasses.MISSING:
        return field.default
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return dataclasses.MISSING
