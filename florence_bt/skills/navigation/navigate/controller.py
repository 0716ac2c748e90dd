"""The local controller: the velocity to command now, by trajectory rollout along a path.

Three ways to move, in this order on the way to a goal: follow the path (rollout; a turn in place where the
path leads off sharply), approach the goal in a straight line, and turn to the goal's heading.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2, normalize_angle
from florence_bt.core.limits import CheckedParameters, Limits, NotNegative, Positive, check_order
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED
from florence_bt.skills.navigation.navigate._rollout_kernels import MEETS, roll_out
from florence_bt.skills.navigation.navigate._wave_kernels import NEUTRAL, OBSTACLE, UNVISITED, spread_wave
from florence_bt.skills.navigation.navigate.clearance import Clearance
from florence_bt.skills.navigation.navigate.costmap import Costmap
from florence_bt.skills.navigation.navigate.people import SOMEBODY_IN_THE_WAY, People
from florence_bt.skills.robot_description.room import BLOCKED_XY_TOLERANCE_M


@dataclass(frozen=True, slots=True)
class ControllerParameters(CheckedParameters):
    """The parameters of following a path.

    Attributes:
        max_vel_x: m/s.
        min_vel_x: m/s, slowest forward speed that is tried.
        max_rotational_vel: rad/s.
        min_in_place_rotational_vel: rad/s.
        acc_lim_x: m/s^2.
        acc_lim_th: rad/s^2; the velocity filter behind the controller holds it to 1.0.
        sim_time: How far ahead commands are simulated, in seconds.
        dwa: Whether the commands that are tried are those that can be reached within ``sim_period`` (dynamic
            window), and not within ``sim_time`` (trajectory rollout).
        sim_period: Seconds; that of the controller, or a little longer.
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
        latch_xy_goal_tolerance: Whether the position, once reached, counts as reached however far the robot
            drifts while it turns; otherwise it drives back when it is off by 1.6 tolerances.
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
    dwa: bool = False
    sim_period: Positive = 0.2
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
    latch_xy_goal_tolerance: bool = False
    yaw_goal_tolerance: Positive = 0.08
    blocked_xy_tolerance: NotNegative = BLOCKED_XY_TOLERANCE_M
    trans_stopped_velocity: Positive = 0.02
    rot_stopped_velocity: Positive = 0.04

    def _check(self) -> None:
        check_order(
            self,
            ("min_vel_x", "max_vel_x"),
            ("min_in_place_rotational_vel", "max_rotational_vel"),
            equal=True,
        )


_SMALLEST_WAY_M = 0.02
_BLOCKED_YAW_TOLERANCE, _SMALLEST_TURN_RAD = 0.15, 0.02
"""So far from the wanted heading is near enough where something is in the way of the turn; a smaller part of
a turn than the second is none."""
_SHIFT_M = 0.03
"""So much the place in the map may shift while the robot turns."""
_CREEP_M, _CREEP_TURNS = 0.1, (-0.3, -0.15, 0.0, 0.15, 0.3)
"""Out of something that is too near: so far ahead must be free, with one of these turns (radians)."""
_AHEAD_RAD = 1.2
"""Ahead leads out only when the path does so, too."""
_PASSED_TOLERANCES = 1.6
"""Once reached, the position stays so until it is off by this many tolerances."""


@dataclass(frozen=True, slots=True)
class Control:
    """The decision of the controller.

    Attributes:
        command: The velocity.
        remaining: Metres left along the path.
        reached: Whether the robot stands at the goal.
        blocked: Why no velocity is possible, empty when one is.
        is_narrow: Whether that is because the robot cannot turn at its goal, or right before it.
        is_tight: Whether that is because every way along the path would touch something.
        text: What the robot does, for people; steady.
    """

    command: Twist2
    remaining: float
    reached: bool = False
    blocked: str = ""
    is_narrow: bool = False
    is_tight: bool = False
    text: str = ""


