"""The navigator in a small world: doors, unknown obstacles, blocked ways, bad goals, cancelling."""

from __future__ import annotations

import dataclasses
import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest

from florence_bt.core.base_stop import BaseStop
from florence_bt.core.geometry import STANDSTILL, FramedPose, Pose2, angle_difference, problem_with_quaternion
from florence_bt.core.outcome import Outcome, Result
from florence_bt.core.serving import ActionBinding
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED, LETHAL
from florence_bt.skills.navigation.navigate.bindings import BINDINGS
from florence_bt.skills.navigation.navigate.contact import SlipWatch
from florence_bt.skills.navigation.navigate.costmap import Rays
from florence_bt.skills.navigation.navigate.drive_actions import PoseGoal, SpinGoal
from florence_bt.skills.navigation.navigate.navigator import Navigator
from florence_bt.skills.navigation.navigate.parameters import (
    CycleParameters,
    NavigatorParameters,
    RecoveryParameters,
)
from florence_bt.skills.navigation.navigate.results import (
    HELD,
    SERVER_CODES,
    SPIN_SERVER_CODES,
    TOUCHES,
    result_from_server,
)
from florence_bt.skills.served import error_codes
from florence_bt.trees.language.declarations import own_declarations
from tests.unit.skills.navigation_world import UPSIDE_DOWN_LASER, WALLS, Box, Trip, World, ahead, make_map

DOOR: Box = (4.0, 2.0, 4.1, 2.8)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("start", "goal"),
    [
        (Pose2(1.0, 1.5, 0.0), Pose2(7.0, 1.5, 0.0)),
        (Pose2(7.0, 1.5, 0.0), Pose2(1.0, 1.0, 2.0)),
        (Pose2(3.6, 0.5, -1.0), Pose2(4.5, 0.5, 3.0)),
        (Pose2(4.5, 4.6, 0.0), Pose2(3.6, 4.6, 0.0)),
        (Pose2(0.3, 0.3, -2.3), Pose2(7.4, 4.4, 0.8)),
    ],
)
def test_through_the_door_and_precisely_to_the_goal(start: Pose2, goal: Pose2) -> None:
    trip = Trip(start, jitter=0.007)
    assert trip.go(goal).outcome is Outcome.SUCCEEDED
    trip.assert_at(goal)


@pytest.mark.slow
@pytest.mark.parametrize("width", [0.75, 0.70])
@pytest.mark.parametrize(
    ("start", "goal"),
    [(Pose2(3.6, 0.5, -1.0), Pose2(4.5, 0.5, 3.0)), (Pose2(7.4, 4.4, 0.8), Pose2(0.5, 0.6, -2.3))],
)
def test_through_a_narrow_door(width: float, start: Pose2, goal: Pose2) -> None:
    post: Box = (3.95, 2.0, 4.15, 2.8 - width)
    boxes = (*WALLS, post)
    trip = Trip(start, boxes=boxes, on_map=boxes, jitter=0.007)
    assert trip.go(goal).outcome is Outcome.SUCCEEDED
    trip.assert_at(goal)


@pytest.mark.parametrize("goal", [Pose2(2.3, 2.4, 0.0), Pose2(1.7, 2.4, 0.0), Pose2(2.0, 2.46, 3.0)])
def test_short_ways(goal: Pose2) -> None:
    trip = Trip(Pose2(2.0, 2.4, 0.0))
    assert trip.go(goal).succeeded
    trip.assert_at(goal)


@pytest.mark.slow
def test_a_speed_limit_slows_the_whole_drive_until_it_is_taken_back() -> None:
    trip = Trip(Pose2(1.0, 2.4, 0.0))
    trip.navigator.speed_limit = 0.15
    assert trip.go(Pose2(2.5, 1.8, -1.0)).succeeded
    trip.assert_at(Pose2(2.5, 1.8, -1.0))
    assert max(trip.commands) == pytest.approx(0.15)
    trip.navigator.speed_limit = 0.0
    assert trip.go(Pose2(1.0, 2.4, 0.0)).succeeded
    assert max(trip.commands) > 0.3


