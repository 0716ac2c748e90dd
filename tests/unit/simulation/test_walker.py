"""How people who walk get past the robot and each other."""

import itertools
import math

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.simulation.home.flat import load_flat
from florence_bt.simulation.home.free_space import free_space_of
from florence_bt.simulation.home.person import PersonSpec
from florence_bt.simulation.home.walker import SQUEEZE_M, STOP_DISTANCE_M, Walker

STEP_S = 0.02
FAR = Pose2(100.0, 0.0)
LIVING_ROOM = PersonSpec("ann", Pose2(2.2, 5.3), "walking", ((5.0, 5.3),))
THROUGH_A_DOOR = PersonSpec("ann", Pose2(6.2, 3.2), "walking", ((6.2, 1.2),), once=True)


@pytest.fixture(scope="module")
def flat():
    return load_flat()


def walk(walker, seconds, robot=FAR, people=()):
    return [walker.advance(STEP_S, robot, people) for _ in range(round(seconds / STEP_S))]


def assert_free(flat, poses):
    space = free_space_of(flat)
    assert min(space.clearance_at(pose.x, pose.y) for pose in poses) >= 0.2


def test_a_walker_goes_round_a_standing_robot_and_returns_to_the_route(flat):
    robot = Pose2(3.5, 5.3)
    poses = walk(Walker(LIVING_ROOM, flat), 7.0, robot)
    assert min(pose.distance_to(robot) for pose in poses) >= STOP_DISTANCE_M - 1e-9
    assert max(abs(pose.y - 5.3) for pose in poses) > 0.5
    assert poses[-1].y == pytest.approx(5.3) and poses[-1].x > 4.5
    assert max(a.distance_to(b) for a, b in itertools.pairwise(poses)) <= 0.5 * STEP_S + 1e-9
    assert_free(flat, poses)


def test_who_is_in_nobodys_way_changes_nothing(flat):
    alone = walk(Walker(LIVING_ROOM, flat), 12.0)
    assert walk(Walker(LIVING_ROOM, flat), 12.0, Pose2(3.5, 6.0), [Pose2(3.0, 4.6)]) == alone
    assert walk(Walker(LIVING_ROOM), 12.0) == alone


def test_the_robot_that_stands_behind_who_turns_round_is_passed(flat):
    """A leader comes back to the robot that followed."""
    walker = Walker(LIVING_ROOM, flat)
    robot = Pose2(4.0, 5.3)
    walk(walker, 5.6)
    poses = walk(walker, 7.0, robot)
    assert poses[-1].x < 2.8 and min(pose.distance_to(robot) for pose in poses) >= STOP_DISTANCE_M - 1e-9


def test_a_robot_that_comes_too_near_is_stepped_back_from(flat):
    walker = Walker(LIVING_ROOM, flat)
    poses = [pose for n in range(100) for pose in walk(walker, 0.02, Pose2(3.0 - 0.005 * n, 5.3))]
    poses += walk(walker, 6.0, Pose2(2.5, 5.3))
    assert poses[-1].x > 3.5 and poses[-1].y == pytest.approx(5.3)
    assert_free(flat, poses)


def test_two_walkers_pass_each_other_and_return_to_their_routes(flat):
    there = Walker(LIVING_ROOM, flat)
    back = Walker(PersonSpec("bob", Pose2(5.0, 5.3), "walking", ((2.2, 5.3),)), flat)
    apart = []
    for _ in range(350):
        there.advance(STEP_S, FAR, [back.pose])
        back.advance(STEP_S, FAR, [there.pose])
        apart.append(there.pose.distance_to(back.pose))
    assert min(apart) >= STOP_DISTANCE_M - 0.011 - 1e-9
    assert there.pose.x > 4.0 and back.pose.x < 3.2
    assert there.pose.y == back.pose.y == pytest.approx(5.3)


def test_a_walker_waits_in_front_of_a_blocked_door_and_walks_on(flat):
    walker, robot = Walker(THROUGH_A_DOOR, flat), Pose2(6.2, 2.2)
    poses = walk(walker, 10.0, robot)
    assert walker.pose == Pose2(6.2, pytest.approx(robot.y + STOP_DISTANCE_M, abs=0.011), -math.pi / 2)
    assert {pose.x for pose in poses} == {6.2} and not walker.arrived
    walk(walker, 4.0)
    assert walker.arrived


