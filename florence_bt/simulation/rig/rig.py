"""The rig: robot, flat, skills and executor in one process on one manual clock. No ROS, no bytes.

The same seed gives the same run, bit for bit, many times faster than real time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import partial
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.clock import ManualClock, call_every
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result, failure, success
from florence_bt.core.ports import Ports
from florence_bt.core.sensing import LaserScan, OccupancyGrid
from florence_bt.core.skill import SkillRun
from florence_bt.core.transforms import TransformBuffer
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.journal import Journal
from florence_bt.runtime.recorder import RunRecord, RunRecorder
from florence_bt.runtime.run import MissionRequest, MissionRun, RunIds
from florence_bt.simulation.home.flat import Flat
from florence_bt.simulation.home.people import PersonSpec
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.rig.robot import BASE_FRAME, ODOM_FRAME, Config, RigRobot, parameters_of
from florence_bt.simulation.rig.skills import RigVoice, rig_skills
from florence_bt.simulation.rig.wires import ExclusiveComponent, Link, Wires
from florence_bt.skills.locator.hotspots import Hotspots
from florence_bt.skills.locator.locator import Locator
from florence_bt.skills.navigation.mapping.growing_map import GrowingMap
from florence_bt.skills.navigation.navigate.bindings import SPEED_LIMIT
from florence_bt.skills.navigation.navigate.costmap import BODIES, LASER
from florence_bt.skills.navigation.navigate.navigator import FEET, Navigator
from florence_bt.skills.navigation.navigate.parameters import NavigatorParameters
from florence_bt.skills.navigation.navigate.people_frames import see_people
from florence_bt.skills.navigation.navigate.results import NO_POSE, BaseStop
from florence_bt.skills.people.approach_user.polite_pose import propose_approach
from florence_bt.skills.people.user_tracker.parameters import (
    DetectorParameters,
    LookParameters,
    TrackerParameters,
)
from florence_bt.skills.people.user_tracker.tracking import BODIES as BODY_SCAN
from florence_bt.skills.people.user_tracker.tracking import (
    FOUND,
    MAP,
    SCAN,
    FoundUser,
    UserTracking,
    UserTrackingParameters,
)
from florence_bt.skills.robot_description.room import RoomParameters
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.loader import MissionLibrary

BATTERY_PERIOD_S = 1.0
"""As of the base's driver."""
SETTLE_S = 2.0
"""Seconds before a mission, in which the gyro learns its rest offset and the costmaps fill."""


@dataclass(frozen=True, slots=True)
class RigSetting:
    """The setting that a rig is built from.

    Attributes:
        flat: The simulated flat.
        grid: Its map.
        hotspots: Its hotspots.
        frames: The robot's static frames.
        config: Parameters by node name.
        people: Who is at home.
        start: Where the robot stands at first, None for the flat's own place.
        believed: Where it believes to stand at first, None for where it does.
        user_room: Where the user was last seen, empty for unknown.
        seed: Start of every random generator.
        runs_folder: Where the runs leave their folders, None for nowhere.
        mapping: What makes a map in place of that one, None for nothing.
        missions: The missions; those of this installation when not given.
        links: How well topics are carried, by name; perfectly without an entry.
    """

    flat: Flat
    grid: OccupancyGrid
    hotspots: Hotspots
    frames: TransformBuffer
    config: Config
    people: Sequence[PersonSpec] = ()
    start: Pose2 | None = None
    believed: Pose2 | None = None
    user_room: str = ""
    seed: int = 0
    runs_folder: Path | None = None
    mapping: GrowingMap | None = None
    missions: MissionLibrary | None = None
    links: Mapping[str, Link] = field(default_factory=dict)