def test_another_heading_only_turns() -> None:
    trip = Trip(Pose2(2.0, 2.4, 0.0))
    assert trip.go(Pose2(2.01, 2.4, 2.5)).succeeded
    assert set(trip.commands) == {0.0}
    trip.assert_at(Pose2(2.0, 2.4, 2.5))


def test_around_an_obstacle_that_is_not_in_the_map() -> None:
    obstacle: Box = (2.3, 1.9, 2.7, 2.9)
    trip = Trip(Pose2(1.0, 2.4, 0.0), boxes=(*WALLS, obstacle))
    assert trip.go(Pose2(3.4, 2.4, 0.0)).succeeded
    trip.assert_at(Pose2(3.4, 2.4, 0.0))


@pytest.mark.slow
def test_around_a_table_top_that_only_the_camera_sees() -> None:
    table: Box = (2.2, 1.9, 2.8, 2.9)
    trip = Trip(Pose2(0.8, 2.4, 0.0), only_camera=(table,))

    def check(world: World) -> None:
        x0, y0, x1, y1 = table
        assert not (x0 < world.pose.x < x1 and y0 < world.pose.y < y1)

    assert trip.go(Pose2(3.4, 2.4, 0.0), each=check).succeeded
    trip.assert_at(Pose2(3.4, 2.4, 0.0))


@pytest.mark.parametrize("goal", [Pose2(6.0, 1.5, 0.0), Pose2(6.0, 4.0, 1.0)])
@pytest.mark.parametrize("start", [Pose2(4.1, 2.175, 0.0), Pose2(4.1, 2.185, 0.1), Pose2(4.1, 2.615, -0.1)])
def test_a_robot_that_is_too_near_to_a_door_post_gets_clear_of_it(start: Pose2, goal: Pose2) -> None:
    """As it comes to stand there on a busy machine: no turn is possible, nor any arc."""
    trip = Trip(start)
    assert trip.go(goal).succeeded
    assert trip.world.hits == 0


@pytest.mark.slow
def test_somebody_closes_the_door() -> None:
    quick = NavigatorParameters(
        recovery=RecoveryParameters(planner_patience=1.0, controller_patience=1.0, rotate_angle=1.0)
    )
    trip = Trip(Pose2(2.5, 2.4, 0.0), boxes=(*WALLS, DOOR), parameters=quick)
    result = trip.go(Pose2(6.0, 2.4, 0.0))
    assert (result.outcome, result.code) == (Outcome.FAILED, "blocked")
    assert "blocks every way" in result.reason
    assert trip.world.hits == 0
    assert trip.world.pose.x < 3.9


@pytest.mark.slow
def test_somebody_stands_in_the_door_for_a_while() -> None:
    trip = Trip(Pose2(2.5, 2.4, 0.0))

    def each(world: World) -> None:
        there = 1.5 < world.now < 12.0
        world.boxes = [*WALLS, (3.9, 2.2, 4.2, 2.6)] if there else list(WALLS)

    assert trip.go(Pose2(6.0, 2.4, 0.0), each=each).succeeded
    trip.assert_at(Pose2(6.0, 2.4, 0.0))


def test_something_stands_on_a_goal() -> None:
    quick = NavigatorParameters(recovery=RecoveryParameters(goal_patience=0.5, rotate_angle=0.5))
    trip = Trip(Pose2(0.6, 2.4, 0.0), boxes=(*WALLS, (3.2, 2.3, 3.4, 2.5)), parameters=quick)
    result = trip.go(Pose2(3.3, 2.4, 0.0))
    assert result.code == "goal_occupied"
    assert trip.world.hits == 0


def test_what_was_seen_at_a_goal_is_looked_at_before_the_drive_ends() -> None:
    trip = Trip(Pose2(2.0, 2.4, 1.6), boxes=(*WALLS, (0.7, 2.3, 0.9, 2.5)))
    goal = Pose2(0.8, 2.4, 0.0)
    assert trip.go(goal).code == "goal_occupied"
    assert abs(trip.world.pose.bearing_to(goal.x, goal.y)) < 0.1
    assert trip.world.pose.distance_to(Pose2(2.0, 2.4)) < 0.02


