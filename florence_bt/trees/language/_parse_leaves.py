"""Parsers of the nodes with nothing below: skills, calls, and the small ones."""

from __future__ import annotations

import re

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError
from florence_bt.trees.language._parse_common import Maker, Parsing
from florence_bt.trees.language._suggestions import mission_meant
from florence_bt.trees.language.kinds import NEVER_INPUTS
from florence_bt.trees.language.model import Call, Condition, Fail, Literal, Node, Set, Use, Value, Wait
from florence_bt.trees.language.quantities import read_value
from florence_bt.trees.language.source import Source, Table, Text

SHORTEST_S = 0.01
"""The shortest period of ``every``: as often as an executor of BehaviorTree.CPP usually ticks."""
_ASSIGNMENT = re.compile(r"\$?(?P<key>[a-z][a-z0-9_]*)\s*[:=]\s*(?P<value>[^=].*)")
"""What people write who know a programming language: ``tries = 3``."""


def _condition(parsing: Parsing, key: Text, value: Source, table: Table) -> Node | None:
    condition, common = parsing.reader.expression(value, "condition"), parsing.common(key, table)
    return Condition(condition=condition, **common) if condition is not None else None


def _fail(parsing: Parsing, key: Text, value: Source, table: Table) -> Node | None:
    reason, common, code = parsing.text(value, "fail"), parsing.common(key, table), table.get("code")
    name = parsing.reader.identifier(code, "code") if code is not None else None
    return Fail(reason=reason, code=name, **common) if reason is not None else None


def _wait(parsing: Parsing, key: Text, value: Source, table: Table) -> Node | None:
    duration, common = parsing.reader.value(value, "wait"), parsing.common(key, table)
    return Wait(duration=duration, **common) if duration is not None else None


def _set(parsing: Parsing, key: Text, value: Source, table: Table) -> Node | None:
    common = parsing.common(key, table)
    if isinstance(value, Text) and not value.empty and (match := _ASSIGNMENT.fullmatch(value.text)):
        valid = [f"set: {{{match['key']}: {match['value']}}}"]
        parsing.reader.problem(value.position, "set must be a table (key: value)", valid)
        return Set(values=(), **common)
    values = parsing.reader.values(value, "set")
    if (isinstance(value, Table) and not value.entries) or (isinstance(value, Text) and value.empty):
        parsing.reader.problem(value.position, "set needs keys and values", ["set: {key: value}"])
    return Set(values=values, **common)


def _call(parsing: Parsing, key: Text, value: Source, table: Table) -> Node | None:
    common = parsing.common(key, table)
    if isinstance(value, Table):
        valid = ["run: goto_room", "with: {room: kitchen} indented like run"]
        parsing.reader.problem(value.position, "run needs the name of a mission, not a table", valid)
        return None
    mission = parsing.reader.identifier(value, "run", mission_meant(value))
    given = table.get("with")
    inputs = parsing.reader.values(given, "with")
    outputs = parsing.reader.keys(table.get("out"))
    if mission is None:
        return None
    return Call(mission=mission, inputs=inputs, outputs=outputs, unread=_unread(given, inputs), **common)


def use(parsing: Parsing, key: Text, value: Source, table: Table) -> Node | None:
    """The use of a skill: every kind key that is no kind of node."""
    given = isinstance(value, Table)
    value = _without_modifiers(parsing, key, value)
    inputs = parsing.reader.values(value, key.text) if given else ()
    return Use(
        skill=key.text,
        inputs=inputs,
        outputs=parsing.reader.keys(table.get("out")),
        table_given=given or (isinstance(value, Text) and value.empty),
        unread=_unread(value, inputs),
        written=value.text if isinstance(value, Text) else "",
        every=_every(parsing, table.get("every")),
        **parsing.common(key, table),
    )


def _every(parsing: Parsing, source: Source | None) -> float | None:
    """``every`` in seconds."""
    if source is None:
        return None
    try:
        seconds = float(read_value(source.text, Kind.DURATION)) if isinstance(source, Text) else 0.0
    except ConfigError as error:
        parsing.reader.problem(source.position, f"every: {error.problem}", error.valid)
        return None
    if seconds < SHORTEST_S:
        parsing.reader.problem(source.position, "every: at least 10 ms are needed", ["1 s", "100 ms"])
        return None
    return seconds


def _unread(source: Source | None, inputs: tuple[tuple[Literal, Value], ...]) -> tuple[str, ...]:
    """The names in a table whose values could not be read."""
    read = {name.text for name, _ in inputs}
    entries = source.entries if isinstance(source, Table) else ()
    return tuple(name.text for name, _ in entries if name.text not in read)


def _without_modifiers(parsing: Parsing, key: Text, value: Source) -> Source:
    """Leave out modifiers that were indented as if they were inputs, and say so."""
    if not isinstance(value, Table):
        return value
    for name, _ in value.entries:
        if name.text in NEVER_INPUTS:
            message = f"{name.text!r} stands among the inputs of {key.text}"
            parsing.reader.problem(name.position, message, [f"{name.text} indented like {key.text}"])
    entries = tuple((name, item) for name, item in value.entries if name.text not in NEVER_INPUTS)
    return Table(entries, value.position)


LEAVES: dict[str, Maker] = {
    "condition": _condition,
    "fail": _fail,
    "wait": _wait,
    "set": _set,
    "run": _call,
}
"""Kind key -> its parser; every other kind key is the name of a skill."""
