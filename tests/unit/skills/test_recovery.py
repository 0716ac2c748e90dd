"""When drives recover, and that those which cannot succeed end in time."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from florence_bt.core.base_stop import BaseStop
from florence_bt.core.geometry import FramedPose, Pose2
from florence_bt.core.outcome import Result
from florence_bt.core.sensing import LaserScan
from florence_bt.core.transforms import Transform3
from florence_bt.skills.navigation.navigate._cell_kernels import LETHAL
from florence_bt.skills.navigation.navigate.costmap import LASER
from florence_bt.skills.navigation.navigate.drive import Drive
from florence_bt.skills.navigation.navigate.drive_actions import PoseGoal
from florence_bt.skills.navigation.navigate.parameters import RecoveryParameters
from florence_bt.skills.navigation.navigate.recovery import (
    RECOVERY_BEHAVIOURS,
    TRANSITIONS,
    DriveEvent,
    DriveState,
    LostTime,
    RecoveryBehaviour,
)
from tests.unit.skills.navigation_world import WALLS, Box, Trip, World
from tools.recovery_page import as_mermaid, as_table

DOOR: Box = (3.9, 2.0, 4.2, 2.8)
BUMPER = BaseStop("bumper", "the left bumper is pressed")
WITHIN_S = 30.0


def test_every_state_can_end_and_is_reached() -> None:
    over = {DriveState.SUCCEEDED, DriveState.ABORTED}
    assert {state for state, _ in TRANSITIONS} == set(DriveState) - over
    assert set(TRANSITIONS.values()) == set(DriveState)
    assert {event for _, event in TRANSITIONS} == set(DriveEvent)
    for state in set(DriveState) - over:
        assert DriveState.ABORTED in {after for (before, _), after in TRANSITIONS.items() if before is state}


def test_the_page_has_the_table_of_the_code() -> None:
    page = (Path(__file__).parents[3] / "docs" / "notes" / "navigation.md").read_text(encoding="utf-8")
    assert as_mermaid() in page and as_table() in page, (
        "python tools/recovery_page.py docs/notes/navigation.md"
    )


def test_lost_time_counts_where_the_robot_gets_no_nearer() -> None:
    lost = LostTime(RecoveryParameters(progress_distance=0.5), 0.0)
    assert lost.saw(0.1, 3.0)
    assert not lost.saw(0.2, 2.9) and lost.seconds == 0.0
    # It stands, then has no plan.
    assert not lost.saw(1.2, 2.9) and not lost.saw(2.2, math.inf)
    assert lost.seconds == pytest.approx(2.0)
    # On a detour time is not lost, but what was lost stays.
    for step in range(20):
        assert not lost.saw(3.2 + step, 9.0 - 0.3 * step)
    assert lost.seconds == pytest.approx(3.0)
    assert lost.saw(30.0, 2.4) and lost.seconds == 0.0


def until_over(trip: Trip, goal: Pose2, each: Callable[[World], None]) -> tuple[Result, float]:
    """The result, and for how long the robot had not come nearer to its goal."""
    trip.navigator.start(PoseGoal(FramedPose(goal)), trip.world.now)
    least, since = math.inf, trip.world.now
    while trip.world.now < 120.0:
        each(trip.world)
        result = trip.cycle()
        left = trip.world.pose.distance_to(goal)
        if left < least - 0.1:
            least, since = left, trip.world.now
        if result is not None:
            return result, trip.world.now - since
    pytest.fail(f"not over: {trip.texts[-1]}")


def closed_door(trip: Trip, world: World) -> None:
    world.boxes = [*WALLS, DOOR] if world.now > 2.0 else list(WALLS)


def felt_everywhere(trip: Trip, world: World) -> None:
    """Something that only the bumper feels, right across the room."""
    trip.navigator.base_stop = BUMPER if world.pose.x > 2.6 and math.cos(world.pose.yaw) > 0.5 else BaseStop()


def caught(trip: Trip, world: World) -> None:
    """People stand close round the robot."""
    if world.now > 2.0 and len(world.boxes) == len(WALLS):
        x, y = world.pose.x, world.pose.y
        world.boxes += [(x + 0.35, y - 0.5, x + 0.4, y + 0.5), (x - 0.4, y - 0.5, x - 0.35, y + 0.5)]
        world.boxes += [(x - 0.4, y + 0.35, x + 0.4, y + 0.4), (x - 0.4, y - 0.4, x + 0.4, y - 0.35)]


def always_before_it(trip: Trip, world: World) -> None:
    """Somebody plays with the robot: wherever it looks, something is there."""
    x, y = world.pose.apply(0.5, 0.0)
    world.boxes = [*WALLS, (x - 0.1, y - 0.1, x + 0.1, y + 0.1)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("happens", "codes"),
    [
        (closed_door, {"blocked"}),
        (felt_everywhere, {"bumper"}),
        (caught, {"blocked"}),
        (always_before_it, {"no_progress", "blocked"}),
    ],
)
def test_a_drive_that_cannot_succeed_ends_within_half_a_minute(
    happens: Callable[[Trip, World], None], codes: set[str]
) -> None:
    trip = Trip(Pose2(1.5, 2.4, 0.0))
    result, without_progress = until_over(trip, Pose2(6.0, 2.4, 0.0), lambda world: happens(trip, world))
    assert result.code in codes and result.reason
    assert without_progress < WITHIN_S
    assert trip.world.hits == 0


@pytest.mark.slow
def test_people_who_go_away_again_do_not_end_a_drive() -> None:
    trip = Trip(Pose2(1.5, 2.4, 0.0))

    def each(world: World) -> None:
        world.boxes = [*WALLS, DOOR] if 1.0 < world.now < 20.0 else list(WALLS)

    result, _ = until_over(trip, Pose2(6.0, 2.4, 0.0), each)
    assert result.succeeded


@pytest.mark.slow
def test_progress_brings_the_recovery_behaviours_back() -> None:
    trip = Trip(Pose2(1.5, 2.4, 0.0))
    left: list[int] = []

    def each(world: World) -> None:
        drive = trip.navigator._goal
        assert isinstance(drive, Drive)
        left.append(len(drive._untried))
        world.boxes = [*WALLS, DOOR] if 1.0 < world.now < 9.0 else list(WALLS)

    result, _ = until_over(trip, Pose2(6.0, 2.4, 0.0), each)
    assert result.succeeded
    assert min(left) < len(RECOVERY_BEHAVIOURS) == left[-1]


@pytest.mark.slow
@pytest.mark.parametrize("source", ["depth", "low", "overhangs", "people"])
def test_recovering_forgets_nothing_that_the_laser_would_not_see_again(source: str) -> None:
    trip = Trip(Pose2(2.6, 2.4, 0.0))
    trip.navigator.add_scan(
        source,
        LaserScan(0.0, "camera", math.radians(90.0), 0.1, 0.02, 5.6, np.array([0.8], np.float32)),
        Transform3.from_pose2(Pose2()),
        trip.world.odom,
        trip.map_from_odom(),
    )
    place, in_odom = (2.6, 3.2), trip.world.pose.inverse().apply(2.6, 3.2)
    result, _ = until_over(trip, Pose2(6.0, 2.4, 0.0), lambda world: closed_door(trip, world))
    assert result.code == "blocked"
    assert trip.world.now > 20.0 and RecoveryBehaviour.BACK_UP.value in trip.texts
    assert trip.navigator.global_costmap.cost_at(*place) == LETHAL
    assert trip.navigator.local_costmap.cost_at(*in_odom) == LETHAL


def test_recovering_forgets_what_the_laser_marked_where_it_does_not_look_now() -> None:
    trip = Trip(Pose2(1.5, 2.4, 0.0))
    beam = LaserScan(0.0, "laser", 0.0, 0.1, 0.02, 5.6, np.array([0.3], np.float32))
    beyond_the_door = Transform3.from_pose2(Pose2(3.7, 0.0))
    trip.navigator.add_scan(LASER, beam, beyond_the_door, trip.world.odom, trip.map_from_odom())
    global_costmap, place = trip.navigator.global_costmap, (5.5, 2.4)
    assert global_costmap.cost_at(*place) == LETHAL
    trip.world.boxes = [*WALLS, DOOR]

    def each(world: World) -> None:
        world.boxes = [*WALLS, DOOR]

    result, _ = until_over(trip, Pose2(7.0, 3.6, 0.0), each)
    assert result.code == "blocked" and global_costmap.cost_at(*place) < LETHAL


@pytest.mark.slow
@pytest.mark.parametrize(("age_s", "reached"), [(0.0, False), (100.0, True)])
def test_who_was_seen_to_sit_long_ago_does_not_close_the_only_way(age_s: float, reached: bool) -> None:
    trip = Trip(Pose2(2.0, 2.4, 0.0))
    beams = np.linspace(1.6, 2.0, 20, dtype=np.float32)
    trip.world.now += age_s
    for turn in np.linspace(-0.3, 0.3, 40):
        trip.navigator.add_scan(
            "people",
            LaserScan(0.0, "camera", float(turn), 0.0, 0.02, 5.6, beams),
            Transform3.from_pose2(Pose2()),
            trip.world.odom,
            trip.map_from_odom(),
        )
    trip.see()
    result, _ = until_over(trip, Pose2(6.0, 2.4, 0.0), lambda world: None)
    assert result.succeeded is reached


def test_what_is_marked_under_the_nose_does_not_hold_a_robot_that_backs_off() -> None:
    trip = Trip(Pose2(2.0, 2.4, 0.0))
    for costmap, pose in (
        (trip.navigator.local_costmap, trip.world.odom),
        (trip.navigator.global_costmap, trip.world.pose),
    ):
        costmap.add_contact(pose, 0.0)
    touching = [True]

    def each(world: World) -> None:
        touching[0] = touching[0] and world.pose.x > 1.97
        trip.navigator.base_stop = BUMPER if touching[0] else BaseStop()

    trip.navigator.start(PoseGoal(FramedPose(Pose2(1.0, 3.6, 0.0))), trip.world.now)
    result, _ = until_over(trip, Pose2(1.0, 3.6, 0.0), each)
    assert result.succeeded, result.reason
