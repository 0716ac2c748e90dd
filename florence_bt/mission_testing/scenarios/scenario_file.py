"""Reads scenario files: YAML with ``given``, ``when`` and ``then`` (docs/manual/testing.md is the grammar).

The parts of this module in order: pieces of the grammar, the mocks under ``skills``, what happens under
``when``, what must hold under ``then``, and the file as a whole.
"""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import Any

from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.errors import ConfigError, close_matches, closest_first
from florence_bt.core.plain_yaml import Position, YamlMapping, YamlNode, YamlScalar, YamlSequence, read_yaml
from florence_bt.core.skill import Inputs
from florence_bt.core.unquoted_commas import unquoted_commas
from florence_bt.mission_testing.mission_tester import MissionTester
from florence_bt.mission_testing.mocks.board import MockError, check_outputs
from florence_bt.mission_testing.mocks.scripts import (
    MockReply,
    Script,
    read_script,
    reply_per_call,
    to_step,
)
from florence_bt.mission_testing.mocks.stubs import MockedMission, copied, mocked_missions, put_stubs
from florence_bt.mission_testing.paths import (
    MissionMap,
    MissionMaps,
    NodeRef,
    Pattern,
    all_declarations,
    matching,
    read_pattern,
    unmatched,
)
from florence_bt.mission_testing.record import INVALID, RUNNING, STATUSES, read_line
from florence_bt.mission_testing.scenarios.scenario import (
    Check,
    Expectation,
    MockEntry,
    Scenario,
    ScenarioRun,
    ScenarioStep,
    Trigger,
)
from florence_bt.mission_testing.test_run import TestRun
from florence_bt.mission_testing.values import read_kind, read_port, same
from florence_bt.runtime.run import RunStatus, TriggerPolicy
from florence_bt.trees.language.findings import Finding, finding_from_error, limit_findings
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission
from florence_bt.trees.language.reader import WordReader
from florence_bt.trees.language.vocabulary import by_spelling

TRIGGER_KEYS = ("policy", "priority", "caller", "refused")
FILE_KEYS = ("mission", "missions", "given", "scenarios")
GIVEN_KEYS = ("inputs", "skills", *(key for key in TRIGGER_KEYS if key != "refused"))
SCENARIO_KEYS = ("name", "mission", "examples", "given", "when", "then")
SWITCH_KEYS = ("switch", "cases", "default")
WHEN_KEYS: dict[str, tuple[str, ...]] = {
    "advance": (),
    "until": ("is",),
    "stop": (),
    "pause": (),
    "resume": (),
    "override": (),
    "release": (),
    "start": ("inputs", *TRIGGER_KEYS, "as"),
    "expect": (),
}
"""Things that can happen -> the further keys of that table. ``at`` may stand with each, and alone."""
_OTHER_EVENTS = by_spelling(
    {
        "advance": ("wait", "sleep", "after", "delay", "for", "passes", "time"),
        "until": ("wait_until", "wait_for", "reach"),
        "stop": ("cancel", "abort", "kill", "end"),
        "resume": ("continue", "go_on", "unpause"),
        "start": ("run", "trigger", "call"),
        "expect": ("assert", "check", "then"),
    }
)
"""People's words for the things that can happen."""
THEN_KEYS = (
    *("status", "code", "reason", "leaf", "outputs", "keys", "duration", "within", "calls", "only_calls"),
    *("called", "not_called", "nodes", "trace", "tree"),
)
"""Keys below ``then`` and ``expect``."""
RUN_STATUSES = tuple(status.value for status in RunStatus)
MAX_SCENARIOS = 10_000
"""Scenarios that one file may have, examples counted."""

_GOES_ON = frozenset({RunStatus.QUEUED, RunStatus.RUNNING, RunStatus.PAUSED, RunStatus.ENDING})
_RUN_CODES = frozenset({"internal_error", "timed_out", "spinning", "failed", "cancelled"})
"""Codes with which the executor itself ends a run, whatever its mission is."""
_STOPS = ("stop", "override", "start")
"""Events that can stop a run: a start may preempt it."""
_REASON = "requested by the scenario"
_THEN = ("then: {status: SUCCEEDED}",)
_SCRIPTS = ("SUCCESS", "running 3 s, then FAILURE no_path twice, then SUCCESS")
_WORD = re.compile(r"\w+")
_PARAMETER = re.compile(r"<([a-z][a-z0-9_]*)>")

Assertion = Callable[[TestRun], object]
Act = Callable[[ScenarioRun], None]
Entries = Mapping[str, YamlNode]
Users = list[tuple[SkillDeclaration, NodeRef | None]]
"""Users of a script, which it must fit: declarations, and the nodes that start them."""


# ---- pieces of the grammar ------------------------------------------------------------------------------


def _where_it_belongs(word: str, value: YamlNode) -> str | None:
    """Write what stands beside the keys of a scenario where it belongs; None when it belongs nowhere."""
    shown = value.text if isinstance(value, YamlScalar) else "..."
    if _OTHER_EVENTS.get(word) == "expect" or word == "expect":
        return f"then: {shown}"
    if word in GIVEN_KEYS:
        return f"given: {{{word}: {shown}}}"
    if word in THEN_KEYS:
        return f"then: {{{word}: {shown}}}"
    event = word if word in WHEN_KEYS else _OTHER_EVENTS.get(word)
    return f"when: [{{{event}: {shown}}}]" if event else None


