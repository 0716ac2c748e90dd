"""The parameters of the local controller; names as in TrajectoryPlannerROS (REFERENCE 7.6)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from florence_bt.core.limits import Limits, NotNegative, Positive, check_limits, check_order


@dataclass(frozen=True, slots=True)
class ControllerParameters:
    """How to follow a path.

    Attributes:
        max_vel_x: m/s.
        min_vel_x: m/s, slowest forward speed that is tried.
        max_rotational_vel: rad/s.
        min_in_place_rotational_vel: rad/s.
        acc_lim_x: m/s^2.
        acc_lim_th: rad/s^2; the velocity filter behind the controller holds it to 1.0.
        sim_time: How far ahead commands are simulated, in seconds.
        sim_granularity: Metres between two looks at the costmap.
        angular_sim_granularity: Radians between two looks.
        vx_samples: Forward speeds to try.
        vtheta_samples: Turning speeds to try with each.
        path_distance_bias: Weight of the distance from the path, per cell.
        goal_distance_bias: Weight of the distance from the local goal, per cell.
        occdist_scale: Weight of the highest cost on the way.
        local_goal_distance: How far along the path the local goal is, in metres.
        heading_lookahead: How far along the path its direction is looked up, in metres.
        rotate_to_path_angle: When the path leads off by more than this (rad), turn in place first.
        approach_distance: Nearer to the goal than this (m), drive straight to it.
        approach_gain: Speed per distance from the goal, 1/s.
        turn_gain: Turning speed per angle, 1/s.
        xy_goal_tolerance: Metres.
        yaw_goal_tolerance: Radians.
        blocked_xy_tolerance: When something stands right before the goal, this near (m) with the right
            heading is near enough; the document's own tolerance is 0.25 m.
        trans_stopped_velocity: m/s; slower counts as standing.
        rot_stopped_velocity: rad/s; slower counts as standing.
    """

    max_vel_x: Positive = 0.45
    min_vel_x: Positive = 0.08
    max_rotational_vel: Positive = 1.0
    min_in_place_rotational_vel: Positive = 0.12
    acc_lim_x: Positive = 0.5
    acc_lim_th: Positive = 1.0
    sim_time: Positive = 1.5
    sim_granularity: Positive = 0.025
    angular_sim_granularity: Positive = 0.05
    vx_samples: Annotated[int, Limits(2, 999)] = 6
    vtheta_samples: Annotated[int, Limits(3, 999)] = 20
    path_distance_bias: NotNegative = 0.7
    goal_distance_bias: NotNegative = 0.7
    occdist_scale: NotNegative = 0.01
    local_goal_distance: Positive = 1.5
    heading_lookahead: Positive = 0.325
    rotate_to_path_angle: Positive = 0.9
    approach_distance: NotNegative = 0.35
    approach_gain: Positive = 0.8
    turn_gain: Positive = 1.5
    xy_goal_tolerance: Positive = 0.05
    yaw_goal_tolerance: Positive = 0.08
    blocked_xy_tolerance: NotNegative = 0.12
    trans_stopped_velocity: Positive = 0.02
    rot_stopped_velocity: Positive = 0.04

    def __post_init__(self) -> None:
        check_limits(self)
        check_order(
            self,
            ("min_vel_x", "max_vel_x"),
            ("min_in_place_rotational_vel", "max_rotational_vel"),
            equal=True,
        )
