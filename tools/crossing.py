"""Measures how well two people keep their ids who cross each other in view of the robot.

``python tools/crossing.py --minutes 60 --write docs/notes/people.md``
"""

from __future__ import annotations

import argparse
import colorsys
import itertools
import math
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from florence_bt.app.bringup.simulated import robot_frames
from florence_bt.core.geometry import Pose2, Twist2, angle_difference
from florence_bt.core.sensing import ColourImage, DepthImage, TrackedUser
from florence_bt.core.transforms import Transform3
from florence_bt.drivers.hokuyo.geometry import URG_04LX, scan_from_distances
from florence_bt.drivers.kinect.codec import metres_from_raw
from florence_bt.drivers.turtlebot.parameters import TurtlebotParameters
from florence_bt.drivers.turtlebot.wheels import wheels_from_twist
from florence_bt.simulation.home.build_map import laser_map
from florence_bt.simulation.home.flat import Colour, Flat, load_flat
from florence_bt.simulation.home.free_space import FreeSpace, Point, free_space_of
from florence_bt.simulation.home.generate import generated_flat
from florence_bt.simulation.home.person import PersonSpec
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.rig.robot import BASE_FRAME, CAMERA_FRAME, LASER_FRAME
from florence_bt.simulation.sensors.kinect_sensor import KinectSensor
from florence_bt.simulation.sensors.laser_sensor import LaserSensor
from florence_bt.skills.people.user_tracker.detector import Detection, detect_people
from florence_bt.skills.people.user_tracker.known_obstacles import KnownObstacles
from florence_bt.skills.people.user_tracker.tracker import UserTracker, filter_users
from tools.processes import processes
from tools.tables import RowTable, command_of, table

FIRST_SEED = 7000
"""Neither the training of the network nor the choice of the tracker's parameters used these people."""

ENCOUNTER_S, PERIOD_S = 60.0, 0.2
HAND_MADE = 5
"""Every so manieth encounter is in the hand-made flat, and those for which generated homes have no room."""

SHIRTS = ("different shirts", "nearly the same shirt", "no colour pictures")
ROBOTS = ("stands", "turns")
MANNERS = ("cross", "pass", "turn round")
"""They cross at an angle, pass each other side by side, or meet and turn round."""
TURN_RADPS, TURN_RAD = 0.25, 0.4
"""The robot turns to and fro at this rate, by so much to either side."""

NEAR_M = 1.0
"""Two people meet when they come this near to each other."""

MATCH_M = 0.5
"""A tracked user this near to a person is that person."""

HALF_VIEW_RAD = math.radians(27.0)
_BODY_M, _ROBOT_M, _TRIES, _HOMES = 0.25, 0.25, 20_000, 3

Random = np.random.Generator
Route = tuple[Point, Point]


@dataclass(frozen=True, slots=True)
class Encounter:
    """Two people who walk to and fro before the robot.

    Attributes:
        flat: The home.
        robot: Where the robot stands, map frame.
        people: The two.
        shirts: One of ``SHIRTS``.
        turns: Whether the robot turns to and fro.
    """

    flat: Flat
    robot: Pose2
    people: tuple[PersonSpec, PersonSpec]
    shirts: str
    turns: bool


@dataclass(frozen=True, slots=True)
class Shown:
    """One picture.

    Attributes:
        time: Seconds.
        robot: Where the robot is, map frame.
        truth: Where the two people are, map frame.
        found: What the detector found, map frame.
        scans: When each scan since the picture before was taken, where its beams ended at nothing of the map,
            map frame, shape (n, 2), and the robot then.
    """

    time: float
    robot: Pose2
    truth: tuple[Point, Point]
    found: Sequence[Detection]
    scans: Sequence[tuple[float, NDArray[np.float64], Pose2]]