def test_who_has_waited_for_some_seconds_passes_nearer_by(flat):
    """Beside the robot in the door there is half a metre, and not more."""
    walker, robot = Walker(THROUGH_A_DOOR, flat), Pose2(6.71, 2.2)
    poses = walk(walker, 3.9, robot)
    assert min(pose.distance_to(robot) for pose in poses) >= STOP_DISTANCE_M - 1e-9
    poses = walk(walker, 6.0, robot)
    assert walker.arrived
    assert min(pose.distance_to(robot) for pose in poses) >= STOP_DISTANCE_M - SQUEEZE_M - 1e-9


def test_who_walks_to_and_fro_turns_round_before_somebody_in_a_door(flat):
    walker = Walker(PersonSpec("ann", Pose2(6.2, 3.4), "walking", ((6.2, 1.2),)), flat)
    poses = walk(walker, 5.2, people=[Pose2(6.2, 2.2)])
    assert min(pose.y for pose in poses) == pytest.approx(2.8, abs=0.011)
    assert walker.pose.y > 3.2


def test_who_walks_once_steps_back_before_somebody_in_a_door_but_not_before_the_robot(flat):
    door = Pose2(6.2, 2.2)
    for bodies in ({"robot": door}, {"people": [door]}):
        walker = Walker(THROUGH_A_DOOR, flat)
        before = walk(walker, 10.0, **bodies)[-1]
        assert before.y < 3.0
        after = walk(walker, 5.0, **bodies)
        stepped_back = "people" in bodies
        assert (max(pose.y for pose in after) > before.y + 0.2) == stepped_back
    assert walk(walker, 10.0)[-1].y == pytest.approx(1.2), "then on, when the door is free"


def test_who_is_hemmed_in_beside_the_route_gets_out_again(flat):
    """Otherwise a visitor, a leader and the robot that follows can hold each other up for ever."""
    walker = Walker(LIVING_ROOM, flat)
    walk(walker, 2.0, Pose2(3.5, 5.3))
    ring = [walker.pose.apply(0.59 * math.cos(a), 0.59 * math.sin(a)) for a in (-0.7, 0.0, 0.7)]
    walk(walker, 8.0, Pose2(3.5, 5.3), [Pose2(*point) for point in ring])
    assert min(walker.pose.distance_to(Pose2(*point)) for point in ring) > 1.0
    assert walker.pose.y == pytest.approx(5.3)


def test_once_means_to_the_end_and_no_further(flat):
    walker = Walker(THROUGH_A_DOOR, flat)
    walk(walker, 3.9)
    assert not walker.arrived
    walk(walker, 5.0)
    assert walker.arrived and walker.pose == Pose2(6.2, pytest.approx(1.2), -math.pi / 2)


def test_who_waits_sets_off_after_that_time(flat):
    walker = Walker(PersonSpec("ann", Pose2(2.2, 5.3), "walking", ((5.0, 5.3),), wait=3.0), flat)
    assert {pose.x for pose in walk(walker, 2.9)} == {2.2}
    walk(walker, 1.1)
    assert walker.pose.x == pytest.approx(2.7, abs=0.011)


def test_who_waits_does_so_at_each_end(flat):
    spec = PersonSpec("ann", Pose2(2.2, 5.3), "walking", ((3.2, 5.3),), speed=0.5, wait=3.0)
    walker = Walker(spec, flat)
    xs = [pose.x for pose in walk(walker, 13.0)]
    ends = [x for x, after in itertools.pairwise(xs) if x == after]
    there, back = (sum(abs(x - end) < 0.02 for x in ends) for end in (3.2, 2.2))
    assert there == pytest.approx(3.0 / STEP_S, abs=2) and back == pytest.approx(6.0 / STEP_S, abs=4)


def test_nobody_waits_less_than_no_time():
    with pytest.raises(ConfigError, match="0 s"):
        PersonSpec("ann", Pose2(), "walking", ((1.0, 0.0),), wait=-1.0)


def test_the_same_bodies_give_the_same_way(flat):
    ways = [walk(Walker(LIVING_ROOM, flat), 8.0, Pose2(3.5, 5.35), [Pose2(4.5, 5.2)]) for _ in range(2)]
    assert ways[0] == ways[1]


def test_who_walks_once_stands_for_a_while_where_they_have_something_to_do(flat):
    route = ((3.2, 5.3), (4.2, 5.3), (5.0, 5.3))
    walker = Walker(PersonSpec("ann", Pose2(2.2, 5.3), "walking", route, once=True, pauses=(0.0, 3.0)), flat)
    poses = walk(walker, 8.7)
    assert [pose.x for pose in (poses[99], poses[199], poses[345])] == pytest.approx(
        [3.2, 4.2, 4.2], abs=0.02
    )
    assert poses[-1].x == pytest.approx(5.0) and walker.arrived
