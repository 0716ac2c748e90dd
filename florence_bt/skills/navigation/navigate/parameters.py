"""The parameters of navigation."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

from florence_bt.core.limits import CheckedParameters, Limits, NotNegative, Positive, check_order
from florence_bt.skills.navigation.navigate.controller import ControllerParameters
from florence_bt.skills.navigation.navigate.costmap import CostmapParameters
from florence_bt.skills.navigation.navigate.exploration import ExplorationParameters
from florence_bt.skills.navigation.navigate.people import PeopleParameters
from florence_bt.skills.navigation.navigate.planner import PlannerParameters
from florence_bt.skills.navigation.navigate.spin import SpinParameters
from florence_bt.skills.navigation.navigate.straight import SLOWEST_MPS


@dataclass(frozen=True, slots=True)
class RecoveryParameters(CheckedParameters):
    """The parameters of recovery.

    Attributes:
        planner_patience: Seconds without a plan before recovering.
        goal_patience: Seconds that what stands at the goal has to go away, once the robot has looked at it.
            Who waits there for the robot to make way may do so for ten.
        controller_patience: Seconds without a velocity before recovering.
        conservative_reset_dist: Side of the window around the robot whose obstacles are kept, in metres.
        recovery_pause: Seconds for the costmaps to fill again before the next recovery behaviour.
        give_up_time: A drive ends after so many seconds in which the robot did not get nearer along its path,
            unless it has come nearer to the goal than ever before.
        progress_distance: Metres nearer than ever before, after which every recovery behaviour may be tried
            again.
        rotate_angle: How far to look around, in radians.
        rotate_speed: rad/s.
        back_up_distance: Metres.
        back_up_speed: m/s.
        required_movement_radius: The robot must move this far (m) ...
        required_movement_angle: ... or turn this far (rad) ...
        movement_time_allowance: ... in this many seconds.
        approach_time_allowance: It must get nearer to the goal in this many seconds.
        oscillation_timeout: A drive that does not in this many seconds tries a recovery behaviour.
        find_place_time: A robot with a goal that does not know where it is turns and drives a little for so
            many seconds before the goal fails; 0: it stands still for ``sensor_patience``.
        find_place_turn_speed: rad/s, as fast as was tried by hand.
        find_place_distance: How far it drives at most before it chooses another direction, in metres.
        find_place_speed: m/s.

    Source:
        REFERENCE 7.1, 7.3, 7.9.
    """

    planner_patience: Positive = 5.0
    goal_patience: Positive = 15.0
    controller_patience: Positive = 3.0
    conservative_reset_dist: Positive = 3.0
    recovery_pause: NotNegative = 0.5
    give_up_time: Positive = 25.0
    progress_distance: Positive = 0.5
    rotate_angle: Positive = math.tau
    rotate_speed: Positive = 1.0
    back_up_distance: Positive = 0.15
    back_up_speed: Positive = 0.08
    required_movement_radius: Positive = 0.25
    required_movement_angle: Positive = 0.5
    movement_time_allowance: Positive = 10.0
    approach_time_allowance: Positive = 40.0
    oscillation_timeout: Positive = 15.0
    find_place_time: NotNegative = 60.0
    find_place_turn_speed: Positive = 0.7
    find_place_distance: Positive = 1.5
    find_place_speed: Annotated[float, Limits(SLOWEST_MPS)] = 0.25


@dataclass(frozen=True, slots=True)
class CycleParameters(CheckedParameters):
    """The rhythm of navigation.

    Attributes:
        controller_frequency: Hz, how often ``step`` is called while a goal is active.
        planner_frequency: Hz, how often the path is planned again.
        sensor_timeout: Older scans, odometry and places in the map stop the robot, in seconds.
        scan_timeout: When no scan of a required sensor has come for so many seconds, the robot stops. It
            stands within this time and that of braking, 0.25 s + 0.45 m/s / 2.5 m/s^2 = 0.43 s. The laser
            scans every 0.1 s.
        sensor_patience: Without them for this many seconds, the goal fails.
        silence_advice: What to do then, for people, behind the reason.
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
    silence_advice: str = ""
    required_sources: tuple[str, ...] = ("scan",)
    goal_search_radius: NotNegative = 1.5
    prediction_limit: NotNegative = 0.2


