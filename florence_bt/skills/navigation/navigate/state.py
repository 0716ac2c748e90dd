"""Input and answer of a goal in each cycle."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from florence_bt.core.base_stop import BaseStop
from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.core.outcome import Result
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED, UNKNOWN_COST, Cells
from florence_bt.skills.navigation.navigate.clearance import Clearance, MapWalls
from florence_bt.skills.navigation.navigate.contact_marks import ContactMarks
from florence_bt.skills.navigation.navigate.costmap import Costmap
from florence_bt.skills.navigation.navigate.driven_way import DrivenWay
from florence_bt.skills.navigation.navigate.people import People
from florence_bt.skills.navigation.navigate.tight_ways import TightWays
from florence_bt.skills.navigation.navigate.zone_layer import ZoneLayer


@dataclass(frozen=True, slots=True)
class Feedback:
    """The progress towards a goal.

    Attributes:
        distance_remaining: Metres along the path; for a turn the radians that are left.
        time_remaining: Seconds, a rough estimate.
        recoveries: How often the robot had to recover.
        text: What it does, for people; steady while nothing new happens.
        poses_remaining: How many of several goals are left.
        travelled: What a motion by odometry has behind it, in metres; of a turn in radians.
    """

    distance_remaining: float = 0.0
    time_remaining: float = 0.0
    recoveries: int = 0
    text: str = ""
    poses_remaining: int = 1
    travelled: float = 0.0


@dataclass(frozen=True, slots=True)
class CycleResult:
    """The answer of one cycle.

    Attributes:
        command: The velocity to send; None when navigation has nothing to say.
        feedback: How far the goal is.
        result: How the goal ended, in its last cycle only; that cycle's command is standstill.
    """

    command: Twist2 | None
    feedback: Feedback
    result: Result | None = None


@dataclass(slots=True)
class Costmaps:
    """The costmaps that the robot drives by; ``static``, ``walls`` and ``zones`` change when a newer map
    comes.

    Attributes:
        global_costmap: In the map frame.
        local_costmap: In the odometry frame.
        static: Inflated costs of the map alone, on the cells of the global costmap.
        walls: The map's walls.
        zones: Where the robot does not drive, or drives slowly.
        tight: Where it could not.
        contacts: Puts there what it has touched.
    """

    global_costmap: Costmap
    local_costmap: Costmap
    static: Cells
    walls: MapWalls
    zones: ZoneLayer
    tight: TightWays
    contacts: ContactMarks

    def problem_with(self, goal: Pose2) -> tuple[str, str] | None:
        """Tell why the robot cannot stand at a pose (map frame), as (code, reason); None when it can."""
        if not goal.is_finite():
            return "bad_input", f"the goal {goal} is not finite"
        cell = self.global_costmap.cell_of(goal.x, goal.y)
        place = f"({goal.x:.2f}, {goal.y:.2f})"
        if cell is None:
            return "goal_outside", f"the goal {place} lies outside of the map"
        cost = self.static[cell]
        if cost == UNKNOWN_COST:
            return "goal_outside", f"the goal {place} is where the map knows nothing"
        if INSCRIBED <= cost < UNKNOWN_COST:
            return "goal_occupied", f"the robot does not fit at {place}: an obstacle of the map is too near"
        if self.walls.touches(goal):
            heading = f"{math.degrees(goal.yaw):.0f} degrees"
            return "goal_occupied", f"the robot does not fit at {place} with the heading of {heading}"
        forbidden = self.zones.problem_with(goal)
        return None if forbidden is None else ("goal_occupied", forbidden)


@dataclass(frozen=True, slots=True)
class CycleState:
    """The robot now.

    Attributes:
        now: Seconds.
        pose: base_footprint in the odometry frame.
        twist: Its velocity.
        map_from_odom: The place of the odometry frame in the map; identity while it is not known.
        clearance: What is around it.
        stop: What holds the base.
        driven: Where it was.
        people: Whom it has to mind; not the person who is followed.
        localised: Whether the place in the map is known.
    """

    now: float
    pose: Pose2
    twist: Twist2
    map_from_odom: Pose2
    clearance: Clearance
    stop: BaseStop
    driven: DrivenWay
    people: People = field(default_factory=People)
    localised: bool = True

    @property
    def map_pose(self) -> Pose2:
        """base_footprint in the map frame."""
        return self.map_from_odom @ self.pose
