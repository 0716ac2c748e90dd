"""The local controller, turning, clearance and the watch over progress."""

from __future__ import annotations

import math

import numpy as np
import pytest

from florence_bt.core.base_stop import BaseStop
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2, integrate_twist
from florence_bt.core.sensing import LaserScan
from florence_bt.core.transforms import Transform3
from florence_bt.skills.navigation.navigate._rollout_kernels import distance_at
from florence_bt.skills.navigation.navigate.clearance import Clearance
from florence_bt.skills.navigation.navigate.contact import BackUp
from florence_bt.skills.navigation.navigate.controller import Control, Controller, ControllerParameters
from florence_bt.skills.navigation.navigate.costmap import Costmap, CostmapParameters, rays_of
from florence_bt.skills.navigation.navigate.driven_way import DrivenWay
from florence_bt.skills.navigation.navigate.parameters import RecoveryParameters
from florence_bt.skills.navigation.navigate.people import People
from florence_bt.skills.navigation.navigate.recovery import ProgressWatch
from florence_bt.skills.navigation.navigate.spin import Spin, SpinParameters
from florence_bt.skills.navigation.navigate.state import CycleState

COSTMAP = CostmapParameters()
ORIGIN = Pose2()


def local(*obstacles: tuple[float, float], robot: Pose2 = ORIGIN) -> Costmap:
    """A local costmap with single obstacles, x and y in the odometry frame."""
    costmap = Costmap(COSTMAP)
    for x, y in obstacles:
        reach, angle = math.hypot(x, y), math.atan2(y, x)
        scan = LaserScan(0.0, "laser", angle, 0.1, 0.02, 5.6, np.array([reach], np.float32))
        costmap.add_rays("scan", rays_of(scan, Transform3.identity()), robot)
    return costmap


def wall(x: float, low: float = -1.0, high: float = 1.0) -> list[tuple[float, float]]:
    return [(x, y) for y in np.arange(low, high, 0.04)]


def path_to(goal: Pose2) -> np.ndarray:
    count = max(2, int(math.hypot(goal.x, goal.y) / 0.025))
    return np.linspace([0.0, 0.0], [goal.x, goal.y], count)


def control(
    goal: Pose2, costmap: Costmap | None = None, pose: Pose2 = ORIGIN, twist: Twist2 = STANDSTILL
) -> Control:
    controller = Controller(ControllerParameters())
    controller.set_plan(path_to(goal), goal)
    costmap = costmap or local()
    return controller.control(pose, twist, costmap, Pose2(), Clearance(costmap, pose, None, None), People())


def test_it_drives_along_a_straight_path() -> None:
    answer = control(Pose2(2.0, 0.0))
    assert answer.command.linear > 0.3
    assert abs(answer.command.angular) < 0.1
    assert answer.remaining == pytest.approx(2.0, abs=0.05)


def test_the_dynamic_window_is_what_can_be_reached_within_its_period() -> None:
    parameters = ControllerParameters(dwa=True, sim_period=0.2)
    controller = Controller(parameters)
    controller.set_plan(path_to(Pose2(2.0, 0.0)), Pose2(2.0, 0.0))
    costmap, speed = local(), 0.2
    clearance = Clearance(costmap, Pose2(), None, None)
    answer = controller.control(Pose2(), Twist2(speed, 0.0), costmap, Pose2(), clearance, People())
    assert answer.command.linear == pytest.approx(speed + 0.2 * parameters.acc_lim_x)
    assert control(Pose2(2.0, 0.0), twist=Twist2(speed, 0.0)).command.linear > answer.command.linear


def test_it_turns_first_when_the_path_leads_off_sharply() -> None:
    for goal, sign in ((Pose2(0.0, 2.0), 1.0), (Pose2(0.0, -2.0), -1.0), (Pose2(-2.0, 0.1), 1.0)):
        answer = control(goal)
        assert answer.command.linear == 0.0
        assert answer.command.angular * sign > 0.5


def test_it_steers_towards_a_path_beside_it() -> None:
    controller = Controller(ControllerParameters())
    controller.set_plan(np.linspace([0.0, 0.2], [2.0, 0.2], 80), Pose2(2.0, 0.2))
    costmap = local()
    answer = controller.control(
        Pose2(), STANDSTILL, costmap, Pose2(), Clearance(costmap, Pose2(), None, None), People()
    )
    assert answer.command.angular > 0.05


def test_the_path_is_taken_to_the_odometry_frame() -> None:
    controller = Controller(ControllerParameters())
    goal = Pose2(2.0, 0.0)
    controller.set_plan(path_to(goal), goal)
    # The map is turned by 90 degrees against the odometry: the path leads to y there.
    costmap, pose = local(), Pose2(0.0, 0.0, math.pi / 2)
    answer = controller.control(
        pose,
        STANDSTILL,
        costmap,
        Pose2(0.0, 0.0, math.pi / 2),
        Clearance(costmap, pose, None, None),
        People(),
    )
    assert answer.command.linear > 0.3
    assert abs(answer.command.angular) < 0.1


