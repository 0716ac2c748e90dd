"""Poses in front of a person: three proposals at a safe distance, then as near as possible.

Pure functions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.core.outcome import Result, failure, success
from florence_bt.skills.robot_description.room import DEFAULT_ROOM, RUN_UPS_M, RoomParameters

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from florence_bt.core.sensing import OccupancyGrid

DEFAULT_SAFE_DISTANCE = 0.5
"""Metres; document, table 13."""
ANGLE_OFFSETS = (0.0, math.radians(45.0), math.radians(-45.0))
"""Radians, by trial; REFERENCE 12.8."""
POLITE_TRIALS, NEAREST_TRIALS = len(ANGLE_OFFSETS), 3
"""So many trials at the safe distance, then so many places as near as the robot gets."""
TRIALS = POLITE_TRIALS + NEAREST_TRIALS
MINIMUM_SAFE_DISTANCE, MAXIMUM_SAFE_DISTANCE = 0.3, 2.0
"""Metres; the bounds of a safe distance that is given. Chosen."""
LETHAL_COST = 99
"""Occupancy value (0..100) from which the robot would touch something; costmap value 253, REFERENCE 12.8."""
RESERVE = 0.06
"""Metres: by so much what stands there may be nearer on arrival: half a cell and what the localisation errs.
With half a cell alone the robot often stood at the place without room to turn to the person."""
SHORT = 0.1
"""The share of the safe distance by which the robot may stop before a place at that distance."""
_STOPS = (0.0, 1 / 3, 2 / 3)
"""Places before a place where the robot may have to stop, as parts of ``blocked_xy_tolerance``; and at all of
it."""
RUN_UP = RUN_UPS_M[0]
"""Metres: a place without room to turn is entered straight, from one with room so far before it."""
FARTHEST = 2.5
"""Metres; further away is not in front of a person."""
WAY_WEIGHT = 0.05
"""Worth of a metre of way, in metres nearer to the person."""
TURN_WORTH = 0.25
"""Worth of room to turn, in metres nearer to the person."""
WAY_WORTH = 1.0
"""Worth of a way with room to turn, but for the run-up, in metres nearer to the person: in a narrow one the
robot may get stuck."""
SIGHT_WORTH = 0.5
"""Worth of a free line of sight between the place and the person, in metres nearer to the person."""
_AROUND, _DETOUR = 0.95, 0.3
"""Metres: the way to a place leads no further from the person than the safe distance and the first, or than
the robot is and the second. Somebody in a bed at a wall would otherwise be met from the room behind it."""
_BESIDE = 0.1
"""Metres beside the straight way into a place that are no matter."""
STAY_WORTH = 0.06
"""The robot stays where it is when the best place is no more than this nearer to the person, metres."""
PLACES_APART = 0.3
"""Metres between the places of two trials."""


def polite_pose(user: Pose2, robot: Pose2, trial: int, safe_distance: float = DEFAULT_SAFE_DISTANCE) -> Pose2:
    """Propose a pose at the safe distance that faces the person.

    Args:
        user: Where the person is, map frame; the yaw does not matter.
        robot: Where the robot was when the approach began, map frame; the yaw matters only when both
            positions are the same: the proposal then lies behind the robot.
        trial: 1 to ``POLITE_TRIALS``.
        safe_distance: Metres between the person and the proposal.

    Raises:
        ValueError: There is no such trial.

    Source:
        REFERENCE 12.8.
    """
    if not 1 <= trial <= POLITE_TRIALS:
        raise ValueError(f"trial is {trial}, it must be 1 to {POLITE_TRIALS}")
    if robot.distance_to(user) > 0.0:
        direction = math.atan2(robot.y - user.y, robot.x - user.x)
    else:
        direction = robot.yaw + math.pi
    direction += ANGLE_OFFSETS[trial - 1]
    return Pose2(
        user.x + safe_distance * math.cos(direction),
        user.y + safe_distance * math.sin(direction),
        normalize_angle(direction + math.pi),
    )


def _farthest_way(user: Pose2, robot: Pose2, safe_distance: float) -> float:
    """Return how far from the person the way to a place may lead, metres."""
    return max(robot.distance_to(user) + _DETOUR, safe_distance + _AROUND)


class _Surroundings:
    """The surroundings of a person: where the robot gets to near a person, and where it fits.

    Args:
        user: Where the person is, map frame.
        robot: Where the robot is, map frame.
        safe_distance: Metres.
        costmap: 99 and more where the robot would touch something, 100 where something stands.
        room: What the robot needs on the floor.
    """

    def __init__(
        self, user: Pose2, robot: Pose2, safe_distance: float, costmap: OccupancyGrid, room: RoomParameters
    ) -> None:
        import numpy as np
        from scipy import ndimage

        from florence_bt.core.sensing import OCCUPIED

        rows, columns = costmap.cells.shape
        self.x = costmap.origin.x + (np.arange(columns) + 0.5) * costmap.resolution
        self.y = costmap.origin.y + (np.arange(rows) + 0.5) * costmap.resolution
        self.from_user, self.from_robot = (
            np.hypot(self.x[None, :] - place.x, self.y[:, None] - place.y) for place in (user, robot)
        )
        self._costmap, self._user, self._robot = costmap, user, robot
        self._free = costmap.cells < OCCUPIED
        self._spare = room.blocked_xy_tolerance
        footprint = room.make_footprint()
        self._outline = footprint.outline(costmap.resolution / 2.0)
        distances = ndimage.distance_transform_edt(np.pad(self._free, 1))
        clearance, turning = distances[1:-1, 1:-1] * costmap.resolution, footprint.circumscribed_radius
        self.has_room_to_turn = clearance >= turning + RESERVE
        around = self.from_user <= _farthest_way(user, robot, safe_distance)
        leaving = self._free & (self.from_robot <= room.start_clearance)
        free = costmap.cells < LETHAL_COST
        self.reached: NDArray[np.bool_] = self._connected(around & (free | leaving)) & free
        """Cells to which the robot gets without leaving the surroundings of the person."""
        # On the way navigation sees what is nearer than thought, and goes round it: it needs no reserve.
        wide = self._connected(around & ((clearance >= turning + costmap.resolution / 2) | leaving))
        beside = ndimage.distance_transform_edt(~wide) if wide.any() else np.full(wide.shape, np.inf)
        self.has_wide_way = self.reached & (beside * costmap.resolution <= RUN_UP)

    def _connected(self, cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return the cells that the robot reaches without leaving them."""
        import numpy as np
        from scipy import ndimage

        parts, _ = ndimage.label(cells, np.ones((3, 3)))
        own = self._cell(self._robot)
        part = parts[own] if own is not None else 0
        connected: NDArray[np.bool_] = (parts == part) & (part > 0)
        return connected

    def _cell(self, place: Pose2) -> tuple[int, int] | None:
        cell = self._costmap.cell_of(place.x, place.y)
        return cell if self._costmap.contains(*cell) else None

    def _fits(self, pose: Pose2) -> bool:
        """Tell whether nothing stands under the outline of the robot, and the map knows all of it."""
        import numpy as np

        c, s = math.cos(pose.yaw), math.sin(pose.yaw)
        points = self._outline @ np.array([[c, s], [-s, c]]) + (pose.x, pose.y)
        origin = (self._costmap.origin.x, self._costmap.origin.y)
        cells = np.floor((points - origin) / self._costmap.resolution).astype(int)
        inside = ((cells >= 0) & (cells < self._free.shape[::-1])).all(axis=1)
        return bool(inside.all() and self._free[cells[:, 1], cells[:, 0]].all())

    def problem_with(self, pose: Pose2) -> str:
        """Tell why the robot cannot get to a pose, or cannot stand there; empty when it can."""
        cell = self._cell(pose)
        if cell is None:
            return "lies beyond the map"
        if self._costmap.cells[cell] >= LETHAL_COST:
            return f"is not free: cost {self._costmap.cells[cell]}"
        if not self.reached[cell]:
            return "cannot be reached"
        if not self.is_in_sight(pose):
            return "does not see the person"
        short = SHORT * self._user.distance_to(pose)
        enters = self.can_enter(pose) and self.stops_before(pose) <= short
        return "" if enters else "has no room for the robot"

    def is_in_sight(self, place: Pose2) -> bool:
        """Tell whether only the person's seat or bed is in between: no free floor beyond an obstacle."""
        import numpy as np

        away = self._user.distance_to(place)
        along = np.arange(0.0, away, self._costmap.resolution / 2.0) / max(away, 1e-9)
        x = place.x + along * (self._user.x - place.x)
        y = place.y + along * (self._user.y - place.y)
        columns = np.floor((x - self._costmap.origin.x) / self._costmap.resolution).astype(int)
        rows = np.floor((y - self._costmap.origin.y) / self._costmap.resolution).astype(int)
        inside = (rows >= 0) & (columns >= 0) & (rows < len(self.y)) & (columns < len(self.x))
        costs = self._costmap.cells[rows[inside], columns[inside]]
        open_floor = (costs >= 0) & (costs < LETHAL_COST)
        first = int(np.argmin(costs < LETHAL_COST + 1)) if (costs > LETHAL_COST).any() else len(costs)
        return not open_floor[first:].any()

    def stay_for(self, best: Pose2, safe_distance: float) -> Pose2:
        """Return where the robot stands, facing the person, if the best place is hardly nearer to them."""
        here, user = self._robot, self._user
        away = here.distance_to(user)
        near = safe_distance - STAY_WORTH <= away <= best.distance_to(user) + STAY_WORTH
        if not near or not self.is_in_sight(here):
            return best
        return Pose2(here.x, here.y, math.atan2(user.y - here.y, user.x - here.x))

    def stops_before(self, pose: Pose2) -> float:
        """Return how far before a pose, entered straight, the robot has to stop, metres.

        At most ``blocked_xy_tolerance``.
        """
        stops = (self._spare * part for part in _STOPS)
        return next((back for back in stops if self._fits(pose @ Pose2(-back, 0.0, 0.0))), self._spare)

    def can_enter(self, pose: Pose2) -> bool:
        """Tell whether the robot can turn at a pose, or drive straight into it."""
        cell = self._cell(pose)
        if cell is None or self.has_room_to_turn[cell]:
            return cell is not None
        start = self._cell(pose @ Pose2(-RUN_UP, 0.0, 0.0))
        behind = pose.inverse() @ self._robot
        lined_up = -2.0 * RUN_UP <= behind.x <= 0.0 and abs(behind.y) <= _BESIDE
        if not lined_up and (start is None or not (self.has_room_to_turn & self.reached)[start]):
            return False
        backs = (self._spare, (self._spare + RUN_UP) / 2)
        return all(self._fits(pose @ Pose2(-back, 0.0, 0.0)) for back in backs)


