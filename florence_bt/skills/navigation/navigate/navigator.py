"""Goals: the cycle of planning, driving and recovering, and turns in place. No ROS, no clock of its own."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from florence_bt.core.base_stop import BaseStop
from florence_bt.core.geometry import STANDSTILL, Point2, Pose2, Twist2, integrate_twist
from florence_bt.core.outcome import Outcome, Result, cancelled, failure
from florence_bt.core.sensing import LaserScan, OccupancyGrid, Odometry
from florence_bt.core.table_legs import with_tables
from florence_bt.core.transforms import Transform3
from florence_bt.core.zones import Zone
from florence_bt.skills.navigation.navigate._cell_kernels import LETHAL, UNKNOWN_COST, Cells
from florence_bt.skills.navigation.navigate.clearance import Clearance, MapWalls
from florence_bt.skills.navigation.navigate.contact_marks import ContactMarks
from florence_bt.skills.navigation.navigate.costmap import (
    BODIES,
    CONTACTS,
    LASER,
    Costmap,
    moved_rays,
    rays_of,
)
from florence_bt.skills.navigation.navigate.driven_way import DrivenWay
from florence_bt.skills.navigation.navigate.exploration import Exploration
from florence_bt.skills.navigation.navigate.find_place import LOOKING_FOR_PLACE, FindPlace
from florence_bt.skills.navigation.navigate.glass import GlassMemory
from florence_bt.skills.navigation.navigate.goal import NavigationGoal
from florence_bt.skills.navigation.navigate.goal_start import ActionGoal, GoalStart, ToMap, as_in_map
from florence_bt.skills.navigation.navigate.map_difference import MapDifference
from florence_bt.skills.navigation.navigate.parameters import NavigatorParameters
from florence_bt.skills.navigation.navigate.people_tracks import PeopleTracks
from florence_bt.skills.navigation.navigate.planner import Plan, plan_path
from florence_bt.skills.navigation.navigate.state import Costmaps, CycleResult, CycleState, Feedback
from florence_bt.skills.navigation.navigate.tight_ways import TightWays
from florence_bt.skills.navigation.navigate.vacated_cells import VacatedCells, clear_person
from florence_bt.skills.navigation.navigate.zone_layer import ZoneLayer
from florence_bt.skills.robot_description.room import START_CLEARANCE_M

FEET = "laser"
"""The source of scans of the laser alone."""
_CONTACTS_KEPT_S = 600.0
"""A goal that begins so long after the last contact, or after a way was too tight, does not believe in it any
more."""
_HANDED_ON = frozenset({"ok", "user_lost"})
"""Ends of a goal whose knowledge is left to the next one."""
_FOUND_ELSEWHERE_M = 0.5
"""A place that jumps so far was wrong: what the sensors have marked in the map is elsewhere. Chosen: the
localiser's largest correction of a place that is right is 0.4 m."""
_CORRECTED_M = 0.1
"""A map whose place jumps so far was corrected, while it grows."""
_WAY_STEP_M, _WAY_POSES = 0.04, 20
"""Each pose of the way on which the robot came is at least so far from the one before; so many are kept."""


class SensorTimeouts:
    """Remembers the newest scan of each sensor and says what is missing.

    Args:
        timeout: Older data counts as missing, in seconds; data from as far ahead too, because it would look
            fresh for too long after the sensor has fallen silent.
        scan_timeout: A sensor of which nothing has come for so long counts as missing, in seconds. Scans that
            come regularly may be older: on a busy machine all are late.
        required: The sensors without which the robot does not move.
    """

    def __init__(self, timeout: float, scan_timeout: float, required: tuple[str, ...]) -> None:
        self._timeout = timeout
        self._scan_timeout = scan_timeout
        self._required = required
        self._scans: dict[str, float] = {}
        self._arrived: dict[str, float] = {}

    def saw(self, source: str, stamp: float, arrived: float) -> None:
        """Note that a scan came."""
        self._scans[source] = stamp
        self._arrived[source] = arrived

    def missing(self, now: float, odometry: Odometry | None) -> tuple[str, str] | None:
        """Tell what is missing, as (code, reason); None when all is there."""
        if odometry is None or not odometry.pose.is_finite():
            return "no_pose", "the base publishes no odometry"
        if abs(now - odometry.stamp) > self._timeout:
            return "no_pose", f"the odometry is older than {self._timeout:g} s"
        for source in self._required:
            stamp = self._scans.get(source)
            if stamp is None:
                return "no_scan", f"no scan of {source!r} has come yet"
            if abs(now - stamp) > self._timeout:
                return "no_scan", f"the last scan of {source!r} is older than {self._timeout:g} s"
            if not 0.0 <= now - self._arrived[source] <= self._scan_timeout:
                return "no_scan", f"no scan of {source!r} has come for {self._scan_timeout:g} s"
        return None