def test_a_wall_ahead_blocks() -> None:
    answer = control(Pose2(2.0, 0.0), local(*wall(0.32)))
    assert answer.command == STANDSTILL
    assert "touch" in answer.blocked


def test_it_never_chooses_a_command_that_hits() -> None:
    for y in np.linspace(-0.3, 0.3, 13):
        costmap = local((0.6, float(y)), (0.6, float(y) + 0.05))
        answer = control(Pose2(2.0, 0.0), costmap)
        pose, speed = Pose2(), Twist2()
        for _ in range(75):
            speed = Twist2(
                min(speed.linear + 0.01, answer.command.linear),
                max(
                    -abs(answer.command.angular),
                    min(abs(answer.command.angular), 2.0 * answer.command.angular),
                ),
            )
            pose = integrate_twist(pose, speed, 0.02)
            assert costmap.footprint_cost(pose) >= 0


@pytest.mark.parametrize("distance", [0.06, 0.12, 0.2, 0.3])
def test_it_slows_down_near_the_goal(distance: float) -> None:
    answer = control(Pose2(distance, 0.0))
    assert 0.04 <= answer.command.linear <= max(0.05, 0.81 * distance)


def test_within_the_tolerance_it_only_turns() -> None:
    answer = control(Pose2(0.01, 0.0, 1.5))
    assert answer.command.linear == 0.0
    assert answer.command.angular > 0.3
    assert not answer.reached


@pytest.mark.parametrize(("goal", "turns_away"), [(Pose2(0.3, 0.07), False), (Pose2(0.3, 0.15), True)])
def test_who_has_driven_there_does_not_turn_away_for_some_centimetres(goal: Pose2, turns_away: bool) -> None:
    controller, costmap = Controller(ControllerParameters()), local()
    controller.set_plan(path_to(goal), goal)
    for x in (0.0, 0.1, 0.2, 0.29):
        pose = Pose2(x, 0.0)
        clearance = Clearance(costmap, pose, None, None)
        answer = controller.control(pose, STANDSTILL, costmap, Pose2(), clearance, People())
    assert (abs(answer.command.angular) > 0.3) is turns_away


def test_it_stops_before_it_turns_to_the_goal() -> None:
    assert control(Pose2(0.01, 0.0, 1.5), twist=Twist2(0.2, 0.0)).command == STANDSTILL


def test_it_has_arrived_only_when_it_stands() -> None:
    assert control(Pose2(0.01, 0.0, 0.03)).reached
    moving = control(Pose2(0.01, 0.0, 0.03), twist=Twist2(0.0, 0.3))
    assert not moving.reached
    assert moving.command == STANDSTILL


def test_turning_the_other_way_when_one_side_is_blocked() -> None:
    # Beside the robot's nose on the left; turning left would hit it.
    side = (0.18, 0.22)
    answer = control(Pose2(0.01, 0.0, 2.0), local(side, (0.14, 0.26)))
    assert answer.command.angular < 0.0
    both = control(Pose2(0.01, 0.0, 2.0), local(side, (0.14, 0.26), (0.18, -0.22), (0.14, -0.26)))
    assert both.blocked
    assert both.command == STANDSTILL


def test_distances_between_cells() -> None:
    grid = np.array([[0.0, 1.0], [2.0, 3.0]])
    assert distance_at(grid, 1.0, 1.0, 100.0) == pytest.approx(1.5)
    assert distance_at(grid, 0.5, 0.5, 100.0) == pytest.approx(0.0)
    assert distance_at(grid, 2.5, 0.5, 100.0) == 100.0
    holed = np.array([[0.0, 100.0], [2.0, 3.0]])
    assert distance_at(holed, 0.9, 0.9, 100.0) == 0.0
    assert distance_at(holed, 1.5, 0.5, 100.0) == 100.0


def still(now: float, pose: Pose2, clearance: Clearance, twist: Twist2 = STANDSTILL) -> CycleState:
    """A robot beside which nobody is, and which nothing holds."""
    driven = DrivenWay(COSTMAP.make_true_footprint())
    return CycleState(now, pose, twist, ORIGIN, clearance, BaseStop(), driven)


def turn_to_its_end(turn: Spin, *, delay: int = 3) -> tuple[float, float, str]:
    """Turn a base with the velocity filter's inertia and a delay; total angle, seconds, code."""
    yaw, speed, now, waiting = 0.0, 0.0, 0.0, [0.0] * delay
    costmap = local()
    for _ in range(400):
        pose = Pose2(0.0, 0.0, math.remainder(yaw, math.tau))
        clearance = Clearance(costmap, pose, None, None)
        command, _, result = turn.step(still(now, pose, clearance, Twist2(0.0, speed)))
        if result is not None:
            assert command == STANDSTILL
            return yaw, now, result.code
        for _ in range(5):
            waiting.append(command.angular)
            speed += max(-0.02, min(0.02, waiting.pop(0) - speed))
            yaw += speed * 0.02
            now += 0.02
    pytest.fail("the turn did not end")