class Controller:
    """Follows one path to its goal. Positions are in the odometry frame, in which nothing jumps."""

    def __init__(self, parameters: ControllerParameters) -> None:
        self._p = parameters
        self._points: NDArray[np.float64] = np.empty((0, 2))
        self._goal = Pose2()
        self._position_reached = self._came = False
        self._stays_within = 0.0
        self._turning_to_path = False
        self._turn_sign = 0.0

    def start(self) -> None:
        """Forget the last goal."""
        self._position_reached = self._came = False
        self._stays_within = 0.0
        self._turning_to_path = False
        self._turn_sign = 0.0

    def set_plan(self, points: NDArray[np.float64], goal: Pose2) -> None:
        """Follow a path from now on.

        Args:
            points: Shape (n, 2), in the map frame, from the robot to the goal.
            goal: The last pose.
        """
        self._points, self._goal = points, goal

    def control(
        self,
        pose: Pose2,
        twist: Twist2,
        costmap: Costmap,
        odom_from_map: Pose2,
        clearance: Clearance,
        people: People,
    ) -> Control:
        """Choose a velocity.

        Args:
            pose: base_footprint in the odometry frame.
            twist: Its velocity.
            costmap: The local costmap, in the odometry frame.
            odom_from_map: Takes the path to the odometry frame.
            clearance: What is around the robot.
            people: Whom to mind.
        """
        answer = self._choose(pose, twist, costmap, odom_from_map, clearance, people)
        command = people.slowed(pose, answer.command)
        if command.is_zero() and not answer.command.is_zero():
            return Control(STANDSTILL, answer.remaining, blocked=SOMEBODY_IN_THE_WAY)
        return answer if command == answer.command else replace(answer, command=command)

    def _choose(
        self,
        pose: Pose2,
        twist: Twist2,
        costmap: Costmap,
        odom_from_map: Pose2,
        clearance: Clearance,
        people: People,
    ) -> Control:
        goal = odom_from_map @ self._goal
        path = self._path_ahead(pose, odom_from_map)
        distance = pose.distance_to(goal)
        if self._has_reached_position(pose, goal, distance):
            return self._turn_to_goal(pose, twist, goal, distance, clearance)
        remaining = max(distance, float(np.hypot(*np.diff(path, axis=0).T).sum()))
        if distance <= self._p.approach_distance:
            approach = self._approach(pose, goal, distance, clearance)
            if approach is not None:
                return approach
        return self._follow(pose, twist, path, remaining, costmap, clearance, people)

    def _path_ahead(self, pose: Pose2, odom_from_map: Pose2) -> NDArray[np.float64]:
        """Return the path from its point nearest to the robot on, odometry frame, shape (n, 2)."""
        c, s = math.cos(odom_from_map.yaw), math.sin(odom_from_map.yaw)
        points = self._points @ np.array([[c, s], [-s, c]]) + np.array([odom_from_map.x, odom_from_map.y])
        squared = (points[:, 0] - pose.x) ** 2 + (points[:, 1] - pose.y) ** 2
        # Of a path that comes back near the robot, the first nearest place counts.
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
        window = along <= along[int(np.argmax(squared < 0.25))] + 1.5
        return points[int(np.argmin(np.where(window, squared, np.inf))) :]

    # Near the goal.

    def _has_reached_position(self, pose: Pose2, goal: Pose2, distance: float) -> bool:
        tolerance = self._p.xy_goal_tolerance
        if self._position_reached:
            self._position_reached = self._p.latch_xy_goal_tolerance or distance <= self._stays_within
        else:
            # Inside the tolerance it drives on to the middle, until that is passed. A robot that has come
            # from further away does not turn away for a goal beside it that is nearly as near.
            self._came = self._came or distance > _PASSED_TOLERANCES * tolerance
            passed = abs(pose.bearing_to(goal.x, goal.y)) > 1.2
            enough = 0.4 if not passed else _PASSED_TOLERANCES if self._came else 1.0
            self._position_reached = distance <= enough * tolerance
            self._stays_within = _PASSED_TOLERANCES * tolerance
        return self._position_reached

    def _turn_to_goal(
        self, pose: Pose2, twist: Twist2, goal: Pose2, distance: float, clearance: Clearance
    ) -> Control:
        p = self._p
        left = normalize_angle(goal.yaw - pose.yaw)
        text = "turning to the goal's heading"
        if abs(left) <= 0.5 * p.yaw_goal_tolerance or (
            abs(left) <= p.yaw_goal_tolerance and abs(twist.angular) < p.min_in_place_rotational_vel / 2.0
        ):
            standing = (
                abs(twist.linear) < p.trans_stopped_velocity and abs(twist.angular) < p.rot_stopped_velocity
            )
            return Control(STANDSTILL, distance, reached=standing, text=text)
        if abs(twist.linear) > 2.0 * p.trans_stopped_velocity:
            return Control(STANDSTILL, distance, text=text)
        command = self._turn(left, clearance)
        if command is None and abs(left) <= _BLOCKED_YAW_TOLERANCE:
            return Control(STANDSTILL, distance, reached=True, text="as near as the obstacle allows")
        if command is None:
            return Control(
                STANDSTILL, distance, blocked="there is no room to turn to the goal's heading", is_narrow=True
            )
        return Control(command, distance, text=text)

    def _approach(self, pose: Pose2, goal: Pose2, distance: float, clearance: Clearance) -> Control | None:
        """Drive straight to the goal; None when something is in the way."""
        p = self._p
        bearing = pose.bearing_to(goal.x, goal.y)
        text = "approaching the goal"
        if abs(bearing) > 0.35:
            turn = self._turn(bearing, clearance)
            return Control(turn, distance, text=text) if turn is not None else None
        way = distance * clearance.free_part(distance, bearing)
        if distance - way > p.blocked_xy_tolerance:
            return None
        if way < distance and way < _SMALLEST_WAY_M:
            return self._stop_before(pose, goal, distance, clearance)
        linear = min(p.max_vel_x, max(min(p.min_vel_x, 0.05), p.approach_gain * way))
        angular = max(-p.max_rotational_vel, min(p.max_rotational_vel, p.turn_gain * bearing))
        return Control(Twist2(linear * math.cos(bearing) ** 2, angular), distance, text=text)

    def _stop_before(self, pose: Pose2, goal: Pose2, distance: float, clearance: Clearance) -> Control:
        """Stop before something that stands right before the goal: near enough, with the right heading."""
        left = normalize_angle(goal.yaw - pose.yaw)
        if abs(left) <= _BLOCKED_YAW_TOLERANCE:
            return Control(STANDSTILL, distance, reached=True, text="as near as the obstacle allows")
        turn = self._turn(left, clearance)
        if turn is None:
            return Control(
                STANDSTILL, distance, blocked="something stands right before the goal", is_narrow=True
            )
        self._position_reached, self._stays_within = True, distance + _SHIFT_M
        return Control(turn, distance, text="turning to the goal's heading")

    def _turn(self, left: float, clearance: Clearance) -> Twist2 | None:
        """Turn in place by an angle, the other way round when the short way is blocked."""
        p = self._p
        # Near half a circle both ways are equal: stay with the one that was begun.
        if abs(left) > 2.6 and self._turn_sign and math.copysign(1.0, left) != self._turn_sign:
            left -= math.copysign(math.tau, left)
        free = clearance.free_part(0.0, left)
        if free < 1.0 and (1.0 - free) * abs(left) > _BLOCKED_YAW_TOLERANCE:
            left -= math.copysign(math.tau, left)
            if not clearance.is_free(0.0, left):
                return None
        elif free * abs(left) < _SMALLEST_TURN_RAD:
            return None
        self._turn_sign = math.copysign(1.0, left)
        braking = math.sqrt(1.4 * p.acc_lim_th * abs(left))
        speed = min(p.max_rotational_vel, braking, p.turn_gain * abs(left))
        return Twist2(0.0, math.copysign(max(p.min_in_place_rotational_vel, speed), left))

    # Along the path.

    def _follow(
        self,
        pose: Pose2,
        twist: Twist2,
        path: NDArray[np.float64],
        remaining: float,
        costmap: Costmap,
        clearance: Clearance,
        people: People,
    ) -> Control:
        turn = self._turn_to_path(pose, path, clearance)
        if turn is not None:
            return Control(turn, remaining, text="turning towards the path")
        commands = self._samples(twist, remaining)
        ratings = self._rate(commands, pose, twist, path, costmap, people)
        good = ratings >= 0.0
        if good.any():
            best = commands[int(np.argmin(np.where(good, ratings, np.inf)))]
            return Control(Twist2(float(best[0]), float(best[1])), remaining, text="following the path")
        if (ratings == MEETS).any():
            return Control(STANDSTILL, remaining, blocked=SOMEBODY_IN_THE_WAY)
        # Nothing leads forward: turn on the spot towards the path, if that is possible.
        heading = self._path_bearing(pose, path)
        turn = self._turn(heading, clearance) if abs(heading) > 0.2 else None
        if turn is not None:
            return Control(turn, remaining, text="turning towards the path")
        out = self._out_of_the_wedge(heading, clearance)
        if out is not None:
            return Control(out, remaining, text="getting clear of what is too near")
        return Control(
            STANDSTILL, remaining, blocked="every way forward would touch something", is_tight=True
        )

    def _out_of_the_wedge(self, bearing: float, clearance: Clearance) -> Twist2 | None:
        """Creep ahead, where the robot stands in something already and gets in no deeper.

        Beside a door post it can neither turn nor drive an arc: its corners would swing into the post.
        """
        if abs(bearing) > _AHEAD_RAD or not clearance.is_wedged:
            return None
        for turn in sorted(_CREEP_TURNS, key=lambda each: abs(each - bearing)):
            if clearance.is_free(_CREEP_M, turn):
                return Twist2(self._p.min_vel_x, turn * self._p.min_vel_x / _CREEP_M)
        return None

    def _path_bearing(self, pose: Pose2, path: NDArray[np.float64]) -> float:
        """Return the direction of the path relative to the robot's heading."""
        away = np.hypot(path[:, 0] - pose.x, path[:, 1] - pose.y)
        far = away >= self._p.heading_lookahead
        x, y = path[int(np.argmax(far)) if far.any() else -1]
        return pose.bearing_to(float(x), float(y))

    def _turn_to_path(self, pose: Pose2, path: NDArray[np.float64], clearance: Clearance) -> Twist2 | None:
        bearing = self._path_bearing(pose, path)
        limit = self._p.rotate_to_path_angle
        self._turning_to_path = abs(bearing) > (0.3 * limit if self._turning_to_path else limit)
        if not self._turning_to_path:
            self._turn_sign = 0.0
            return None
        return self._turn(bearing, clearance)

    def _samples(self, twist: Twist2, remaining: float) -> NDArray[np.float64]:
        """Return the commands to try, shape (n, 2)."""
        p = self._p
        # It must be able to stop at the goal.
        fastest = min(p.max_vel_x, max(p.min_vel_x, math.sqrt(p.acc_lim_x * remaining)))
        window = p.sim_period if p.dwa else p.sim_time
        low = max(p.min_vel_x, twist.linear - p.acc_lim_x * window)
        high = max(low, min(fastest, twist.linear + p.acc_lim_x * window))
        reach = p.acc_lim_th * window
        slowest_turn = max(-p.max_rotational_vel, twist.angular - reach)
        fastest_turn = min(p.max_rotational_vel, twist.angular + reach)
        turns = np.concatenate([[0.0], np.linspace(slowest_turn, fastest_turn, p.vtheta_samples - 1)])
        speeds = np.linspace(min(low, fastest), min(high, fastest), p.vx_samples)
        return np.array([(speed, turn) for speed in speeds for turn in turns])

    def _rate(
        self,
        commands: NDArray[np.float64],
        pose: Pose2,
        twist: Twist2,
        path: NDArray[np.float64],
        costmap: Costmap,
        people: People,
    ) -> NDArray[np.float64]:
        p = self._p
        path_grid, goal_grid = self._distance_grids(pose, path, costmap)
        frame = np.array([costmap.origin_x, costmap.origin_y, costmap.resolution])
        ratings: NDArray[np.float64] = roll_out(
            costmap.master,
            frame,
            np.array([pose.x, pose.y, pose.yaw, twist.linear, twist.angular]),
            commands,
            np.array([p.acc_lim_x, p.acc_lim_th, p.sim_time, p.sim_granularity, p.angular_sim_granularity]),
            costmap.footprint.outline(costmap.resolution / 2.0),
            costmap.harmless_below,
            path_grid,
            goal_grid,
            np.array([p.path_distance_bias, p.goal_distance_bias, p.occdist_scale]),
            UNVISITED / NEUTRAL,
            people.rows,
        )
        return ratings

    def _distance_grids(
        self, pose: Pose2, path: NDArray[np.float64], costmap: Costmap
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return distances from the path and from the local goal in cells, around obstacles.

        The original counts cells in four directions (REFERENCE 7.6); a wave measures the true length, so that
        a slanted way is not rated 1.4 times as long.
        """
        master = costmap.master
        crossing = np.full((master.shape[0] + 2, master.shape[1] + 2), OBSTACLE, np.uint8)
        crossing[1:-1, 1:-1] = np.where(master < INSCRIBED, NEUTRAL, OBSTACLE)
        own = costmap.cell_of(pose.x, pose.y)
        if own is not None:
            # The robot's own place counts as free.
            row, column = own[0] + 1, own[1] + 1
            around = crossing[max(1, row - 4) : row + 5, max(1, column - 4) : column + 5]
            around[: master.shape[0], : master.shape[1]] = NEUTRAL
            crossing[[0, -1], :] = OBSTACLE
            crossing[:, [0, -1]] = OBSTACLE
        columns = crossing.shape[1]
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
        near = path[along <= self._p.local_goal_distance]
        cells = (
            np.floor((near - np.array([costmap.origin_x, costmap.origin_y])) / costmap.resolution).astype(int)
            + 1
        )
        inside = ((cells >= 1) & (cells <= np.array(master.shape[::-1]))).all(axis=1)
        cells = cells[: len(cells) if inside.all() else int(np.argmin(inside))]
        index = cells[:, 1] * columns + cells[:, 0]
        flat = crossing.ravel()
        index = index[flat[index] < OBSTACLE]
        grids = []
        for starts in (np.unique(index), index[-1:]):
            wave = spread_wave(flat, columns, starts, -1, 2.0 * NEUTRAL)
            grids.append(wave.reshape(crossing.shape)[1:-1, 1:-1].astype(float) / NEUTRAL)
        return np.ascontiguousarray(grids[0]), np.ascontiguousarray(grids[1])
