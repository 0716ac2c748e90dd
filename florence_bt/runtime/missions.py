"""Mission files while they are edited: a good edit takes effect at the next trigger, a broken one does not.

An edit is good when it passes the check and breaks no mission that calls the edited one. Otherwise the
old version stays in force, and every answer says so. Runs that go on keep their version.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.core.text_files import MAX_MISSION_BYTES, read_bytes
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.declared_skills import is_skills_file
from florence_bt.trees.language.findings import ERROR, Finding
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission

READINGS = 5
"""Readings of files that change while they are read."""


@dataclass(frozen=True)
class ReloadReport:
    """The outcome of edits of files.

    Attributes:
        changed: Missions that are new or different now.
        removed: Missions that are gone.
        held: Mission, or file of skills -> why its edit is not used and the previous version stays in force.
        broken: Mission -> its first error, for those that never were right.
    """

    changed: tuple[str, ...] = ()
    removed: tuple[str, ...] = ()
    held: Mapping[str, str] = field(default_factory=dict)
    broken: Mapping[str, str] = field(default_factory=dict)

    @property
    def ok(self) -> bool:
        """Tell whether every file could be loaded as it is."""
        return not self.held and not self.broken

    def text(self) -> str:
        """Write the report for people, a line for each mission."""
        lines = [f"{name}: reloaded" for name in self.changed]
        lines += [f"{name}: removed" for name in self.removed]
        lines += [f"{name}: {reason}" for name, reason in self.held.items()]
        lines += [f"{name}: cannot run: {reason}" for name, reason in self.broken.items()]
        return "\n".join(lines) or "nothing has changed"


class MissionFolders:
    """The missions of some folders, kept up to date.

    Args:
        load: Reads all folders again.
        declarations: What the skills say about themselves.

    Attributes:
        library: The missions in force.
        held: Mission, or file of skills -> why the previous version is in force instead of its file.

    Raises:
        ConfigError: A folder does not exist, or its files do not hold still.
    """

    def __init__(
        self,
        load: Callable[[], MissionLibrary],
        declarations: Mapping[str, SkillDeclaration],
    ) -> None:
        self.held: dict[str, str] = {}
        self._load = load
        self._declarations = declarations
        self._known_versions: dict[str, str] = {}
        self._checked: dict[str, tuple[Mission, list[Finding]]] = {}
        self.library = load()  # only its folders count: what is in force comes from files that held still
        self.library, self._prints = self._read()
        self._versions = self._file_versions(self.library)
        self._skills_at_start = _skills_files(self._prints)

    @classmethod
    def of(
        cls,
        folders: Sequence[Path],
        declarations: Mapping[str, SkillDeclaration],
        *,
        built_in: bool = True,
    ) -> MissionFolders:
        """Make the missions of some folders, behind those that come with the package.

        Args:
            folders: Mission folders; a later one shadows missions of the same name in an earlier one.
            declarations: What the skills say about themselves.
            built_in: Whether to begin with the missions that come with the package.

        Raises:
            ConfigError: A folder does not exist.
        """
        return cls(partial(MissionLibrary.load, folders, built_in=built_in), declarations)

    def refresh(self) -> ReloadReport:
        """Take edits over, if there are any; a look at the files' texts when there are none.

        A folder that is out of reach for a moment changes nothing.
        """
        try:
            return self._reload() if self.edited() else ReloadReport(held=dict(self.held))
        except (OSError, ConfigError) as error:
            return ReloadReport(held={**self.held, "the folders": f"cannot be read: {error}"})

    def version_of(self, name: str) -> str:
        """Compute the fingerprint of a mission and of everything that it calls, as in force now."""
        known = self._known_versions.get(name)
        if known is None:
            names = [name, *sorted(self.library.called_by(name))]
            text = "\n".join(f"{each} {self._versions.get(each, '')}" for each in names)
            known = self._known_versions[name] = hashlib.sha256(text.encode()).hexdigest()[:16]
        return known

    def note_about(self, name: str) -> str:
        """Return what callers should know about a mission's version, empty when it is as in the files."""
        if not self.held:
            return ""
        names = [name, *sorted(self.library.called_by(name))]
        return "; ".join(f"{each}: {self.held[each]}" for each in names if each in self.held)

    def _look(self) -> dict[Path, str]:
        """Return the fingerprint of the text of each file."""
        found = {}
        for folder in self.library.folders:
            for name in os.listdir(folder):
                if name.endswith(".yaml") and not name.startswith("."):
                    found[folder / name] = _fingerprint(folder / name)
        return found

    def findings_of(self, mission: Mission) -> list[Finding]:
        """Return what the check says about a mission in force; it is checked once as long as it stays."""
        known = self._checked.get(mission.name)
        if known is None or known[0] is not mission:
            known = self._checked[mission.name] = mission, check(mission, self.library, self._declarations)
        return known[1]

    def edited(self) -> bool:
        """Tell whether a file is not as it was read."""
        return self._look() != self._prints

    def _read(self) -> tuple[MissionLibrary, dict[Path, str]]:
        """Read all folders: the missions, with the fingerprints of the very same texts.

        Without that a broken edit could get the fingerprint of the good one before, and pass as no edit.

        Raises:
            ConfigError: The files do not hold still.
        """
        for _ in range(READINGS):
            prints = self._look()
            library = self._load()
            if self._look() == prints:
                return library, prints
        raise ConfigError(
            "the files of the missions are being written at this moment", valid=["a reload later"]
        )

    def _reload(self) -> ReloadReport:
        before = self.library
        new, self._prints = self._read()
        versions = self._file_versions(new)
        edited = {
            name
            for name in {*before.names(), *new.names(), *(path.stem for path in self._prints)}
            if versions.get(name) != self._versions.get(name)
        }
        held = self._hold(before, new, edited)
        for name in held:
            versions[name] = self._versions[name]
        held |= self._hold_skills(new)
        self.library, self._versions, self.held = new, versions, held
        self._known_versions.clear()
        self._checked.clear()
        good = sorted(edited - set(held))
        broken = {name: text for name in good if (text := self._error_of(new, name))}
        return ReloadReport(
            tuple(name for name in good if name in new and name not in broken),
            tuple(name for name in good if name not in new and name in before),
            held,
            broken,
        )

    def _hold(self, before: MissionLibrary, new: MissionLibrary, edited: set[str]) -> dict[str, str]:
        """Put the old versions of edits back that break something that worked; gives the reasons."""
        held: dict[str, str] = {}
        while culprits := self._culprits(before, new, edited - set(held)):
            for name, reason in culprits.items():
                new.put(before.get(name))
                held[name] = f"its edit is not used, the previous version stays in force: {reason}"
        return dict(sorted(held.items()))

    def _hold_skills(self, new: MissionLibrary) -> dict[str, str]:
        """Tell of each file of skills that is not as it was at the start: their clients were made then."""
        before, now = self._skills_at_start, _skills_files(self._prints)
        changed = sorted(path for path in before.keys() | now.keys() if before.get(path) != now.get(path))
        held = {}
        for path in changed:
            errors = [one for one in new.findings if one.severity == ERROR and one.file == str(path)]
            reason = f", but it has an error: {errors[0].as_error()}" if errors else ""
            held[path.name] = (
                f"its edit is not used before the mission server starts again (florence up){reason}; "
                "skills are connected to their servers at the start"
            )
        return held

    def _culprits(self, before: MissionLibrary, new: MissionLibrary, edited: set[str]) -> dict[str, str]:
        """Map each edited mission to what it breaks that worked before: itself, or one that calls it."""
        own: dict[str, str] = {}
        others: dict[str, str] = {}
        for name in before.names():
            concerned = edited & {name, *before.called_by(name), *new.called_by(name)}
            error = self._error_of(new, name) if concerned else ""
            if not error or self._error_of(before, name):
                continue
            if name in edited and (name in new or name in new.unreadable()):
                own[name] = error
            elif name not in edited:
                others |= {each: f"it breaks {name}: {error}" for each in sorted(concerned) if each in before}
        return {**others, **own}

    def _error_of(self, library: MissionLibrary, name: str) -> str:
        """Return the first error of a mission, empty when it has none; a mission that is gone has none."""
        try:
            mission = library.get(name)
        except ConfigError as error:
            return str(error) if name in library.unreadable() else ""
        declarations = library.with_declared(self._declarations)
        findings = check(mission, library, declarations)
        return next((str(f.as_error()) for f in findings if f.severity == ERROR), "")

    def _file_versions(self, library: MissionLibrary) -> dict[str, str]:
        return {
            **{mission.file.stem: self._prints.get(mission.file, "") for mission in library},
            **{name: f"unreadable: {error}" for name, error in library.unreadable().items()},
        }


def _skills_files(prints: Mapping[Path, str]) -> dict[Path, str]:
    """Return the fingerprints of the files that declare skills."""
    return {path: fingerprint for path, fingerprint in prints.items() if is_skills_file(path)}


def _fingerprint(file: Path) -> str:
    try:
        return hashlib.sha256(read_bytes(file, MAX_MISSION_BYTES)).hexdigest()
    except ConfigError as error:
        return f"unreadable: {error}"
