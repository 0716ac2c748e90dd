"""Skills, missions, commands and processes of installed packages: found by Python entry points.

A package that cannot be loaded is reported by its name and takes nothing else away.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import importlib.util
import os
import sys
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from florence_bt.trees.language.findings import Finding

SKILLS = "florence_bt.skills"
"""Entry points of modules with ``SkillDeclaration`` values."""
MISSIONS = "florence_bt.missions"
"""Entry points of package folders with mission files."""
COMMANDS = "florence_bt.commands"
"""Entry points of ``typer.Typer`` objects whose commands become verbs of ``florence``."""
PROCESSES = "florence_bt.processes"
"""Entry points of processes of ``florence up`` (``app/bringup/package_processes.py``)."""


class ThirdParty:
    """The skills, missions, commands and processes of installed packages.

    Attributes:
        findings: The packages that could not be loaded, and why.
    """

    def __init__(self) -> None:
        self.findings: list[Finding] = []

    def skill_modules(self) -> Iterator[tuple[str, ModuleType]]:
        """Yield the modules of skills, in the order of the entry points' names, each with who brought it."""
        for point in _points(SKILLS):
            try:
                yield _owner(point), importlib.import_module(point.module)
            except (Exception, SystemExit) as error:
                # Whatever a stranger's module does when it is imported is the stranger's fault alone.
                self._refuse(point, f"cannot be imported: {type(error).__name__}: {error}")

    def commands(self) -> Iterator[tuple[str, Any]]:
        """Yield the ``typer.Typer`` objects by the entry points' names, each with who brought it."""
        return self._objects(COMMANDS)

    def processes(self) -> Iterator[tuple[str, Any]]:
        """Yield the processes of ``florence up`` by the entry points' names, each with who brought it."""
        return self._objects(PROCESSES)

    def _objects(self, group: str) -> Iterator[tuple[str, Any]]:
        for point in _points(group):
            try:
                yield _owner(point), point.load()
            except (Exception, SystemExit) as error:
                self._refuse(point, f"cannot be loaded: {type(error).__name__}: {error}")

    def mission_folders(self) -> Iterator[tuple[str, Path]]:
        """Yield the folders of missions by the entry points' names, each with who brought it."""
        for point in _points(MISSIONS):
            try:
                spec = importlib.util.find_spec(point.value)
            except (Exception, SystemExit) as error:
                # Finding a module imports the packages above it.
                self._refuse(point, f"cannot be found: {type(error).__name__}: {error}")
                continue
            places = list(spec.submodule_search_locations or ()) if spec is not None else []
            folder = next((Path(place) for place in places if Path(place).is_dir()), None)
            if folder is None:
                self._refuse(point, "is not a package folder")
            else:
                yield _owner(point), folder

    def refuse(self, owner: str, problem: str, *valid: str) -> None:
        """Report that something of a package is ignored."""
        from florence_bt.trees.language.findings import WARNING, Finding  # the list of verbs needs no YAML

        self.findings.append(Finding(owner, 1, 1, WARNING, problem, tuple(valid)))

    def _refuse(self, point: importlib.metadata.EntryPoint, problem: str) -> None:
        self.refuse(_owner(point), f"{point.value!r} (entry point {point.name!r} of {point.group}) {problem}")


def _points(group: str) -> list[importlib.metadata.EntryPoint]:
    """Return the entry points of a group, each once, in a fixed order."""
    found = {(point.name, point.value): point for point in _all_points(installed()).select(group=group)}
    return [found[key] for key in sorted(found)]


def installed() -> tuple[tuple[str, int], ...]:
    """Return what is another one when something was installed: for what is remembered until then."""
    return tuple((place, _changed(place)) for place in sys.path)


@lru_cache(maxsize=1)  # all installed packages are looked through for them
def _all_points(places: tuple[tuple[str, int], ...]) -> importlib.metadata.SelectableGroups:
    return importlib.metadata.entry_points()


def _changed(place: str) -> int:
    """Return when something was installed in a folder of ``sys.path``, in ns; 0 when there is none."""
    try:
        return os.stat(place or ".").st_mtime_ns
    except OSError:
        return 0


def _owner(point: importlib.metadata.EntryPoint) -> str:
    """Return the package of an entry point, for people."""
    return f"package {point.dist.name}" if point.dist is not None else f"package of {point.value}"