class Rig:
    """A robot in a flat that is driven by hand.

    Attributes:
        clock: Advance it and everything happens.
        world: The truth.
        executor: Runs the missions.
        records: What finished runs left, when a folder for runs was given.
        topics: The topics that skills use beside actions and services, by name.
        wires: They connect the components.
        found: Where looks for a person have found one so far, in the map frame.
        charge_fraction: How full the battery is, 0 to 1; it stays as it is set.
    """

    def __init__(self, setting: RigSetting) -> None:
        self.clock = ManualClock()
        start = setting.start or setting.flat.start
        self.world = SimulatedWorld(setting.flat, people=setting.people, start=start, seed=setting.seed)
        self.wires = Wires(self.clock, setting.frames.mounts(), setting.links, setting.seed)
        self.topics = self.wires.topics
        self.robot = RigRobot(
            self.world,
            setting.grid,
            setting.frames,
            setting.config,
            self.clock,
            seed=setting.seed,
            start=setting.believed or start,
            ports=self.wires.ports("turtlebot_node"),
            on_scan=self._on_scan,
            driving=lambda: self._base.active,
            mapping=setting.mapping,
            on_map=self._use_map,
        )
        self.locator = Locator(setting.hotspots, self.clock, setting.user_room)
        self.locator.map = setting.grid
        self._base = _BaseSkills(self.robot, setting, self.clock, self.wires.ports("navigate"))
        self._tracking = _user_tracking(self.wires.ports("user_tracker_ni_node"), setting.config)
        self._map = self.wires.ports("map_server").output(MAP)
        self._map.send(setting.grid)
        self._scans = self.wires.ports("laser_filter").output(SCAN)
        self.found: list[Pose2] = []
        self.topics[FOUND.name].subscribe(self._note_found)
        room = parameters_of(RoomParameters, setting.config, "navigate")
        skills = rig_skills(
            {
                "base": self._base,
                "locator": self.locator,
                "approach": lambda **inputs: propose_approach(
                    **inputs, costmap=self._base.global_grid(), room=room
                ),
                "voice": RigVoice(self.wires),
            },
            self.wires,
            setting.seed,
        )
        self.topics[SPEED_LIMIT].subscribe(self._base.limit_speed)
        self.charge_fraction = 1.0
        call_every(self.clock, BATTERY_PERIOD_S, self._publish_battery)
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
                self.executor, setting.runs_folder, self.clock, lambda: self.robot.pose, self.records.append
            )
        call_every(self.clock, 0.1, self._locate)
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
    def plan(self) -> NDArray[np.float64] | None:
        """The way that is being driven, (n, 2) in metres in the map frame; None when nothing is."""
        return self._base.path

    @property
    def scan(self) -> LaserScan | None:
        """What the laser saw last, filtered; None before its first scan."""
        return self._base.scan

    @property
    def grid(self) -> OccupancyGrid:
        """The map as it is now."""
        assert self.locator.map is not None
        return self.locator.map

    def _use_map(self, grid: OccupancyGrid) -> None:
        self.locator.map = grid
        self._base.use_map(grid)
        self._map.send(grid)

    def _on_scan(self, source: str, scan: LaserScan) -> None:
        self._base.on_scan(source, scan)
        if source == LASER:
            self._scans.send(scan)

    def _note_found(self, user: FoundUser) -> None:
        self.found.append(Pose2(user.user_position_x, user.user_position_y))

    def _publish_battery(self) -> None:
        self.topics["battery_state"].publish(percentage=self.charge_fraction)

    def _locate(self) -> None:
        self.locator.robot = self.robot.pose


