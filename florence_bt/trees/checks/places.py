"""Checks of places: labels that the hotspots file lacks, poses that the map lacks."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from typing import TypeGuard

from florence_bt.core.geometry import Pose2
from florence_bt.core.plain_yaml import Position
from florence_bt.trees.language import model
from florence_bt.trees.language.analysis import Analysis
from florence_bt.trees.language.expressions.syntax import (
    Binary,
    Constant,
    Expression,
    Key,
    Listed,
    Term,
    parts_of,
)
from florence_bt.trees.language.findings import ERROR, FindingList
from florence_bt.trees.language.model import Literal, Mission, PoseParts, Value, default_of
from florence_bt.trees.language.values import literal_value, tree_value


@dataclass(frozen=True, slots=True)
class KnownPlaces:
    """The places of a flat.

    Attributes:
        labels: The labels of all hotspots.
        rooms: The labels of those that are rooms; None when every label may be one.
        file: Where they stand, for messages; empty when that goes without saying.
        severity: How bad an unknown label is.
        problem_at: Says what is wrong with a place of the map (x, y in metres), None when nothing is; None
            when there is no map to check against.
    """

    labels: Collection[str] | None
    rooms: Collection[str] | None = None
    file: str = ""
    severity: str = ERROR
    problem_at: Callable[[float, float], str | None] | None = None


def check_places(mission: Mission, analysis: Analysis, places: KnownPlaces, findings: FindingList) -> None:
    """Report the labels and poses of a mission that do not exist.

    Args:
        mission: The mission.
        analysis: Its surroundings.
        places: What exists.
        findings: Receives what is wrong.
    """
    if places.labels is not None:
        for text, position, what in labels_in(mission, analysis):
            # A key of this name may have lost its dollar sign; a default reads no keys.
            is_default = position in mission.positions.values()
            suggestions = [f"${text}"] if text in analysis.of(mission).kinds and not is_default else []
            _check_label(text, position, what, places, findings, suggestions)
    if places.problem_at is not None:
        for node in analysis.of(mission).all:
            for value in node.reads:
                _check_pose(value, places.problem_at, findings)


def labels_in(mission: Mission, analysis: Analysis) -> Iterator[tuple[str, Position, str]]:
    """Yield every written label, where it stands, and what it names.

    An empty text in a key names nothing: it says that no place is known yet. What an author gives to an
    input is meant to be a label.
    """
    names = analysis.of(mission).names
    for name, port in (*mission.inputs.items(), *mission.keys.items()):
        given = port.default if isinstance(port.default, tuple) else (port.default,)
        declared = mission.positions.get(default_of(name), mission.positions.get(name, Position()))
        for number, text in enumerate(given if name in names else ()):
            if isinstance(text, str) and text:
                yield text, mission.positions.get(default_of(name, number), declared), names[name]
    for node in analysis.of(mission).all:
        for _, value, what in analysis.names_in(node):
            for item in value.items if isinstance(value, model.ListItems) else (value,):
                if isinstance(item, Literal):
                    yield item.text, item.position, what
        for literal, key in node.literals_of_keys():
            if key in names and literal.text and isinstance(literal_value(literal, None), str):
                yield literal.text, literal.position, names[key]
        for expression in (*node.expressions, *node.reads):
            if isinstance(expression, Expression):
                yield from _compared(expression.term, names)


def _compared(term: Term, names: dict[str, str] | Collection[str]) -> Iterator[tuple[str, Position, str]]:
    """Yield the texts with which keys that name a place are compared."""
    key, texts = _held_against(term)
    if isinstance(names, dict) and key in names:
        yield from ((text.value, text.position, names[key]) for text in texts if text.value)
    for part in parts_of(term):
        yield from _compared(part, names)


def _held_against(term: Term) -> tuple[str, list[Constant]]:
    """Return the key of a comparison and the texts with which it is compared; no key when it is none."""
    match term:
        case Binary(operator="==" | "!=", left=Key(key=key), right=other):
            pass
        case Binary(operator="==" | "!=" | "in", left=other, right=Key(key=key)):
            pass
        case Binary(operator="in", left=Key(key=key), right=Listed(items=items)):
            return key, [item for item in items if _is_text(item)]
        case _:
            return "", []
    return key, [other] if _is_text(other) else []


def _is_text(term: Term) -> TypeGuard[Constant]:
    return isinstance(term, Constant) and isinstance(term.value, str)


def _check_label(
    text: str,
    position: Position,
    what: str,
    places: KnownPlaces,
    findings: FindingList,
    suggestions: list[str],
) -> None:
    labels = places.labels or ()
    rooms = labels if places.rooms is None else places.rooms
    where = f" in {places.file}" if places.file else ""
    if text not in labels:
        wanted = rooms if what == "room" else labels
        noun = "room" if what == "room" and places.rooms is not None else "hotspot"
        message = f"there is no {noun} {text!r}{where}"
        findings.unknown(position, message, text, wanted, severity=places.severity, suggestions=suggestions)
    elif what == "room" and text not in rooms:
        message = f"the hotspot {text!r} is not a room{where}"
        findings.unknown(position, message, text, rooms, severity=places.severity)


def _check_pose(
    value: Value, problem_at: Callable[[float, float], str | None], findings: FindingList
) -> None:
    if not isinstance(value, PoseParts):
        return
    if not all(isinstance(part, Literal) for part in (value.x, value.y, value.yaw)):
        return
    pose = tree_value(value, None)
    problem = problem_at(pose.x, pose.y) if isinstance(pose, Pose2) else None
    if problem is not None:
        findings.error(value.position, f"this pose is {problem}", ["a pose where the robot can stand"])