class SourceReader(WordReader):
    """Reads pieces of a scenario file and collects what is wrong with them.

    Args:
        file: The file.
        library: The missions that it may use.
        maps: Where the maps of missions are kept.
        declarations: The skills by name.
    """

    def __init__(
        self,
        file: Path,
        library: MissionLibrary,
        maps: MissionMaps,
        declarations: Mapping[str, SkillDeclaration],
    ) -> None:
        super().__init__(file)
        self.file = file
        self.library = library
        self.maps = maps
        self.declarations = declarations
        self._added: dict[str, Path] = {}

    def wrong(self, position: Position, error: ConfigError) -> None:
        """Note an error that something else found."""
        self.error(position, error.problem, error.valid)

    def entries(
        self, source: YamlNode | None, what: str, keys: Collection[str]
    ) -> dict[str, tuple[YamlScalar, YamlNode]]:
        """Return the entries of a table that has only these keys."""
        found: dict[str, tuple[YamlScalar, YamlNode]] = {}
        for key, value in self.table(source, what, keys):
            if key.text in keys:
                found[key.text] = (key, value)
            elif keys is SCENARIO_KEYS and (below := _where_it_belongs(key.text, value)):
                self.error(key.position, f"{what} has no key {key.text!r}", [below])
            else:
                self.unknown(key.position, f"{what} has no key {key.text!r}", key.text, keys)
        return found

    def values(self, source: YamlNode | None, what: str, keys: Collection[str]) -> dict[str, YamlNode]:
        """Return the values of a table that has only these keys."""
        return {name: value for name, (_, value) in self.entries(source, what, keys).items()}

    def table(
        self, source: YamlNode | None, what: str, keys: Collection[str] = (), valid: Iterable[str] = ()
    ) -> Iterator[tuple[YamlScalar, YamlNode]]:
        """Yield the entries of a table, none when nothing was written.

        An unquoted comma splits a text into several keys: that is noted, and the text is put together. (A
        single word behind a comma may be a key without its colon, and so may one of the ``keys``.) What is
        not a table is noted, with ``valid`` as what would have worked.
        """
        if isinstance(source, YamlMapping):
            commas = {
                text.key: text
                for text in unquoted_commas(source)
                if text.pieces[0].text not in keys and not _WORD.fullmatch(text.pieces[0].text)
            }
            pieces = {piece for text in commas.values() for piece in text.pieces}
            for key, value in source.entries:
                if key in commas:
                    text = commas[key]
                    message = "text with a comma needs quotes between { and }"
                    self.error(text.first.position, message, [text.valid])
                    yield key, replace(text.first, text=text.whole)
                elif key not in pieces:
                    yield key, value
        elif source is not None and not (isinstance(source, YamlScalar) and source.empty):
            self.error(source.position, f"{what} must be a table (key: value)", valid)

    def items(self, source: YamlNode | None) -> tuple[YamlNode, ...]:
        """Return the items of a list; a single thing counts as a list of one, nothing as none."""
        if source is None or (isinstance(source, YamlScalar) and source.empty):
            return ()
        return source.items if isinstance(source, YamlSequence) else (source,)

    def text(self, source: YamlNode, what: str) -> str | None:
        """Read a text, as it stands there: an empty one in quotes may be what is expected."""
        if isinstance(source, YamlScalar) and (source.quoted or not source.empty):
            return source.text
        self.error(source.position, f"{what} must be text")
        return None

    def whole(self, source: YamlNode, what: str) -> int | None:
        """Read a whole number of at least 0."""
        return self.noted(self.yaml.count, source, what)

    def pattern(
        self,
        key: YamlScalar,
        mission_map: MissionMap | None,
        *,
        skills_only: bool = False,
        unused: bool = False,
    ) -> list[NodeRef] | None:
        """Return the nodes that a pattern means, None (noted) when it is wrong.

        Args:
            key: The pattern.
            mission_map: The nodes of the mission; None when they are not known.
            skills_only: Whether only nodes that run a skill count.
            unused: Whether the name of a skill that the mission does not use is allowed.
        """
        if mission_map is None:
            return []
        candidates = mission_map.uses() if skills_only else list(mission_map.nodes.values())
        try:
            found = matching(key.text, candidates)
        except ConfigError as error:
            self.wrong(key.position, error)
            return None
        if found or (unused and key.text in self.declarations):
            return found
        self.wrong(key.position, unmatched(key.text, mission_map, self.declarations, skills_only=skills_only))
        return None

    def quantities(
        self, source: YamlNode | None, what: str, owner: str, kinds: Mapping[str, Kind | None], **hints: Any
    ) -> dict[str, Any]:
        """Read values by name, in SI units where their kind is known.

        Args:
            source: The table.
            what: What one of them is: an input, an output or a key.
            owner: What has them, for messages.
            kinds: The kind of each that there is.
            **hints: Further arguments of :meth:`table`.
        """
        wanted: dict[str, Any] = {}
        for key, item in self.table(source, f"the {what}s", **hints):
            if key.text not in kinds:
                valid = closest_first(key.text, kinds) or (f"no {what}s",)
                self.error(key.position, f"{owner} has no {what} {key.text!r}", valid)
                continue
            kind = kinds[key.text]
            try:
                wanted[key.text] = plain(item) if kind is None else read_kind(plain(item), kind)
            except ConfigError as error:
                self.wrong(item.position, error)
        return wanted

    def mission(self, source: YamlNode, what: str) -> str | None:
        """Read the name of a mission that can run."""
        name = self.text(source, what)
        if name is None:
            return None
        if name.endswith((".yaml", ".yml")):
            path = Path(os.path.normpath(self.file.parent / name))
            if not path.exists():
                message = f"there is no file {str(path)!r}: paths are counted from the folder of this file"
                meant = [os.path.relpath(name, self.file.parent)] if Path(name).exists() else []
                self.error(source.position, message, meant)
                return None
            name = path.stem
            if self._added.setdefault(name, path) != path:
                message = f"the mission {name!r} is {self._added[name]} in this file already"
                self.error(source.position, message)
            known = self.library.find(name)
            if known is None or known.file != path:
                added = self.library.add_file(path)
                self.library.add_neighbours([added] if added is not None else [])
        try:
            mission = self.library.get(name)
            self.maps.of(mission, self.library, self.declarations)
        except ConfigError as error:
            where = f"{error.file}:{error.line}:{error.column}: " if error.file and error.line else ""
            unknown = name not in self.library and not self.library.unreadable().get(name)
            valid = error.valid
            if unknown:
                folder = "missions: [FOLDER] at the top of this file, with the folder of the missions"
                close = close_matches(name, self.library.names())
                valid = (*close, folder)
            self.error(source.position, f"{where}{error.problem}", valid)
            return None
        return name

    def trigger(self, mission: YamlNode, entries: Entries, what: str) -> Trigger | None:
        """Read how a mission is started.

        Args:
            mission: Its name or file.
            entries: ``inputs`` and the keys of :data:`TRIGGER_KEYS`.
            what: What the name is called, for messages.
        """
        name = self.mission(mission, what)
        # An input that stands there with nothing after it is not given, also when the file gives it to all.
        ports = self.library.get(name).inputs if name is not None else {}
        inputs = {
            key.text: input_text(value, ports.get(key.text))
            for key, value in self.table(entries.get("inputs"), "inputs")
            if not (isinstance(value, YamlScalar) and value.empty)
        }
        options: dict[str, Any] = {}
        if "policy" in entries:
            policies = [policy.value for policy in TriggerPolicy]
            options["policy"] = self.choice(entries["policy"], "policy", policies)
        if "priority" in entries:
            options["priority"] = self.whole(entries["priority"], "priority") or 0
        if "caller" in entries:
            options["caller"] = self.text(entries["caller"], "caller")
        refused = self.text(entries["refused"], "refused") if "refused" in entries else None
        if name is None:
            return None
        if refused is None:
            self._check_inputs(name, entries.get("inputs"), mission, inputs)
        position = entries["refused"].position if "refused" in entries else mission.position
        return Trigger(name, inputs, options, refused, position)

    def _check_inputs(
        self, name: str, source: YamlNode | None, mission: YamlNode, inputs: Mapping[str, str]
    ) -> None:
        ports = self.library.get(name).inputs
        for key, value in self.table(source, "inputs"):
            if key.text not in ports:
                valid = closest_first(key.text, ports) or ("no inputs",)
                self.error(key.position, f"{name} has no input {key.text!r}", valid)
            elif key.text in inputs:
                try:
                    read_port(inputs[key.text], ports[key.text])
                except ConfigError as error:
                    self.wrong(value.position, error)
        missing = [port for port in ports if ports[port].required and port not in inputs]
        if missing:
            place = source.position if source is not None else mission.position
            self.error(place, f"{name} needs the input {' and '.join(missing)}", [f"{missing[0]}: ..."])


