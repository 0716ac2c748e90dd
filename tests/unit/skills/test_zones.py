"""Zones on the way: keep-out zones are driven round and left, and refuse goals; slow ones limit the speed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from florence_bt.core.geometry import FramedPose, Pose2
from florence_bt.core.outcome import Result
from florence_bt.core.polygons import (
    Polygon,
    area,
    cells_inside,
    common_area,
    contains,
    crossing_edges,
    distance_to,
)
from florence_bt.core.zones import KEEP_OUT, SLOW, Zone
from florence_bt.skills.navigation.navigate._cell_kernels import LETHAL
from florence_bt.skills.navigation.navigate.drive_actions import FollowUserGoal, PoseGoal
from florence_bt.skills.navigation.navigate.navigator import Navigator
from florence_bt.skills.navigation.navigate.planner import Plan
from tests.sweeps import examples
from tests.unit.skills.navigation_world import Trip, World, ahead, make_map, outline


def rectangle(x0: float, y0: float, x1: float, y1: float) -> Polygon:
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


RUG = Zone("rug", KEEP_OUT, rectangle(1.5, 1.0, 2.5, 2.6))
"""In the middle of the left room, on the straight way to the right."""
DOOR = Zone("door", KEEP_OUT, rectangle(3.8, 1.9, 4.3, 2.9))


def corners_inside(world: World, zone: Zone) -> int:
    """How many points of the robot's outline are in a zone now."""
    return sum(zone.contains(*world.pose.apply(*corner)) for corner in outline(0.02))


@pytest.mark.slow
@pytest.mark.parametrize("goal", [Pose2(3.2, 1.8, 0.0), Pose2(7.0, 1.5, 0.0)])
def test_no_part_of_the_robot_enters_a_keep_out_zone(goal: Pose2) -> None:
    trip = Trip(Pose2(0.8, 1.8, 0.0), jitter=0.002)
    trip.navigator.set_zones([RUG])
    deepest = 0

    def look(world: World) -> None:
        nonlocal deepest
        deepest = max(deepest, corners_inside(world, RUG))

    assert trip.go(goal, each=look).succeeded
    trip.assert_at(goal)
    assert deepest == 0


@pytest.mark.parametrize(
    ("goal", "reason"),
    [
        (Pose2(2.0, 1.8, 0.0), "lies in the keep-out zone 'rug'"),
        (Pose2(2.6, 1.8, 0.0), "the keep-out zone 'rug' is too near"),
    ],
)
def test_a_goal_in_or_at_a_keep_out_zone_is_refused_by_its_name(goal: Pose2, reason: str) -> None:
    trip = Trip(Pose2(0.8, 1.8, 0.0))
    trip.navigator.set_zones([DOOR, RUG])
    result = trip.go(goal, limit=1.0)
    assert (result.code, trip.world.pose) == ("goal_occupied", Pose2(0.8, 1.8, 0.0))
    assert reason in result.reason
    planned = trip.navigator.plan_between(Pose2(0.8, 1.8, 0.0), goal)
    assert isinstance(planned, Result) and reason in planned.reason
    trip.navigator.set_zones([])
    assert trip.go(goal).succeeded


def test_a_zone_that_closes_every_way_is_named_at_once() -> None:
    trip = Trip(Pose2(2.0, 2.4, 0.0))
    trip.navigator.set_zones([DOOR])
    result = trip.go(Pose2(7.0, 1.5, 0.0), limit=2.0)
    assert result.code == "no_path" and "'door'" in result.reason


@pytest.mark.slow
def test_a_zone_switched_on_while_driving_is_driven_round() -> None:
    trip = Trip(Pose2(0.6, 1.8, 0.0))
    switched = False

    def switch(world: World) -> None:
        nonlocal switched
        if not switched and world.pose.x > 0.9:
            switched = True
            trip.navigator.set_zones([RUG])
        assert not switched or corners_inside(world, RUG) == 0

    assert trip.go(Pose2(3.2, 1.8, 0.0), each=switch).succeeded
    assert switched