class _BaseSkills:
    """The skills that drive, on one navigator."""

    def __init__(self, robot: RigRobot, setting: RigSetting, clock: ManualClock, ports: Ports) -> None:
        parameters = navigator_parameters(setting.config)
        self._moving_frames = ports.listen_to_frames()
        ports.listen(BODY_SCAN, partial(self.on_scan, BODIES))
        self._navigator = Navigator(setting.grid, parameters)
        self._navigator.set_zones(setting.hotspots.zones)
        self._component = ExclusiveComponent()
        self._robot = robot
        self._clock = clock
        self._frames = setting.frames
        self.scan: LaserScan | None = None
        call_every(clock, 1.0 / parameters.cycle.controller_frequency, self._step)

    @property
    def active(self) -> bool:
        """Whether something is being driven."""
        return bool(self._navigator.active)

    @property
    def path(self) -> NDArray[np.float64] | None:
        """The way that is being driven, None when nothing is."""
        return self._navigator.plan if self._navigator.active else None

    def global_grid(self) -> OccupancyGrid:
        """Return the global costmap."""
        return self._navigator.global_grid()

    def on_scan(self, source: str, scan: LaserScan) -> None:
        if source == FEET:
            self.scan = scan
        sensor_in_base = self._frames.lookup(BASE_FRAME, scan.frame_id)
        self._navigator.add_scan(
            source, scan, sensor_in_base, self._robot.odometry.pose, self._robot.map_from_odom
        )

    def limit_speed(self, message: Any) -> None:
        self._navigator.speed_limit = message.data

    def navigate(self, goal: Pose2, precise: bool) -> SkillRun:
        run = self._component.begin("driving", self._navigator.cancel)
        self._navigator.start(goal, self._clock.now(), precise=precise)
        return run

    def navigate_through(self, goals: Sequence[Pose2]) -> SkillRun:
        run = self._component.begin("driving", self._navigator.cancel)
        self._navigator.start_through(goals, self._clock.now())
        return run

    def use_map(self, grid: OccupancyGrid) -> None:
        self._navigator.replace_map(grid)

    def get_frontier(self, number: int) -> Result:
        place = self._robot.map_from_odom
        if place is None:
            return failure("no_pose", NO_POSE)
        return self._navigator.next_view(place @ self._robot.odometry.pose, number)

    def plan(self, goal: Pose2) -> Result:
        place = self._robot.map_from_odom
        if place is None:
            return failure("no_pose", NO_POSE)
        plan = self._navigator.plan_between(place @ self._robot.odometry.pose, goal)
        return plan if isinstance(plan, Result) else success(length=plan.length)

    def clear_costmap(self) -> Result:
        self._navigator.global_costmap.reset_outside(0.0, 0.0, 0.0)
        return success()

    def drive_straight(self, distance: float, speed: float, time_allowance: float) -> SkillRun:
        run = self._component.begin("driving straight on", self._navigator.cancel)
        self._navigator.start_straight(distance, speed, self._clock.now(), time_allowance)
        return run

    def turn(self, angle: float, time_allowance: float) -> SkillRun:
        run = self._component.begin("turning", self._navigator.cancel)
        self._navigator.start_spin(angle, self._clock.now(), time_allowance)
        return run

    def follow(self, user_id: int, distance: float, max_lin_speed: float, max_ang_speed: float) -> SkillRun:
        run = self._component.begin("following", self._navigator.cancel)
        self._navigator.start_follow(self._clock.now(), user_id, distance, max_lin_speed, max_ang_speed)
        return run

    def search(self, user_id: int, max_lin_speed: float, max_ang_speed: float) -> SkillRun:
        run = self._component.begin("searching", self._navigator.cancel)
        self._navigator.start_search(self._clock.now(), user_id, max_lin_speed, max_ang_speed)
        return run

    def approach(
        self,
        x: float,
        y: float,
        distance: float,
        p2r_orientation: float,
        r2p_orientation: float,
        max_lin_speed: float,
        max_ang_speed: float,
    ) -> SkillRun:
        run = self._component.begin("approaching the person", self._navigator.cancel)
        orientations = p2r_orientation, r2p_orientation
        self._navigator.start_approach(
            self._clock.now(), (x, y), distance, orientations, max_lin_speed, max_ang_speed
        )
        return run

    def _step(self) -> None:
        if not self._navigator.active:
            return
        self._navigator.base_stop = BaseStop(*self._robot.stop)
        now = self._clock.now()
        see_people(self._navigator, self._moving_frames.buffer, ODOM_FRAME, now)
        step = self._navigator.step(now, self._robot.odometry, self._robot.map_from_odom)
        if step.command is not None:
            self._robot.command(step.command)
        if step.result is not None:
            self._component.finish(step.result)


def navigator_parameters(config: Config) -> NavigatorParameters:
    """Return all parameters of navigation from the flat section of the node ``navigate``."""
    hints = get_type_hints(NavigatorParameters)
    return NavigatorParameters(
        **{
            field.name: parameters_of(hints[field.name], config, "navigate")
            for field in fields(NavigatorParameters)
        }
    )


def _user_tracking(ports: Ports, config: Config) -> UserTracking:
    node = "user_tracker_ni_node"
    return UserTracking(
        ports,
        parameters_of(UserTrackingParameters, config, node),
        parameters_of(DetectorParameters, config, node),
        parameters_of(TrackerParameters, config, node),
        parameters_of(LookParameters, config, node),
    )