@dataclass(frozen=True, slots=True)
class Judged:
    """The fate of the ids in one encounter.

    Attributes:
        seed: Of the home and its people.
        shirts: One of ``SHIRTS``.
        turns: Whether the robot turned.
        seconds: How long it was.
        crossings: How often one passed before or behind the other in view.
        meetings: How often they came nearer to each other than a metre in view.
        seen: In how many pictures a person was tracked, for both people together.
        switches: How often a person got another id than before, or an id went to another person.
    """

    seed: int
    shirts: str
    turns: bool
    seconds: float
    crossings: int
    meetings: int
    seen: int
    switches: int


def encounter(seed: int) -> Encounter:
    """Make two people by seed: where they walk, how fast, and in which shirts."""
    rng = np.random.default_rng((seed, 41))
    shirts = SHIRTS[seed % len(SHIRTS)]
    turns = bool(seed // len(SHIRTS) % 2)
    manner = MANNERS[seed // 6 % len(MANNERS)]
    homes = (generated_flat(seed + 1000 * home) for home in range(_HOMES if seed % HAND_MADE else 0))
    for flat in itertools.chain(homes, (load_flat(),)):
        place = _robot_and_routes(flat, manner, rng)
        if place is not None:
            robot, routes = place
            return Encounter(flat, robot, _people(routes, shirts, rng), shirts, turns)
    raise RuntimeError(f"no place for two people in the homes of seed {seed}")


def _robot_and_routes(flat: Flat, manner: str, rng: Random) -> tuple[Pose2, Sequence[Route]] | None:
    """Find a free place for the robot with two free routes before it, None when none was found."""
    space = free_space_of(flat)
    for _ in range(_TRIES):
        room = flat.rooms[int(rng.integers(len(flat.rooms)))]
        x, y, yaw = rng.uniform(*room.x), rng.uniform(*room.y), rng.uniform(-math.pi, math.pi)
        robot = Pose2(float(x), float(y), float(yaw))
        middle = robot.apply(float(rng.uniform(1.6, 3.2)), float(rng.uniform(-0.3, 0.3)))
        if space.clearance_at(robot.x, robot.y) < _ROBOT_M or space.clearance_at(*middle) < _BODY_M:
            continue
        routes = _routes(middle, manner, rng)
        if all(_is_free(space, each, robot) for each in routes) and space.sees((robot.x, robot.y), middle):
            return robot, routes
    return None


def _routes(middle: Point, manner: str, rng: Random) -> list[Route]:
    """Return the first and the last point of both routes, such that two who are equally fast never touch."""
    heading, half = float(rng.uniform(-math.pi, math.pi)), float(rng.uniform(0.8, 2.0))
    at = Pose2(*middle, heading)
    if manner == "cross":
        angle = float(rng.uniform(0.25, 0.5)) * math.pi * float(rng.choice([-1.0, 1.0]))
        after = float(rng.uniform(0.7, 1.0)) * float(rng.choice([-1.0, 1.0]))
        other = Pose2(*middle, heading + angle)
        return [
            (at.apply(-half, 0.0), at.apply(half, 0.0)),
            (other.apply(after - half, 0.0), other.apply(after + half, 0.0)),
        ]
    if manner == "pass":
        beside = float(rng.uniform(0.5, 0.8)) * float(rng.choice([-1.0, 1.0]))
        return [
            (at.apply(-half, 0.0), at.apply(half, 0.0)),
            (at.apply(half, beside), at.apply(-half, beside)),
        ]
    return [(at.apply(-half, 0.0), at.apply(-0.3, 0.0)), (at.apply(half, 0.0), at.apply(0.3, 0.0))]


def _is_free(space: FreeSpace, route: Route, robot: Pose2) -> bool:
    """Tell whether nothing is in the way, including the robot."""
    points = np.linspace(*route, 40)
    away = np.hypot(points[:, 0] - robot.x, points[:, 1] - robot.y)
    return bool(away.min() > 0.9) and all(space.clearance_at(x, y) >= _BODY_M for x, y in points.tolist())


def _people(routes: Sequence[Route], shirts: str, rng: Random) -> tuple[PersonSpec, PersonSpec]:
    hue, speed = float(rng.random()), float(rng.uniform(0.4, 1.0))
    shift = float(rng.uniform(0.2, 0.8)) if shirts == "different shirts" else float(rng.uniform(-0.02, 0.02))
    first, second = (
        PersonSpec(
            name,
            Pose2(*start, math.atan2(end[1] - start[1], end[0] - start[0])),
            "walking",
            (end,),
            speed,
            _shirt((hue + add) % 1.0, rng),
            round(float(rng.uniform(1.5, 1.95)), 2),
        )
        for name, (start, end), add in zip(("first", "second"), routes, (0.0, shift), strict=True)
    )
    return first, second


def _shirt(hue: float, rng: Random) -> Colour:
    red, green, blue = (
        round(255 * each) for each in colorsys.hsv_to_rgb(hue, rng.uniform(0.6, 0.7), rng.uniform(0.6, 0.7))
    )
    return red, green, blue


def pictures(given: Encounter, seed: int, seconds: float = ENCOUNTER_S) -> Iterator[Shown]:
    """Yield what the robot sees of an encounter through the simulated Kinect, five times a second.

    The simulated laser scans twice as often.
    """
    world = SimulatedWorld(given.flat, people=given.people, start=given.robot, seed=seed)
    frames = robot_frames()
    mount, laser_mount = (frames.lookup(BASE_FRAME, frame) for frame in (CAMERA_FRAME, LASER_FRAME))
    kinect = KinectSensor(world, mount, seed=seed)
    laser = LaserSensor(world, laser_mount, seed + 1)
    known = KnownObstacles(laser_map(given.flat))
    rate = TURN_RADPS if given.turns else 0.0
    for index in range(1, round(seconds / PERIOD_S) + 1):
        turned = angle_difference(world.robot_pose.yaw, given.robot.yaw)
        if turned * rate > 0.0 and abs(turned) > TURN_RAD:
            rate = -rate
        speeds = wheels_from_twist(Twist2(0.0, rate), TurtlebotParameters().wheels())
        world.set_wheels(speeds.left_mmps / 1000.0, speeds.right_mmps / 1000.0)
        now = index * PERIOD_S
        scans = []
        for stamp in (now - PERIOD_S / 2.0, now):
            world.step_to(stamp)
            distances = laser.measure(URG_04LX.first_step, URG_04LX.last_step)
            scan = scan_from_distances(distances, URG_04LX.first_step, 1, URG_04LX, stamp, LASER_FRAME)
            in_map = Transform3.from_pose2(world.robot_pose) @ laser_mount
            scans.append((stamp, known.unmapped_ends(scan, in_map, Pose2()), world.robot_pose))
        raw, pixels = kinect.measure()
        depth = DepthImage(now, CAMERA_FRAME, kinect.camera, metres_from_raw(raw))
        colour = ColourImage(now, CAMERA_FRAME, kinect.camera, pixels)
        robot = world.robot_pose
        found = detect_people(
            depth, mount, None if given.shirts == SHIRTS[2] else colour, known=known, robot=robot
        )
        first, second = ((pose.x, pose.y) for pose in map(world.person_pose, ("first", "second")))
        yield Shown(now, robot, (first, second), [each.moved_by(robot) for each in found], scans)


class Identities:
    """Compares the ids of tracked users with the truth.

    A person and a user stay together while they are near each other; who is left is matched by the smallest
    sum of distances.

    Source:
        Bernardin and Stiefelhagen, "Evaluating Multiple Object Tracking Performance: The CLEAR MOT Metrics",
        2008, section 2.1.2 (mismatches).
    """

    def __init__(self) -> None:
        self.seen = 0
        self.switches = 0
        self._user_of: dict[int, int] = {}
        self._person_of: dict[int, int] = {}

    def compare(self, truth: Sequence[Point], users: Sequence[TrackedUser]) -> None:
        """Take one picture: where the people are, and who is tracked, in the same frame."""
        pairs = list(self._pairs(truth, users))
        self.seen += len(pairs)
        for person, user_id in pairs:
            before = self._user_of.get(person, user_id), self._person_of.get(user_id, person)
            self.switches += before != (user_id, person)
            self._user_of[person], self._person_of[user_id] = user_id, person

    def _pairs(self, truth: Sequence[Point], users: Sequence[TrackedUser]) -> Iterator[tuple[int, int]]:
        apart = np.array([[math.dist(at, (user.x, user.y)) for user in users] for at in truth])
        apart = apart.reshape(len(truth), len(users))
        same = np.array(
            [[self._user_of.get(person) == user.user_id for user in users] for person in range(len(truth))]
        )
        cost = np.where(apart <= MATCH_M, apart - 10.0 * same.reshape(apart.shape), 1e3)
        for person, column in zip(*linear_sum_assignment(cost), strict=True):
            if cost[person, column] < 1e3:
                yield int(person), users[column].user_id


def judge(given: Encounter, shown: Iterable[Shown], seed: int) -> Judged:
    """Track the people of an encounter and count what became of their ids."""
    tracker, identities = UserTracker(), Identities()
    tracker.start()
    crossings = meetings = 0
    side, near, last = 0.0, False, 0.0
    for picture in shown:
        for scan in picture.scans:
            tracker.saw_scan(*scan)
        users = filter_users(tracker.update(picture.time, picture.found))
        identities.compare(picture.truth, users)
        bearings = [picture.robot.bearing_to(*at) for at in picture.truth]
        in_view = max(map(abs, bearings)) < HALF_VIEW_RAD
        new_side = math.copysign(1.0, bearings[0] - bearings[1]) if in_view else 0.0
        crossings += new_side * side < 0.0
        was_near, near = near, in_view and math.dist(*picture.truth) < NEAR_M
        meetings += near and not was_near
        side, last = new_side, picture.time
    return Judged(
        seed, given.shirts, given.turns, last, crossings, meetings, identities.seen, identities.switches
    )


def judge_seed(seed: int, seconds: float) -> Judged:
    """Judge so many seconds of the encounter of a seed."""
    given = encounter(seed)
    return judge(given, pictures(given, seed, seconds), seed)


def report(judged: Sequence[Judged]) -> str:
    """Write all results as Markdown."""
    head = ("shirts", "robot", "minutes", "crossings in view", "meetings in view", "tracked", "id switches")
    rows = []
    for shirts, robot in itertools.product(SHIRTS, ROBOTS):
        mine = [each for each in judged if (each.shirts, each.turns) == (shirts, robot == "turns")]
        rows.append((shirts, robot, *_cells(mine)))
    return table(head, [*rows, ("all", "", *_cells(judged))])


def _cells(judged: Sequence[Judged]) -> Iterator[str]:
    seconds = sum(each.seconds for each in judged)
    yield f"{seconds / 60.0:.0f}"
    yield str(sum(each.crossings for each in judged))
    yield str(sum(each.meetings for each in judged))
    shown = 2.0 * seconds / PERIOD_S
    yield f"{100.0 * sum(each.seen for each in judged) / shown:.0f} %" if shown else ""
    yield str(sum(each.switches for each in judged))


TABLE = RowTable("crossing", Judged, report)


def main(arguments: Sequence[str] | None = None) -> int:
    """Let people cross each other and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--minutes", type=int, default=60, help="how many pairs of people; a simulated minute of each"
    )
    parser.add_argument(
        "--seconds", type=float, default=ENCOUNTER_S, help="simulated seconds in place of that minute"
    )
    parser.add_argument("--seed", type=int, default=FIRST_SEED, help="first seed of a home and its people")
    parser.add_argument("--jobs", type=int, default=2, help="pairs at a time, each on a core")
    parser.add_argument(
        "--write", type=Path, metavar="PAGE", help="put the table between the marks of this page"
    )
    given = parser.parse_args(arguments)
    seeds = range(given.seed, given.seed + given.minutes)
    with processes(given.jobs) as pool:
        judged = list(pool.map(partial(judge_seed, seconds=given.seconds), seeds))
    TABLE.publish(judged, given.write, command_of("tools/crossing.py", arguments))
    return 0


if __name__ == "__main__":
    sys.exit(main())