@pytest.mark.parametrize("away", [0.29, 0.31])
def test_where_a_goal_has_no_room_to_turn_the_place_beside_it_is_near_enough(away: float) -> None:
    """Two posts, and a box before the place to line up: whichever way round, the nose would touch a post."""
    x, y = 2.5 + away * math.cos(math.pi / 3), away * math.sin(math.pi / 3)
    posts = [(x - 0.02, 2.4 + side - 0.02, x + 0.02, 2.4 + side + 0.02) for side in (-y, y)]
    trip = Trip(Pose2(1.0, 2.4, 0.0), boxes=(*WALLS, *posts, (2.8, 2.35, 2.95, 2.45)))
    goal = Pose2(2.5, 2.4, math.pi)
    assert trip.go(goal).succeeded
    assert trip.world.hits == 0
    assert trip.world.pose.distance_to(goal) < 0.15
    assert abs(angle_difference(trip.world.pose.yaw, goal.yaw)) < 0.1


def test_a_goal_beside_marks_that_come_and_go_is_planned_for_in_one_way() -> None:
    wall: Box = (1.6, 2.65, 3.5, 2.8)
    trip, wanted = Trip(Pose2(1.4, 2.4, 0.0), boxes=(*WALLS, wall)), Pose2(2.5, 2.4, math.pi / 2)
    goals: list[Pose2] = []

    def flicker(world: World) -> None:
        world.boxes = [*WALLS, wall] if int(world.now) % 2 else list(WALLS)
        path = trip.navigator.plan
        if path is not None and (not goals or goals[-1].distance_to(Pose2(*path[-1])) > 0.01):
            goals.append(Pose2(*path[-1]))

    assert trip.go(wanted, each=flicker).succeeded
    assert trip.world.pose.distance_to(wanted) < 0.15
    assert len(goals) <= 4


def test_who_left_a_goal_where_the_laser_does_not_look_is_forgotten_when_the_robot_looks_there() -> None:
    trip, goal = Trip(Pose2(1.0, 2.4, 0.0)), Pose2(2.2, 2.4, 0.0)
    body = np.array([[2.2, 2.35], [2.2, 2.45]])
    seen = Rays(1.0, 2.4, body, np.hypot(*(body - [1.0, 2.4]).T), 0.0, 5.6)
    trip.navigator.global_costmap.update_feet(seen)
    trip.navigator.global_costmap.add_rays("depth", seen, trip.world.pose)
    assert trip.navigator.cost_at(goal.x, goal.y) >= INSCRIBED
    assert trip.go(goal).succeeded
    trip.assert_at(goal)


def test_what_was_seen_at_a_goal_behind_a_wall_is_looked_at_from_where_no_wall_hides_it() -> None:
    trip, goal = Trip(Pose2(3.6, 3.3, 0.0)), Pose2(4.6, 3.3, 0.0)
    there = np.array([[4.6, 3.25], [4.6, 3.35]])
    who_has_left = Rays(5.6, 3.3, there, np.hypot(*(there - [5.6, 3.3]).T), 0.0, 5.6)
    trip.navigator.global_costmap.add_rays("scan", who_has_left, trip.world.pose)
    assert trip.navigator.cost_at(goal.x, goal.y) >= INSCRIBED
    assert trip.go(goal).succeeded
    trip.assert_at(goal)


@pytest.mark.parametrize(
    ("goal", "code"),
    [
        (Pose2(math.nan, 1.0), "bad_input"),
        (Pose2(1.0, 1.0, math.inf), "bad_input"),
        (Pose2(99.0, 1.0), "goal_outside"),
        (Pose2(4.05, 1.0), "goal_occupied"),
        (Pose2(0.21, 1.0, math.pi), "goal_occupied"),
        (Pose2(8.35, 2.0), "goal_outside"),
    ],
)
def test_bad_goals_move_nothing(goal: Pose2, code: str) -> None:
    trip = Trip(Pose2(2.0, 2.4, 0.0))
    result = trip.go(goal)
    assert (result.outcome, result.code) == (Outcome.FAILED, code)
    assert result.reason
    assert trip.world.pose == Pose2(2.0, 2.4, 0.0)


