"""The part of a scenario under ``skills``: which skill does what."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

from florence_bt.core.declaration import Port, SkillDeclaration
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.plain_yaml import Position, YamlMapping, YamlNode, YamlScalar
from florence_bt.core.skill import Inputs
from florence_bt.mission_testing.mocks._script_text import ScriptError, parse_script
from florence_bt.mission_testing.mocks.board import MockError, check_outputs
from florence_bt.mission_testing.mocks.replies import Ending, Phase, Reply
from florence_bt.mission_testing.mocks.scripts import Script, endless, in_turn, to_step
from florence_bt.mission_testing.paths import MissionMap, Place
from florence_bt.mission_testing.scenarios._reading import Reading, plain
from florence_bt.mission_testing.scenarios.scenario import MockEntry
from florence_bt.mission_testing.values import read_port, same

ENDINGS = ("success", "failure", "cancelled", "never", "raises")
"""The keys of a step of which it has one."""
STEP_KEYS = (*ENDINGS, "running", "saying", "accept_after", "cancel_takes", "reason", "times", "lasts")
SWITCH_KEYS = ("switch", "cases", "default")

Replies = tuple[Reply, ...]
Users = list[tuple[SkillDeclaration, Place | None]]
"""What a script must fit: declarations, and the nodes that start them."""


def read_mocks(
    reading: Reading, source: YamlNode | None, places: MissionMap | None, *, default: bool
) -> list[MockEntry]:
    """Read the mocks under ``skills``.

    Args:
        reading: Notes what is wrong.
        source: The table.
        places: The nodes of the mission; None when it is not known, then less is checked.
        default: Whether they are for the whole file, and need not be used by each mission in it.
    """
    entries = []
    for key, value in reading.table(source, "skills"):
        if default and key.text in reading.library and key.text not in reading.declarations:
            continue  # a mission that is mocked whole where it is called; here it is not
        found = reading.pattern(key, places, skills_only=True, unused=default)
        if found is None and not default:
            continue
        make = _script(reading, key, value, found or [])
        if make is not None:
            entries.append(MockEntry(key.text, make, default, key.position))
    return entries


def _script(
    reading: Reading, key: YamlScalar, value: YamlNode, places: list[Place]
) -> Callable[[], Script] | None:
    """What makes the script of a mock."""
    users: Users = [(reading.declarations[place.skill], place) for place in places if place.skill]
    if "*" in key.text.split("/")[-1]:
        users = []  # other mocks may answer for some of them; the start of the mission tells
    if not users and key.text in reading.declarations:
        users = [(reading.declarations[key.text], None)]
    if isinstance(value, YamlMapping) and value.get("switch") is not None:
        return _switch(reading, key, value, users)
    replies = read_replies(reading, value, users)
    return (lambda: replies) if replies else None


def read_replies(reading: Reading, value: YamlNode, users: Users) -> Replies:
    """Read a script: a text, a step as a table, or a list of both; empty (noted) when it is wrong.

    Args:
        reading: Notes what is wrong.
        value: The script.
        users: Declarations and places that it must fit.
    """
    parts = reading.items(value)
    if not parts:
        reading.problem(value.position, "the script is empty", ["SUCCESS", "running 3 s, then FAILURE"])
    replies: list[Reply] = []
    before = len(reading.findings)
    for part in parts:
        if replies and endless(replies[-1]):
            reading.problem(part.position, "nothing can follow a step that is for always or begins anew")
        read = _from_table(reading, part) if isinstance(part, YamlMapping) else _from_text(reading, part)
        _hold_against(reading, read, part, users)
        replies += read
    return tuple(replies) if len(reading.findings) == before else ()


def _from_text(reading: Reading, source: YamlNode) -> Replies:
    text = reading.text(source, "a script")
    if text is None or not isinstance(source, YamlScalar):
        return ()
    try:
        return parse_script(text)
    except ScriptError as error:
        position = source.position
        if source.first_column is not None:
            position = replace(position, column=source.first_column + error.offset)
        reading.wrong(position, error)
        return ()


def _from_table(reading: Reading, table: YamlMapping) -> Replies:
    entries = reading.entries(table, "a step of a script", STEP_KEYS)
    named = [name for name in ENDINGS if name in entries]
    if len(named) != 1:
        reading.problem(table.position, "a step of a script has exactly one ending", ENDINGS)
        return ()
    reply = Reply(Ending(named[0]))
    for name, (_, value) in entries.items():
        reply = replace(reply, **_field(reading, name, value))
    if "saying" in entries:
        says = reading.text(entries["saying"][1], "saying") or ""
        phases = reply.phases or (Phase(0.0),)
        reply = replace(reply, phases=(replace(phases[0], feedback=says), *phases[1:]))
    return (reply,)


def _field(reading: Reading, name: str, value: YamlNode) -> dict[str, Any]:
    """The fields of a reply that one key of a step gives."""
    match name:
        case "success":
            return {"outputs": {key.text: plain(item) for key, item in reading.table(value, "success")}}
        case "failure" if isinstance(value, YamlScalar) and value.empty:
            return {}
        case "failure":
            code = reading.text(value, "failure") or ""
            return {"code": int(code) if code.isdigit() else code}
        case "raises":
            return {"error": RuntimeError(reading.text(value, "raises") or "")}
        case "running":
            return {"phases": tuple(_phases(reading, value))}
        case "reason":
            return {"reason": reading.text(value, "reason") or ""}
        case "accept_after" | "cancel_takes":
            return {name: reading.duration(value, name) or 0.0}
        case "lasts":
            return {"lasts": reading.duration(value, name)}
        case "times":
            return {"times": reading.whole(value, "times", 1)}
    return {}


def _phases(reading: Reading, value: YamlNode) -> Iterator[Phase]:
    """``3 s``, or a list of ``3 s`` and ``{for: 3 s, saying: text}``."""
    for part in reading.items(value):
        if isinstance(part, YamlMapping):
            entries = reading.entries(part, "a phase", ("for", "saying"))
            if "for" not in entries:
                reading.problem(part.position, "a phase needs a duration", ["{for: 3 s, saying: on the way}"])
                continue
            says = reading.text(entries["saying"][1], "saying") if "saying" in entries else ""
            yield Phase(reading.duration(entries["for"][1], "for") or 0.0, says or "")
        else:
            yield Phase(reading.duration(part, "running") or 0.0)


def _hold_against(reading: Reading, replies: Replies, source: YamlNode, users: Users) -> None:
    """Note what the skills that a script is for cannot do; each problem once."""
    told: set[str] = set()
    for reply in replies:
        for declaration, place in users:
            try:
                step = to_step(reply, declaration)
                if place is not None:
                    check_outputs(step, place)
            except ConfigError as error:
                if error.problem not in told:
                    told.add(error.problem)
                    reading.wrong(_place_of(source, error.problem), error)


def _place_of(source: YamlNode, problem: str) -> Position:
    """Where the word that a problem quotes stands in a script; its beginning when it is not there."""
    quoted = re.search(r"'([^']+)'", problem)
    if not isinstance(source, YamlScalar) or source.first_column is None or quoted is None:
        return source.position
    at = source.text.find(quoted[1])
    return replace(source.position, column=source.first_column + at) if at >= 0 else source.position


def _switch(
    reading: Reading, key: YamlScalar, table: YamlMapping, users: Users
) -> Callable[[], Script] | None:
    """A mock that looks at an input: ``{switch: label, cases: {kitchen: ...}, default: ...}``."""
    entries = reading.entries(table, "a mock with switch", SWITCH_KEYS)
    name = reading.text(entries["switch"][1], "switch")
    port = _port_of(reading, entries["switch"][1], name or "", users)
    cases: list[tuple[Any, Replies]] = []
    for case, value in reading.table(entries["cases"][1] if "cases" in entries else None, "cases"):
        replies = read_replies(reading, value, users)
        if any(reply.lasts is not None for reply in replies):
            problem = "a case of a switch counts its calls and has no time"
            reading.problem(value.position, problem, ["3 times", "once"])
        try:
            cases.append((read_port(case.text, port) if port else case.text, replies))
        except ConfigError as error:
            reading.wrong(case.position, error)
    default = read_replies(reading, entries["default"][1], users) if "default" in entries else ()
    if "cases" not in entries and "default" not in entries:
        reading.problem(table.position, f"the mock {key.text!r} has no cases", ["cases: {kitchen: SUCCESS}"])
    if port is None or name is None or (not cases and not default):
        return None
    return lambda: _choice(name, cases, default)


def _port_of(reading: Reading, source: YamlNode, name: str, users: Users) -> Port | None:
    declarations: list[SkillDeclaration] = [declaration for declaration, _ in users]
    for declaration in declarations:
        if name not in declaration.inputs:
            reading.problem(
                source.position,
                f"{declaration.name} has no input {name!r}",
                closest_first(name, declaration.inputs),
            )
            return None
    if not declarations:
        return None
    return declarations[0].inputs[name]


def _choice(name: str, cases: list[tuple[Any, Replies]], default: Replies) -> Script:
    """The script of a mock with ``switch``; each case counts its own calls."""
    turns = [(value, in_turn(replies)) for value, replies in cases]
    otherwise = in_turn(default)

    def choose(inputs: Inputs) -> Any:
        for value, replies in turns:
            if same(value, inputs[name]):
                return _next(replies, f"{name} {inputs[name]!r}")
        return _next(otherwise, f"{name} {inputs[name]!r}")

    return choose


def _next(replies: Iterator[Any], what: str) -> Any:
    reply = next(replies, None)
    if reply is None:
        raise MockError(f"the mock provides for no (further) call with {what}")
    return reply