def plain(source: YamlNode) -> Any:
    """Return a source as plain texts, lists and tables."""
    match source:
        case YamlScalar():
            return source.text
        case YamlSequence():
            return [plain(item) for item in source.items]
        case YamlMapping():
            return {key.text: plain(value) for key, value in source.entries}


def input_text(source: YamlNode, port: Port | None = None) -> str:
    """Write a mission's input on one line, as a caller would. A sequence that is no list is a pose."""
    match source:
        case YamlScalar():
            return source.text
        case YamlSequence() if port is not None and port.kind.item is not None:
            return f"[{', '.join(input_text(item) for item in source.items)}]"
        case YamlSequence():
            return f"({', '.join(input_text(item) for item in source.items)})"
        case YamlMapping():
            return f"{{{', '.join(f'{key.text}: {input_text(value)}' for key, value in source.entries)}}}"


def _fill_in(
    source: YamlNode, values: Mapping[str, YamlNode], unknown: Callable[[Position, str], object]
) -> YamlNode:
    """Put the values of an example where ``<name>`` stands.

    Args:
        source: The source.
        values: The values by name. One that stands alone may be a list or a table.
        unknown: Called with the position and the name of each that has no value.
    """
    match source:
        case YamlScalar():
            return _fill_in_text(source, values, unknown)
        case YamlSequence():
            return YamlSequence(
                tuple(_fill_in(item, values, unknown) for item in source.items), source.position
            )
        case YamlMapping():
            filled = []
            for key, value in source.entries:
                name = _fill_in_text(key, values, unknown)
                filled.append(
                    (name if isinstance(name, YamlScalar) else key, _fill_in(value, values, unknown))
                )
            return YamlMapping(tuple(filled), source.position)


def _fill_in_text(
    source: YamlScalar, values: Mapping[str, YamlNode], unknown: Callable[[Position, str], object]
) -> YamlNode:
    names = _PARAMETER.findall(source.text)
    if not names:
        return source
    for name in names:
        if name not in values:
            unknown(source.position, name)
            return source
    alone = _PARAMETER.fullmatch(source.text)
    if alone is not None:
        value = values[alone[1]]
        return (
            YamlScalar(value.text, value.quoted, source.position) if isinstance(value, YamlScalar) else value
        )
    text = _PARAMETER.sub(lambda match: input_text(values[match[1]]), source.text)
    return YamlScalar(text, True, source.position)


# ---- skills: which skill does what ----------------------------------------------------------------------


def read_mocks(
    reader: SourceReader, source: YamlNode | None, mission_map: MissionMap | None, *, default: bool
) -> list[MockEntry]:
    """Read the mocks under ``skills``.

    Args:
        reader: Notes what is wrong.
        source: The table.
        mission_map: The nodes of the mission; None when it is not known, then less is checked.
        default: Whether they are for the whole file, and need not be used by each mission in it.
    """
    entries = []
    for key, value in reader.table(source, "skills"):
        if default and key.text in reader.library and key.text not in reader.declarations:
            continue  # a mission that is mocked whole where it is called; here it is not
        found = reader.pattern(key, mission_map, skills_only=True, unused=default)
        if found is None and not default:
            continue
        users: Users = [(reader.declarations[node.skill], node) for node in found or () if node.skill]
        if "*" in key.text.split("/")[-1]:
            users = []  # other mocks may answer for some of them; the start of the mission decides
        if not users and key.text in reader.declarations:
            users = [(reader.declarations[key.text], None)]
        make = _read_mock(reader, value, users)
        if make is not None:
            entries.append(MockEntry(key.text, make, default, key.position))
    return entries


def _read_mock(reader: SourceReader, value: YamlNode, users: Users) -> Callable[[], Script] | None:
    """Return what makes the script of a mock."""
    if isinstance(value, YamlMapping) and value.get("switch") is not None:
        return _read_switch(reader, value, users)
    replies = _read_script(reader, value, users)
    return (lambda: replies) if replies else None


def _read_script(reader: SourceReader, source: YamlNode, users: Users) -> tuple[MockReply, ...]:
    """Read a script; empty (noted) when it is wrong."""
    if not isinstance(source, YamlScalar) or source.empty:
        reader.error(source.position, "a script must be text", _SCRIPTS)
        return ()
    replies, mistakes = read_script(source.text)
    for mistake in mistakes:
        position = source.position
        if source.first_column is not None:
            position = replace(position, column=source.first_column + mistake.offset)
        reader.wrong(position, mistake)
    problems: dict[str, ConfigError] = {}
    for reply in replies:
        for declaration, node in users:
            try:
                step = to_step(reply, declaration)
                if node is not None:
                    check_outputs(step, node, declaration)
            except ConfigError as error:
                problems.setdefault(error.problem, error)
    for problem, found in problems.items():
        reader.wrong(_quoted_position(source, problem), found)
    return () if mistakes or problems else replies


def _quoted_position(source: YamlScalar, problem: str) -> Position:
    """Return where the word that a problem quotes stands in a script; its beginning when it is not there."""
    quoted = re.search(r"'([^']+)'", problem)
    if source.first_column is None or quoted is None:
        return source.position
    at = source.text.find(quoted[1])
    return replace(source.position, column=source.first_column + at) if at >= 0 else source.position


