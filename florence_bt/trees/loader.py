"""The missions of a robot: those that come with the package and those of further folders."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.trees.findings import Finding, finding_from_error, sort_findings
from florence_bt.trees.model import Mission
from florence_bt.trees.parse import read_mission

BUILT_IN = Path(__file__).parent / "missions"
"""The missions that come with the package."""


class MissionLibrary:
    """Missions by name.

    One broken file does not take the others away: what is wrong with it is in :attr:`findings` (when it is no
    YAML) or in the mission's own findings.
    """

    def __init__(self) -> None:
        self.findings: list[Finding] = []
        self._missions: dict[str, Mission] = {}
        self._unreadable: dict[str, ConfigError] = {}

    @classmethod
    def load(cls, folders: Sequence[Path] = (), *, built_in: bool = True) -> MissionLibrary:
        """Read every ``*.yaml`` of some folders.

        Args:
            folders: Mission folders; a later one shadows missions of the same name in an earlier one.
            built_in: Whether to begin with the missions that come with the package.

        Raises:
            ConfigError: A folder does not exist.
        """
        library = cls()
        for folder in ([BUILT_IN] if built_in else []) + list(folders):
            if not folder.is_dir():
                raise ConfigError(f"there is no folder of missions {str(folder)!r}")
            for path in sorted(folder.glob("*.yaml")):
                library.add_file(path)
        return library

    def add_file(self, path: Path) -> Mission | None:
        """Read one file; its mission shadows an earlier one of the same name.

        Returns:
            The mission, or None when the file cannot be read at all (see :attr:`findings`).
        """
        self._unreadable.pop(path.stem, None)
        self._missions.pop(path.stem, None)
        try:
            mission = read_mission(path)
        except ConfigError as error:
            self.findings = sort_findings([*self.findings, finding_from_error(error)])
            self._unreadable[path.stem] = error
            return None
        # The stem counts, also when the file calls the mission something else: that is one of its findings.
        self._missions[path.stem] = mission
        return mission

    def get(self, name: str) -> Mission:
        """The mission of a name.

        Raises:
            ConfigError: There is none, or its file cannot be read.
        """
        if name in self._unreadable:
            raise self._unreadable[name]
        if name not in self._missions:
            raise ConfigError(f"there is no mission {name!r}", valid=closest_first(name, self._missions))
        return self._missions[name]

    def find(self, name: str) -> Mission | None:
        """The mission of a name, or None."""
        return self._missions.get(name)

    def missions(self) -> list[Mission]:
        """Every mission, in alphabetical order."""
        return [self._missions[name] for name in self.names()]

    def names(self) -> list[str]:
        """The names of every mission, in alphabetical order."""
        return sorted(self._missions)

    def __contains__(self, name: object) -> bool:
        return name in self._missions

    def __iter__(self) -> Iterator[Mission]:
        return iter(self.missions())
