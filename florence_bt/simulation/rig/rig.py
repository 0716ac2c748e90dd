"""The rig: robot, flat, skills and executor in one process on one manual clock. No ROS, no bytes.

The same seed gives the same run, bit for bit, many times faster than real time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.clock import ManualClock, call_every
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result, cancelled, failure, success
from florence_bt.core.sensing import ColourImage, DepthImage, LaserScan, OccupancyGrid, TrackedUser
from florence_bt.core.skill import SkillRun
from florence_bt.core.transforms import Transform3, TransformBuffer
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.journal import Journal
from florence_bt.runtime.recorder import RunRecord, RunRecorder
from florence_bt.runtime.run import MissionRequest, MissionRun, RunIds
from florence_bt.simulation.home.flat import Flat
from florence_bt.simulation.home.people import PersonSpec
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.rig.robot import BASE_FRAME, CAMERA_FRAME, Config, RigRobot, parameters_of
from florence_bt.simulation.rig.skills import ExclusiveComponent, RigTopic, RigVoice, rig_skills
from florence_bt.skills.locator.hotspots import Hotspots
from florence_bt.skills.locator.locator import Locator
from florence_bt.skills.navigation.mapping.growing_map import GrowingMap
from florence_bt.skills.navigation.navigate.bindings import SPEED_LIMIT
from florence_bt.skills.navigation.navigate.costmap import BODIES, LASER
from florence_bt.skills.navigation.navigate.navigator import FEET, Navigator
from florence_bt.skills.navigation.navigate.parameters import NavigatorParameters
from florence_bt.skills.navigation.navigate.results import NO_POSE, BaseStop
from florence_bt.skills.people.approach_user.polite_pose import Proposals
from florence_bt.skills.people.user_tracker.body_scan import body_scan
from florence_bt.skills.people.user_tracker.camera_view import view_of
from florence_bt.skills.people.user_tracker.detector import detect_people
from florence_bt.skills.people.user_tracker.known_obstacles import KnownObstacles
from florence_bt.skills.people.user_tracker.laser_view import laser_view
from florence_bt.skills.people.user_tracker.look import LookForUser, Wanted
from florence_bt.skills.people.user_tracker.parameters import (
    DetectorParameters,
    LookParameters,
    TrackerParameters,
)
from florence_bt.skills.people.user_tracker.tracker import UserTracker, filter_users, on_the_floor
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


class Rig:
    """A robot in a flat that is driven by hand.

    Attributes:
        clock: Advance it and everything happens.
        world: The truth.
        executor: Runs the missions.
        records: What finished runs left, when a folder for runs was given.
        topics: The topics that skills use beside actions and services, by name.
        charge_fraction: How full the battery is, 0 to 1; it stays as it is set.
    """

    def __init__(self, setting: RigSetting) -> None:
        self.clock = ManualClock()
        start = setting.start or setting.flat.start
        self.world = SimulatedWorld(setting.flat, people=setting.people, start=start, seed=setting.seed)
        self.robot = RigRobot(
            self.world,
            setting.grid,
            setting.frames,
            setting.config,
            self.clock,
            seed=setting.seed,
            start=setting.believed or start,
            on_scan=lambda source, scan: self._on_scan(source, scan),
            on_images=lambda depth, colour: self._people.on_images(depth, colour),
            driving=lambda: self._base.active,
            looking=lambda: self._people.running,
            mapping=setting.mapping,
            on_map=self._use_map,
        )
        self.locator = Locator(setting.hotspots, self.clock, setting.user_room)
        self.locator.map = setting.grid
        self._base = _BaseSkills(self.robot, setting, self.clock)
        self._people = _PeopleSkills(self.robot, setting, self.clock)
        self._people.on_users = self._saw_users
        self._people.on_bodies = partial(self._base.on_scan, BODIES)
        self.topics: dict[str, RigTopic] = {}
        room, proposals = parameters_of(RoomParameters, setting.config, "navigate"), Proposals()
        skills = rig_skills(
            {
                "base": self._base,
                "people": self._people,
                "locator": self.locator,
                "approach": lambda **inputs: proposals.propose(
                    **inputs, costmap=self._base.global_grid(), room=room
                ),
                "voice": RigVoice(self.topics, self.clock),
            },
            self.topics,
            self.clock,
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

    @property
    def found(self) -> Sequence[Pose2]:
        """Where looks for a person have found one so far, in the map frame."""
        return self._people.found

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
        self._people.use_map(grid)

    def _on_scan(self, source: str, scan: LaserScan) -> None:
        self._base.on_scan(source, scan)
        if source == LASER:
            self._base.saw_users(self._people.on_scan(scan))

    def _saw_users(self, users: Sequence[TrackedUser]) -> None:
        seen = self._people.in_image
        self._base.saw_users([user for user in filter_users(users) if user.user_id in seen])
        self.topics["user_lying"].publish(data=on_the_floor(users))

    def _publish_battery(self) -> None:
        self.topics["battery_state"].publish(percentage=self.charge_fraction)

    def _locate(self) -> None:
        self.locator.robot = self.robot.pose


class _BaseSkills:
    """The skills that drive, on one navigator."""

    def __init__(self, robot: RigRobot, setting: RigSetting, clock: ManualClock) -> None:
        parameters = navigator_parameters(setting.config)
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

    def saw_users(self, users: Sequence[TrackedUser]) -> None:
        self._navigator.saw_people(self._clock.now(), [(user.x, user.y) for user in users])
        for user in users:
            self._navigator.saw_person(self._clock.now(), user.user_id, user.x, user.y)

    def _step(self) -> None:
        if not self._navigator.active:
            return
        self._navigator.base_stop = BaseStop(*self._robot.stop)
        step = self._navigator.step(self._clock.now(), self._robot.odometry, self._robot.map_from_odom)
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


class _PeopleSkills:
    """The user tracker and the look for a person."""

    def __init__(self, robot: RigRobot, setting: RigSetting, clock: ManualClock) -> None:
        self._detector = parameters_of(DetectorParameters, setting.config, "user_tracker_ni_node")
        self._tracker = UserTracker(parameters_of(TrackerParameters, setting.config, "user_tracker_ni_node"))
        self._look = LookForUser(parameters_of(LookParameters, setting.config, "user_tracker_ni_node"))
        self.use_map(setting.grid)
        self._component = ExclusiveComponent()
        self._robot = robot
        self._clock = clock
        self._frames = setting.frames
        self._optical_in_base = setting.frames.lookup(BASE_FRAME, CAMERA_FRAME)
        self._looking = False
        self.found: list[Pose2] = []
        self.on_users: Callable[[Sequence[TrackedUser]], None] = lambda users: None
        self.on_bodies: Callable[[LaserScan], None] = lambda scan: None

    @property
    def running(self) -> bool:
        """Whether images are needed."""
        return bool(self._tracker.running) or self._looking

    @property
    def in_image(self) -> list[int]:
        """Whom the last image shows: their persistent ids."""
        return self._tracker.in_view

    def on_images(self, depth: DepthImage, colour: Callable[[], ColourImage] | None) -> None:
        now = self._clock.now()
        odom = self._robot.map_from_odom
        if self._tracker.running and odom is not None:
            robot_in_odom = self._robot.odometry.pose
            robot = odom @ robot_in_odom
            found = detect_people(
                depth, self._optical_in_base, colour, self._detector, known=self._known, robot=robot
            )
            view = view_of(depth, self._optical_in_base, robot_in_odom)
            tracked = self._tracker.update(now, [each.moved_by(robot_in_odom) for each in found], view)
            users = [user.moved_by(odom) for user in tracked]
            self.on_bodies(body_scan(found, now, BASE_FRAME))
            if self._looking:
                self._look.feed(
                    now, users, robot, undecided=self._tracker.undecided, view=view.moved_by(odom)
                )
            self.on_users(tracked)
        self._end_look_when_over()

    def on_scan(self, scan: LaserScan) -> Sequence[TrackedUser]:
        """Return those whose legs go on in a scan while the camera does not see them."""
        odom = self._robot.map_from_odom
        if not self._tracker.running or odom is None:
            return ()
        robot = self._robot.odometry.pose
        laser = Transform3.from_pose2(robot) @ self._frames.lookup(BASE_FRAME, scan.frame_id)
        self._look.saw_scan(laser_view(scan, laser, odom))
        return self._tracker.saw_scan(self._clock.now(), self._known.unmapped_ends(scan, laser, odom), robot)

    def use_map(self, grid: OccupancyGrid) -> None:
        self._known = KnownObstacles(grid)

    def start_tracker(self) -> Result:
        self._tracker.start()
        return success()

    def stop_tracker(self) -> Result:
        self._tracker.stop()
        return success()

    def look(self, window: float, user_id: int, x: float, y: float) -> SkillRun:
        run = self._component.begin("looking", self._cancel_look)
        self._look.start(self._clock.now(), window, Wanted(user_id, x, y))
        self._looking = True
        return run

    def _end_look_when_over(self) -> None:
        if not self._looking:
            return
        result = self._look.result(self._clock.now())
        if result is not None:
            self._looking = False
            if result.succeeded:
                self.found.append(result.outputs["user"])
            self._component.finish(result)

    def _cancel_look(self) -> None:
        self._looking = False
        self._component.finish(cancelled())
