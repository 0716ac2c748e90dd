"""For colcon, which builds Python packages through this file. What it can read there is in pyproject.toml."""

import os
from pathlib import Path

from setuptools import setup

SHARE = Path("share") / "florence_bt"
DATA = ("maps", "hotspots", "urdf", "config", "launch")


def data_files() -> list[tuple[str, list[str]]]:
    """List the files for ``share``: what ROS wants to know of a package, and the data folders."""
    found = [
        ("share/ament_index/resource_index/packages", ["resource/florence_bt"]),
        (str(SHARE), ["package.xml"]),
    ]
    for kind in filter(os.path.isdir, DATA):
        folders = [Path(kind), *(path for path in sorted(Path(kind).rglob("*")) if path.is_dir())]
        for folder in folders:
            files = sorted(str(file) for file in folder.iterdir() if file.is_file())
            if files and folder.name != "__pycache__":
                found.append((str(SHARE / folder), files))
    return found


setup(python_requires=">=3.11,<3.13", license="Apache-2.0", data_files=data_files())