def _read_switch(reader: SourceReader, table: YamlMapping, users: Users) -> Callable[[], Script] | None:
    """Read a mock that looks at an input: ``{switch: label, cases: {kitchen: ...}, default: ...}``."""
    entries = reader.values(table, "a mock with switch", SWITCH_KEYS)
    name = reader.text(entries["switch"], "switch")
    port = _port_of(reader, entries["switch"], name or "", users)
    cases: list[tuple[Any, tuple[MockReply, ...]]] = []
    for case, value in reader.table(entries.get("cases"), "cases"):
        replies = _read_script(reader, value, users)
        if any(reply.lasts is not None for reply in replies):
            problem = "a case of a switch counts its calls and has no time"
            reader.error(value.position, problem, ["3 times", "once"])
        try:
            cases.append((read_port(case.text, port) if port else case.text, replies))
        except ConfigError as error:
            reader.wrong(case.position, error)
    default = _read_script(reader, entries["default"], users) if "default" in entries else ()
    if "cases" not in entries and "default" not in entries:
        reader.error(table.position, "the mock has no cases", ["cases: {kitchen: SUCCESS}"])
    if port is None or name is None or (not cases and not default):
        return None
    return lambda: _choice(name, cases, default)


def _port_of(reader: SourceReader, source: YamlNode, name: str, users: Users) -> Port | None:
    for declaration, _ in users:
        if name not in declaration.inputs:
            message = f"{declaration.name} has no input {name!r}"
            reader.unknown(source.position, message, name, declaration.inputs)
            return None
    return users[0][0].inputs[name] if users else None


def _choice(
    name: str, cases: list[tuple[Any, tuple[MockReply, ...]]], default: tuple[MockReply, ...]
) -> Script:
    """Make the script of a mock with ``switch``; each case counts its own calls."""
    calls = [(value, reply_per_call(replies)) for value, replies in cases]
    otherwise = reply_per_call(default)

    def choose(inputs: Inputs) -> Any:
        found = next((replies for value, replies in calls if same(value, inputs[name])), otherwise)
        reply = next(found, None)
        if reply is None:
            raise MockError(f"the mock has no (further) answer for a call with {name} {inputs[name]!r}")
        return reply

    return choose


# ---- when: what happens while the mission runs ----------------------------------------------------------


class WhenReader:
    """Reads the list under ``when``.

    Args:
        reader: Notes what is wrong.
        mission_map: The nodes of the scenario's mission; None when it is not known.

    Attributes:
        started: The nodes of the missions that it starts, by the names that ``as`` gives them.
    """

    def __init__(self, reader: SourceReader, mission_map: MissionMap | None) -> None:
        self.started: dict[str, MissionMap] = {}
        self._reader = reader
        self._mission_map = mission_map

    def read(self, source: YamlNode | None) -> Iterator[ScenarioStep]:
        """Read what happens, in order."""
        for item in self._reader.items(source):
            if not isinstance(item, YamlMapping):
                self._refuse(item)
                continue
            kind = self._kind(item)
            act = self._act(item, kind) if kind is not None else None
            if kind is not None and act is not None:
                yield ScenarioStep(kind, act, item.position)

    def _refuse(self, item: YamlNode) -> None:
        word, _, rest = item.text.strip().partition(" ") if isinstance(item, YamlScalar) else ("", "", "")
        if not word or word in WHEN_KEYS:
            valid = [f"{word}: {rest}".strip()] if word else ["advance: 3 s", "stop:"]
            self._reader.error(item.position, "an event must be a table (key: value)", valid)
        else:
            self._unknown(item.position, f"{word} {rest}".strip())

    def _unknown(self, position: Position, name: str, value: str = "") -> None:
        """Note an event that there is not; ``value`` is what stands behind its colon."""
        word, _, rest = name.partition(" ")
        known = (*WHEN_KEYS, "at")
        meant = word if word in known and rest else _OTHER_EVENTS.get(word.lower())
        valid = (f"{meant}: {rest or value}".strip(),) if meant else closest_first(name, known)
        self._reader.error(position, f"there is no event {name!r}", valid)

    def _kind(self, table: YamlMapping) -> str | None:
        """Return the key that says what happens; ``at`` when only time passes."""
        kinds = [key for key, _ in table.entries if key.text in WHEN_KEYS]
        if len(kinds) > 1:
            message = f"{kinds[1].text!r} cannot be combined with {kinds[0].text!r}"
            valid = [f"an entry of its own: - {kinds[1].text}: ..."]
            self._reader.error(kinds[1].position, message, valid)
            return None
        if kinds:
            return kinds[0].text
        unknown = next((key for key, _ in table.entries if key.text != "at"), None)
        if unknown is not None:
            value = table.get(unknown.text)
            given = value.text if isinstance(value, YamlScalar) else "..."
            self._unknown(unknown.position, unknown.text, given)
        elif not table.entries:
            self._reader.error(table.position, "nothing happens here", list(WHEN_KEYS))
        return "at" if table.entries and unknown is None else None

    def _act(self, table: YamlMapping, kind: str) -> Act | None:
        entries = self._reader.values(table, kind, (kind, *WHEN_KEYS.get(kind, ()), "at"))
        act: Act | None = (lambda run: None) if kind == "at" else self._action(kind, entries)
        at = self._reader.duration(entries["at"], "at") if "at" in entries else None
        if at is None or act is None:
            return act

        def wait_then_act(run: ScenarioRun) -> None:
            wait = at + run.test_run.started - run.tester.now
            if wait < -1e-6:
                raise AssertionError(f"at {at:g} s has passed already")
            run.tester.advance(max(0.0, wait))
            act(run)

        return wait_then_act

    def _action(self, kind: str, entries: Entries) -> Act | None:
        match kind:
            case "advance":
                seconds = self._reader.duration(entries["advance"], "advance")
                return (lambda run: run.tester.advance(seconds)) if seconds is not None else None
            case "until":
                return self._until(entries)
            case "start":
                return self._start(entries)
            case "expect":
                return self._expect(entries["expect"])
            case "resume":
                return lambda run: run.tester.resume()
            case "release":
                return lambda run: run.tester.release()
        source = entries[kind]
        empty = isinstance(source, YamlScalar) and source.empty
        reason = _REASON if empty else self._reader.text(source, "a reason") or _REASON
        do = {"stop": MissionTester.stop, "pause": MissionTester.pause, "override": MissionTester.override}[
            kind
        ]
        return lambda run: do(run.tester, reason)

    def _until(self, entries: Entries) -> Act | None:
        pattern = entries["until"]
        name = self._reader.text(pattern, "until")
        status = RUNNING
        if "is" in entries:
            status = self._reader.choice(entries["is"], "status", STATUSES) or ""
        if not isinstance(pattern, YamlScalar) or not name or not status:
            return None
        if self._reader.pattern(pattern, self._mission_map) is None:
            return None
        return lambda run: _wait_for(run, name, status)

    def _expect(self, source: YamlNode) -> Act:
        expectation = ThenReader(self._reader, self._mission_map).read(source, "expect")
        if (isinstance(source, YamlScalar) and source.empty) or (
            isinstance(source, YamlMapping) and not source.entries
        ):
            valid = ["expect: {status: RUNNING}"]
            self._reader.error(source.position, "nothing is expected here", valid)
        return lambda run: run.expect(expectation)

    def _start(self, entries: Entries) -> Act | None:
        reader = self._reader
        trigger = reader.trigger(entries["start"], entries, "start")
        if trigger is None:
            return None
        name = trigger.mission
        if "as" in entries:
            name = reader.text(entries["as"], "as") or name
        if name in self.started:
            position = entries.get("as", entries["start"]).position
            message = f"something else is called {name!r} here already"
            reader.error(position, message, [f"as: second_{trigger.mission}"])
        mission = reader.library.get(trigger.mission)
        self.started[name] = reader.maps.of(mission, reader.library, reader.declarations)
        return lambda run: run.start(trigger, name)


