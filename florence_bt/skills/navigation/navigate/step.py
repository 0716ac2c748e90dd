"""What a navigator is configured with and what it answers each cycle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from florence_bt.core.geometry import Twist2
from florence_bt.core.limits import NotNegative, Positive, check_limits
from florence_bt.core.outcome import Result
from florence_bt.skills.navigation.navigate.controller_parameters import ControllerParameters
from florence_bt.skills.navigation.navigate.costmap import CostmapParameters
from florence_bt.skills.navigation.navigate.planner import PlannerParameters
from florence_bt.skills.navigation.navigate.recovery import RecoveryParameters
from florence_bt.skills.navigation.navigate.turning import TurnParameters


@dataclass(frozen=True, slots=True)
class CycleParameters:
    """The rhythm of navigation.

    Attributes:
        controller_frequency: Hz, how often ``step`` is called while a goal is active.
        planner_frequency: Hz, how often the path is planned anew.
        sensor_timeout: Older scans, odometry and places in the map stop the robot, in seconds.
        scan_timeout: When no scan of a required sensor has come for so many seconds, the robot stops. It
            stands within this time and that of braking, 0.25 s + 0.45 m/s / 2.5 m/s^2 = 0.43 s. The laser
            scans every 0.1 s.
        sensor_patience: Without them for this many seconds, the goal fails.
        required_sources: The sensors without which the robot does not move.
        goal_search_radius: When something stands on a goal that is far away, drive to within this many
            metres of it and look again.
        prediction_limit: Odometry is carried forward with its velocity for at most this long, in seconds.
    """

    controller_frequency: Positive = 10.0
    planner_frequency: Positive = 1.0
    sensor_timeout: Positive = 1.0
    scan_timeout: Positive = 0.25
    sensor_patience: Positive = 10.0
    required_sources: tuple[str, ...] = ("scan",)
    goal_search_radius: NotNegative = 1.5
    prediction_limit: NotNegative = 0.2

    def __post_init__(self) -> None:
        check_limits(self)


@dataclass(frozen=True, slots=True)
class NavigatorParameters:
    """All parameters of navigation."""

    cycle: CycleParameters = field(default_factory=CycleParameters)
    costmap: CostmapParameters = field(default_factory=CostmapParameters)
    planner: PlannerParameters = field(default_factory=PlannerParameters)
    controller: ControllerParameters = field(default_factory=ControllerParameters)
    recovery: RecoveryParameters = field(default_factory=RecoveryParameters)
    turn: TurnParameters = field(default_factory=TurnParameters)

    @staticmethod
    def read(read: Callable[[type[Any]], Any]) -> NavigatorParameters:
        """Fill every part with one reader of parameter dataclasses; all names are different."""
        return NavigatorParameters(
            cycle=read(CycleParameters),
            costmap=read(CostmapParameters),
            planner=read(PlannerParameters),
            controller=read(ControllerParameters),
            recovery=read(RecoveryParameters),
            turn=read(TurnParameters),
        )


@dataclass(frozen=True, slots=True)
class Feedback:
    """How far a goal is.

    Attributes:
        distance_remaining: Metres along the path; for a turn the radians that are left.
        time_remaining: Seconds, a rough estimate.
        recoveries: How often the robot had to recover.
        text: What it does, for people; steady while nothing new happens.
    """

    distance_remaining: float = 0.0
    time_remaining: float = 0.0
    recoveries: int = 0
    text: str = ""


@dataclass(frozen=True, slots=True)
class Step:
    """The answer of one cycle.

    Attributes:
        command: The velocity to send; None when navigation has nothing to say.
        feedback: How far the goal is.
        result: How the goal ended, in its last cycle only; that cycle's command is standstill.
    """

    command: Twist2 | None
    feedback: Feedback
    result: Result | None = None
