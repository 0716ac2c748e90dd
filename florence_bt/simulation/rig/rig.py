"""The rig: robot, flat, skills and executor in one process on one manual clock. No ROS, no bytes.

The same seed gives the same run, bit for bit, many times faster than real time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.clock import ManualClock
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import LaserScan, OccupancyGrid
from florence_bt.core.skill import Skill
from florence_bt.core.topics import FOUND, MAP, FoundUser
from florence_bt.core.transforms import TransformBuffer, TransformUnavailable
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.journal import Journal
from florence_bt.runtime.recorder import RunRecord, RunRecorder
from florence_bt.runtime.run import MissionRequest, MissionRun, RunIds
from florence_bt.simulation.home.flat import Flat
from florence_bt.simulation.home.people import PersonSpec
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.rig.components import (
    Config,
    connect_approach,
    connect_filters,
    connect_localiser,
    connect_locator,
    connect_mapping,
    connect_navigation,
    connect_user_tracking,
    connect_voice,
)
from florence_bt.simulation.rig.drawn_people import DrawnPeople
from florence_bt.simulation.rig.robot import BASE_FRAME, MAP_FRAME, USUAL_QUALITY, RigRobot, SensorQuality
from florence_bt.simulation.rig.skills import rig_skills
from florence_bt.simulation.rig.wires import Link, Wires
from florence_bt.skills.locator.hotspots import Hotspots
from florence_bt.skills.navigation.mapping.growing_map import MapMaker
from florence_bt.skills.navigation.navigate.navigation import (
    SCANS,
)
from florence_bt.skills.navigation.navigate.navigator import FEET, Navigator
from florence_bt.skills.people.user_tracker.detector import Network, network_says
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.loader import MissionLibrary

T = TypeVar("T")
SkillChange = Callable[[dict[str, Skill], ManualClock], dict[str, Skill]]
FEET_SCAN = next(topic for topic, source in SCANS.items() if source == FEET)
SETTLE_S = 2.0
"""Seconds before a mission, in which the gyro learns its rest offset and the costmaps fill."""


@dataclass(frozen=True, slots=True)
class RigSetting:
    """The setting that a rig is built from.

    Attributes:
        flat: The simulated flat.
        grid: Its map; None while it is made.
        hotspots: Its hotspots.
        frames: The robot's static frames.
        config: Parameters by node name.
        people: Who is at home.
        start: Where the robot stands at first, None for the flat's own place.
        believed: Where it believes to stand at first, None for where it does.
        user_room: Where the user was last seen, empty for unknown.
        seed: Start of every random generator.
        runs_folder: Where the runs leave their folders, None for nowhere.
        map_maker: What makes the map; None when there is one.
        missions: The missions; those of this installation when not given.
        links: How well topics are carried, by name; perfectly without an entry.
        quality: How good the sensors are.
        change_skills: Given the skills and the clock, returns those that missions get; for faults.
        drawn_people: Whether what the network for people says is drawn (:class:`DrawnPeople`): less time, for
            large numbers of runs.
    """

    flat: Flat
    grid: OccupancyGrid | None
    hotspots: Hotspots
    frames: TransformBuffer
    config: Config
    people: Sequence[PersonSpec] = ()
    start: Pose2 | None = None
    believed: Pose2 | None = None
    user_room: str = ""
    seed: int = 0
    runs_folder: Path | None = None
    map_maker: MapMaker | None = None
    missions: MissionLibrary | None = None
    links: Mapping[str, Link] = field(default_factory=dict)
    quality: SensorQuality = USUAL_QUALITY
    change_skills: SkillChange = lambda skills, clock: skills
    drawn_people: bool = False


class Rig:
    """A robot in a flat that is driven by hand.

    Args:
        setting: What it is built from.

    Raises:
        ConfigError: A link has the name of no topic.

    Attributes:
        clock: Advance it and everything happens.
        world: The truth.
        executor: Runs the missions.
        records: What finished runs left, when a folder for runs was given.
        topics: The topics that skills use beside actions and services, by name.
        wires: They connect the components.
        found: Where looks for a person have found one so far, in the map frame.
        scan: What the laser saw last, filtered; None before its first scan.
        robot: Its hardware.
    """

    def __init__(self, setting: RigSetting) -> None:
        self.clock = ManualClock()
        start = setting.start or setting.flat.start
        self.world = SimulatedWorld(setting.flat, people=setting.people, start=start, seed=setting.seed)
        self.wires = Wires(self.clock, setting.frames.mounts(), setting.links, setting.seed)
        self.topics = self.wires.topics
        self.robot = RigRobot(
            self.world,
            setting.frames,
            setting.config,
            self.clock,
            seed=setting.seed,
            wires=self.wires,
            quality=setting.quality,
        )
        self._frames = self.wires.ports("viewer").listen_to_frames()
        self._first_pose = setting.believed or start
        self._maps = self.wires.ports("map_server").output(MAP)
        if setting.grid is not None:
            self._maps.send(setting.grid)
            connect_localiser(self.wires, setting.config, self._first_pose, setting.seed)
        if setting.map_maker is not None:
            connect_mapping(self.wires, setting.config, setting.map_maker)
        self.locator = connect_locator(self.wires, setting.config, setting.hotspots, setting.user_room)
        connect_filters(self.wires, setting.config)
        self._navigation = connect_navigation(self.wires, setting.config)
        network: Network = network_says
        if setting.drawn_people:
            network = DrawnPeople(self.world, self.robot.kinect, setting.seed).answer
        connect_user_tracking(self.wires, setting.config, network)
        self.topics[FEET_SCAN].subscribe(self._note_scan)
        self.found: list[Pose2] = []
        self.scan: LaserScan | None = None
        self.topics[FOUND.name].subscribe(self._note_found)
        connect_voice(self.wires)
        connect_approach(self.wires, setting.config)
        skills = setting.change_skills(rig_skills(self.wires, setting.seed), self.clock)
        self.executor = Executor(
            setting.missions or MissionLibrary.load(),
            skills,
            collect_declarations(),
            self.clock,
            RunIds(f"rig-{setting.seed}"),
            log=Journal(setting.runs_folder, date=str) if setting.runs_folder is not None else None,
        )
        self.records: list[RunRecord] = []
        if setting.runs_folder is not None:
            RunRecorder(
                self.executor, setting.runs_folder, self.clock, lambda: self.pose, self.records.append
            )
        self.wires.check_links()
        self.clock.advance(SETTLE_S)

    def run(
        self, mission: str, inputs: Mapping[str, str] | None = None, *, limit_s: float = 600.0
    ) -> MissionRun:
        """Run a mission to its end.

        Args:
            mission: Its name.
            inputs: Its inputs as texts.
            limit_s: Simulated seconds after which it is stopped.

        Returns:
            The finished run.
        """
        run = self.executor.trigger(MissionRequest(mission, inputs or {}, caller="rig"))
        end = self.clock.now() + limit_s
        while not run.status.final and self.clock.now() < end:
            self.clock.run_next()
        if not run.status.final:
            self.executor.stop(f"not over after {limit_s:.0f} s")
            while not run.status.final:
                self.clock.run_next()
        return run

    @property
    def pose(self) -> Pose2:
        """Return where the robot believes to be, or last did; base_footprint in the map frame."""
        try:
            return self._frames.buffer.lookup_pose(MAP_FRAME, BASE_FRAME)
        except TransformUnavailable:
            return self._first_pose  # nobody has looked yet

    @property
    def plan(self) -> NDArray[np.float64] | None:
        """The way that is being driven, (n, 2) in metres in the map frame; None when nothing is."""
        return self._navigator.plan if self._navigation.active else None

    @property
    def _navigator(self) -> Navigator:
        navigator = self._navigation.navigator
        assert navigator is not None, "it has its map since the rig has settled"
        return navigator

    @property
    def grid(self) -> OccupancyGrid:
        """The map as it is now."""
        grid = self.topics[MAP.name].last
        assert isinstance(grid, OccupancyGrid), "it has its map since the rig has settled"
        return grid

    def _note_scan(self, scan: LaserScan) -> None:
        self.scan = scan

    def _note_found(self, user: FoundUser) -> None:
        self.found.append(Pose2(user.user_position_x, user.user_position_y))