def test_a_cancel_stops_at_once() -> None:
    trip = Trip(Pose2(1.0, 2.4, 0.0))
    trip.navigator.start(PoseGoal(FramedPose(Pose2(3.4, 2.4, 0.0))), 0.0)
    for _ in range(20):
        assert trip.cycle() is None
    assert trip.world.twist.linear > 0.2
    trip.navigator.cancel()
    trip.navigator.cancel()
    assert trip.navigator.active
    step = trip.navigator.step(trip.world.now, None, None)
    assert step.command == STANDSTILL
    assert step.result is not None
    assert step.result.outcome is Outcome.CANCELLED
    assert not trip.navigator.active
    assert trip.navigator.step(trip.world.now, trip.world.odometry(), Pose2()).command is None
    trip.navigator.cancel()
    assert not trip.navigator.active


def test_a_new_goal_replaces_the_old_one() -> None:
    trip = Trip(Pose2(1.0, 2.4, 0.0))
    trip.navigator.start(PoseGoal(FramedPose(Pose2(3.4, 2.4, 0.0))), 0.0)
    for _ in range(20):
        assert trip.cycle() is None
    assert trip.go(Pose2(1.2, 3.2, 1.0)).succeeded
    trip.assert_at(Pose2(1.2, 3.2, 1.0))


@pytest.mark.parametrize("silent", ["scan", "odometry", "pose"])
def test_the_robot_does_not_move_on_old_data(silent: str) -> None:
    parameters = NavigatorParameters(
        cycle=CycleParameters(sensor_patience=3.0), recovery=RecoveryParameters(find_place_time=0.0)
    )
    trip = Trip(Pose2(1.0, 2.4, 0.0), parameters=parameters)
    navigator, world = trip.navigator, trip.world
    navigator.start(PoseGoal(FramedPose(Pose2(3.4, 2.4, 0.0))), 0.0)
    for _ in range(20):
        trip.cycle()
    stale, place, since = world.odometry(), trip.map_from_odom(), world.now
    while True:
        if silent != "scan":
            navigator.add_scan("scan", world.scan(), UPSIDE_DOWN_LASER, world.odom, place)
        odometry = stale if silent == "odometry" else world.odometry()
        step = navigator.step(world.now, odometry, None if silent == "pose" else place)
        assert step.command is not None
        world.command = step.command
        world.advance(0.1)
        if step.result is not None:
            break
        if world.now - since > (0.4 if silent == "scan" else 1.2):
            assert step.command == STANDSTILL
            assert step.feedback.text.startswith("waiting: ")
    assert step.result.code == ("no_scan" if silent == "scan" else "no_pose")
    assert 3.0 < world.now - since < 4.7
    assert world.hits == 0


def test_advice_for_a_silent_sensor_stands_behind_the_reason() -> None:
    cycle = CycleParameters(sensor_patience=0.5, silence_advice="use another machine")
    trip = Trip(Pose2(1.0, 2.4, 0.0), parameters=NavigatorParameters(cycle=cycle))
    trip.navigator.start(PoseGoal(FramedPose(Pose2(3.4, 2.4, 0.0))), 0.0)
    results = []
    while not results:
        trip.world.advance(0.1)
        step = trip.navigator.step(trip.world.now, trip.world.odometry(), trip.map_from_odom())
        results += [step.result] if step.result is not None else []
    assert results[0].code == "no_scan" and results[0].reason.endswith("; use another machine")


def test_scans_that_are_late_but_come_do_not_stop_the_robot() -> None:
    trip = Trip(Pose2(1.0, 2.4, 0.0))
    navigator, world = trip.navigator, trip.world
    navigator.start(PoseGoal(FramedPose(Pose2(3.4, 2.4, 0.0))), 0.0)
    for late in (0.3, 0.3, 0.6, 0.9):
        scan = dataclasses.replace(world.scan(), stamp=world.now - late)
        place = trip.map_from_odom()
        navigator.add_scan("scan", scan, UPSIDE_DOWN_LASER, world.odom, place, world.now)
        step = navigator.step(world.now, world.odometry(), place)
        assert not step.feedback.text.startswith("waiting: ")
        world.advance(0.1)


