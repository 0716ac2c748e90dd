"""The missions of a robot: those that come with the package and those of further folders."""

from __future__ import annotations

import filecmp
from collections import ChainMap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.plain_yaml import Position
from florence_bt.trees.kinds import CallMission, RunSkill
from florence_bt.trees.language.declarations import own_declarations
from florence_bt.trees.language.declared_skills import ENDING, STOCK, is_skills_file, read_skills_file
from florence_bt.trees.language.findings import WARNING, Finding, finding_from_error, sort_findings
from florence_bt.trees.language.message_mappings import MessageMapping
from florence_bt.trees.language.model import Mission
from florence_bt.trees.language.parse import read_mission
from florence_bt.trees.language.third_party import ThirdParty

BUILT_IN = Path(__file__).parents[1] / "missions"
"""The missions that come with the package."""


class MissionLibrary:
    """Missions by name.

    One broken file does not take the others away: what is wrong with it is in :attr:`findings` (when it is no
    YAML) or in the mission's own findings.
    """

    def __init__(self) -> None:
        self._findings: list[Finding] = []
        self.folders: list[Path] = []
        """The folders that were read, the first one first."""
        self.declarations: dict[str, SkillDeclaration] = {}
        """Skills that files beside the missions declare, whether anybody has written them or not."""
        self.mappings: dict[str, MessageMapping] = {}
        """Servers of those skills of which these files say it."""
        self._skills_files: set[Path] = set()
        self._skills_texts: dict[str, tuple[Path, str]] = {}
        """Skill -> the file that declares it, and its text; not of those that come with Florence."""
        self._skills_folders: set[Path] = set()
        self._missions: dict[str, Mission] = {}
        self._files: dict[str, Path] = {}
        self._unreadable: dict[str, ConfigError] = {}
        self.compiled: object = None
        """The compiler's work on these missions; forgotten when one of them changes."""

    @property
    def findings(self) -> list[Finding]:
        """List what is wrong with files and packages that could not be read, by file and place."""
        return sort_findings(self._findings)

    @classmethod
    def load(
        cls, folders: Sequence[Path] = (), *, built_in: bool = True, third_party: bool | None = None
    ) -> MissionLibrary:
        """Read every ``*.yaml`` of some folders, but no hidden file: editors leave such beside their own.

        That a mission shadows another is one of the findings.

        Args:
            folders: Mission folders; a later one shadows missions of the same name in an earlier one.
            built_in: Whether to begin with the missions that come with the package.
            third_party: Whether to go on with those of installed packages (entry points of the group
                ``florence_bt.missions``); as ``built_in`` when not given.

        Raises:
            ConfigError: A folder does not exist.
        """
        library = cls()
        packages = ThirdParty()
        further = built_in if third_party is None else third_party
        if built_in:
            library._add_skills(STOCK)
        installed = [folder for _, folder in packages.mission_folders()] if further else []
        library._findings += packages.findings
        library.folders = ([BUILT_IN] if built_in else []) + [*installed, *folders]
        for folder in library.folders:
            if not folder.is_dir():
                raise ConfigError(f"there is no folder of missions {str(folder)!r}")
            for path in sorted(folder.glob("[!.]*.yaml")):
                library.add_file(path)
        return library

    def add_file(self, path: Path) -> Mission | None:
        """Read one file; its mission shadows an earlier one of the same name.

        Returns:
            The mission, or None when the file cannot be read at all (see :attr:`findings`).
        """
        if is_skills_file(path):
            self._add_skills(path)
            return None
        self._add_skills_of(path.parent)
        self._note_shadow(path)
        self.compiled = None
        self._unreadable.pop(path.stem, None)
        self._missions.pop(path.stem, None)
        try:
            mission = read_mission(path)
        except ConfigError as error:
            self._findings.append(finding_from_error(error))
            self._unreadable[path.stem] = error
            return None
        # The stem counts, also when the file calls the mission something else: that is one of its findings.
        self._missions[path.stem] = mission
        return mission

    def add_neighbours(self, missions: Iterable[Mission]) -> None:
        """Let missions call those that lie beside their files."""
        waiting = list(missions)
        looked_for: set[Path] = set()
        for mission in waiting:
            for node in mission.nodes():
                if not isinstance(node, CallMission) or node.mission.text in self:
                    continue
                file = mission.file.parent / f"{node.mission.text}.yaml"
                if file not in looked_for and file.is_file():
                    neighbour = self.add_file(file)
                    waiting += [neighbour] if neighbour is not None else []
                looked_for.add(file)

    def with_declared(self, declarations: Mapping[str, SkillDeclaration]) -> Mapping[str, SkillDeclaration]:
        """Return the given skills, and behind them those that are only declared; later ones are seen too."""
        return ChainMap(dict(declarations), self.declarations)

    def _add_skills_of(self, folder: Path) -> None:
        if folder not in self._skills_folders:
            self._skills_folders.add(folder)
            for path in sorted(folder.glob(f"*{ENDING}")):
                self._add_skills(path)

    def _add_skills(self, path: Path) -> None:
        if path in self._skills_files:
            return
        self._skills_files.add(path)
        try:
            declared = read_skills_file(path)
        except ConfigError as error:
            self._findings.append(finding_from_error(error))
            return
        self._findings += declared.findings
        for name, place in declared.positions.items():
            if name in own_declarations():
                message = f"the skill {name!r} is ignored: Florence itself has one of that name"
                valid = (f"another name, such as my_{name}",)
                self._findings.append(Finding(str(path), place.line, place.column, WARNING, message, valid))
        self.compiled = None
        self.declarations.update(declared.declarations)
        if path != STOCK:
            self._skills_texts.update(dict.fromkeys(declared.declarations, (path, declared.text)))
        for name, mapping in declared.mappings.items():
            self._note_two_types(path, declared.positions[name], mapping)
            self.mappings[name] = mapping

    def _note_two_types(self, path: Path, place: Position, mapping: MessageMapping) -> None:
        """Warn of a name that another skill has with another type: a program can have one of them alone."""
        for name, other in self.mappings.items():
            same = other.server == mapping.server and not (other.stock or mapping.stock)
            if same and other.interface != mapping.interface and name != mapping.declaration.name:
                problem = f"{mapping.name} has the type {other.interface} for the skill {name!r}"
                message = f"{problem}: one of the two will be missing"
                valid = (f"type: {other.interface}",)
                self._findings.append(Finding(str(path), place.line, place.column, WARNING, message, valid))
                return

    def _note_shadow(self, path: Path) -> None:
        earlier = self._files.get(path.stem)
        self._files[path.stem] = path
        if earlier is not None and not _same_mission(earlier, path):
            message = f"this mission shadows the one of the same name in {earlier}"
            self._findings.append(Finding(str(path), 1, 1, WARNING, message))

    def put(self, mission: Mission) -> None:
        """Let a mission that was read earlier count instead of what its file says now."""
        name = mission.file.stem
        self.compiled = None
        self._unreadable.pop(name, None)
        self._missions[name] = mission

    def unreadable(self) -> dict[str, ConfigError]:
        """Return the names of the files that could not be read at all, and why."""
        return dict(self._unreadable)

    def get(self, name: str) -> Mission:
        """Return the mission of a name.

        Raises:
            ConfigError: There is none, or its file cannot be read.
        """
        if name in self._unreadable:
            raise self._unreadable[name]
        if name not in self._missions:
            raise ConfigError(f"there is no mission {name!r}", valid=closest_first(name, self._missions))
        return self._missions[name]

    def find(self, name: str) -> Mission | None:
        """Return the mission of a name, or None."""
        return self._missions.get(name)

    def missions(self) -> list[Mission]:
        """Return every mission, in alphabetical order."""
        return [self._missions[name] for name in self.names()]

    def names(self) -> list[str]:
        """Return the names of every mission, in alphabetical order."""
        return sorted(self._missions)

    def called_by(self, name: str) -> list[str]:
        """Return the missions that a mission calls, and those that they call, without itself."""
        found = [name]
        for each in found:
            found += dict.fromkeys(called for called in self._calls(each) if called not in found)
        return found[1:]

    def skills_below(self, name: str) -> Iterator[tuple[str, str]]:
        """Yield the skills that a mission uses and all that it calls, each with the mission that uses it."""
        for each in (name, *self.called_by(name)):
            mission = self.find(each)
            for node in mission.nodes() if mission is not None else ():
                if isinstance(node, RunSkill):
                    yield node.skill, each

    def texts_of(self, name: str) -> dict[Path, str]:
        """Return the texts that a run of a mission rests on, by file.

        These are its own, those of the missions that it calls, and of the files beside missions that declare
        skills which they use.
        """
        missions = filter(None, map(self.find, (name, *self.called_by(name))))
        skills = (
            self._skills_texts[skill] for skill, _ in self.skills_below(name) if skill in self._skills_texts
        )
        return {mission.file: mission.text for mission in missions} | dict(skills)

    def _calls(self, name: str) -> list[str]:
        mission = self.find(name)
        nodes = mission.nodes() if mission is not None else ()
        return [node.mission.text for node in nodes if isinstance(node, CallMission)]

    def __contains__(self, name: object) -> bool:
        return name in self._missions

    def __iter__(self) -> Iterator[Mission]:
        return iter(self.missions())


def _same_mission(first: Path, second: Path) -> bool:
    """Tell whether two files are one, or one is a plain copy of the other."""
    try:
        return first.samefile(second) or filecmp.cmp(first, second, shallow=False)
    except OSError:
        return False