def nearest_pose(
    user: Pose2,
    robot: Pose2,
    safe_distance: float,
    costmap: OccupancyGrid,
    tried: Sequence[Pose2] = (),
    room: RoomParameters = DEFAULT_ROOM,
) -> Pose2 | None:
    """Return a place as near to a person as the robot gets, at the safe distance or more.

    Who sits on a sofa or lies in bed can often not be met at the safe distance. Only places count to which
    the robot gets without leaving the surroundings of the person, so none behind a wall.

    Args:
        user: Where the person is, map frame.
        robot: Where the robot is, map frame.
        safe_distance: Metres.
        costmap: 99 and more where the robot would touch something, 100 where something stands.
        tried: Places to which the robot did not get: the place is ``PLACES_APART`` from each of them.
        room: What the robot needs on the floor.

    Returns:
        The pose, which faces the person; None when there is no such place within ``FARTHEST``.
    """
    import numpy as np

    near = _Surroundings(user, robot, safe_distance, costmap, room)
    apart = near.from_user
    places = near.reached & (apart >= safe_distance - costmap.resolution / 2) & (apart <= FARTHEST)
    # Of places about equally near to the person, the one with the shortest way.
    cost = apart + WAY_WEIGHT * near.from_robot + TURN_WORTH * ~near.has_room_to_turn
    cost += WAY_WORTH * ~near.has_wide_way
    order = np.argsort(cost[places], kind="stable")
    candidates = list(zip(cost[places][order].tolist(), np.argwhere(places)[order].tolist(), strict=True))
    best: Pose2 | None = None
    least = math.inf
    for worth, (row, column) in candidates:
        if worth >= least:
            break
        x, y = float(near.x[column]), float(near.y[row])
        place = Pose2(x, y, math.atan2(user.y - y, user.x - x))
        if any(place.distance_to(other) < PLACES_APART for other in tried) or not near.can_enter(place):
            continue
        worth += near.stops_before(place)
        worth += 0.0 if near.is_in_sight(place) else SIGHT_WORTH
        if worth < least:
            best, least = place, worth
    return best if best is None or tried else near.stay_for(best, safe_distance)


