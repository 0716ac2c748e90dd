"""Parsers of the nodes with one node below."""

from __future__ import annotations

from functools import partial

from florence_bt.trees.language._parse_common import Maker, Parsing
from florence_bt.trees.language.kinds import FORCED
from florence_bt.trees.language.model import (
    Cooldown,
    Delay,
    Force,
    Invert,
    Node,
    Once,
    Repeat,
    Retry,
    Succeed,
    Timeout,
)
from florence_bt.trees.language.source import Source, Table, Text

_EXAMPLES = {"retry": "3", "repeat": "3", "force": "success"}
"""How the value behind a kind key is written; where nothing stands it is a duration."""


def _all_below(parsing: Parsing, key: Text, value: Source) -> bool:
    """Whether a table stands where a single value is needed; noted, with where the rest belongs."""
    if not isinstance(value, Table):
        return False
    message = f"a single value is needed behind {key.text}; `do` has the same indentation as {key.text}"
    example = f"{key.text}: {_EXAMPLES.get(key.text, '30 s')}"
    parsing.reader.problem(key.position, message, [example])
    return True


def _retry(parsing: Parsing, key: Text, value: Source, table: Table) -> Node | None:
    if _all_below(parsing, key, value):
        return None
    common, child = parsing.common(key, table), parsing.child(key, table)
    attempts = parsing.reader.value(value, "retry")
    on, attempt = table.get("on"), table.get("attempt")
    codes = parsing.reader.identifiers(on, "a code in on") if on is not None else ()
    attempt_key = parsing.reader.identifier(attempt, "attempt") if attempt is not None else None
    if child is None or attempts is None:
        return None
    return Retry(child=child, attempts=attempts, on=codes, attempt_key=attempt_key, **common)


def _repeat(parsing: Parsing, key: Text, value: Source, table: Table) -> Node | None:
    if _all_below(parsing, key, value):
        return None
    common, child = parsing.common(key, table), parsing.child(key, table)
    rounds = parsing.reader.value(value, "repeat")
    if child is None or rounds is None:
        return None
    return Repeat(child=child, rounds=rounds, **common)


def _timed(
    parsing: Parsing, key: Text, value: Source, table: Table, kind: type[Timeout | Delay | Cooldown]
) -> Node | None:
    if _all_below(parsing, key, value):
        return None
    common, child = parsing.common(key, table), parsing.child(key, table)
    duration = parsing.reader.value(value, key.text)
    if child is None or duration is None:
        return None
    return kind(child=child, duration=duration, **common)


def _force(parsing: Parsing, key: Text, value: Source, table: Table) -> Node | None:
    if _all_below(parsing, key, value):
        return None
    common, child = parsing.common(key, table), parsing.child(key, table)
    success = parsing.reader.choice(value, "force", FORCED, "success") == "success"
    return Force(child=child, success=success, **common) if child is not None else None


def _wrapper(
    parsing: Parsing, key: Text, value: Source, table: Table, kind: type[Invert | Succeed | Once]
) -> Node | None:
    common, child = parsing.common(key, table), parsing.node(value)
    return kind(child=child, **common) if child is not None else None


DECORATORS: dict[str, Maker] = {
    "retry": _retry,
    "repeat": _repeat,
    "timeout": partial(_timed, kind=Timeout),
    "delay": partial(_timed, kind=Delay),
    "cooldown": partial(_timed, kind=Cooldown),
    "force": _force,
    "once": partial(_wrapper, kind=Once),
    "invert": partial(_wrapper, kind=Invert),
    "succeed": partial(_wrapper, kind=Succeed),
}
"""Kind key -> its parser."""