def _wait_for(run: ScenarioRun, pattern: str, status: str) -> None:
    run.tester.run_until(pattern, status, test_run=run.test_run)


# ---- then: what must hold -------------------------------------------------------------------------------


class ThenReader:
    """Reads a table under ``then`` or ``expect``.

    Args:
        reader: Notes what is wrong.
        mission_map: The nodes of the mission; None when it is not known.
    """

    def __init__(self, reader: SourceReader, mission_map: MissionMap | None) -> None:
        self._reader = reader
        self._mission_map = mission_map

    def read(self, source: YamlNode | None, what: str, happens: Collection[str] | None = None) -> Expectation:
        """Read a table.

        Args:
            source: The table.
            what: What the table is called, for messages.
            happens: What happens before; None when that is not known.
        """
        reader = self._reader
        if isinstance(source, YamlScalar) and source.text.upper() in RUN_STATUSES:
            valid = [f"{what}: {{status: {source.text.upper()}}}"]
            reader.error(source.position, f"{what} must be a table (key: value)", valid)
            source = None
        entries = reader.entries(source, what, THEN_KEYS)
        checks: list[Check] = []
        for name, (key, value) in entries.items():
            before = reader.count
            assertions = list(self._assertions(name, value))
            known = self._mission_map is not None  # else an error has been noted already
            if known and not assertions and reader.count == before:
                reader.error(key.position, f"{name} expects nothing", ["leaving it out"])
            checks += [Check(assertion, key.position) for assertion in assertions]
        written = entries["status"][1] if "status" in entries else None
        known = isinstance(written, YamlScalar) and written.text in RUN_STATUSES
        status = RunStatus(written.text) if isinstance(written, YamlScalar) and known else None
        self._check_code(entries["code"][1] if "code" in entries else None, status)
        if written is not None and happens is not None:
            self._check_status(written.position, status, happens)
        return Expectation(tuple(checks), status in _GOES_ON)

    def _check_code(self, source: YamlNode | None, status: RunStatus | None) -> None:
        """Note a code with which the mission can never end."""
        if not isinstance(source, YamlScalar) or self._mission_map is None or not source.text:
            return
        fails = self._mission_map.outcomes.codes | _RUN_CODES
        known = {
            None: {"ok", "stopped", *fails},
            RunStatus.SUCCEEDED: {"ok"},
            RunStatus.STOPPED: {"stopped"},
            RunStatus.FAILED: fails,
        }.get(status)
        if known is None or source.text in known:
            return
        word = f"a run that is {status.value}" if status is not None else ""
        if status is None or status is RunStatus.FAILED:
            word = self._mission_map.mission
        message = f"{word} cannot end with the code {source.text!r}"
        self._reader.unknown(source.position, message, source.text, known)

    def _check_status(self, position: Position, status: RunStatus | None, happens: Collection[str]) -> None:
        """Note a status that nothing under ``when`` can bring about."""
        wanted = {RunStatus.STOPPED: _STOPS, RunStatus.PAUSED: ("pause",)}.get(status) if status else None
        if status and wanted and not any(word in happens for word in wanted):
            message = f"the run cannot be {status.value}: nothing under 'when' does that"
            self._reader.error(position, message, [f"when: [{{at: 3 s, {wanted[0]}: enough}}]"])

    def _assertions(self, name: str, value: YamlNode) -> Iterator[Assertion]:
        match name:
            case "status":
                status = self._reader.choice(value, "status", RUN_STATUSES)
                if status is not None:
                    yield partial(TestRun.assert_status, status=status)
            case "code" | "reason":
                text = self._reader.text(value, name)
                if text is not None:
                    yield lambda test_run: test_run.assert_why(**{name: text})
            case "leaf":
                if self._is_pattern(value, name, skills_only=False):
                    yield partial(TestRun.assert_why, leaf=plain(value))
            case "outputs":
                yield from self._outputs(value)
            case "keys":
                outcomes = self._mission_map.outcomes if self._mission_map is not None else None
                if outcomes is not None:
                    kinds = {key: outcomes.kinds.get(key) for key in outcomes.keys}
                    keys = self._reader.quantities(value, "key", self._mission, kinds)
                    if keys:
                        yield partial(TestRun.assert_keys, keys=keys)
            case "duration" | "within":
                seconds = self._reader.duration(value, "a duration")
                if seconds is not None:
                    yield lambda test_run: test_run.assert_duration(seconds, at_most=name == "within")
            case "calls" | "only_calls":
                yield from self._calls(value, only=name == "only_calls")
            case "called":
                yield from self._called(value)
            case "not_called":
                for item in self._reader.items(value):
                    if self._is_pattern(item, "a skill", skills_only=True, unused=True):
                        yield partial(_assert_called, pattern=plain(item), times=0)
            case "nodes":
                yield from self._nodes(value)
            case "trace":
                yield from self._trace(value)
            case "tree":
                text = self._reader.text(value, name)
                if text is not None:
                    yield partial(TestRun.assert_tree, expected=text)

    @property
    def _mission(self) -> str:
        return self._mission_map.mission if self._mission_map is not None else ""

    def _is_pattern(self, source: YamlNode, what: str, *, skills_only: bool, unused: bool = False) -> bool:
        """Tell whether a source is a pattern that means a node; if not, that is noted."""
        if self._reader.text(source, what) is None or not isinstance(source, YamlScalar):
            return False
        found = self._reader.pattern(source, self._mission_map, skills_only=skills_only, unused=unused)
        return found is not None

    def _outputs(self, value: YamlNode) -> Iterator[Assertion]:
        """Read outputs by name; an empty table stands for none at all."""
        if self._mission_map is None:
            return
        kinds = {name: port.kind for name, port in self._mission_map.outputs.items()}
        outputs = self._reader.quantities(value, "output", self._mission, kinds)
        if isinstance(value, YamlMapping) and not value.entries:
            yield _assert_no_outputs
        elif outputs:
            yield partial(TestRun.assert_outputs, outputs=outputs)

    def _calls(self, value: YamlNode, *, only: bool) -> Iterator[Assertion]:
        """Read calls in their order: patterns, or tables of a pattern and inputs."""
        wanted: list[tuple[str, Mapping[str, Any]]] = []
        for item in self._reader.items(value):
            if isinstance(item, YamlScalar):
                pairs: tuple[tuple[YamlScalar, YamlNode | None], ...] = ((item, None),)
            elif isinstance(item, YamlMapping) and len(item.entries) == 1:
                pairs = item.entries
            else:
                valid = ["turn: {angle: 45 deg}"]
                self._reader.error(item.position, "a call is a skill, or a skill and inputs", valid)
                continue
            for key, inputs in pairs:
                found = self._reader.pattern(key, self._mission_map, skills_only=True)
                if found is not None:
                    wanted.append((key.text, self._inputs(inputs, found)))
        if wanted or only:
            yield lambda test_run: test_run.assert_calls(wanted, only=only)

    def _inputs(self, source: YamlNode | None, users: list[NodeRef]) -> dict[str, Any]:
        """Read the inputs that a call must have, in SI units."""
        wanted: dict[str, Any] = {}
        is_count = isinstance(source, YamlScalar) and source.text.isdigit()
        before = self._reader.count
        for skill in dict.fromkeys(node.skill for node in users if node.skill):
            kinds = {name: port.kind for name, port in self._reader.declarations[skill].inputs.items()}
            valid = [f"called: {{{skill}: {plain(source)}}}"] if is_count and source is not None else []
            wanted |= self._reader.quantities(source, "input", skill, kinds, valid=valid)
            if self._reader.count > before:
                break
        return wanted

    def _called(self, value: YamlNode) -> Iterator[Assertion]:
        """Read numbers of calls by pattern; or a list of patterns that were called at least once."""
        if not isinstance(value, YamlMapping):
            for item in self._reader.items(value):
                if self._is_pattern(item, "a skill", skills_only=True):
                    yield partial(_assert_called, pattern=plain(item), times=None)
            return
        for key, item in value.entries:
            users = self._reader.pattern(key, self._mission_map, skills_only=True, unused=True)
            if users is None:
                continue
            inputs: dict[str, Any] = {}
            count = item.get("times") if isinstance(item, YamlMapping) else item
            times = self._reader.whole(count, "a number of calls") if count is not None else None
            if isinstance(item, YamlMapping):
                rest = tuple((name, each) for name, each in item.entries if name.text != "times")
                inputs = self._inputs(YamlMapping(rest, item.position), users)
            yield partial(_assert_called, pattern=key.text, times=times, inputs=inputs)

    def _nodes(self, value: YamlNode) -> Iterator[Assertion]:
        """Read statuses by pattern: every node that it means has the status."""
        for key, item in self._reader.table(value, "nodes"):
            status = self._reader.choice(item, "status", STATUSES)
            if status is not None and self._reader.pattern(key, self._mission_map) is not None:
                yield partial(_assert_nodes, pattern=key.text, status=status)

    def _trace(self, value: YamlNode) -> Iterator[Assertion]:
        """Read the lines of a trace, or a table of ``of`` (a pattern), ``inner`` and ``lines``."""
        pattern, inner, source = "**", False, value
        if isinstance(value, YamlMapping):
            entries = self._reader.values(value, "trace", ("of", "inner", "lines"))
            if "of" in entries:
                if not self._is_pattern(entries["of"], "of", skills_only=False):
                    return
                pattern = plain(entries["of"])
            if "inner" in entries:
                inner = self._reader.choice(entries["inner"], "value", ("true", "false")) == "true"
            if "lines" not in entries:
                self._reader.error(value.position, "the trace has no lines", ["lines: [...]"])
                return
            source = entries["lines"]
        lines = [line for item in self._reader.items(source) for line in self._trace_lines(item)]
        if lines or isinstance(source, YamlSequence):
            yield lambda test_run: test_run.assert_trace("\n".join(lines), pattern, inner=inner)

    def _trace_lines(self, item: YamlNode) -> Iterator[str]:
        """Read the lines in one item of a list: one, or those of a block of text."""
        for text in (self._reader.text(item, "a line of a trace") or "").splitlines():
            try:
                line = read_line(text)
            except ConfigError as error:
                self._reader.wrong(item.position, error)
                continue
            if (
                self._reader.pattern(YamlScalar(line.node, True, item.position), self._mission_map)
                is not None
            ):
                yield text


