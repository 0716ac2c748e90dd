"""The declaration of a skill, written once: the linter, the schema, the docs and the mocks read it.

The shipped skills say it in a ``NAME.skills.yaml`` in their folder, those of a robot's folder likewise; a
package may have :class:`SkillDeclaration` values in a module.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from florence_bt.core.geometry import MAX_ANGLE_RAD, MAX_DISTANCE_M, Pose2


class Kind(enum.Enum):
    """The types that flow between missions and skills; inside the system always SI units."""

    TEXT = "text"
    BOOLEAN = "boolean"
    INTEGER = "integer"
    NUMBER = "number"
    LENGTH = "length"
    """float, metres"""
    ANGLE = "angle"
    """float, radians"""
    DURATION = "duration"
    """float, seconds"""
    SPEED = "speed"
    """float, metres per second"""
    POSE = "pose"
    """:class:`Pose2` in the map frame"""
    LIST_OF_TEXT = "list of text"
    LIST_OF_BOOLEAN = "list of boolean"
    LIST_OF_INTEGER = "list of integer"
    LIST_OF_NUMBER = "list of number"
    LIST_OF_LENGTH = "list of length"
    LIST_OF_ANGLE = "list of angle"
    LIST_OF_DURATION = "list of duration"
    LIST_OF_SPEED = "list of speed"
    LIST_OF_POSE = "list of pose"
    """tuples of the values above"""

    @cached_property
    def item(self) -> Kind | None:
        """The kind of the items of a list; None for what is no list."""
        word = self.value.removeprefix("list of ")
        return Kind(word) if word != self.value else None

    @cached_property
    def list(self) -> Kind:
        """The kind of a list of such values."""
        return Kind(f"list of {self.value}")

    # A part of the keys of dictionaries that are asked for every node; that of Enum is computed in Python.
    __hash__ = object.__hash__

    @cached_property
    def python_types(self) -> tuple[type, ...]:
        """The types that a value of this kind may have."""
        if self.item is not None:
            return (tuple,)
        match self:
            case Kind.TEXT:
                return (str,)
            case Kind.BOOLEAN:
                return (bool,)
            case Kind.INTEGER:
                return (int,)
            case Kind.POSE:
                return (Pose2,)
            case _:
                return (float, int)


SHOWN_UNITS: Mapping[Kind, tuple[str, float]] = {
    Kind.LENGTH: ("m", 1.0),
    Kind.ANGLE: ("deg", 180.0 / math.pi),
    Kind.DURATION: ("s", 1.0),
    Kind.SPEED: ("m/s", 1.0),
}
"""Kind -> the unit in which people read it, and how many of them are one SI unit."""
_SCALES: Mapping[Kind, tuple[tuple[float, str, float], ...]] = {
    Kind.LENGTH: ((0.01, "mm", 1000.0), (0.1, "cm", 100.0), (1000.0, "m", 1.0), (math.inf, "km", 0.001)),
    Kind.DURATION: ((0.1, "ms", 1000.0), (math.inf, "s", 1.0)),
}
"""Kind -> up to what (SI units) people read it in which unit, and how many of them are one SI unit."""


_TOO_LONG_S = 1e8
"""From here on nobody counts a duration in hours."""


def quantity_text(value: float, kind: Kind, digits: int) -> str:
    """Write a quantity for people in the unit that they would take.

    An hour and a half is ``90 min`` and not 5400 s, half an hour and ten seconds are ``30 min 10 s``, and
    one and a half kilometres are not 1500 m.

    Args:
        value: In SI units.
        kind: What it is, one of :data:`SHOWN_UNITS`.
        digits: How many digits are shown of what is no whole number of minutes or hours.
    """
    whole = abs(value - round(value)) <= 1e-9 * abs(value)
    if kind is Kind.DURATION and whole and 60.0 <= abs(value) < _TOO_LONG_S:
        return _in_minutes(round(value))
    unit, size = SHOWN_UNITS[kind]
    for most, smaller, count in _SCALES.get(kind, ()) if value else ():
        if abs(value) < most:
            unit, size = smaller, count
            break
    return f"{value * size:.{digits}g} {unit}"


def _in_minutes(seconds: int) -> str:
    """Write a minute or more: ``90 s``, ``90 min``, ``2 h``, ``2 h 30 min``, ``30 min 10 s``."""
    if seconds < 0:  # written in one unit, as it is read
        size, unit = next(each for each in ((3600, "h"), (60, "min"), (1, "s")) if seconds % each[0] == 0)
        return f"{seconds // size} {unit}"
    minutes, rest = divmod(seconds, 60)
    if rest and minutes < 2:
        return f"{seconds} s"
    hours = minutes // 60 if rest or minutes >= 120 or minutes == 60 else 0
    parts = ((hours, "h"), (minutes - 60 * hours, "min"), (rest, "s"))
    return " ".join(f"{count} {unit}" for count, unit in parts if count)


def number_text(value: float, kind: Kind) -> str:
    """Write a number (SI units) for people: ``10 min``, short and the same every time."""
    return quantity_text(value, kind, 6) if kind in SHOWN_UNITS else f"{value:.6g}"


MAGNITUDES: Mapping[Kind, float] = {
    Kind.LENGTH: MAX_DISTANCE_M,
    Kind.ANGLE: MAX_ANGLE_RAD,
    Kind.DURATION: 1e8,  # three years; timers count nanoseconds in 64 bits
}
"""The largest absolute value of a kind, SI units: what is beyond is a mistake."""


class _Required(enum.Enum):
    """One value that stays itself when it travels to another process."""

    REQUIRED = "required"


REQUIRED: Any = _Required.REQUIRED
"""The default of a port that must be given."""


@dataclass(frozen=True, slots=True)
class Port:
    """An input or output by name.

    Attributes:
        kind: The type.
        description: One sentence for people.
        default: The value when none is given; :data:`REQUIRED` when one must be given. Of an output: what a
            mock gives that does not name it; a skill itself gives all its outputs.
        minimum: Smallest value allowed, or None.
        maximum: Largest value allowed, or None.
        names: What a text must name: ``hotspot`` (any label of the hotspots file), ``room`` (the label of a
            room in it), or nothing in particular. The checks hold written labels against the file.
        choices: The texts that are allowed, or that the items of a list may be; empty for any.
    """

    kind: Kind
    description: str
    default: Any = REQUIRED
    minimum: float | None = None
    maximum: float | None = None
    names: str = ""
    choices: tuple[str, ...] = ()

    @property
    def required(self) -> bool:
        """Tell whether a value must be given."""
        return self.default is REQUIRED

    def problem_with(self, value: Any) -> str | None:
        """Tell why a value (in SI units) does not fit, or None when it does."""
        wrong_type = not isinstance(value, self.kind.python_types) or (
            isinstance(value, bool) and self.kind is not Kind.BOOLEAN
        )
        if wrong_type:
            return f"a value of type {self.kind.value} is needed, not {value!r}"
        if self.kind.item is not None:
            one = Port(self.kind.item, "", choices=self.choices)
            return next((problem for each in value if (problem := one.problem_with(each))), None)
        # Of a text that stands for an unknown one its own characters count.
        if self.choices and str.__str__(value) not in self.choices:
            return f"{value!r} is none of {', '.join(self.choices)}"
        if isinstance(value, Pose2):
            return None if value.is_within_limits() else f"{value!r} is not finite, or too far away"
        if isinstance(value, float) and not math.isfinite(value):
            return f"{value!r} is not finite"
        most = MAGNITUDES.get(self.kind)
        if most is not None and abs(value) > most:
            limits = f"{number_text(-most, self.kind)} and {number_text(most, self.kind)}"
            return f"{number_text(value, self.kind)} is not between {limits}"
        if self.minimum is not None and value < self.minimum:
            least = number_text(self.minimum, self.kind)
            return f"{number_text(value, self.kind)} is below the minimum of {least}"
        if self.maximum is not None and value > self.maximum:
            most_allowed = number_text(self.maximum, self.kind)
            return f"{number_text(value, self.kind)} is above the maximum of {most_allowed}"
        return None


@dataclass(frozen=True, slots=True)
class CodeGroup:
    """Failure codes that mean the same to a mission; it can name them all with one word.

    Groups of one name, from several skills, are one group.

    Attributes:
        name: The word.
        codes: The codes.
        meaning: What the codes have in common, for people; empty where another skill says it.
    """

    name: str
    codes: frozenset[str]
    meaning: str = ""


@dataclass(frozen=True, slots=True)
class SkillDeclaration:
    """A skill as missions see it.

    Attributes:
        name: verb_noun, unique among all skills.
        summary: What it does, one sentence.
        inputs: Ports by name.
        outputs: Ports by name; written to the tree's keys on success.
        failures: Code -> what it means; those of :data:`florence_bt.core.outcome.COMMON_CODES` come on top.
        resources: What only one skill at a time may use, e.g. ``base``.
        deadline_s: Seconds after which a run is ended with the code ``timed_out``.
        instant: Whether a run is over as soon as it starts (a condition or a look-up). A composite without
            memory asks such a skill again every second, or as often as the mission says.
        reports_changes: Whether the skill reports changes of its answer
            (:class:`florence_bt.core.skill.WakingSkill`), so that it is asked again then and only then.
        deprecated: What missions should use instead, when the skill is deprecated; empty otherwise.
        groups: What its codes have in common with those of other skills.
    """

    name: str
    summary: str
    inputs: Mapping[str, Port] = field(default_factory=dict)
    outputs: Mapping[str, Port] = field(default_factory=dict)
    failures: Mapping[str, str] = field(default_factory=dict)
    resources: frozenset[str] = frozenset()
    deadline_s: float = 60.0
    instant: bool = False
    reports_changes: bool = False
    deprecated: str = ""
    groups: tuple[CodeGroup, ...] = ()

    def problems_with(self, inputs: Mapping[str, Any]) -> list[str]:
        """Return everything that is wrong with a set of inputs (SI units); empty when they fit."""
        problems = [f"{self.name} has no input {name!r}" for name in inputs if name not in self.inputs]
        for name, port in self.inputs.items():
            if name in inputs:
                problem = port.problem_with(inputs[name])
                if problem:
                    problems.append(f"{name}: {problem}")
            elif port.required:
                problems.append(f"{name} is missing")
        return problems

    def complete(self, inputs: Mapping[str, Any]) -> dict[str, Any]:
        """Return the inputs with the defaults of those that were not given."""
        return {name: inputs.get(name, port.default) for name, port in self.inputs.items()}
