"""Finds the scenario files among files and folders."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.core.text_files import read_bytes

SUFFIXES = (".yaml", ".yml")

_SCENARIOS = re.compile(rb"^(?:scen\w*|given|then|missions?)\s*:", re.MULTILINE)
"""A line that only a scenario file has; a mission has the last of these words too."""
_MISSION = re.compile(rb"^tree\s*:", re.MULTILINE)
_CERTAIN = re.compile(rb"^scenarios\s*:", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class FoundFiles:
    """What was found.

    Attributes:
        files: The scenario files in order, each once.
        left_out: YAML files in folders that hold no scenarios, such as missions.
    """

    files: tuple[Path, ...]
    left_out: tuple[Path, ...]


def scenario_files(given: Iterable[Path]) -> FoundFiles:
    """The scenario files among some files and folders; what is named itself is always taken.

    Raises:
        ConfigError: One does not exist, or a folder has none.
    """
    files: list[Path] = []
    left_out: list[Path] = []
    for path in given:
        if path.is_dir():
            below = list(_below(path))
            found = [file for file in below if looks_like_scenarios(file)]
            if not found:
                what = "only other YAML files" if below else "no YAML file"
                raise ConfigError(
                    f"there is no scenario file in {str(path)!r}, {what}",
                    valid=["a folder of scenario files (*.yaml with 'scenarios:')"],
                )
            files += found
            left_out += [file for file in below if file not in found]
        elif path.exists():
            files.append(path)
        else:
            pattern = any(sign in str(path) for sign in "*?[")
            what = "no file that is called like" if pattern else "no file"
            raise ConfigError(
                f"there is {what} {str(path)!r}", valid=["scenarios", "scenarios/goto_user.yaml"]
            )
    return FoundFiles(tuple(dict.fromkeys(files)), tuple(dict.fromkeys(left_out)))


def looks_like_scenarios(path: Path) -> bool:
    """Whether a YAML file in a folder is meant to hold scenarios; one that cannot be read counts too."""
    try:
        data = read_bytes(path)
    except ConfigError:
        return True
    if _MISSION.search(data):
        return _CERTAIN.search(data) is not None
    return _SCENARIOS.search(data) is not None


def _below(folder: Path) -> Iterator[Path]:
    """Every YAML file below a folder, in order, without hidden folders and virtual environments."""
    for at, names, files in os.walk(folder):
        names[:] = sorted(name for name in names if not name.startswith(".") and not _foreign(Path(at, name)))
        yield from (Path(at, name) for name in sorted(files) if name.endswith(SUFFIXES))


def _foreign(folder: Path) -> bool:
    return folder.name in ("__pycache__", "node_modules") or (folder / "pyvenv.cfg").exists()
