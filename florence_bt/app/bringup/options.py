"""The options of a bring-up, in one value that travels to every process as JSON."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass, field
from pathlib import Path

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.file_sets import replace_files
from florence_bt.core.geometry import Pose2
from florence_bt.ros.arguments import namespace_in, renamed_nodes, ros_arguments

NAVIGATIONS = ("own", "nav2")
"""Origins of the navigation: Florence's, or a Nav2 that is already running."""
BASES = ("own", "running")
"""Origins of the drivers of base and sensors: Florence's, or others that run already."""
FILE = "options.json"
"""Its name in the folder of a bring-up."""
STARTS = (
    "florence up --sim",
    "florence up --robot CONFIG",
    "florence up --missions-only beside a robot",
)
"""Ways of starting a system."""
ABSENT = "absent"
"""The value of ``person`` that means nobody is at home."""


@dataclass(frozen=True, slots=True)
class BringUp:
    """One bring-up of the whole system.

    Attributes:
        folder: Holds the logs, the simulated ports and the runs of this bring-up.
        simulated: Whether the hardware is the simulated flat; otherwise the ports of the configuration.
        emulated: Whether a robot's bring-up drives emulated devices in place of its own, as a rehearsal:
            base and sensors of the simulated flat, in real time.
        config_file: The robot's configuration, None for the one of the package.
        map_file: Map of the flat, None for the one of the package.
        hotspots_file: Hotspots of the flat, None for the one of the package.
        nav: One of :data:`NAVIGATIONS`.
        base: One of :data:`BASES`.
        mapping: Whether a map is made while the robot drives, in place of one that is known.
        resumed_drive: The file of a drive (``map build``) that the map goes on with, None for a new map.
        missions_only: Whether only the mission server and the locator come up, beside a robot that runs.
        speech: The parameter ``program`` of the node ``speech``, None for that of the configuration.
        home_file: The home sensors (docs/manual/home_sensors.md), None for none.
        person: Simulated only: the room the person is in, what they do, None for a random room, ``absent``
            for nobody (``app.bringup.simulated.who_is_at_home``).
        start: Pose of the robot at the start in the map frame, None for the flat's own.
        user_room: The room in which the user was last seen, None for what the configuration says.
        world_file: Source file of the simulated home, None for the flat that comes with Florence.
        world_seed: Seed of a generated home in its place.
        seed: Seed of every random generator.
        speed: Simulated seconds per wall second to aim at.
        record: Whether what is published is recorded.
        foxglove_port: The TCP port of 127.0.0.1 at which Foxglove finds the robot, 0 for none.
        page_port: The TCP port of the page in a browser, 0 for none.
        page_host: The address at which it is served.
        split: Whether each node has a process of its own.
        mission_folders: Folders of missions beside the built-in ones; later ones shadow earlier ones.
        ros_arguments: The ROS arguments of every process (``ros.arguments``); those of this one when not
            given. What they say about parameters goes over the configuration.
    """

    folder: str
    simulated: bool = True
    emulated: bool = False
    config_file: str | None = None
    map_file: str | None = None
    hotspots_file: str | None = None
    nav: str = "own"
    base: str = "own"
    mapping: bool = False
    resumed_drive: str | None = None
    missions_only: bool = False
    home_file: str | None = None
    speech: str | None = None
    person: str | None = None
    start: tuple[float, float, float] | None = None
    user_room: str | None = None
    world_file: str | None = None
    world_seed: int | None = None
    seed: int = 0
    speed: float = 1.0
    record: bool = False
    foxglove_port: int = 0
    page_port: int = 0
    page_host: str = "127.0.0.1"
    split: bool = False
    mission_folders: tuple[str, ...] = ()
    ros_arguments: tuple[str, ...] = field(default_factory=ros_arguments)

    def __post_init__(self) -> None:
        """Check the values."""
        if not 0.05 <= self.speed <= 100.0:
            raise ConfigError(f"speed is {self.speed}", valid=["0.05 <= speed <= 100"])
        if self.seed < 0:
            raise ConfigError(f"seed is {self.seed}", valid=["0 or a positive whole number"])
        if renamed := renamed_nodes(self.ros_arguments):
            raise ConfigError(
                f"the nodes of a bring-up find each other by their names, so {renamed[0]}:= cannot be",
                valid=["--namespace /robot1", "-r topic:=another"],
            )
        for name, value, known in (("nav", self.nav, NAVIGATIONS), ("base", self.base, BASES)):
            if value not in known:
                raise ConfigError(f"--{name} is {value!r}", valid=closest_first(value, known))
        if self.base == "running" and (self.in_flat or self.nav != "nav2"):
            raise ConfigError(
                "a base that is already running is driven by a Nav2 that is already running",
                valid=["--robot CONFIG --base running --nav nav2"],
            )
        if self.missions_only and self.base != "running":
            raise ConfigError(
                "with --missions-only base and navigation run already", valid=["--missions-only alone"]
            )
        if self.mapping and (self.map_file is not None or self.nav == "nav2"):
            raise ConfigError(
                "with --mapping Florence makes the map, and drives on it",
                valid=["--mapping without --map", "--mapping without --nav nav2"],
            )
        if self.resumed_drive is not None and not self.mapping:
            raise ConfigError("--continue goes on with a map", valid=["--mapping --continue FILE.drive"])
        if not self.in_flat and (self.world_file is not None or self.world_seed is not None):
            raise ConfigError(
                "--world and --world-seed are simulated homes", valid=["--sim", "--robot --emulate"]
            )

    @property
    def namespace(self) -> str:
        """The namespace of every node, as ``/robot1``; empty for the root."""
        return namespace_in(self.ros_arguments) or ""

    @property
    def in_flat(self) -> bool:
        """Tell whether the devices are those of the simulated flat."""
        return self.simulated or self.emulated

    @property
    def has_recorder(self) -> bool:
        """Tell whether there is a recorder, for files or for Foxglove."""
        return self.record or self.foxglove_port > 0

    @property
    def own_world(self) -> bool:
        """Tell whether the simulated home is another one than the flat that comes with Florence."""
        return self.world_file is not None or self.world_seed is not None

    @property
    def has_no_places(self) -> bool:
        """Tell whether neither a map nor hotspots are known at first."""
        return self.missions_only or self.mapping

    @property
    def runs(self) -> Path:
        """Parent of the folders of the runs."""
        return Path(self.folder) / "runs"

    @property
    def hotspots(self) -> Path:
        """The file with the hotspots; of those of the package a copy, because ``setHotspot`` writes to it."""
        name = "places.yaml" if self.has_no_places else "hotspots.yaml"
        return Path(self.hotspots_file or Path(self.folder) / name)

    @property
    def start_pose(self) -> Pose2 | None:
        """The start as a pose."""
        return Pose2(*self.start) if self.start else None

    def up_file(self, group: str) -> Path:
        """Return where the process of a group of nodes writes its process id once all its nodes are there."""
        return Path(self.folder) / "up" / group

    def write(self) -> Path:
        """Write to ``options.json`` in the folder and return that file.

        Raises:
            ConfigError: The folder cannot be made or written to.
        """
        file = Path(self.folder) / FILE
        try:
            replace_files({file: f"{json.dumps(asdict(self), indent=1)}\n".encode()}, make_folders=True)
        except OSError as error:
            raise ConfigError(
                f"the folder {self.folder!r} cannot be used: {error.strerror}",
                valid=["a folder that can be written to, with --out"],
            ) from error
        return file

    @staticmethod
    def read(file: Path) -> BringUp:
        """Read what :meth:`write` wrote."""
        values = json.loads(file.read_text(encoding="utf-8"))
        if values["start"] is not None:
            values["start"] = tuple(values["start"])
        for name in ("mission_folders", "ros_arguments"):
            values[name] = tuple(values[name])
        return BringUp(**values)


def parse_start(text: str) -> tuple[float, float, float]:
    """Parse the place where the robot starts, as people write it: ``x,y,yaw`` in metres and degrees.

    Returns:
        x, y in metres and the heading in radians.

    Raises:
        ConfigError: The text is something else.
    """
    try:
        x, y, yaw = (float(part) for part in text.split(","))
    except ValueError:
        x = y = yaw = math.nan
    if not all(math.isfinite(number) for number in (x, y, yaw)):
        raise ConfigError(f"{text!r} is not a start", valid=["x,y,yaw in metres and degrees, e.g. 1.5,2,90"])
    return x, y, math.radians(yaw)