@dataclass(frozen=True, slots=True)
class FollowParameters(CheckedParameters):
    """The parameters of following somebody. The first three are the defaults of a goal that says 0.

    Attributes:
        follow_distance: How far to stay behind, between the middles, in metres.
        follow_max_lin_speed: m/s; along a planned path never more than what the controller allows.
        follow_max_ang_speed: rad/s.
        follow_back_speed: The robot backs away from a person who comes too near at this speed at most, in
            m/s; with 0 it stands still instead, as REFERENCE 12.6 proposes, but then nobody gets past the
            robot in a corridor.
        follow_give_way: How much nearer than wanted that is, in metres; to a person who comes towards the
            robot it gives way as soon as they are nearer than wanted.
        follow_linear_gain: Speed per metre too far away, 1/s.
        follow_angular_gain: Turning speed per angle to the person, 1/s.
        follow_distance_tolerance: So much too far away is near enough, in metres.
        follow_angle_tolerance: So much beside the heading is straight ahead, in radians.
        follow_look_ahead: A motion must be free for so many seconds.
        follow_coast: Not seen for so many seconds, a person is out of sight: the robot drives to where they
            were.
        follow_patience: For so many seconds the robot waits for the first sight of the person, turns after
            who has left the view, and stands before a blocked way; then: lost.

    Source:
        REFERENCE 12.6; document, section 4.1.
    """

    follow_distance: Positive = 1.0
    follow_max_lin_speed: Positive = 0.5
    follow_max_ang_speed: Positive = 1.0
    follow_back_speed: NotNegative = 0.3
    follow_give_way: NotNegative = 0.25
    follow_linear_gain: Positive = 0.8
    follow_angular_gain: Positive = 1.5
    follow_distance_tolerance: NotNegative = 0.05
    follow_angle_tolerance: NotNegative = 0.03
    follow_look_ahead: Positive = 1.0
    follow_coast: Positive = 0.7
    follow_patience: Positive = 3.0

    def _check(self) -> None:
        check_order(self, ("follow_coast", "follow_patience"))


@dataclass(frozen=True, slots=True)
class ApproachParameters(CheckedParameters):
    """The parameters of approaching somebody. The first three are the defaults of a goal that says 0.

    Attributes:
        approach_person_distance: Where to stand, between the middles, in metres.
        approach_person_max_lin_speed: m/s; never more than what the controller allows.
        approach_person_max_ang_speed: rad/s; the same.
        approach_person_laser_gain: The person is moved by this share of the way to where the laser sees legs.
        approach_person_patience: When for so many seconds nobody is where the person should be: lost.
        approach_person_limit: Seconds until it gives up.

    Source:
        REFERENCE 12.7; document, section 4.3.
    """

    approach_person_distance: Positive = 0.8
    approach_person_max_lin_speed: Positive = 0.5
    approach_person_max_ang_speed: Positive = 1.0
    approach_person_laser_gain: Annotated[float, Limits(0.0, 1.0, above=True)] = 0.3
    approach_person_patience: Positive = 5.0
    approach_person_limit: Positive = 60.0


@dataclass(frozen=True, slots=True)
class NavigatorParameters:
    """All parameters of navigation.

    Attributes:
        CLASSES: The class of each part, in their order.
    """

    CLASSES: ClassVar[tuple[type[Any], ...]] = (
        CycleParameters,
        CostmapParameters,
        PlannerParameters,
        ControllerParameters,
        RecoveryParameters,
        SpinParameters,
        FollowParameters,
        ApproachParameters,
        PeopleParameters,
        ExplorationParameters,
    )

    cycle: CycleParameters = field(default_factory=CycleParameters)
    costmap: CostmapParameters = field(default_factory=CostmapParameters)
    planner: PlannerParameters = field(default_factory=PlannerParameters)
    controller: ControllerParameters = field(default_factory=ControllerParameters)
    recovery: RecoveryParameters = field(default_factory=RecoveryParameters)
    turn: SpinParameters = field(default_factory=SpinParameters)
    follow: FollowParameters = field(default_factory=FollowParameters)
    approach: ApproachParameters = field(default_factory=ApproachParameters)
    people: PeopleParameters = field(default_factory=PeopleParameters)
    exploration: ExplorationParameters = field(default_factory=ExplorationParameters)

    @staticmethod
    def read(read: Callable[[type[Any]], Any]) -> NavigatorParameters:
        """Fill every part with one reader of parameter dataclasses; all names are different."""
        return NavigatorParameters(*map(read, NavigatorParameters.CLASSES))


_BACKING_UP = "a robot that is stuck backs up as a recovery behaviour: back_up_distance, back_up_speed"
_HEADING = "where the path leads off sharply the robot turns first: rotate_to_path_angle, heading_lookahead"
_TURNING = "a turn in place stays with its direction; oscillation_timeout ends what leads nowhere"
_DIFFERENTIAL = "the base cannot drive sideways"
_SILENT = "the robot stops when a sensor of required_sources is silent for scan_timeout"
REPLACED_PARAMETERS = {
    "escape_vel": _BACKING_UP,
    "escape_reset_dist": _BACKING_UP,
    "escape_reset_theta": _BACKING_UP,
    "heading_scoring": _HEADING,
    "heading_scoring_timestep": _HEADING,
    "oscillation_reset_dist": _TURNING,
    "oscillation_distance": "required_movement_radius, in movement_time_allowance",
    "prune_plan": "what lies behind the robot on its path is always left out",
    "meter_scoring": "path_distance_bias and goal_distance_bias count cells of local_resolution",
    "holonomic_robot": _DIFFERENTIAL,
    "acc_lim_y": _DIFFERENTIAL,
    **{f"{source}.expected_update_rate": _SILENT for source in ("scan", "depth", "low", "overhangs")},
    **{
        f"{source}.observation_persistence": "what a sensor has marked stays until it sees through there"
        for source in ("scan", "depth", "low", "overhangs")
    },
}
"""Parameters of move_base that would do nothing here -> what to use instead.

Source:
    Document, section 3.3.5; REFERENCE 7.1, 7.4 and 7.6.
"""