@pytest.mark.slow
def test_a_goal_that_is_closed_while_driving_ends_the_drive_by_the_zones_name() -> None:
    trip = Trip(Pose2(0.6, 3.5, 0.0))

    def close(world: World) -> None:
        if world.pose.x > 1.0:
            trip.navigator.set_zones([Zone("bed", KEEP_OUT, rectangle(2.7, 2.8, 3.8, 4.8))])

    result = trip.go(Pose2(3.2, 3.6, 0.0), each=close, limit=20.0)
    assert result.code == "goal_occupied" and "'bed'" in result.reason


@pytest.mark.slow
@pytest.mark.parametrize("start", [Pose2(2.2, 1.8, 0.0), Pose2(1.8, 2.0, math.pi), Pose2(1.35, 1.8, 0.0)])
def test_a_robot_in_a_keep_out_zone_leaves_it_and_stays_out(start: Pose2) -> None:
    """The third one only touches it; none may cross it to the far side once it is out."""
    trip = Trip(start)
    trip.navigator.set_zones([RUG])
    out = False

    def watch(world: World) -> None:
        nonlocal out
        inside = corners_inside(world, RUG)
        out = out or inside == 0
        assert not (out and inside)

    assert trip.go(Pose2(7.0, 1.5, 0.0), each=watch).succeeded
    assert out


@pytest.mark.slow
def test_a_robot_that_a_zone_catches_can_leave_by_the_door_alone() -> None:
    """The zone is the whole left room: the nearest free place is behind its wall."""
    trip = Trip(Pose2(3.0, 4.0, 0.0))
    trip.navigator.set_zones([Zone("room", KEEP_OUT, rectangle(0.0, 0.0, 4.05, 5.0))])
    assert trip.go(Pose2(7.0, 1.5, 0.0)).succeeded
    assert trip.go(Pose2(3.0, 4.0, 0.0), limit=1.0).code == "goal_occupied"


@pytest.mark.slow
@pytest.mark.parametrize(("limit", "is_share", "most"), [(0.15, False, 0.15), (0.2, True, 0.09)])
def test_a_slow_zone_limits_the_speed_there_and_nowhere_else(
    limit: float, is_share: bool, most: float
) -> None:
    trip = Trip(Pose2(0.8, 3.4, 0.0))
    slow = Zone("carpet", SLOW, rectangle(1.6, 2.8, 2.4, 4.0), limit, is_share)
    trip.navigator.set_zones([slow])
    inside: list[float] = []
    outside: list[float] = []

    def note(world: World) -> None:
        if trip.commands:
            there = slow.contains(world.pose.x, world.pose.y) and slow.contains(*world.pose.apply(-0.1, 0.0))
            (inside if there else outside).append(trip.commands[-1])

    assert trip.go(Pose2(3.4, 3.4, 0.0), each=note).succeeded
    assert inside and max(inside) <= most + 1e-9
    assert max(outside) > 0.3


@pytest.mark.parametrize("limit", [0.1, 0.3])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_at_the_border_of_a_slow_zone_its_speed_holds_already(limit: float, way: float) -> None:
    trip = Trip(Pose2(0.7, 3.4, 0.0))
    if way < 0.0:
        trip.come(2.0)
    slow = Zone("carpet", SLOW, rectangle(1.4, 2.8, 2.0, 4.0), limit)
    trip.navigator.set_zones([slow])
    trip.navigator.start(ahead(1.6 * way, 0.45, 0.0), trip.world.now)
    inside: list[float] = []
    outside: list[float] = []
    while trip.cycle() is None:
        there = slow.contains(trip.world.pose.x, trip.world.pose.y)
        (inside if there else outside).append(abs(trip.world.twist.linear))
    assert inside and limit - 0.05 < max(inside) <= limit + 1e-9
    assert max(outside) > 0.44


def test_a_slow_zone_beside_the_way_slows_nothing() -> None:
    trip = Trip(Pose2(0.7, 3.4, 0.0))
    trip.navigator.set_zones([Zone("carpet", SLOW, rectangle(1.0, 3.45, 3.0, 4.0), 0.1)])
    trip.navigator.start(ahead(1.6, 0.45, 0.0), trip.world.now)
    while trip.cycle() is None:
        pass
    assert max(trip.commands) > 0.44


