"""Limits of the fields of parameter dataclasses: written in the annotations, checked by one function.

A class writes ``rate: Positive = 20.0`` or ``skip: Annotated[int, Limits(0, 9)] = 0``, and is a
:class:`CheckedParameters`.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import typing
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from florence_bt.core.errors import ConfigError, closest_first, raise_all


@dataclass(frozen=True, slots=True)
class Limits:
    """The numbers that a field may hold; NaN is never one of them.

    Attributes:
        low: Smallest value.
        high: Largest value.
        above: Whether ``low`` itself is too small.
        below: Whether ``high`` itself is too large.
    """

    low: float = -math.inf
    high: float = math.inf
    above: bool = False
    below: bool = False

    def admits(self, value: float) -> bool:
        """Tell whether a value is within the limits."""
        high_enough = self.low < value if self.above else self.low <= value
        low_enough = value < self.high if self.below else value <= self.high
        return high_enough and low_enough

    def __str__(self) -> str:
        """Write the limits for people, e.g. ``above 0`` or ``0 to 99``."""
        if self.low == -math.inf:
            return "a finite number"
        if self.high == math.inf:
            return f"above {self.low:g}" if self.above else f"{self.low:g} or more"
        if not self.above and not self.below:
            return f"{self.low:g} to {self.high:g}"
        low = f"above {self.low:g}" if self.above else f"at least {self.low:g}"
        return f"{low} and {'below' if self.below else 'at most'} {self.high:g}"


Finite = Annotated[float, Limits(above=True, below=True)]
"""Neither infinite nor NaN."""
Positive = Annotated[float, Limits(0.0, math.inf, above=True, below=True)]
"""A finite number above zero."""
NotNegative = Annotated[float, Limits(0.0, math.inf, below=True)]
"""A finite number, zero or more."""


class CheckedParameters:
    """The base of a dataclass whose fields are checked when it is made, against :func:`check_limits`."""

    __slots__ = ()

    def __post_init__(self) -> None:
        """Check each field alone, then what :meth:`_check` adds."""
        check_limits(self)
        self._check()

    def _check(self) -> None:
        """Check what concerns several fields, or cannot be said in an annotation; nothing by default."""


def check_limits(parameters: Any) -> None:
    """Refuse a dataclass with a field outside its limits, or with none of the choices of a ``Literal``.

    None is left alone: a field that may be None has no value then.

    Raises:
        ConfigError: Names each such field, its value and what would have worked.
    """
    cls = type(parameters)
    names = rules_of(cls)  # type: ignore[arg-type]  # a class is hashable
    raise_all(outside_limits(cls, {name: getattr(parameters, name) for name in names}))


def outside_limits(cls: type, values: Mapping[str, Any]) -> list[ConfigError]:
    """Return an error for each value that a dataclass would refuse by :func:`check_limits`.

    Args:
        cls: The dataclass.
        values: Values by field; fields that are not there are left alone.
    """
    wrong = []
    for name, rule in rules_of(cls).items():
        value = values.get(name)
        if value is None:
            continue
        if not isinstance(rule, Limits):
            if value not in rule:
                choices = [str(choice) for choice in rule]
                valid = closest_first(str(value), choices)
                wrong.append(ConfigError(f"{name} cannot be {value!r}", valid=valid, parameters=[name]))
        elif not rule.admits(value):
            valid = (f"{_example(cls, name)} ({rule})",)
            wrong.append(ConfigError(f"{name} is {value}", valid=valid, parameters=[name]))
    return wrong


def check_order(parameters: Any, *pairs: tuple[str, str], equal: bool = False) -> None:
    """Refuse a dataclass in which the first field of a pair is not below the second one.

    Args:
        parameters: The dataclass.
        *pairs: Names of fields.
        equal: Whether the two may be equal.

    Raises:
        ConfigError: Names both fields and their values.
    """
    for low, high in pairs:
        small, large = getattr(parameters, low), getattr(parameters, high)
        if not (small <= large if equal else small < large):
            relation = "must not be above" if equal else "must be below"
            examples = [_example(type(parameters), name) for name in (low, high)]
            problem = f"{low} ({small}) {relation} {high} ({large})"
            raise ConfigError(problem, valid=examples, parameters=[low, high])


def _example(cls: type, name: str) -> str:
    """Return a field with its default, if it has one."""
    default = cls.__dataclass_fields__[name].default  # type: ignore[attr-defined]
    return name if default is dataclasses.MISSING else f"{name}: {default}"


@functools.cache
def rules_of(cls: type) -> dict[str, Limits | tuple[Any, ...]]:
    """Return the limits, or the choices, of each field that has some."""
    rules: dict[str, Limits | tuple[Any, ...]] = {}
    for name, hint in typing.get_type_hints(cls, include_extras=True).items():
        for part in (hint, *typing.get_args(hint)):
            if typing.get_origin(part) is Literal:
                rules[name] = typing.get_args(part)
            elif typing.get_origin(part) is Annotated:
                limits = [note for note in part.__metadata__ if isinstance(note, Limits)]
                rules |= {name: limits[0]} if limits else {}
    return rules