def test_nothing_moves_before_the_first_scan() -> None:
    navigator = Navigator(make_map())
    world = World(Pose2(1.0, 2.4, 0.0))
    navigator.start(PoseGoal(FramedPose(Pose2(3.0, 2.4, 0.0))), 0.0)
    step = navigator.step(0.0, world.odometry(), world.pose)
    assert step.command == STANDSTILL
    assert "no scan" in step.feedback.text
    assert navigator.step(0.1, None, None).command == STANDSTILL


@pytest.mark.parametrize("angle", [math.pi / 4, -math.pi / 2, math.pi])
def test_spin(angle: float) -> None:
    trip = Trip(Pose2(2.0, 2.4, 0.0))
    trip.navigator.start(SpinGoal(angle, 20.0), 0.0)
    result = None
    while result is None:
        result = trip.cycle()
    assert result.succeeded
    trip.world.advance(0.5)
    assert abs(angle_difference(trip.world.pose.yaw, angle)) < 0.06
    assert trip.world.pose.distance_to(Pose2(2.0, 2.4)) < 1e-6


def test_a_spin_beside_a_wall_behind_the_robot_is_refused() -> None:
    # The laser does not see behind the robot; the map knows the wall.
    trip = Trip(Pose2(0.19, 2.4, 0.0))
    trip.navigator.start(SpinGoal(1.0, 10.0), 0.0)
    result = trip.cycle()
    assert result is not None
    assert result.code == "collision_ahead"
    assert trip.world.twist.is_zero()


@pytest.mark.parametrize(("angle", "allowance"), [(math.nan, 10.0), (1.0, math.nan), (1.0, math.inf)])
def test_bad_spins(angle: float, allowance: float) -> None:
    trip = Trip(Pose2(2.0, 2.4, 0.0))
    trip.navigator.start(SpinGoal(angle, allowance), 0.0)
    result = trip.cycle()
    assert result is not None
    assert result.code == "bad_input"


def test_the_costmap_for_others() -> None:
    navigator = Navigator(make_map())
    assert navigator.cost_at(2.0, 2.4) == 0
    assert navigator.cost_at(4.05, 1.0) == 254
    assert navigator.cost_at(3.9, 1.0) == 253
    assert navigator.cost_at(math.nan, 1.0) == navigator.cost_at(99.0, 1.0) == 255
    grid = navigator.global_grid()
    assert set(np.unique(grid.cells)) >= {-1, 0, 99, 100}
    assert grid.cells[grid.cell_of(4.05, 1.0)] == 100


@pytest.mark.slow
def test_a_goal_beside_something_is_entered_from_its_run_up_at_once() -> None:
    """A planned way would bend away from what is beside the goal: the robot would line up again and again."""
    x, y = 2.52 + 0.265 * math.cos(0.5), 2.4 + 0.265 * math.sin(0.5)
    trip = Trip(Pose2(1.0, 2.4, 0.0), boxes=(*WALLS, (x, y, x + 0.1, y + 0.1)))
    goal = Pose2(2.52, 2.4, -1.5)
    assert trip.go(goal).succeeded
    trip.assert_at(goal)
    assert trip.world.now < 20.0


@pytest.mark.slow
def test_the_same_world_gives_the_same_commands() -> None:
    runs = []
    for _ in range(2):
        trip = Trip(Pose2(1.0, 1.5, 0.0), jitter=0.005)
        trip.go(Pose2(3.0, 3.0, 1.0))
        runs.append(trip.commands)
    assert runs[0] == runs[1]


def answered(skill: str, outcome: Outcome, number: int, text: str = "") -> Result:
    message = SimpleNamespace(error_code=number, error_msg=text)
    return result_from_server(skill, error_codes(skill), "blocked", message, outcome)


