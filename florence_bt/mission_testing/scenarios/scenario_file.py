"""Reads scenario files: YAML with ``given``, ``when`` and ``then`` (docs/testing.md is its grammar)."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.plain_yaml import Position, YamlMapping, YamlNode, YamlScalar, read_yaml
from florence_bt.mission_testing.known import MissionMaps, all_declarations
from florence_bt.mission_testing.mocks.stubs import copied, mocked_missions, put_stubs
from florence_bt.mission_testing.paths import MissionMap, Pattern, read_pattern
from florence_bt.mission_testing.scenarios._reading import Reading, fill_in, input_text
from florence_bt.mission_testing.scenarios._scenario_checks import read_expectation
from florence_bt.mission_testing.scenarios._scenario_events import TRIGGER_KEYS, read_happenings, read_trigger
from florence_bt.mission_testing.scenarios._scenario_mocks import read_mocks
from florence_bt.mission_testing.scenarios.scenario import Expectation, MockEntry, Scenario
from florence_bt.trees.language.findings import Finding, finding_from_error, sort_findings
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission

FILE_KEYS = ("mission", "missions", "given", "scenarios")
GIVEN_KEYS = ("inputs", "skills", *(key for key in TRIGGER_KEYS if key != "refused"))
SCENARIO_KEYS = ("name", "mission", "examples", "given", "when", "then")
_THEN = ("then: {status: SUCCEEDED}",)
MAX_SCENARIOS = 10_000
"""How many scenarios one file may have, examples counted."""


@dataclass(frozen=True, slots=True)
class ScenarioFile:
    """What a file holds.

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
        declarations: The skills; all that are installed when not given.
    """

    def __init__(
        self, folders: tuple[Path, ...] = (), declarations: Mapping[str, SkillDeclaration] | None = None
    ) -> None:
        self.declarations = declarations if declarations is not None else all_declarations()
        self.maps = MissionMaps()
        self._folders = folders
        self._known: dict[tuple[Path, ...], MissionLibrary] = {}

    def load(self, home: Path, folders: tuple[Path, ...]) -> MissionLibrary:
        """The missions of the package, of the common folders and of these.

        Args:
            home: The folder of the scenario file; missions that it names by file join the library.
            folders: Further folders of missions.

        Raises:
            ConfigError: A folder does not exist.
        """
        if (home, *folders) not in self._known:
            self._known[home, *folders] = MissionLibrary.load([*self._folders, *folders])
        return self._known[home, *folders]

    def own_missions(self) -> Iterator[tuple[Mission, MissionLibrary]]:
        """The missions of the folders that scenario files and the caller name, each with its library; those
        of Florence and of other packages are none of them.
        """
        for (_, *folders), library in self._known.items():
            own = {folder.resolve() for folder in (*self._folders, *folders)}
            yield from ((each, library) for each in library if each.file.parent.resolve() in own)


def read_scenarios(file: Path, libraries: Libraries) -> ScenarioFile:
    """Read a scenario file. Nothing is raised: what is wrong is in the findings."""
    try:
        source = read_yaml(file)
    except ConfigError as error:
        return ScenarioFile(file, (), (finding_from_error(error),))
    reading = Reading(file, MissionLibrary(), libraries.maps, libraries.declarations)
    scenarios = list(_FileReader(reading, libraries).scenarios(source))
    return ScenarioFile(file, tuple(scenarios), tuple(sort_findings(reading.findings)))


@dataclass(frozen=True, slots=True)
class _Surroundings:
    """What a scenario is read with: as the folders have it, or with stubs for some missions."""

    library: MissionLibrary
    declarations: Mapping[str, SkillDeclaration]
    maps: MissionMaps

    def enter(self, reading: Reading) -> None:
        reading.library, reading.declarations, reading.maps = self.library, self.declarations, self.maps


class _FileReader:
    def __init__(self, reading: Reading, libraries: Libraries) -> None:
        self._reading = reading
        self._libraries = libraries
        self._mission: YamlNode | None = None
        self._given: dict[str, YamlNode] = {}
        self._names: dict[str, int] = {}
        self._mocks: dict[tuple[str, tuple[str, ...]], list[MockEntry]] = {}
        self._not_playable: set[tuple[str, tuple[str, ...]]] = set()
        self._stubs: tuple[str, ...] = ()
        self._plain: _Surroundings | None = None
        self._stubbed: dict[tuple[str, ...], _Surroundings] = {}

    def scenarios(self, source: YamlNode) -> Iterator[Scenario]:
        reading = self._reading
        if not isinstance(source, YamlMapping):
            reading.problem(source.position, "a scenario file must be a table", FILE_KEYS)
            return
        top = reading.entries(source, "a scenario file", FILE_KEYS)
        self._load_missions(top["missions"][1] if "missions" in top else None)
        self._mission = top["mission"][1] if "mission" in top else None
        self._given = self._given_of(top["given"][1] if "given" in top else None)
        if "scenarios" not in top:
            reading.problem(
                source.position, "the file has no scenarios", ["scenarios: [{name: ..., then: ...}]"]
            )
            return
        count = 0
        for item in reading.items(top["scenarios"][1]):
            for values, filled in self._examples(item):
                count += 1
                if count > MAX_SCENARIOS:
                    reading.problem(item.position, f"the file has more than {MAX_SCENARIOS} scenarios")
                    return
                yield from self._scenario(filled, values)

    def _load_missions(self, source: YamlNode | None) -> None:
        reading = self._reading
        folders = []
        for item in reading.items(source):
            name = reading.text(item, "a folder of missions")
            folder = Path(os.path.normpath(reading.file.parent / name)) if name else None
            if folder is not None and not folder.is_dir():
                reading.problem(item.position, f"there is no folder {str(folder)!r}")
            elif folder is not None:
                folders.append(folder)
        reading.library = self._libraries.load(reading.file.parent.resolve(), tuple(folders))
        # Skills that are only declared, beside missions that were imported, are mocked like any other.
        reading.declarations = reading.library.with_declared(self._libraries.declarations)

    def _given_of(self, source: YamlNode | None) -> dict[str, YamlNode]:
        entries = self._reading.entries(source, "given", GIVEN_KEYS)
        return {name: value for name, (_, value) in entries.items()}

    def _examples(self, item: YamlNode) -> Iterator[tuple[dict[str, YamlNode], YamlNode]]:
        """A scenario once for each of its examples, filled in."""
        reading = self._reading
        source = item.get("examples") if isinstance(item, YamlMapping) else None
        if source is None or not isinstance(item, YamlMapping):
            yield {}, item
            return
        rest = YamlMapping(tuple(e for e in item.entries if e[0].text != "examples"), item.position)
        examples = list(_example_rows(reading, source))
        if not examples:
            reading.problem(source.position, "there are no examples", ["[{room: kitchen}, {room: hall}]"])
        for values in examples:
            told: set[Position] = set()

            def unknown(
                position: Position,
                name: str,
                values: dict[str, YamlNode] = values,
                told: set[Position] = told,
            ) -> None:
                if position not in told:
                    told.add(position)
                    reading.problem(position, f"the examples have no {name!r}", closest_first(name, values))

            filled = fill_in(rest, values, unknown)
            if not told:
                yield values, filled

    def _scenario(self, item: YamlNode, values: dict[str, YamlNode]) -> Iterator[Scenario]:
        reading = self._reading
        before = len(reading.findings)
        entries = {
            name: value for name, (_, value) in reading.entries(item, "a scenario", SCENARIO_KEYS).items()
        }
        if not isinstance(item, YamlMapping):
            return
        name = self._name(item, entries.get("name"), values)
        own = self._given_of(entries.get("given"))
        then, refused, others_source = _split_then(entries.get("then"))
        if isinstance(then, YamlScalar) and then.empty:
            then = None
        mission = entries.get("mission", self._mission)
        if mission is None:
            reading.problem(item.position, "the scenario names no mission", ["mission: goto_user"])
            return
        merged = {**self._given, **own, "inputs": _merged(self._given.get("inputs"), own.get("inputs"))}
        if refused is not None:
            merged["refused"] = refused
        given = {key: value for key, value in merged.items() if value is not None}
        trigger = read_trigger(reading, mission, given, "mission")
        self._use_stubs(trigger.mission if trigger is not None else None, own.get("skills"))
        places = self._places(trigger.mission) if trigger is not None else None
        mocks = [
            *self._common_mocks(places),
            *read_mocks(reading, own.get("skills"), places, default=False),
        ]
        known = len(reading.findings)
        when, others = read_happenings(reading, entries.get("when"), places)
        happens = [each.text for each in when] if len(reading.findings) == known else None
        expectation = read_expectation(reading, then, places, "then", happens)
        runs = self._runs(others_source, others)
        self._check_expecting(item, then, bool(runs), refused is not None)
        if len(reading.findings) > before or trigger is None:
            return
        if (trigger.mission, self._stubs) in self._not_playable:
            return
        yield Scenario(
            name, reading.file, item.position, trigger, tuple(mocks), when, expectation, runs,
            reading.library, reading.maps,
        )  # fmt: skip

    def _runs(self, source: YamlNode | None, others: Mapping[str, MissionMap]) -> dict[str, Expectation]:
        """What must hold of the missions that the scenario starts beside its own."""
        reading = self._reading
        runs: dict[str, Expectation] = {}
        for key, value in reading.table(source, "runs"):
            if key.text not in others:
                message = f"no run is called {key.text!r}"
                reading.problem(key.position, message, closest_first(key.text, others))
                continue
            runs[key.text] = read_expectation(reading, value, others[key.text], "then")
            if isinstance(value, YamlScalar) and value.empty:
                reading.problem(key.position, f"nothing is expected of the run {key.text!r}", _THEN)
        return runs

    def _check_expecting(self, item: YamlMapping, then: YamlNode | None, runs: bool, refused: bool) -> None:
        """See that something is expected, and nothing of a mission that does not run."""
        entries = then.entries if isinstance(then, YamlMapping) else ()
        if refused and entries:
            key = entries[0][0]
            message = f"{key.text} can never hold: a mission that is refused does not run"
            self._reading.problem(key.position, message, ["leaving it out"])
        empty = isinstance(then, YamlMapping) and not entries and not runs and not refused
        unknown = [key.text for key, _ in item.entries if key.text not in SCENARIO_KEYS]
        if empty or (then is None and not get_close_matches("then", unknown)):
            self._reading.problem(item.position, "the scenario expects nothing", _THEN)

    def _common_mocks(self, places: MissionMap | None) -> list[MockEntry]:
        """The mocks for the whole file, held against each mission once."""
        key = (places.mission if places is not None else "", self._stubs)
        if key not in self._mocks:
            before = len(self._reading.findings)
            self._mocks[key] = read_mocks(self._reading, self._given.get("skills"), places, default=True)
            if len(self._reading.findings) > before:
                self._not_playable.add(key)
        return self._mocks[key]

    def _use_stubs(self, mission: str | None, own: YamlNode | None) -> None:
        """Let stubs stand for the called missions that the mocks of the next scenario name."""
        reading, self._stubs = self._reading, ()
        if self._plain is None:
            self._plain = _Surroundings(reading.library, reading.declarations, reading.maps)
        self._plain.enter(reading)
        if mission is None:
            return
        keys = [key.text for source in (self._given.get("skills"), own) for key in _keys(source)]
        patterns = list(_readable_patterns(keys))
        self._stubs = mocked_missions(patterns, self._places(mission), reading.declarations)
        if not self._stubs:
            return
        if self._stubs not in self._stubbed:
            library = copied(reading.library)
            put_stubs(self._stubs, library, reading.declarations)
            known = library.with_declared(self._libraries.declarations)
            self._stubbed[self._stubs] = _Surroundings(library, known, MissionMaps())
        self._stubbed[self._stubs].enter(reading)

    def _places(self, mission: str) -> MissionMap:
        reading = self._reading
        return reading.maps.of(reading.library.get(mission), reading.library, reading.declarations)

    def _name(self, item: YamlMapping, source: YamlNode | None, values: Mapping[str, YamlNode]) -> str:
        name = self._reading.text(source, "name") if source is not None else None
        if not name:
            self._reading.problem(item.position, "the scenario has no name", ["name: the room is unknown"])
            name = "?"
        if values and name in self._names:
            name += f" [{', '.join(f'{key}={input_text(value)}' for key, value in values.items())}]"
        if name in self._names:
            self._reading.problem(
                item.position,
                f"two scenarios are called {name!r} (the first in line {self._names[name]})",
                ["another name", "name: ... <parameter>"] if values else ["another name"],
            )
        self._names[name] = item.position.line
        return name


def _example_rows(reading: Reading, source: YamlNode) -> Iterator[dict[str, YamlNode]]:
    """A list of tables; or a table of columns, each a list of the same length."""
    if isinstance(source, YamlMapping):
        columns = {key.text: reading.items(value) for key, value in source.entries}
        lengths = {len(column) for column in columns.values()}
        if len(lengths) > 1:
            reading.problem(source.position, "the columns of the examples have different lengths")
            return
        for cells in zip(*columns.values(), strict=True):
            yield dict(zip(columns, cells, strict=True))
        return
    for item in reading.items(source):
        row = {key.text: value for key, value in reading.table(item, "an example")}
        if row:
            yield row


def _keys(source: YamlNode | None) -> Iterator[YamlScalar]:
    if isinstance(source, YamlMapping):
        yield from (key for key, _ in source.entries)


def _readable_patterns(texts: Iterable[str]) -> Iterator[Pattern]:
    """The patterns; what is none is told where the mocks are read."""
    for text in texts:
        with contextlib.suppress(ConfigError):
            yield read_pattern(text)


def _merged(common: YamlNode | None, own: YamlNode | None) -> YamlNode | None:
    """Two tables as one; what the second says counts."""
    if not isinstance(common, YamlMapping) or not isinstance(own, YamlMapping):
        return own if own is not None else common
    kept = tuple(entry for entry in common.entries if own.key(entry[0].text) is None)
    return YamlMapping((*kept, *own.entries), own.position)


def _split_then(source: YamlNode | None) -> tuple[YamlNode | None, YamlNode | None, YamlNode | None]:
    """``then`` without ``refused`` and ``runs``, and these two."""
    if not isinstance(source, YamlMapping):
        return source, None, None
    rest = tuple(entry for entry in source.entries if entry[0].text not in ("refused", "runs"))
    return YamlMapping(rest, source.position), source.get("refused"), source.get("runs")