def test_a_slow_zone_limits_follow_and_straight_drives_too() -> None:
    trip = Trip(Pose2(1.0, 3.4, 0.0))
    trip.navigator.set_zones([Zone("carpet", SLOW, rectangle(0.0, 0.0, 4.0, 5.0), 0.1)])
    trip.navigator.start(ahead(0.5, 0.4, 0.0), trip.world.now)
    while trip.cycle() is None:
        pass
    assert 0.0 < max(trip.commands) <= 0.1 + 1e-9
    trip.commands.clear()
    trip.navigator.start(FollowUserGoal(7), trip.world.now)
    for _ in range(30):
        person = trip.world.odom.apply(2.0, 0.0)
        trip.navigator.saw_person(trip.world.now, 7, *person)
        assert trip.cycle() is None
    assert 0.05 < max(trip.commands) <= 0.1 + 1e-9


def test_a_keep_out_zone_is_lethal_in_both_costmaps_and_is_not_cleared() -> None:
    trip = Trip(Pose2(0.8, 1.8, 0.0))
    trip.navigator.set_zones([RUG])
    trip.navigator.start(PoseGoal(FramedPose(Pose2(0.8, 3.0, 0.0))), trip.world.now)
    for _ in range(5):
        trip.cycle()
        trip.navigator.clear()
    in_odom = trip.map_from_odom().inverse().apply(2.0, 1.8)
    assert trip.navigator.cost_at(2.0, 1.8) == LETHAL
    assert trip.navigator.local_costmap.cost_at(*in_odom) == LETHAL
    trip.navigator.set_zones([])
    trip.cycle()
    assert trip.navigator.cost_at(2.0, 1.8) == trip.navigator.local_costmap.cost_at(*in_odom) == 0


COORDINATE = st.floats(-1e4, 1e4) | st.integers(-2, 9).map(float)
POLYGONS = st.lists(st.tuples(COORDINATE, COORDINATE), min_size=3, max_size=12).map(tuple)


@settings(max_examples=examples(40))
@given(st.lists(POLYGONS, max_size=3))
def test_no_polygon_upsets_navigation(polygons: list[Polygon]) -> None:
    navigator = Navigator(make_map())
    navigator.set_zones(Zone(f"{number}", KEEP_OUT, corners) for number, corners in enumerate(polygons))
    start, goal = Pose2(1.0, 1.0, 0.0), Pose2(7.0, 4.0, 0.0)
    plan = navigator.plan_between(start, goal)
    if any(contains(polygon, goal.x, goal.y) for polygon in polygons):
        assert isinstance(plan, Result) and plan.code in ("goal_occupied", "start_occupied")
    elif isinstance(plan, Plan):
        # Between two points of the path there are cells that are not sampled here.
        middles = plan.points[1:-1]
        assert not any(contains(polygon, x, y) for polygon in polygons for x, y in middles.tolist())


@given(POLYGONS)
def test_cells_are_inside_as_their_middles_are(polygon: Polygon) -> None:
    marked = cells_inside(polygon, (-1.0, -2.0), 0.5, (12, 9))
    middles = [[(-1.0 + 0.5 * (u + 0.5), -2.0 + 0.5 * (v + 0.5)) for u in range(9)] for v in range(12)]
    wanted = np.array([[contains(polygon, *middle) for middle in row] for row in middles])
    differ = [middles[v][u] for v, u in zip(*np.nonzero(marked != wanted), strict=True)]
    assert all(distance_to(polygon, *middle) < 1e-6 for middle in differ)


def test_polygons_are_measured() -> None:
    square, bow = rectangle(0, 0, 2, 2), ((0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0))
    assert (area(square), crossing_edges(square)) == (4.0, None)
    assert crossing_edges(bow) == (1, 3)
    assert common_area(square, rectangle(2, 0, 4, 2)) == 0.0
    assert common_area(square, rectangle(1, 1, 4, 4)) == pytest.approx(1.0, rel=0.01)
    assert common_area(square, rectangle(0.5, 0.5, 1.0, 1.0)) == pytest.approx(0.25, rel=0.01)
    assert distance_to(square, 3.0, 1.0) == 1.0