class Navigator:
    """Drives to poses and along paths, turns in place, follows and approaches people, one goal at a time.

    Feed it every scan with :meth:`add_scan` and every person with :meth:`saw_person`, start a goal, then call
    :meth:`step` at the controller's frequency and send what it commands, until it gives a result.

    Attributes:
        global_costmap: In the map frame.
        local_costmap: In the odometry frame, rolling with the robot.
        base_stop: What holds the base, as it says itself; keep it up to date.
        speed_limit: How fast to drive at most, m/s; 0 means as fast as the parameters allow.
    """

    def __init__(self, grid: OccupancyGrid, parameters: NavigatorParameters | None = None) -> None:
        self._p = parameters or NavigatorParameters()
        self._robot: Pose2 | None = None
        self.global_costmap = Costmap(self._p.costmap, self._furnished(grid))
        self.local_costmap = Costmap(self._p.costmap)
        tight = TightWays(self.global_costmap)
        contacts = ContactMarks(self.global_costmap, self.local_costmap)
        parts = self._map_parts()
        self._costmaps = Costmaps(self.global_costmap, self.local_costmap, *parts, tight, contacts)
        self._newer_map: OccupancyGrid | None = None
        self._glass = GlassMemory() if self._p.exploration.map_grows else None
        self._exploration = Exploration(self.global_costmap, self._p.exploration)
        self._way: deque[Pose2] = deque(maxlen=_WAY_POSES)
        self._driven = DrivenWay(self._p.costmap.make_true_footprint())
        cycle = self._p.cycle
        self._fresh = SensorTimeouts(cycle.sensor_timeout, cycle.scan_timeout, cycle.required_sources)
        self._unmapped = MapDifference(self._costmaps)
        self._people = PeopleTracks(self._p.people, self._p.follow.follow_coast)
        self._trails = VacatedCells()
        self._left: list[Point2] = []
        self._goal: NavigationGoal | None = None
        self._before: NavigationGoal | None = None
        self._end: Result | None = None
        self._missing_since: float | None = None
        self._finding: FindPlace | None = None
        self._map_from_odom: Pose2 | None = None
        self._feedback = Feedback()
        self.base_stop = BaseStop()
        self.speed_limit = 0.0

    def _furnished(self, grid: OccupancyGrid) -> OccupancyGrid:
        """Return the map with its tables, but for one at which the robot stands: so it is none."""
        if not self._p.costmap.fill_tables:
            return grid
        furnished, robot = with_tables(grid), self._robot
        if robot is None:
            return furnished
        pieces, _ = ndimage.label(furnished.cells != grid.cells)
        rows, columns = np.nonzero(pieces)
        x = grid.origin.x + (columns + 0.5) * grid.resolution - robot.x
        y = grid.origin.y + (rows + 0.5) * grid.resolution - robot.y
        near = np.unique(pieces[rows, columns][np.hypot(x, y) < START_CLEARANCE_M])
        return replace(furnished, cells=np.where(np.isin(pieces, near), grid.cells, furnished.cells))

    def _map_parts(self) -> tuple[Cells, MapWalls, ZoneLayer]:
        """Make what follows from the map, and from no sensor."""
        costmap = self.global_costmap
        static = costmap.static_master()
        frame = np.array([costmap.origin_x, costmap.origin_y, costmap.resolution])
        outline = self._p.costmap.make_true_footprint().outline(costmap.resolution / 2.0)
        return static, MapWalls(static, frame, outline), ZoneLayer(costmap, self.local_costmap, static)

    def replace_map(self, grid: OccupancyGrid) -> None:
        """Take a newer map of the same place; the goal goes on, and what the sensors have marked stays.

        Who follows a person does so on the older map: the newer one is taken afterwards.

        Args:
            grid: The map, with cells of the same size; it may have grown, and begin elsewhere.

        Raises:
            ValueError: Its cells have another size.
        """
        if self._goal is not None and self._goal.keeps_map:
            self._newer_map = grid
            return
        self._newer_map = None
        # Glass is no leg of a table.
        furnished = self._furnished(grid)
        seen = furnished if self._glass is None else self._glass.added_to(furnished)
        stood = [] if self._map_from_odom is None else [self._map_from_odom @ place for place in self._way]
        self.global_costmap.replace_static(seen, forget=LASER, stood=stood)
        zones, costmaps = self._zones.zones, self._costmaps
        costmaps.static, costmaps.walls, costmaps.zones = self._map_parts()
        self._zones.set(zones)
        self._unmapped = MapDifference(costmaps)

    @property
    def _walls(self) -> MapWalls:
        return self._costmaps.walls

    @property
    def _zones(self) -> ZoneLayer:
        return self._costmaps.zones

    def next_view(self, robot: Pose2, number: int) -> Result:
        """Return where to look next while the map grows (:meth:`Exploration.next_view`)."""
        if self._exploration.stands(robot):
            # What it has touched is a wall of the map by now.
            for costmap in (self.global_costmap, self.local_costmap):
                costmap.forget([CONTACTS], before=math.inf)
        return self._exploration.next_view(robot, number)

    @property
    def active(self) -> bool:
        """Tell whether a goal waits for its end."""
        return self._goal is not None or self._end is not None

    @property
    def plan(self) -> NDArray[np.float64] | None:
        """The path that is followed, shape (n, 2) in the map frame, or None."""
        return None if self._goal is None else self._goal.path

    @property
    def person(self) -> Point2 | None:
        """Give the last place of the person who is followed or approached, in the odometry frame, metres."""
        return None if self._goal is None else self._goal.person

    def set_zones(self, zones: Iterable[Zone]) -> None:
        """Keep to these zones from now on, in place of all of before; a drive under way minds them, too."""
        self._zones.set(zones)

    # What is around.

    def add_scan(
        self,
        source: str,
        scan: LaserScan,
        sensor_in_base: Transform3,
        odom_pose: Pose2,
        map_from_odom: Pose2 | None,
        arrived: float | None = None,
    ) -> None:
        """Take a filtered scan into both costmaps.

        Args:
            source: ``scan`` for the laser, ``depth`` for the Kinect; each has a layer of its own. What
                ``people`` shows stays until they have walked away. ``laser`` only tells what has left.
            scan: The scan; what is out of range must read as a far hit to clear (REFERENCE 6.4).
            sensor_in_base: The sensor's frame in base_footprint.
            odom_pose: base_footprint in the odometry frame at the time of the scan.
            map_from_odom: The place of the odometry frame in the map, None while it is not known.
            arrived: When the scan came, in seconds; its own stamp when not given.
        """
        if not odom_pose.is_finite():
            return
        self._fresh.saw(source, scan.stamp, scan.stamp if arrived is None else arrived)
        self._driven.saw(odom_pose)
        self._forget_what_was_elsewhere(odom_pose, map_from_odom)
        self._clear_where_people_were(map_from_odom)
        in_base = rays_of(scan, sensor_in_base)
        known = None
        if source == FEET and map_from_odom is not None:
            known = self._unmapped.is_known(moved_rays(in_base, map_from_odom @ odom_pose).ends)
        if source == LASER and self._glass is not None and map_from_odom is not None:
            ends = moved_rays(in_base, map_from_odom @ odom_pose).ends
            self._glass.saw(scan.stamp, ends[~self._unmapped.is_known(ends)], map_from_odom @ odom_pose)
        if source == LASER and self._goal is not None:
            ends = moved_rays(in_base, odom_pose).ends
            self._goal.saw_scan(scan.stamp, ends, odom_pose, map_from_odom)
        for costmap, robot in (
            (self.local_costmap, odom_pose),
            (self.global_costmap, None if map_from_odom is None else map_from_odom @ odom_pose),
        ):
            if robot is None:
                continue
            if source == FEET:
                costmap.update_feet(moved_rays(in_base, robot), known)
            else:
                only_marks_at = scan.stamp if source == BODIES else None
                costmap.add_rays(source, moved_rays(in_base, robot), robot, only_marks_at=only_marks_at)

    def _forget_what_was_elsewhere(self, odom_pose: Pose2, map_from_odom: Pose2 | None) -> None:
        if map_from_odom is None:
            return
        before, self._map_from_odom = self._map_from_odom, map_from_odom
        self._robot = map_from_odom @ odom_pose
        if not self._way or self._way[-1].distance_to(odom_pose) >= _WAY_STEP_M:
            self._way.append(odom_pose)
        jump = (before @ odom_pose).distance_to(self._robot) if before else 0.0
        if jump > _FOUND_ELSEWHERE_M:
            self.global_costmap.reset_outside(0.0, 0.0, 0.0)
        if jump > _CORRECTED_M and self._glass is not None:
            self._glass.forget()

    def _clear_where_people_were(self, map_from_odom: Pose2 | None) -> None:
        """Clear what the camera marked where somebody was who has walked on: it was that person."""
        for place in self._left:
            in_map = None if map_from_odom is None else map_from_odom.apply(*place)
            clear_person(self._costmaps, place, in_map)
        self._left.clear()

    def clear(self) -> None:
        """Forget everything the sensors have marked."""
        for costmap in (self.global_costmap, self.local_costmap):
            costmap.reset_outside(0.0, 0.0, 0.0)

    def cost_at(self, x: float, y: float) -> int:
        """Return the cost at a place, map frame: 0 free .. 252, 253 too near, 254 obstacle, 255 unknown."""
        return self.global_costmap.cost_at(x, y) if math.isfinite(x) and math.isfinite(y) else UNKNOWN_COST

    def global_grid(self) -> OccupancyGrid:
        """Return the global costmap for showing: 100 lethal, 99 inscribed, -1 unknown."""
        return self.global_costmap.to_grid()

    def local_grid(self) -> OccupancyGrid:
        """Return the local costmap for showing, in the odometry frame."""
        return self.local_costmap.to_grid()

    # Goals.

    def start(self, goal: ActionGoal, now: float, to_map: ToMap = as_in_map) -> None:
        """Begin a goal, which replaces what is active; one that cannot be done ends in the next step.

        Args:
            goal: What is asked.
            now: Seconds.
            to_map: Takes poses to the map frame; without it all are in it.
        """
        before = self._goal or self._before
        for costmap in (self.global_costmap, self.local_costmap):
            costmap.forget([CONTACTS], before=now - _CONTACTS_KEPT_S)
        self._costmaps.tight.forget(before=now - _CONTACTS_KEPT_S, of_map=True)
        self._goal = self._end = self._before = None
        if self._newer_map is not None:
            self.replace_map(self._newer_map)
        self._missing_since = self._finding = None
        self._feedback = Feedback(text="starting")
        begun = goal.begin(GoalStart(now, self._costmaps, self._p, self._people, before, to_map))
        if isinstance(begun, Result):
            self._end = begun
        else:
            self._goal = begun

    def plan_between(self, start: Pose2, goal: Pose2, tolerance: float = 0.0) -> Plan | Result:
        """Plan a path in the map frame, which nobody drives.

        Args:
            start: Where from.
            goal: Where to.
            tolerance: When the goal is blocked, the nearest place within this many metres will do.

        Returns:
            The plan, or a failure as of :func:`plan_path`, or ``start_occupied``.
        """
        if not start.is_finite():
            return failure("bad_input", f"the start {start} is not finite")
        if self.cost_at(start.x, start.y) == LETHAL:
            return failure("start_occupied", f"({start.x:.2f}, {start.y:.2f}) lies in an obstacle")
        problem = self._costmaps.problem_with(goal)
        if problem is not None and problem[0] == "goal_outside" and tolerance <= 0.0:
            return failure(*problem)
        forbidden = self._zones.problem_with(goal) if tolerance <= 0.0 and goal.is_finite() else None
        if forbidden is not None:
            return failure("goal_occupied", forbidden)
        return plan_path(self.global_costmap, start, goal, self._p.planner, tolerance=tolerance)

    def saw_person(self, stamp: float, user_id: int, x: float, y: float) -> None:
        """Note that somebody was seen; ignore what is not newer than before, or not finite.

        Args:
            stamp: Seconds.
            user_id: Their persistent id.
            x: Metres, in the odometry frame.
            y: Metres.
        """
        self._people.saw(stamp, user_id, x, y)
        if math.isfinite(x) and math.isfinite(y):
            self._left += self._trails.saw(stamp, user_id, (x, y))

    def saw_people(self, stamp: float, people: Sequence[Point2]) -> None:
        """Note that the camera saw people; one of them may be the one who is approached.

        Args:
            stamp: Seconds.
            people: Where they are, in the odometry frame, metres.
        """
        if self._goal is not None:
            self._goal.saw_people(stamp, people)

    def cancel(self) -> None:
        """End the goal; the next step stops the robot and reports it. Without a goal nothing happens."""
        if self.active and self._end is None:
            self._goal = None
            self._end = cancelled()

    def step(self, now: float, odometry: Odometry | None, map_from_odom: Pose2 | None) -> CycleResult:
        """Take one step.

        Args:
            now: Seconds.
            odometry: The newest odometry, None before the first.
            map_from_odom: The place of the odometry frame in the map, None while it is not known.

        Returns:
            What to do now. The robot never moves on old data, and every goal's end comes with a standstill.
        """
        if not self.active:
            return CycleResult(None, Feedback())
        if self._end is not None:
            return self._finish(self._end)
        goal = self._goal
        assert goal is not None, "active"
        standing = goal.stand_still(now)
        if standing is not None:
            self._feedback, result = standing
            return CycleResult(STANDSTILL, self._feedback) if result is None else self._finish(result)
        if self.base_stop.holds_all:
            return self._finish(self.base_stop.failure())
        missing = self._fresh.missing(now, odometry)
        if missing is not None:
            return self._wait(now, *missing)
        self._missing_since = None
        assert odometry is not None
        state = self._state_at(now, odometry, map_from_odom)
        self._costmaps.contacts.saw(state)
        if state.localised or goal.by_odometry:
            self._go_on(goal, now)
            command, self._feedback, result = goal.step(state)
        else:
            command, result = self._find(state)
        if result is not None:
            return self._finish(result)
        return CycleResult(command.slowed_to(self._speed_limit(state, command)), self._feedback)

    def _speed_limit(self, state: CycleState, command: Twist2) -> float:
        """Return how fast to drive an arc at most, m/s: infinity without a limit."""
        asked = self.speed_limit or math.inf
        if not state.localised:
            return asked
        arc = command.slowed_to(asked)
        return min(asked, self._zones.speed_limit(state.map_pose, arc, self._p.controller.max_vel_x))

    def _state_at(self, now: float, odometry: Odometry, map_from_odom: Pose2 | None) -> CycleState:
        # The odometry is a little old; the robot has moved on since.
        age = min(self._p.cycle.prediction_limit, max(0.0, now - odometry.stamp))
        pose = integrate_twist(odometry.pose, odometry.twist, age)
        self.local_costmap.roll_to(pose)
        self._zones.update(now, pose, map_from_odom)
        map_pose = None if map_from_odom is None else map_from_odom @ pose
        clearance = Clearance(self.local_costmap, pose, self._walls, map_pose)
        localised = map_from_odom is not None
        # A robot that has lost its place keeps its distance from everybody.
        user_id, place = self._goal.followed if localised and self._goal is not None else (None, None)
        self._people.forget(now, but=user_id)
        people = self._people.people(now, user_id, place)
        if map_from_odom is not None:
            self.global_costmap.set_people(people.in_map(map_from_odom))
        odom = map_from_odom or Pose2()
        return CycleState(
            now, pose, odometry.twist, odom, clearance, self.base_stop, self._driven, people, localised
        )

    def _find(self, state: CycleState) -> tuple[Twist2, Result | None]:
        """Find the robot's place: nobody knows it, and the goal needs it."""
        if self._finding is None:
            self._finding = FindPlace(self._costmaps, self._p, state.now)
        self._feedback = replace(self._feedback, text=f"waiting: {LOOKING_FOR_PLACE}")
        return self._finding.step(state)

    def _go_on(self, goal: NavigationGoal, now: float) -> None:
        """Go on as the place is known: a goal that was interrupted starts counting its time anew."""
        if self._finding is not None and self._finding.moved:
            goal.resume(now)
        self._finding = None

    def _wait(self, now: float, code: str, reason: str) -> CycleResult:
        if self._missing_since is None:
            self._missing_since = now
        if now - self._missing_since > self._p.cycle.sensor_patience:
            advice = self._p.cycle.silence_advice
            return self._finish(failure(code, f"{reason}; {advice}" if advice else reason))
        self._feedback = replace(self._feedback, text=f"waiting: {reason}")
        return CycleResult(STANDSTILL, self._feedback)

    def _finish(self, result: Result) -> CycleResult:
        self._before = self._goal if result.code in _HANDED_ON else None
        self._goal = self._end = None
        text = "arrived" if result.outcome is Outcome.SUCCEEDED else result.reason
        self._feedback = replace(self._feedback, time_remaining=0.0, text=text)
        return CycleResult(STANDSTILL, self._feedback, result)
