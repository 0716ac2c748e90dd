"""``florence check``: reads mission files, checks them and writes the report; without ROS unless asked."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.core.paths import find_data
from florence_bt.core.plain_yaml import Position, YamlMapping, YamlNode, YamlScalar, parse_yaml
from florence_bt.core.text_files import MAX_MISSION_BYTES, decode, readable
from florence_bt.skills.locator.hotspots import Hotspots, load_hotspots
from florence_bt.trees.checks import lint
from florence_bt.trees.checks.lint import KnownPlaces
from florence_bt.trees.checks.report import FORMATS, Excerpts, report_full, summary
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.declared_skills import is_skills_file
from florence_bt.trees.language.findings import (
    ERROR,
    WARNING,
    Finding,
    finding_from_error,
    has_errors,
    limit_findings,
)
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission
from florence_bt.trees.language.parse import parse_mission
from florence_bt.trees.language.properties import ENDING as PROPERTIES_ENDING
from florence_bt.trees.language.vocabulary import IDENTIFIER

STDIN = Path("-")
"""Given in place of a file: the standard input."""
_NAMELESS = Path("<stdin>")

ProblemAt = Callable[[float, float], str | None]
"""Says what is wrong with a place (x, y in metres, map frame), None when nothing is."""


@dataclass(frozen=True, slots=True)
class CheckOptions:
    """The options of a check.

    Attributes:
        hotspots: The hotspots of the flat; None takes those that come with Florence, and what they lack is
            only a warning, because the flat may be another one.
        map_file: The map that hotspots and poses are held against; None: they are not.
        folders: More mission folders that the missions may call.
        form: ``text``, ``json`` or ``github``.
        strict: Whether warnings count as errors.
        colour: Whether to use the colours of a terminal.
        stdin_name: The file that the standard input will become; None when it has no name.
        live: Whether to compare with the running system too.
    """

    hotspots: Path | None = None
    map_file: Path | None = None
    folders: tuple[Path, ...] = ()
    form: str = "text"
    strict: bool = False
    colour: bool = False
    stdin_name: Path | None = None
    live: bool = False


def check_files(files: Sequence[Path], options: CheckOptions | None = None) -> tuple[str, bool]:
    """Check mission files and all files of mission folders.

    Args:
        files: Files, folders, and ``-`` for the standard input. Missions of one call may call each other,
            those in the folders of the files, and the built-in ones.
        options: How to check.

    Returns:
        The report, and whether there are errors.

    Raises:
        ConfigError: A path does not exist, or there is no such form.
        SystemNotThere: The comparison with the running system was asked for and there is none.
    """
    options = options or CheckOptions()
    if options.form not in FORMATS:
        raise ConfigError(f"there is no format {options.form!r}", valid=FORMATS)
    with _nothing_collected():
        checker = _MissionChecker(options, lambda: sys.stdin.buffer.read(MAX_MISSION_BYTES + 1))
        paths = [path for given in files for path in _mission_files(given)]
        findings = limit_findings([*checker.check(paths), *_other_endings(files)])
    excerpts = Excerpts(checker.texts)
    if options.form == "text":
        report = report_full(findings, excerpts, colour=options.colour)
        missions = sum(not is_skills_file(path) for path in paths)
        count, what = (missions, "mission") if missions or not paths else (len(paths), "skills file")
        head = f"{count} {what}{'s' * (count != 1)} checked: {summary(findings)}"
        report = f"{report}\n{head}" if report else head
    else:
        report = FORMATS[options.form](findings, excerpts)
    return report, has_errors(findings) or (options.strict and bool(findings))


@dataclass(frozen=True, slots=True)
class CheckedText:
    """A mission that is being written.

    Attributes:
        mission: The mission, None when the text cannot be read at all.
        findings: Everything that is wrong, by file and place.
        library: The missions that it may call, with itself.
    """

    mission: Mission | None
    findings: tuple[Finding, ...]
    library: MissionLibrary


def check_text(data: bytes, options: CheckOptions) -> CheckedText:
    """Check the text of one mission, as it would stand in the file ``options.stdin_name``.

    Raises:
        ConfigError: A folder or the hotspots cannot be read.
    """
    with _nothing_collected():
        checker = _MissionChecker(options, lambda: data)
        findings = checker.check([STDIN])
    return CheckedText(checker.written, tuple(findings), checker.library)


@contextmanager
def _nothing_collected() -> Iterator[None]:
    """Let the collector of cycles rest: a large file is a hundred thousand records that stay to the end.

    What a file may hold is limited, so the memory stays bounded; the time falls by up to a third.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