def _assert_no_outputs(test_run: TestRun) -> None:
    if test_run.outputs:
        test_run.fail(f"{test_run.run.mission} gave the outputs {', '.join(test_run.outputs)}, not none")


def _assert_called(
    test_run: TestRun, pattern: str, times: int | None, inputs: Mapping[str, Any] | None = None
) -> None:
    test_run.assert_called(pattern, times=times, inputs=inputs)


def _assert_nodes(test_run: TestRun, pattern: str, status: str) -> None:
    for node in matching(pattern, test_run.mission_map.nodes.values()):
        now = test_run.record.statuses.get(node.path, INVALID)
        if now != status:
            test_run.fail(f"{node.short} is {now}, not {status}")


# ---- the file -------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class ScenarioFile:
    """The contents of a scenario file.

    Attributes:
        file: The file.
        scenarios: Its scenarios in order, those with examples once for each; those with errors are left out.
        findings: What is wrong with it, in order.
    """

    file: Path
    scenarios: tuple[Scenario, ...]
    findings: tuple[Finding, ...]


class Libraries:
    """The missions that scenario files use, loaded once for each list of folders.

    Args:
        folders: Folders of missions for every file, beside those that a file names.
        instead: Missions that count instead of what their files say.
    """

    def __init__(self, folders: tuple[Path, ...] = (), instead: Iterable[Mission] = ()) -> None:
        self.declarations: Mapping[str, SkillDeclaration] = all_declarations()
        self._folders = folders
        self._instead = tuple(instead)
        self._known: dict[tuple[Path, ...], tuple[MissionLibrary, MissionMaps]] = {}

    def load(self, home: Path, folders: tuple[Path, ...]) -> tuple[MissionLibrary, MissionMaps]:
        """Load the missions of the package, of the common folders and of these, with their maps.

        Args:
            home: The folder of the scenario file; missions that it names by file join the library.
            folders: Further folders of missions.

        Raises:
            ConfigError: A folder does not exist.
        """
        if (home, *folders) not in self._known:
            library = MissionLibrary.load([*self._folders, *folders])
            for mission in self._instead:
                library.put(mission)
            self._known[home, *folders] = library, MissionMaps()
        return self._known[home, *folders]

    def own_missions(self) -> Iterator[tuple[Mission, MissionLibrary]]:
        """Yield the missions of the folders that scenario files and the caller name, each with its library;
        those of Florence and of other packages are left out.
        """
        for (_, *folders), (library, _) in self._known.items():
            own = {folder.resolve() for folder in (*self._folders, *folders)}
            yield from ((each, library) for each in library if each.file.parent.resolve() in own)


