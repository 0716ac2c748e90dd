"""The folder of a robot, made by ``florence init``: what ``florence up FOLDER`` brings up."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.core.plain_yaml import YamlNode, read_yaml
from florence_bt.core.yaml_reader import YamlReader

FILE = "florence.yaml"
"""Its settings file."""
FILES = ("robot", "map", "hotspots", "home", "out")
"""Keys whose value is a path, relative to the folder."""
KEYS = (*FILES, "missions", "speech", "emulate")


@dataclass(frozen=True, slots=True)
class RobotFolder:
    """The settings of a robot's folder, with absolute paths; None where it has none.

    Attributes:
        robot: The configuration.
        map: The map.
        hotspots: The hotspots.
        home: The house's own sensors.
        out: Where logs and runs go.
        missions: Folders of missions.
        speech: What speaks.
        emulate: Whether base and sensors are emulated.
    """

    robot: Path
    map: Path | None = None
    hotspots: Path | None = None
    home: Path | None = None
    out: Path | None = None
    missions: tuple[Path, ...] = ()
    speech: str | None = None
    emulate: bool = False


def read_robot_folder(folder: Path) -> RobotFolder:
    """Read the settings file of a robot's folder.

    Raises:
        ConfigError: It is not there, or something in it is wrong; with file, line and column.
    """
    file = folder / FILE
    if not file.is_file():
        raise ConfigError(
            f"{str(folder)!r} is not the folder of a robot: it has no {FILE}",
            valid=[f"florence init {folder}"],
        )
    reader = YamlReader(file)
    entries = reader.mapping(read_yaml(file), KEYS, needed=["robot"])
    base = folder.absolute()

    def path(source: YamlNode, name: str) -> Path:
        return base / Path(reader.text(source, name)).expanduser()

    def folders(source: YamlNode, name: str) -> tuple[Path, ...]:
        return tuple(path(item, name) for item in reader.sequence(source, name))

    readers = dict.fromkeys(FILES, path) | {
        "missions": folders,
        "speech": reader.text,
        "emulate": reader.flag,
    }
    return RobotFolder(**reader.values(entries, readers))