class _MissionChecker:
    """One check, with everything that it needs.

    Args:
        options: How to check.
        read: Gives the text that stands for :data:`STDIN`, a byte more than it may have at most.

    Attributes:
        texts: That text, by the name that findings give it.
        written: The mission in it, None when there is none.
        library: The missions.
    """

    def __init__(self, options: CheckOptions, read: Callable[[], bytes]) -> None:
        self.texts: dict[str, str] = {}
        self.written: Mission | None = None
        self._options = options
        self._read = read
        self.library = MissionLibrary.load(options.folders)
        self._declarations = collect_declarations()

    def check(self, paths: Sequence[Path]) -> list[Finding]:
        """Return everything that is wrong with some files."""
        missions, findings = lint.read_files([path for path in paths if path != STDIN], self.library)
        if STDIN in paths:
            try:
                self.written = self._read_text()
                missions.append(self.written)
            except ConfigError as error:
                findings.append(finding_from_error(error))
        self.library.add_neighbours(missions)
        # What shadows what, and packages that could not be loaded.
        findings += [f for f in self.library.findings if f.severity == WARNING]
        findings += self._declarations.findings
        flat = _flat(self._options)
        findings += [*flat.about_map, *flat.wrong_hotspots()]
        findings += lint.check(missions, self.library, self._declarations, flat.for_lint())
        findings += lint.errors_of_called(missions, self.library, self._declarations)
        if self._options.live:
            from florence_bt.app.mission_files.live_check import compare_with_system

            def labels(mission: Mission) -> list[tuple[str, Position]]:
                return lint.written_labels(mission, self.library, self._declarations)

            findings += compare_with_system(missions, self.library, labels)
        return limit_findings(_about_stdin(finding) for finding in findings)

    def _read_text(self) -> Mission:
        data = self._read()
        path = self._options.stdin_name or _NAMELESS
        # Also when it is not UTF-8: the file on the disk is not what was read.
        self.texts[str(path)] = readable(data) or ""
        text = decode(data, path, MAX_MISSION_BYTES)
        if path == _NAMELESS:
            # A text without a file is not wrong for having another name than its file.
            path = _NAMELESS / f"{_name_in(parse_yaml(data, path)) or 'stdin'}.yaml"
        mission = parse_mission(text, path)
        self.library.put(mission)
        return mission


def _about_stdin(finding: Finding) -> Finding:
    """Take the file out of a finding about a text without a file."""
    nameless = Path(finding.file).parent == _NAMELESS
    return replace(finding, file=str(_NAMELESS)) if nameless else finding


def _name_in(source: YamlNode) -> str | None:
    name = source.get("mission") if isinstance(source, YamlMapping) else None
    return name.text if isinstance(name, YamlScalar) and IDENTIFIER.fullmatch(name.text) else None


@dataclass(frozen=True, slots=True)
class _FlatFiles:
    """The flat, as far as it is known.

    Attributes:
        hotspots: Its hotspots.
        file: Where they stand.
        ours: Whether they are those of the flat that is meant; else it may be another one.
        asked: Whether the running system is asked about labels, so that a guess is not needed.
        problem_at: Says what is wrong with a place, if there is a map.
        about_map: What is probably wrong with the map.
    """

    hotspots: Hotspots
    file: Path
    ours: bool
    asked: bool
    problem_at: ProblemAt | None
    about_map: tuple[Finding, ...]

    def for_lint(self) -> KnownPlaces:
        shown = (
            str(self.file) if self.ours else f"{self.file.name}, the flat of Florence; give --hotspots FILE"
        )
        return KnownPlaces(
            labels=self.hotspots.labels() if self.ours or not self.asked else None,
            rooms=tuple(room.label for room in self.hotspots.rooms()),
            file=shown,
            severity=ERROR if self.ours else WARNING,
            problem_at=self.problem_at,
        )

    def wrong_hotspots(self) -> Iterable[Finding]:
        """Yield the hotspots that are where a robot cannot stand."""
        for spot in self.hotspots if self.ours and self.problem_at is not None else ():
            problem = self.problem_at(spot.pose.x, spot.pose.y) if self.problem_at is not None else None
            if problem is not None:
                place = self.hotspots.position_of(spot.label)
                message = f"the hotspot {spot.label!r} is {problem}"
                valid = ("a place where the robot can stand",)
                yield Finding(str(self.file), place.line, place.column, ERROR, message, valid)


def _flat(options: CheckOptions) -> _FlatFiles:
    problem_at, about_map = None, []
    if options.map_file is not None:
        from florence_bt.app.mission_files.map_places import problem_on_map

        map_file = options.map_file
        problem_at = problem_on_map(
            map_file, lambda sentence: about_map.append(Finding(str(map_file), 1, 1, WARNING, sentence))
        )
    file = options.hotspots or find_data("hotspots", "flat.yaml")
    return _FlatFiles(
        load_hotspots(file), file, options.hotspots is not None, options.live, problem_at, tuple(about_map)
    )


def _other_endings(given: Iterable[Path]) -> Iterator[Finding]:
    """Yield a warning for each file that a folder of missions would not be asked for."""
    for path in given:
        for file in sorted(path.glob("[!.]*.yml")) if path.is_dir() else (path,):
            if file.suffix == ".yml" and not file.name.endswith(PROPERTIES_ENDING):
                message = "missions are files that end in .yaml: no other mission and no robot finds this one"
                yield Finding(str(file), 1, 1, WARNING, message, (f"{file.stem}.yaml",))


def _mission_files(given: Path) -> list[Path]:
    if given == STDIN:
        return [given]
    if given.is_dir():
        files = sorted(given.glob("[!.]*.yaml"))
        if not files:
            raise ConfigError(f"there is no mission file in {str(given)!r}", valid=["a folder with *.yaml"])
        return files
    if not given.exists():
        raise ConfigError(
            f"there is no file {str(given)!r}", valid=["a mission file", "a folder of mission files", "-"]
        )
    return [given]