def test_result_codes_there_and_back() -> None:
    for code in own_declarations()["navigate_to"].failures:
        number = SERVER_CODES[code]
        assert number > 0
        back = answered("navigate_to", Outcome.FAILED, number, "why")
        assert (back.code, back.reason) == (code, "why")
    for code in ("collision_ahead", "time_allowance", "no_pose", "no_scan", *HELD):
        number = SPIN_SERVER_CODES[code]
        assert answered("turn", Outcome.FAILED, number).code == code
    assert answered("navigate_to", Outcome.SUCCEEDED, 0).succeeded
    assert answered("turn", Outcome.CANCELLED, 0).outcome is Outcome.CANCELLED
    unknown = answered("navigate_to", Outcome.FAILED, 9999)
    assert unknown.code == "blocked"
    assert "9999" in unknown.reason


def test_an_error_number_that_nobody_knows_gives_a_code_of_the_skill() -> None:
    message = SimpleNamespace(error_code=1, error_msg="", path=SimpleNamespace(poses=[]))
    with_numbers = [each for each in BINDINGS if isinstance(each, ActionBinding) and each.error_codes]
    assert len(with_numbers) == 8
    for served in with_numbers:
        assert served.result(message, Outcome.FAILED).code in own_declarations()[served.skill].failures


@pytest.mark.parametrize(
    ("quaternion", "part"),
    [
        ((0.0, 0.0, 0.0, 1.0), ""),
        ((0.0, 0.0, 2.0, 2.0), ""),
        ((0.01, 0.0, 0.0, 1.0), ""),
        ((0.0, 0.0, 0.0, 0.0), "zero quaternion"),
        ((0.0, 0.0, math.nan, 1.0), "not finite"),
        ((0.1, 0.0, 0.0, 1.0), "tilted"),
    ],
)
def test_goal_quaternions(quaternion: tuple[float, float, float, float], part: str) -> None:
    problem = problem_with_quaternion(*quaternion)
    assert part in problem and bool(problem) is bool(part)


LEFT_BUMPER = BaseStop("bumper", "the left bumper is pressed: forward motion is held")


def touch(trip: Trip, stop: BaseStop, on: bool) -> None:
    """As the base does: it says what holds it, and does not drive forward."""
    trip.navigator.base_stop = stop if on else BaseStop()
    if on and trip.world.command.linear > 0.0:
        trip.world.command = STANDSTILL


@pytest.mark.parametrize("code", [*HELD])
def test_what_holds_the_base_ends_a_drive_and_a_turn_at_once(code: str) -> None:
    trip = Trip(Pose2(1.0, 1.5, 0.0))
    trip.navigator.start(PoseGoal(FramedPose(Pose2(3.0, 1.5, 0.0))), trip.world.now)
    for _ in range(5):
        assert trip.cycle() is None
    trip.navigator.base_stop = BaseStop(code, "the left wheel hangs in the air")
    result = trip.cycle()
    assert result is not None
    assert (result.code, result.reason) == (code, "the left wheel hangs in the air")
    assert SERVER_CODES[code] == SPIN_SERVER_CODES[code] > 10000
    trip.navigator.start(SpinGoal(1.0, 10.0), trip.world.now)
    turn = trip.cycle()
    assert turn is not None
    assert turn.code == code in own_declarations()["turn"].failures


def test_a_dead_base_is_told_at_once_though_the_odometry_is_silent() -> None:
    trip = Trip(Pose2(1.0, 1.5, 0.0))
    trip.navigator.start(PoseGoal(FramedPose(Pose2(3.0, 1.5, 0.0))), trip.world.now)
    trip.navigator.base_stop = BaseStop("no_response", "the base sent no good frame for 0.5 s")
    step = trip.navigator.step(trip.world.now, None, None)
    assert step.result is not None
    assert step.result.code == "no_response"