def propose_approach(
    user: Pose2,
    robot: Pose2,
    trial: int,
    safe_distance: float = DEFAULT_SAFE_DISTANCE,
    costmap: OccupancyGrid | None = None,
    room: RoomParameters = DEFAULT_ROOM,
    tried: Sequence[Pose2] = (),
) -> Result:
    """Propose a pose and check that it is free.

    Args:
        user: Where the person is, map frame.
        robot: Where the robot was when the approach began, map frame.
        trial: The first are the proposals of :func:`polite_pose`, the last those of :func:`nearest_pose`.
        safe_distance: Metres.
        costmap: None when there is none yet: the proposals of :func:`polite_pose` then pass unchecked.
        room: What the robot needs on the floor, as navigation has it.
        tried: What the trials of :func:`nearest_pose` have proposed before in this approach.

    Returns:
        Success with the output ``pose``; or ``pose_occupied``, with the pose as well if there is one; or
        ``bad_input``.
    """
    problem = _problem_with(user, robot, trial, safe_distance)
    if problem:
        return failure("bad_input", problem)
    if trial > POLITE_TRIALS:
        nearest = None
        if costmap is not None:
            nearest = nearest_pose(user, robot, safe_distance, costmap, tried, room)
        if nearest is None:
            other = "no other place" if tried else "no place"
            within = min(FARTHEST, _farthest_way(user, robot, safe_distance))
            return failure("pose_occupied", f"{other} within {within:.1f} m of the person can be reached")
        return success(pose=nearest)
    pose = polite_pose(user, robot, trial, safe_distance)
    if costmap is not None:
        problem = _Surroundings(user, robot, safe_distance, costmap, room).problem_with(pose)
    if problem:
        reason = f"the place ({pose.x:.2f}, {pose.y:.2f}) of trial {trial} {problem}"
        return failure("pose_occupied", reason, pose=pose)
    return success(pose=pose)


