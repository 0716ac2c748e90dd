"""Paths of the maps, hotspots, robot descriptions and settings that come with Florence.

In a checkout (and an editable install of one) they are folders beside the package. Installed, they are in
``share/florence_bt`` of the prefix that holds the package: a virtual environment, a user's folder, or the
install space of a ROS workspace.
"""

from __future__ import annotations

import sysconfig
from collections.abc import Iterator
from pathlib import Path

from florence_bt.core.errors import ConfigError, closest_first

SHARE = Path("share") / "florence_bt"
KINDS = ("maps", "hotspots", "urdf", "config")
PACKAGE = Path(__file__).resolve().parents[1]


def share_folder(package: Path = PACKAGE) -> Path:
    """Return the folder that has ``maps``, ``hotspots``, ``urdf`` and ``config``.

    Args:
        package: The folder of the package.

    Raises:
        ConfigError: There is none; the message says where it was looked for.
    """
    looked = []
    for folder in _candidates(package):
        if any((folder / kind).is_dir() for kind in KINDS):
            return folder
        looked.append(str(folder))
    raise ConfigError(
        f"the data folders of Florence ({', '.join(KINDS)}) are in none of: {', '.join(looked)}; "
        "install Florence again"
    )


def find_data(kind: str, name: str) -> Path:
    """Find a file that comes with Florence.

    Args:
        kind: The folder: maps, hotspots, urdf or config.
        name: The file in it.

    Raises:
        ConfigError: There is no such folder or file; the message says where it was looked for.
    """
    if kind not in KINDS:
        raise ConfigError(f"there is no kind of data {kind!r}", valid=closest_first(kind, KINDS))
    folder = share_folder() / kind
    path = folder / name
    if not path.is_file():
        present = [file.name for file in folder.iterdir() if file.is_file()] if folder.is_dir() else []
        raise ConfigError(f"there is no {name!r} in {folder}", valid=closest_first(name, present))
    return path


def _candidates(package: Path) -> Iterator[Path]:
    if (package.parent / "pyproject.toml").is_file():  # the checkout
        yield package.parent
    for prefix in package.parents:
        yield prefix / SHARE
    yield Path(sysconfig.get_path("data")) / SHARE