def read_scenarios(file: Path, libraries: Libraries) -> ScenarioFile:
    """Read a scenario file. Nothing is raised: what is wrong is in the findings."""
    try:
        source = read_yaml(file)
    except ConfigError as error:
        return ScenarioFile(file, (), (finding_from_error(error),))
    reader = SourceReader(file, MissionLibrary(), MissionMaps(), libraries.declarations)
    scenarios = list(_FileReader(reader, libraries).scenarios(source))
    return ScenarioFile(file, tuple(scenarios), tuple(limit_findings(reader.findings)))


_Surroundings = tuple[MissionLibrary, Mapping[str, SkillDeclaration], MissionMaps]
"""The missions and skills that a scenario is read with: as the folders have them, or with stubs."""


class _FileReader:
    def __init__(self, reader: SourceReader, libraries: Libraries) -> None:
        self._reader = reader
        self._libraries = libraries
        self._mission: YamlNode | None = None
        self._given: dict[str, YamlNode] = {}
        self._names: dict[str, int] = {}
        self._mocks: dict[tuple[str, tuple[MockedMission, ...]], list[MockEntry]] = {}
        self._not_playable: set[tuple[str, tuple[MockedMission, ...]]] = set()
        self._stubs: tuple[MockedMission, ...] = ()
        self._surroundings: dict[tuple[MockedMission, ...], _Surroundings] = {}

    def scenarios(self, source: YamlNode) -> Iterator[Scenario]:
        reader = self._reader
        if not isinstance(source, YamlMapping):
            reader.error(source.position, "a scenario file must be a table", FILE_KEYS)
            return
        top = reader.values(source, "a scenario file", FILE_KEYS)
        self._load_missions(top.get("missions"))
        self._mission = top.get("mission")
        self._given = reader.values(top.get("given"), "given", GIVEN_KEYS)
        if "scenarios" not in top:
            valid = ["scenarios: [{name: ..., then: ...}]"]
            reader.error(source.position, "the file has no scenarios", valid)
            return
        count = 0
        for item in reader.items(top["scenarios"]):
            for values, filled in self._examples(item):
                count += 1
                if count > MAX_SCENARIOS:
                    reader.error(item.position, f"the file has more than {MAX_SCENARIOS} scenarios")
                    return
                yield from self._scenario(filled, values)

    def _load_missions(self, source: YamlNode | None) -> None:
        reader = self._reader
        folders = []
        for item in reader.items(source):
            name = reader.text(item, "a folder of missions")
            folder = Path(os.path.normpath(reader.file.parent / name)) if name else None
            if folder is not None and not folder.is_dir():
                reader.error(item.position, f"there is no folder {str(folder)!r}")
            elif folder is not None:
                folders.append(folder)
        library, maps = self._libraries.load(reader.file.parent.resolve(), tuple(folders))
        # Skills that are only declared, beside missions that were imported, are mocked like any other.
        declarations = library.with_declared(self._libraries.declarations)
        self._surroundings[()] = library, declarations, maps
        reader.library, reader.declarations, reader.maps = self._surroundings[()]

    def _examples(self, item: YamlNode) -> Iterator[tuple[dict[str, YamlNode], YamlNode]]:
        """Yield a scenario once for each of its examples, filled in."""
        reader = self._reader
        source = item.get("examples") if isinstance(item, YamlMapping) else None
        if source is None or not isinstance(item, YamlMapping):
            yield {}, item
            return
        rest = YamlMapping(tuple(e for e in item.entries if e[0].text != "examples"), item.position)
        examples = list(_example_rows(reader, source))
        if not examples:
            reader.error(source.position, "there are no examples", ["[{room: kitchen}, {room: hall}]"])
        for values in examples:
            unknown: dict[Position, str] = {}
            filled = _fill_in(rest, values, unknown.setdefault)
            for position, name in unknown.items():
                reader.unknown(position, f"the examples have no {name!r}", name, values)
            if not unknown:
                yield values, filled

    def _scenario(self, item: YamlNode, values: dict[str, YamlNode]) -> Iterator[Scenario]:
        reader = self._reader
        before = reader.count
        entries = reader.values(item, "a scenario", SCENARIO_KEYS)
        if not isinstance(item, YamlMapping):
            return
        name = self._name(item, entries.get("name"), values)
        own = reader.values(entries.get("given"), "given", GIVEN_KEYS)
        then, refused, others = _split_then(entries.get("then"))
        if isinstance(then, YamlScalar) and then.empty:
            then = None
        mission = entries.get("mission", self._mission)
        if mission is None:
            reader.error(item.position, "the scenario names no mission", ["mission: goto_user"])
            return
        merged = {**self._given, **own, "inputs": _merged(self._given.get("inputs"), own.get("inputs"))}
        given = {key: value for key, value in {**merged, "refused": refused}.items() if value is not None}
        trigger = reader.trigger(mission, given, "mission")
        self._use_stubs(trigger.mission if trigger is not None else None, own.get("skills"))
        mission_map = self._map_of(trigger.mission) if trigger is not None else None
        own_mocks = read_mocks(reader, own.get("skills"), mission_map, default=False)
        mocks = [*self._common_mocks(mission_map), *own_mocks]
        known = reader.count
        when = WhenReader(reader, mission_map)
        happenings = tuple(when.read(entries.get("when")))
        happens = [each.kind for each in happenings] if reader.count == known else None
        expectations = {"": ThenReader(reader, mission_map).read(then, "then", happens)}
        expectations |= self._runs(others, when.started)
        self._check_expecting(item, then, len(expectations) > 1, refused is not None)
        if reader.count > before or trigger is None:
            return
        if (trigger.mission, self._stubs) in self._not_playable:
            return
        yield Scenario(
            name,
            reader.file,
            item.position,
            trigger,
            tuple(mocks),
            happenings,
            expectations,
            reader.library,
            reader.maps,
            self._libraries.declarations,
        )

    def _runs(self, source: YamlNode | None, started: Mapping[str, MissionMap]) -> dict[str, Expectation]:
        """Read what must hold of the missions that the scenario starts beside its own."""
        reader = self._reader
        runs: dict[str, Expectation] = {}
        for key, value in reader.table(source, "runs"):
            if key.text not in started:
                message = f"no run is called {key.text!r}"
                reader.unknown(key.position, message, key.text, started)
                continue
            runs[key.text] = ThenReader(reader, started[key.text]).read(value, "then")
            if isinstance(value, YamlScalar) and value.empty:
                reader.error(key.position, f"nothing is expected of the run {key.text!r}", _THEN)
        return runs

    def _check_expecting(self, item: YamlMapping, then: YamlNode | None, runs: bool, refused: bool) -> None:
        """See that something is expected, and nothing of a mission that does not run."""
        entries = then.entries if isinstance(then, YamlMapping) else ()
        if refused and entries:
            key = entries[0][0]
            message = f"{key.text} can never hold: a mission that is refused does not run"
            self._reader.error(key.position, message, ["leaving it out"])
        empty = isinstance(then, YamlMapping) and not entries and not runs and not refused
        unknown = [key.text for key, _ in item.entries if key.text not in SCENARIO_KEYS]
        if empty or (then is None and not get_close_matches("then", unknown)):
            self._reader.error(item.position, "the scenario expects nothing", _THEN)

    def _common_mocks(self, mission_map: MissionMap | None) -> list[MockEntry]:
        """Return the mocks for the whole file, held against each mission once."""
        key = (mission_map.mission if mission_map is not None else "", self._stubs)
        if key not in self._mocks:
            before = self._reader.count
            self._mocks[key] = read_mocks(self._reader, self._given.get("skills"), mission_map, default=True)
            if self._reader.count > before:
                self._not_playable.add(key)
        return self._mocks[key]

    def _use_stubs(self, mission: str | None, own: YamlNode | None) -> None:
        """Let stubs stand for the called missions that the mocks of the next scenario name."""
        reader = self._reader
        self._stubs = ()
        reader.library, reader.declarations, reader.maps = self._surroundings[()]
        if mission is None:
            return
        tables = [each for each in (self._given.get("skills"), own) if isinstance(each, YamlMapping)]
        patterns = list(_readable_patterns(key.text for table in tables for key, _ in table.entries))
        self._stubs = mocked_missions(patterns, self._map_of(mission), reader.declarations)
        if self._stubs not in self._surroundings:
            library = copied(reader.library)
            put_stubs(self._stubs, library, reader.declarations)
            declarations = library.with_declared(self._libraries.declarations)
            self._surroundings[self._stubs] = library, declarations, MissionMaps()
        reader.library, reader.declarations, reader.maps = self._surroundings[self._stubs]

    def _map_of(self, mission: str) -> MissionMap:
        reader = self._reader
        return reader.maps.of(reader.library.get(mission), reader.library, reader.declarations)

    def _name(self, item: YamlMapping, source: YamlNode | None, values: Mapping[str, YamlNode]) -> str:
        name = self._reader.text(source, "name") if source is not None else None
        if not name:
            self._reader.error(item.position, "the scenario has no name", ["name: the room is unknown"])
            name = "?"
        if values and name in self._names:
            name += f" [{', '.join(f'{key}={input_text(value)}' for key, value in values.items())}]"
        if name in self._names:
            message = f"two scenarios are called {name!r} (the first in line {self._names[name]})"
            valid = ["another name", *(["name: ... <parameter>"] if values else [])]
            self._reader.error(item.position, message, valid)
        self._names[name] = item.position.line
        return name