@pytest.mark.parametrize("code", [*TOUCHES])
def test_a_bumper_that_stays_pressed_fails_the_drive_within_two_seconds(code: str) -> None:
    trip = Trip(Pose2(1.0, 1.5, 0.0))
    stop = BaseStop(code, LEFT_BUMPER.text)
    began = trip.world.now + 1.0
    result = trip.go(Pose2(3.0, 1.5, 0.0), each=lambda world: touch(trip, stop, world.now >= began))
    assert result.code == code
    assert result.reason == f"{LEFT_BUMPER.text}, and backing off did not help"
    assert trip.world.now - began < 3.0  # with the 0.6 s that the robot is given to stand
    assert min(trip.commands) < 0.0


@pytest.mark.slow
def test_a_bumper_that_is_released_by_backing_off_does_not_end_the_drive() -> None:
    trip = Trip(Pose2(1.0, 1.5, 0.0))
    table_leg = 1.6
    pressed = []

    def bump(world: World) -> None:
        touches = world.pose.x > table_leg and len(pressed) < 8
        pressed.extend([True] * touches)
        touch(trip, LEFT_BUMPER, touches)

    assert trip.go(Pose2(3.0, 1.5, 0.0), each=bump).succeeded
    assert any(text.startswith("backing off: the left bumper") for text in trip.texts)


@pytest.mark.slow
def test_what_was_touched_is_driven_round() -> None:
    trip = Trip(Pose2(1.0, 1.5, 0.0))
    box, touches = Pose2(2.0, 1.5), []

    def bump(world: World) -> None:
        on = world.pose.distance_to(box) < 0.4 and abs(world.pose.bearing_to(box.x, box.y)) < 1.0
        touches.append(on)
        touch(trip, LEFT_BUMPER, on)

    assert trip.go(Pose2(3.0, 1.5, 0.0), each=bump).succeeded
    assert sum(now and not before for before, now in itertools.pairwise(touches)) <= 2


@pytest.mark.parametrize("ends", ["as a straight drive", "cancelled while it backs off"])
def test_what_was_touched_is_remembered_however_the_goal_ends(ends: str) -> None:
    trip = Trip(Pose2(1.0, 1.5, 0.0))
    trip.come(0.4)  # the floor behind it is known then
    straight = ends == "as a straight drive"
    goal = ahead(1.0, 0.2, 0.0) if straight else PoseGoal(FramedPose(Pose2(3.0, 1.5, 0.0)))
    trip.navigator.start(goal, trip.world.now)
    result, met = None, []
    while result is None:
        on = trip.world.pose.x > 1.6
        met.extend([trip.world.pose.x] * on)
        touch(trip, LEFT_BUMPER, on)
        if trip.commands and trip.commands[-1] < 0.0:
            trip.navigator.cancel()
        result = trip.cycle()
    assert result.code == ("bumper" if straight else "cancelled")
    touch(trip, LEFT_BUMPER, False)
    trip.navigator.start(ahead(-0.1, 0.1, 0.0), trip.world.now)
    while trip.cycle() is None:
        pass
    assert trip.navigator.cost_at(min(met) + 0.2, 1.5) == LETHAL
    assert (trip.navigator.local_grid().cells == 100).any()


def test_what_was_touched_long_ago_may_be_gone() -> None:
    trip = Trip(Pose2(1.0, 1.5, 0.0))
    trip.navigator.global_costmap.add_contact(Pose2(1.8, 1.5), trip.world.now)
    assert trip.navigator.cost_at(2.0, 1.5) == LETHAL
    trip.navigator.start(PoseGoal(FramedPose(Pose2(3.0, 1.5, 0.0))), trip.world.now + 599.0)
    assert trip.navigator.cost_at(2.0, 1.5) == LETHAL
    trip.navigator.start(PoseGoal(FramedPose(Pose2(3.0, 1.5, 0.0))), trip.world.now + 601.0)
    assert trip.navigator.cost_at(2.0, 1.5) == 0


@pytest.mark.slow
def test_what_was_touched_a_while_ago_does_not_close_the_only_way() -> None:
    trip = Trip(Pose2(1.0, 1.5, 0.0))
    began = trip.world.now
    for y in np.arange(0.0, 3.0, 0.2):
        trip.navigator.global_costmap.add_contact(Pose2(1.8, float(y)), began - 50.0)
    assert trip.go(Pose2(3.0, 1.5, 0.0)).succeeded
    assert trip.world.now - began > 10.0  # until then it is believed