class Proposals:
    """Proposes where to stand, and no place twice in one approach, whatever has been seen meanwhile."""

    def __init__(self) -> None:
        self._tried: list[Pose2] = []

    def propose(
        self,
        user: Pose2,
        robot: Pose2,
        trial: int,
        safe_distance: float,
        costmap: OccupancyGrid | None,
        room: RoomParameters,
    ) -> Result:
        """Propose as :func:`propose_approach` does; the first of the nearest places begins anew."""
        if trial <= POLITE_TRIALS + 1:
            self._tried.clear()
        result = propose_approach(user, robot, trial, safe_distance, costmap, room, self._tried)
        if result.succeeded and trial > POLITE_TRIALS:
            self._tried.append(result.outputs["pose"])
        return result


def _problem_with(user: Pose2, robot: Pose2, trial: int, safe_distance: float) -> str:
    if not (user.is_finite() and robot.is_finite()):
        return f"the positions must be finite: user {user}, robot {robot}"
    if not 1 <= trial <= TRIALS:
        return f"trial is {trial}, it must be 1 to {TRIALS}"
    if not MINIMUM_SAFE_DISTANCE <= safe_distance <= MAXIMUM_SAFE_DISTANCE:
        limits = f"{MINIMUM_SAFE_DISTANCE} to {MAXIMUM_SAFE_DISTANCE} m"
        return f"safe_distance is {safe_distance} m, it must be {limits}"
    return ""