def _example_rows(reader: SourceReader, source: YamlNode) -> Iterator[dict[str, YamlNode]]:
    """Read a list of tables; or a table of columns, each a list of the same length."""
    if isinstance(source, YamlMapping):
        columns = {key.text: reader.items(value) for key, value in source.entries}
        lengths = {len(column) for column in columns.values()}
        if len(lengths) > 1:
            reader.error(source.position, "the columns of the examples have different lengths")
            return
        for cells in zip(*columns.values(), strict=True):
            yield dict(zip(columns, cells, strict=True))
        return
    for item in reader.items(source):
        row = {key.text: value for key, value in reader.table(item, "an example")}
        if row:
            yield row


def _readable_patterns(texts: Iterable[str]) -> Iterator[Pattern]:
    """Yield the patterns; a text that is not one is reported where the mocks are read."""
    for text in texts:
        with contextlib.suppress(ConfigError):
            yield read_pattern(text)


def _merged(common: YamlNode | None, own: YamlNode | None) -> YamlNode | None:
    """Merge two tables; what the second says counts."""
    if not isinstance(common, YamlMapping) or not isinstance(own, YamlMapping):
        return own if own is not None else common
    kept = tuple(entry for entry in common.entries if own.key(entry[0].text) is None)
    return YamlMapping((*kept, *own.entries), own.position)


def _split_then(source: YamlNode | None) -> tuple[YamlNode | None, YamlNode | None, YamlNode | None]:
    """Split ``then`` into the rest, ``refused`` and ``runs``."""
    if not isinstance(source, YamlMapping):
        return source, None, None
    rest = tuple(entry for entry in source.entries if entry[0].text not in ("refused", "runs"))
    return YamlMapping(rest, source.position), source.get("refused"), source.get("runs")