@pytest.mark.slow
def test_a_drive_that_finds_no_way_round_what_it_touches_ends() -> None:
    trip = Trip(Pose2(1.0, 1.5, 0.0))
    result = trip.go(Pose2(3.0, 1.5, 0.0), each=lambda world: touch(trip, LEFT_BUMPER, world.pose.x > 1.6))
    assert result.code == "bumper"
    assert result.reason.startswith(f"{LEFT_BUMPER.text}, and no way round it was found: ")


@pytest.mark.slow
def test_a_drive_that_touches_something_again_and_again_ends() -> None:
    trip = Trip(Pose2(1.0, 1.5, 0.0))
    driven = [0.0]

    def bump(world: World) -> None:
        driven[0] = max(0.0, driven[0] + 0.1 * world.command.linear)
        touch(trip, LEFT_BUMPER, driven[0] > 0.2)

    result = trip.go(Pose2(3.0, 1.5, 0.0), each=bump)
    assert result.code == "bumper"
    # After the third time, or the time that a drive may stay where it is.
    assert result.reason.startswith(LEFT_BUMPER.text)
    assert trip.world.now < 31.0


def hold(world: World, x: float, half: float) -> None:
    """A glass top before x, where no sensor sees it: the wheels turn, and the robot stays."""
    pose = world.pose
    if x < pose.x < x + 0.2 and abs(pose.y - 1.5) < half:
        world.pose = Pose2(x, pose.y, pose.yaw)


@pytest.mark.slow
def test_what_only_the_wheels_feel_is_driven_round() -> None:
    trip = Trip(Pose2(1.0, 1.5, 0.0))
    assert trip.go(Pose2(3.0, 1.5, 0.0), each=lambda world: hold(world, 1.6, 0.3)).succeeded
    assert any(text.startswith("backing off: the wheels turn") for text in trip.texts)


@pytest.mark.slow
def test_a_drive_that_nothing_but_the_wheels_feel_ends_with_the_reason() -> None:
    trip = Trip(Pose2(1.0, 1.5, 0.0))
    result = trip.go(Pose2(3.0, 1.5, 0.0), each=lambda world: hold(world, 1.6, 9.0))
    assert result.code == "blocked"
    assert "the wheels turn and the robot stays where it is" in result.reason
    assert trip.world.now < 60.0


def test_a_turn_in_place_goes_on_with_a_pressed_bumper() -> None:
    trip = Trip(Pose2(1.0, 1.5, 0.0))
    trip.navigator.base_stop = LEFT_BUMPER
    trip.navigator.start(SpinGoal(1.0, 10.0), trip.world.now)
    result = None
    for _ in range(80):
        result = result or trip.cycle() if trip.navigator.active else result
    assert result is not None
    assert result.succeeded


def test_what_passes_by_itself_is_waited_for() -> None:
    trip = Trip(Pose2(1.0, 1.5, 0.0))
    trip.navigator.base_stop = BaseStop("gyro", "the base stands still to calibrate it")
    assert trip.go(Pose2(2.0, 1.5, 0.0)).succeeded


@pytest.mark.parametrize("slips", [True, False])
def test_a_robot_that_was_found_elsewhere_does_not_slip(slips: bool) -> None:
    """Where wheels slip, the map's frame follows the odometry little by little; a relocalisation jumps."""
    watch = SlipWatch()
    found = []
    for cycle in range(25):
        way = 0.04 * cycle
        back = way if slips else (0.7 if cycle >= 18 else 0.0)
        place, pose = Pose2(-back, 0.0), Pose2(way, 0.0)
        state = SimpleNamespace(
            now=0.1 * cycle, pose=pose, map_from_odom=place, map_pose=place @ pose, localised=True
        )
        found.append(watch.slips(state))  # type: ignore[arg-type]
    assert any(found) is slips