@pytest.mark.parametrize("angle", [math.pi / 4, -math.pi / 2, 2 * math.pi, 0.02, -0.3])
def test_turns_are_precise(angle: float) -> None:
    total, _, code = turn_to_its_end(Spin(angle, SpinParameters(), 0.0, 30.0))
    assert code == "ok"
    assert abs(total - angle) <= 0.05


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_seven_turns_leave_no_gap_in_a_circle(delay: int) -> None:
    total, _, _ = turn_to_its_end(Spin(math.pi / 4, SpinParameters(), 0.0, 30.0), delay=delay)
    assert 7 * abs(total - math.pi / 4) < math.radians(9.0), (
        "the camera sees 57 degrees, and the next look is 45 on"
    )


def test_a_turn_has_a_time_allowance() -> None:
    _, now, code = turn_to_its_end(Spin(6.0, SpinParameters(), 0.0, 2.0))
    assert code == "time_allowance"
    assert now == pytest.approx(2.0, abs=0.15)


def test_an_allowance_of_zero_is_no_limit() -> None:
    """As in Nav2."""
    total, _, code = turn_to_its_end(Spin(6.0, SpinParameters(), 0.0, 0.0))
    assert code == "ok" and total == pytest.approx(6.0, abs=0.1)


def test_a_turn_that_would_hit_does_not_begin() -> None:
    costmap = local((0.18, 0.22), (0.14, 0.26))
    clearance = Clearance(costmap, Pose2(), None, None)
    command, _, result = Spin(2.0, SpinParameters(), 0.0, 10.0).step(still(0.0, ORIGIN, clearance))
    assert command == STANDSTILL
    assert result is not None
    assert result.code == "collision_ahead"
    command, _, result = Spin(-0.3, SpinParameters(), 0.0, 10.0).step(still(0.0, ORIGIN, clearance))
    assert result is None
    assert command.angular < 0.0


def test_backing_up_stops_before_an_obstacle() -> None:
    behind = local(*wall(-0.28))

    def state(now: float, costmap: Costmap, pose: Pose2 = ORIGIN) -> CycleState:
        clearance = Clearance(costmap, pose, None, None)
        driven = DrivenWay(CostmapParameters().make_true_footprint())
        driven.saw(ORIGIN)
        return CycleState(now, pose, STANDSTILL, ORIGIN, clearance, BaseStop(), driven)

    parameters = RecoveryParameters(back_up_distance=0.3, back_up_speed=0.1)
    back = BackUp(state(0.0, local()), parameters, 10.0)
    assert back.step(state(0.0, behind)) == STANDSTILL
    assert back.step(state(0.0, local())).linear == pytest.approx(-0.1)
    assert back.step(state(11.0, local())) == STANDSTILL
    assert back.step(state(1.0, local(), Pose2(-0.3, 0.0, 0.0))) == STANDSTILL


def test_progress() -> None:
    watch = ProgressWatch(RecoveryParameters())
    watch.reset(0.0)
    assert watch.problem(0.0, Pose2(), 5.0) is None
    assert watch.problem(9.0, Pose2(0.1, 0.0, 0.0), 4.9) is None
    assert "not moved" in str(watch.problem(10.5, Pose2(0.1, 0.0, 0.0), 4.9))
    watch.reset(11.0)
    assert watch.problem(11.0, Pose2(), 5.0) is None
    # It turns to and fro for ever.
    answers = [watch.problem(11.0 + k, Pose2(0.0, 0.0, (k % 2) * 1.0), 5.0) for k in range(50)]
    assert answers[30] is None
    assert "not come nearer" in str(answers[-1])


@pytest.mark.parametrize(
    ("cls", "values"),
    [
        (ControllerParameters, {"max_vel_x": -1.0}),
        (ControllerParameters, {"max_vel_x": math.nan}),
        (ControllerParameters, {"vx_samples": 1}),
        (ControllerParameters, {"min_vel_x": 0.6}),
        (SpinParameters, {"spin_min_speed": 0.0}),
        (SpinParameters, {"spin_precision": 0.0}),
        (RecoveryParameters, {"planner_patience": 0.0}),
    ],
)
def test_bad_parameters(cls: type, values: dict[str, float]) -> None:
    with pytest.raises(ConfigError):
        cls(**values)


@pytest.mark.parametrize("latched", [True, False])
def test_a_position_that_was_reached_stays_reached_when_latched(latched: bool) -> None:
    controller = Controller(ControllerParameters(latch_xy_goal_tolerance=latched))
    goal, costmap = Pose2(0.0, 0.0, math.pi / 2), local()
    controller.set_plan(np.array([[-0.1, 0.0], [0.0, 0.0]]), goal)
    for pose in (Pose2(0.0, 0.0, 0.0), Pose2(-0.12, 0.0, 0.0)):
        clearance = Clearance(costmap, pose, None, None)
        answer = controller.control(pose, STANDSTILL, costmap, Pose2(), clearance, People())
    assert answer.text == ("turning to the goal's heading" if latched else "approaching the goal")
