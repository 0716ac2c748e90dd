"""Follow somebody who walks: keep a distance, go round what is in the way. No ROS, no clock of its own."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2, normalize_angle
from florence_bt.core.outcome import Result, failure
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED, LETHAL, UNKNOWN_COST
from florence_bt.skills.navigation.navigate.clearance import Clearance
from florence_bt.skills.navigation.navigate.contact import ContactRecovery
from florence_bt.skills.navigation.navigate.controller import Controller
from florence_bt.skills.navigation.navigate.costmap import cost_at_distance, moved_points
from florence_bt.skills.navigation.navigate.legs import (
    LEGS_ALONE_S,
    REACH_M,
    Place,
    all_legs,
    go_on_with_legs,
)
from florence_bt.skills.navigation.navigate.moving_target import CAMERA_GAP_S, MovingTarget
from florence_bt.skills.navigation.navigate.nearby_legs import TOO_NEAR_M, NearbyLegs, StandingThings
from florence_bt.skills.navigation.navigate.parameters import NavigatorParameters
from florence_bt.skills.navigation.navigate.person_path import PersonPath
from florence_bt.skills.navigation.navigate.personal_space import NEAREST_M, keep_off
from florence_bt.skills.navigation.navigate.planner import plan_path
from florence_bt.skills.navigation.navigate.results import SERVER_CODES
from florence_bt.skills.navigation.navigate.state import Costmaps, Feedback, RobotState
from florence_bt.skills.navigation.navigate.step_aside import place_to_step_aside
from florence_bt.skills.navigation.navigate.trails import BODY_M, CAMERA_SOURCES
from florence_bt.skills.navigation.navigate.walking_legs import WalkingLegs
from florence_bt.skills.navigation.navigate.whereabouts import Whereabouts

_BODY_M = 0.6
"""What the sensors have marked so near to the person is the person."""
_NO_NEARER_S = 5.0
"""It goes on to where the person vanished while it comes nearer at least so often, a half turn included; then
it searches."""
_ARRIVED_M, _STOOD_M = 0.4, 0.25
"""The robot is where the person vanished when it is so near to the place; along their path so near."""
_DETOUR_M = 0.8
"""A way so much longer than the straight one is a detour, and so much too far away is far."""
_FACING_RAD = 0.3
_BEFORE_RAD = 1.0
"""Who is further to the side does not come towards the robot: they walk past it."""
_TOWARDS, _CAME_S = 0.7, 1.0
"""Somebody comes towards the robot who walks no further beside it than this cosine, up to so long ago."""
_ASTRAY_RAD = 1.0
"""A way that begins further to the side leads away from the person."""
_VIEW_RAD, _VIEW_M = 0.35, (0.9, 3.5)
"""Somebody there is in the middle of the camera's picture, and seen whole."""
_UNCLEAR_S = 1.5
_WALKING_LEGS_S, _HIDDEN_S, _TURNED_MPS = 15.0, 4.0, 0.6
"""So long after the camera saw the person the robot goes on with legs that walk, hidden for so long at most,
and so much further away from where they should be each second."""
_LOOK_RADPS = 0.6
"""How fast the robot turns at last while it looks for who vanished."""
_WORTH_LOOKING = 0.03, 0.06, 0.12
"""It turns to look when so much of what is likely would get into the picture, at the first look, the second
and so on; else, and after so many looks from one place, it drives on."""
_SAME_PLACE_M = 0.5
_CHOICE_S = 2.5
"""How long it stays with a place to drive to, at least."""
_TRAIL_STEP_M, _TRAIL_POINTS = 0.1, 50
"""The way the robot came, to back off on."""
_BACK_TO_M = 0.3
"""It steers towards a point of that way so far behind its middle."""
_BACK_MPS = 0.2
"""How fast it backs out."""
_BACK_AHEAD_S = 0.4, 1.0
"""A motion back must be free for so many seconds: slow, and where the robot has just been; or for as many as
it takes to get out of something that it touches in the costmap."""
_ASIDE_AFTER_S, _ASIDE_S, _ASIDE_MORE_M = 2.0, 15.0, 0.3
"""Without a way back for so long, the robot drives to where it can be passed: for how long at most, and how
much further away than it follows."""
_WAITS_S, _NEAR_OTHER_M = 6.0, 0.8
"""Who stands before the robot for so long, or anywhere while somebody else is so near to the robot, waits for
it to let them pass."""
_STUCK_S, _BACK_OUT_S = 1.0, 3.0
"""When no wanted motion is free for so long, the robot backs out for so long at most."""
_MAKE_ROOM_S = 1.0
"""In a search it backs out for so long only, as they may be behind it, where it is blind, and from somebody
else who is in the way, who may wait for the robot; once in a search also from who is too near to be seen."""
_PASSED_S, _BEHIND_M, _CLOSE_BEHIND_M = 10.0, 0.4, 0.6
"""It does not back off when somebody else was seen up to so long ago so near to a point behind it."""
_NEARLY_M = 0.2
"""What keeps the robot so much further away than wanted is no trouble: a shoe, or a pillow."""
_NO_WAY_S = 15.0
"""A search in which the robot cannot move for so long is over."""
_PLAN_PERIOD_S = 0.5
_FORGET_AFTER_S, _FORGET_M = 2.0, 3.0
"""Without a way for so long, the robot forgets what the camera has marked up to so far away."""
_STEP_M = 0.05
_START_M = 0.3
"""The robot turns to a point of the person's way when so much of the way to it is free."""
_ROOM_M = 0.05
"""Where it has so much more room on each side than it needs to turn, it is not narrow."""
_CLOSE_M = 0.45
"""Where it is narrow it heads for a point of that way about so far away."""
_SHARES = 1.0, 0.5
"""Parts of the speed to try along the person's own way, the best first."""
_OWN_PLACE_M = 0.2
"""A way is looked at from here on; the robot itself stands on what lies before."""
_SEEN_ERROR_M = 0.15
_ROUND_IT = np.array(
    [(0.0, 0.0)]
    + [
        (part * _SEEN_ERROR_M * math.cos(angle), part * _SEEN_ERROR_M * math.sin(angle))
        for part in (0.5, 1.0)
        for angle in np.linspace(0.0, math.tau, 8, endpoint=False)
    ]
)
"""The tracker tells the places of the person with such an error: what to try round each, nearest first."""
_WALKING_MPS = 0.1
"""Slower, the direction in which somebody walks means nothing."""
_BLOCKED_S = 20.0
"""The person is in sight, but there is no way to them for so long."""


@dataclass(frozen=True, slots=True)
class FollowGoal:
    """Whom to follow, and how.

    Attributes:
        user_id: The persistent id of the person.
        distance: How far to stay behind, in metres.
        max_linear: m/s.
        max_angular: rad/s.
    """

    user_id: int
    distance: float
    max_linear: float
    max_angular: float


class Follow:
    """Keeps a distance to somebody who is told about by :meth:`saw`, until they are lost or it is cancelled.

    While the straight way is free the robot drives towards the person, with their own velocity added to
    the law of the document, so that it does not lag behind. Otherwise it drives along a planned path. Out
    of sight, it drives to where the person vanished.

    Attributes:
        user_id: The persistent id of the person.
        path: The path that is followed, shape (n, 2) in the map frame, or None.
        person: Where the person was last, in the odometry frame; None before.

    Source:
        REFERENCE 12.6; document, section 4.1.
    """

    def __init__(
        self, goal: FollowGoal, costmaps: Costmaps, parameters: NavigatorParameters, now: float
    ) -> None:
        self._goal = goal
        self.user_id = goal.user_id
        self._costmaps = costmaps
        self._p = parameters
        self._use = parameters.follow
        self._controller = Controller(parameters.controller)
        footprint = costmaps.local_costmap.footprint
        self._narrow = cost_at_distance(
            footprint.circumscribed_radius + _ROOM_M, footprint.inscribed_radius, parameters.costmap
        )
        self._contact = ContactRecovery(costmaps, parameters.recovery)
        self._target = MovingTarget(self._use.follow_velocity_time)
        self._person_path = PersonPath()
        self._things = StandingThings()
        self._walking = WalkingLegs()
        self._others: list[tuple[float, Place]] = []
        self._scanned = -math.inf
        self._looks_at_since: float | None = None
        self._started = self._free_since = now
        self._next_plan = now
        self._trail: deque[Place] = deque(maxlen=_TRAIL_POINTS)
        self._unknown = np.empty((0, 2))
        self._trouble = ""
        self._faced = self._vanished = False
        self._whereabouts: Whereabouts | None = None
        self._way_left, self._nearer_at, self._tried = math.inf, now, False
        self._nearby: NearbyLegs | None = None
        self._made_room = False
        self._heading: float | None = None
        self._turning = 0.0
        self._blocked_turns: set[bool] = set()
        self._goal_place: Place | None = None
        self._looks, self._looked_from = 0, Pose2()
        self._next_choice = self._moved = now
        self._cornered_since: float | None = None
        self._gave_way_at: float | None = None
        self._came_at = -math.inf
        self._between_since = now
        self._aside: tuple[Place, float] | None = None
        self._unclear_since = now
        self._no_way_since: float | None = None
        self._held = False
        self._stuck_since: float | None = None
        self._backs_until = -math.inf
        self.path: NDArray[np.float64] | None = None

    def saw(self, stamp: float, x: float, y: float) -> None:
        """The person was seen at a place in the odometry frame, metres; ``stamp`` in seconds."""
        self._target.recognise(stamp, x, y)
        self._note_place()

    def saw_scan(
        self, stamp: float, unknown: NDArray[np.float64], robot: Pose2, others: Sequence[Place] = ()
    ) -> None:
        """Go on with the legs in a scan while the camera does not see the person.

        Args:
            stamp: Seconds.
            unknown: Where beams end at nothing of the map, shape (n, 2), in the odometry frame, metres.
            robot: The robot in the odometry frame at that time.
            others: Where other people are, in the odometry frame, metres.
        """
        self._unknown, self._scanned = unknown, stamp
        self._others = [each for each in self._others if stamp - each[0] <= _PASSED_S]
        self._others += [(stamp, place) for place in others]
        legs = all_legs(unknown)
        self._walking.saw(stamp, legs)
        moving = self._things.without(unknown)
        go_on_with_legs(self._target, stamp, moving, robot, self._use.follow_coast)
        if self._target.seen != stamp:
            self._go_on_with_walking_legs(stamp, others)
        self._note_place()
        if self._target.seen == stamp or self._target.is_recognised(stamp):
            self._things.saw(stamp, legs, self._target.at(stamp, 0.0))

    def _go_on_with_walking_legs(self, stamp: float, others: Sequence[Place]) -> None:
        """Take the nearest legs that walk for those of the person who turned a corner or was hidden."""
        target = self._target
        if target.seen is None or target.recognised is None or stamp - target.recognised > _WALKING_LEGS_S:
            return
        unseen = stamp - target.seen
        if not CAMERA_GAP_S <= unseen <= _HIDDEN_S:
            return
        expected = target.at(stamp, self._use.follow_coast)
        near = [
            place
            for place in self._walking.places(stamp)
            if math.dist(place, expected) <= REACH_M + _TURNED_MPS * unseen
            and all(math.dist(place, who) > REACH_M for who in others)
        ]
        if near:
            target.saw(stamp, *min(near, key=lambda place: math.dist(place, expected)))

    def _note_place(self) -> None:
        if self._target.seen is not None:
            self._person_path.saw(self._target.seen, self._target.at(self._target.seen, 0.0))

    @property
    def person(self) -> Place | None:
        """Where the person was last, metres; None before."""
        return None if self._target.seen is None else self._target.at(self._target.seen, 0.0)

    def step(self, state: RobotState) -> tuple[Twist2, Feedback, Result | None]:
        """One cycle: the velocity, the feedback, and the result when the person is lost."""
        contact = self._contact.step(state)
        if isinstance(contact, Result):
            return STANDSTILL, self._feedback(contact.reason), contact
        if contact is not None:
            return contact, self._feedback(self._contact.text), None
        self._remember_way(state)
        if state.now < self._backs_until:
            command = state.people.slowed(state.pose, self._back_off(state))
            if not command.is_zero():
                self._moved = state.now
                return command, self._feedback("backing out"), None
            self._backs_until = -math.inf
        self._held = False
        wanted, feedback, result = self._follow(state)
        wanted = self._off_the_person(state, wanted)
        command = state.people.slowed(state.pose, wanted)
        for_somebody = command.is_zero() and not wanted.is_zero()
        self._held = self._held or for_somebody
        if not command.is_zero():
            self._moved = state.now
        if not self._held or not command.is_zero():
            self._stuck_since = None
        elif self._stuck_since is None:
            self._stuck_since = state.now
        elif state.now - self._stuck_since > _STUCK_S:
            self._stuck_since = None
            little = for_somebody or self._whereabouts is not None
            self._backs_until = state.now + (_MAKE_ROOM_S if little else _BACK_OUT_S)
        return command, feedback, result

    def _off_the_person(self, state: RobotState, command: Twist2) -> Twist2:
        """Never drive towards somebody who is this near."""
        seen = self._target.seen
        if seen is None or state.now - seen > LEGS_ALONE_S:
            return command
        return keep_off(state.pose, self._target.at(state.now, self._use.follow_coast), command)

    def _follow(self, state: RobotState) -> tuple[Twist2, Feedback, Result | None]:
        seen = self._target.seen
        if seen is None:
            return self._wait_for_person(state)
        if self._aside is not None:
            return self._step_aside(state, *self._aside), self._feedback("stepping aside"), None
        if state.now - seen <= self._use.follow_coast:
            return self._keep_distance(state)
        return self._go_where_they_vanished(state, state.now - seen)

    def _wait_for_person(self, state: RobotState) -> tuple[Twist2, Feedback, Result | None]:
        over = state.now - self._started > self._use.follow_patience
        text = "the tracker does not see the person who is to be followed"
        return STANDSTILL, self._feedback(f"waiting: {text}"), _lost(text) if over else None

    # In sight.

    def _keep_distance(self, state: RobotState) -> tuple[Twist2, Feedback, Result | None]:
        self._faced, self._whereabouts, self._nearby, self._made_room = False, None, None, False
        self._vanished = False
        self._way_left, self._nearer_at, self._tried = math.inf, state.now, False
        x, y = self._target.at(state.now, self._use.follow_coast)
        distance, bearing = math.hypot(x - state.pose.x, y - state.pose.y), state.pose.bearing_to(x, y)
        self._check_camera(state.now, distance, bearing)
        away, speed = self._away(state.pose, bearing), math.hypot(*self._target.velocity)
        comes = speed >= _WALKING_MPS and away < -_TOWARDS * speed
        if comes:
            self._came_at = state.now
        if distance < self._goal.distance - (0.0 if comes else self._use.follow_give_way):
            self.path, self._next_plan, self._free_since = None, state.now, state.now
            if abs(bearing) < _BEFORE_RAD:
                self._gave_way_at = state.now
                return self._give_way(state, (x, y), bearing), self._feedback("giving way"), None
            self._cornered_since = None
            return self._turn_towards(state, bearing), self._feedback("following"), None
        self._cornered_since = None
        self._let_pass(state, (x, y), distance)
        command = self._law(state.pose, distance, bearing)
        if self._is_free(state, (x, y), (x, y), self._narrow) and self._may(state, command):
            self.path, self._next_plan, self._free_since = None, state.now, state.now
            return command, self._feedback("following"), None
        walk, _ = self._along_person_path(state, (x, y), self._goal.distance)
        if walk is not None:
            self.path, self._next_plan, self._free_since = None, state.now, state.now
            return walk, self._feedback("following along the person's path"), None
        seen = self._has_in_sight(state, (x, y))
        if seen and distance <= self._goal.distance + self._use.follow_give_way:
            self.path, self._next_plan, self._free_since = None, state.now, state.now
            return self._turn_towards(state, bearing), self._feedback("following"), None
        command, remaining = self._along_path(state, (x, y))
        speed = self._wanted_speed(state.pose, remaining, bearing)
        near = distance <= self._goal.distance + _DETOUR_M and seen
        # As near as wanted along the path; or on a detour a person who is near would get out of view.
        if speed <= 0.0 or (near and remaining > distance + _DETOUR_M):
            return self._turn_towards(state, bearing), self._feedback("following"), None
        if command.is_zero() and distance <= self._goal.distance + _NEARLY_M:
            command, self._free_since = self._turn_towards(state, bearing), state.now
            self._held = False
            return command, self._feedback("following"), None
        if not command.is_zero():
            self._free_since = state.now
        elif state.now - self._free_since > _BLOCKED_S:
            reason = f"{self._trouble or 'something is in the way'}, for {_BLOCKED_S:g} s"
            result = failure("blocked", reason, server_code=SERVER_CODES["blocked"])
            return STANDSTILL, self._feedback(reason), result
        return command.slowed_to(speed), self._feedback("following, round what is in the way"), None

    def _let_pass(self, state: RobotState, person: Place, distance: float) -> None:
        """Step aside for somebody who came towards the robot and waits before it for long."""
        if math.hypot(*self._target.velocity) >= _WALKING_MPS or not self._is_near_somebody_else(state):
            self._between_since = state.now
        elif state.now - self._between_since > _WAITS_S:
            # The two wait for each other, and one of them for the robot.
            self._between_since = state.now
            self._begin_to_step_aside(state, state.map_from_odom.apply(*person))
        if distance >= self._goal.distance:
            self._gave_way_at = None
        elif self._gave_way_at is not None and state.now - self._gave_way_at > _WAITS_S:
            self._gave_way_at = state.now
            self._begin_to_step_aside(state, state.map_from_odom.apply(*person))

    def _is_near_somebody_else(self, state: RobotState) -> bool:
        others = state.people.rows
        return bool(
            (np.hypot(others[:, 0] - state.pose.x, others[:, 1] - state.pose.y) < _NEAR_OTHER_M).any()
        )

    def _give_way(self, state: RobotState, person: Place, bearing: float) -> Twist2:
        """Back off as far as there is room, else face the person. Who stands there for long wants to pass."""
        too_near = self._goal.distance - math.dist(person, (state.pose.x, state.pose.y))
        comes = max(0.0, -self._away(state.pose, bearing))
        command = self._back_off(state, bearing, comes + self._use.follow_linear_gain * too_near)
        self._note_way_back(state, person, backing=command.linear != 0.0)
        return self._turn_towards(state, bearing) if command.is_zero() else command

    def _back_off(self, state: RobotState, bearing: float = 0.0, speed: float = _BACK_MPS) -> Twist2:
        """Back on the way the robot came, or straight; standstill where there is no room.

        Args:
            state: Of this moment.
            bearing: Of the person who is given way to; the robot does not turn its back on them.
            speed: m/s, limited by ``follow_back_speed``.
        """
        trail, pose = self._trail, state.pose
        while trail and math.dist(trail[-1], (pose.x, pose.y)) < _BACK_TO_M:
            trail.pop()
        back = -min(speed, self._use.follow_back_speed)
        if back == 0.0 or self._is_somebody_behind(state):
            return STANDSTILL
        left = normalize_angle(pose.bearing_to(*trail[-1]) + math.pi) if trail else 0.0
        on_trail = bool(trail) and abs(normalize_angle(bearing - left)) <= _BEFORE_RAD
        if not on_trail:
            left = 0.0
        turn = self._limited(self._use.follow_angular_gain * left)
        straight = back if abs(left) < _FACING_RAD else 0.0
        # Where it has come, nothing stands that the map may know.
        come = Clearance(self._costmaps.local_costmap, pose, None, None) if on_trail else state.clearance
        ways = (Twist2(straight, turn), come), (Twist2(0.0, turn), come), (Twist2(back, 0.0), state.clearance)
        for command, clearance in ways:
            if not command.is_zero() and any(
                clearance.is_free(command.linear * ahead, command.angular * ahead) for ahead in _BACK_AHEAD_S
            ):
                return command
        return STANDSTILL

    def _is_somebody_behind(self, state: RobotState) -> bool:
        """Whether somebody else was behind the robot a moment ago, where it is blind."""
        behind = state.pose.apply(-_BEHIND_M, 0.0)
        return any(
            state.now - stamp <= _PASSED_S and math.dist(place, behind) <= _CLOSE_BEHIND_M
            for stamp, place in self._others
        )

    def _note_way_back(self, state: RobotState, person: Place, *, backing: bool) -> None:
        """Look for a place to step aside to when there is no way back for long."""
        walks_past = math.hypot(*self._target.velocity) >= _WALKING_MPS and self._came_at < state.now
        if backing or walks_past or self._cornered_since is None:
            self._cornered_since = None if backing or walks_past else state.now
            return
        came = self._came_at > self._cornered_since - _CAME_S
        if state.now - self._cornered_since > (_ASIDE_AFTER_S if came else _WAITS_S):
            self._cornered_since = state.now
            self._begin_to_step_aside(state, state.map_from_odom.apply(*person))

    def _begin_to_step_aside(self, state: RobotState, person: Place) -> None:
        apart = self._goal.distance + _ASIDE_MORE_M
        place = place_to_step_aside(self._costmaps, state.map_pose, person, apart)
        if place is not None:
            self._aside, self._next_plan = (place, state.now + _ASIDE_S), state.now

    def _step_aside(self, state: RobotState, place: Place, deadline: float) -> Twist2:
        """Drive to where the robot can be passed."""
        there = state.map_from_odom.inverse().apply(*place)
        command, remaining = self._along_path(state, there)
        person = self._target.at(state.now, self._use.follow_coast)
        far = math.dist(person, (state.pose.x, state.pose.y)) > self._goal.distance + _ASIDE_MORE_M
        known = self._target.seen is not None and state.now - self._target.seen <= self._use.follow_coast
        passed = far or (known and self._away(state.pose, state.pose.bearing_to(*person)) > _WALKING_MPS)
        if passed or state.now > deadline or remaining <= _TRAIL_STEP_M or self.path is None:
            self._aside, self.path, self._next_plan = None, None, state.now
            return STANDSTILL
        return command

    def _remember_way(self, state: RobotState) -> None:
        here = state.pose.x, state.pose.y
        forward = state.twist.linear > 0.0
        if forward and (not self._trail or math.dist(self._trail[-1], here) >= _TRAIL_STEP_M):
            self._trail.append(here)

    def _check_camera(self, now: float, distance: float, bearing: float) -> None:
        """Legs in the middle of the picture without a person are not those of the person."""
        target = self._target
        in_view = abs(bearing) < _VIEW_RAD and _VIEW_M[0] < distance < _VIEW_M[1]
        if not in_view or target.recognised == target.seen:
            self._unclear_since = now
        elif now - self._unclear_since > _UNCLEAR_S:
            self._walking.reject(target.at(now, 0.0))
            target.drop_laser()
            self._person_path.forget_since(target.seen or now)

    def _law(self, pose: Pose2, distance: float, bearing: float) -> Twist2:
        """Straight towards the person. The signs of the document are those of other axes (REFERENCE 12.6)."""
        use, (vx, vy) = self._use, self._target.velocity
        turn = use.follow_angular_gain * bearing if abs(bearing) > use.follow_angle_tolerance else 0.0
        if math.hypot(vx, vy) >= _WALKING_MPS:
            heading = pose.yaw + bearing
            turn += (math.cos(heading) * vy - math.sin(heading) * vx) / max(distance, 0.5)
        speed = self._wanted_speed(pose, distance, bearing) * max(0.0, math.cos(bearing))
        return Twist2(speed, self._limited(turn))

    def _wanted_speed(self, pose: Pose2, distance: float, bearing: float) -> float:
        """As fast as the person walks away, and faster when they are too far away; never backwards."""
        return self._speed(self._away(pose, bearing), distance - self._goal.distance)

    def _away(self, pose: Pose2, bearing: float) -> float:
        """How fast the person walks away from the robot, m/s."""
        (vx, vy), heading = self._target.velocity, pose.yaw + bearing
        return math.cos(heading) * vx + math.sin(heading) * vy

    def _speed(self, away: float, too_far: float) -> float:
        """The speed behind somebody who walks on (m/s) and is some metres too far away."""
        use = self._use
        if abs(too_far) <= use.follow_distance_tolerance:
            too_far = 0.0
            if math.hypot(*self._target.velocity) < _WALKING_MPS:
                return 0.0
        return max(0.0, min(self._goal.max_linear, away + use.follow_linear_gain * too_far))

    def _along_person_path(
        self, state: RobotState, person: Place, keep: float
    ) -> tuple[Twist2 | None, float]:
        """The velocity along the way that the person walked, None when it cannot be driven; the metres left.

        The robot heads for the furthest point of that way to which the straight way is free; rather for a
        nearer one than past something beside which it could not turn.

        Args:
            state: Of this moment.
            person: Where they are now, or were last: the end of the way.
            keep: How far to stay behind, metres.
        """
        pose = state.pose
        distance = math.dist(person, (pose.x, pose.y))
        # Who is in sight is as far away as they look; else they are as far as the robot has to drive.
        seen = self._has_in_sight(state, person)
        walks = self._away(pose, pose.bearing_to(*person)) if seen else math.hypot(*self._target.velocity)
        steps = [
            (self._freest(place), walked)
            for place, walked in self._person_path.ahead((pose.x, pose.y), person)
            if math.dist(place, (pose.x, pose.y)) > _OWN_PLACE_M
        ]
        if seen and distance <= keep + self._use.follow_give_way:
            # Who is near and in sight is not turned away from.
            ahead = pose.bearing_to(*person)
            steps = [
                step
                for step in steps
                if abs(normalize_angle(pose.bearing_to(*step[0]) - ahead)) < _ASTRAY_RAD
            ]
        # Where they walked nothing stands that the map may know: it was moved.
        seen_free = Clearance(self._costmaps.local_costmap, pose, None, None)
        # Where it is narrow, the robot stays on the way itself.
        close = sorted(steps, key=lambda step: abs(math.dist(step[0], (pose.x, pose.y)) - _CLOSE_M))
        points = [
            (place, math.dist(place, (pose.x, pose.y)) + walked)
            for some, least in ((steps, self._narrow), (close, INSCRIBED))
            for place, walked in some
            if self._is_free(state, place, person, least)
        ]
        for share in _SHARES:
            for place, left in points:
                bearing = pose.bearing_to(*place)
                speed = self._speed(walks, (distance if seen else left) - keep)
                speed *= share * max(0.0, math.cos(bearing))
                turn = self._limited(self._use.follow_angular_gain * bearing)
                if speed > 0.0 and self._may_turn(seen_free, speed, turn, bearing):
                    return Twist2(speed, turn), left
        for place, left in points:
            moves = self._speed(walks, (distance if seen else left) - keep) > 0.0
            astray = abs(normalize_angle(pose.bearing_to(*place) - pose.bearing_to(*person))) > _ASTRAY_RAD
            if moves and not (seen and astray) and self._may_after_turning(pose, place):
                command = self._turn_towards(state, pose.bearing_to(*place), seen_free)
                return None if command.is_zero() else command, left
        return None, math.inf

    def _freest(self, place: Place) -> Place:
        """Where it is narrow: where the robot fits best within the error of a place of the person."""
        costs = self._costmaps.local_costmap.costs_at(place + _ROUND_IT)
        if costs[0] < self._narrow:
            return place
        x, y = place + _ROUND_IT[int(np.argmin(costs))]
        return float(x), float(y)

    def _is_free(self, state: RobotState, place: Place, person: Place, least: int = INSCRIBED) -> bool:
        """Whether the straight way to a place is free of such costs; at the person the map alone counts."""
        x, y = state.pose.x, state.pose.y
        away = math.dist(place, (x, y))
        steps = np.arange(_OWN_PLACE_M, away, _STEP_M) / max(away, 1e-6)
        points = np.column_stack([x + steps * (place[0] - x), y + steps * (place[1] - y)])
        costs = self._costmaps.local_costmap.costs_at(points)
        blocked = (costs >= least) & (costs < UNKNOWN_COST)
        if self._target.seen is not None and state.now - self._target.seen <= self._use.follow_coast:
            at_person = np.hypot(points[:, 0] - person[0], points[:, 1] - person[1]) < _BODY_M
            in_map = moved_points(points[at_person], state.map_from_odom)
            known = self._costmaps.global_costmap.costs_at(in_map, self._costmaps.static)
            blocked[at_person] = (known >= least) & (known < UNKNOWN_COST)
        return not blocked.any()

    def _has_in_sight(self, state: RobotState, person: Place) -> bool:
        """Whether nothing that the sensors marked is on the straight line to the person."""
        return self._is_free(state, person, person, LETHAL)

    def _may_after_turning(self, pose: Pose2, place: Place) -> bool:
        """Whether the robot could drive towards a place if it were turned to it."""
        turned = replace(pose, yaw=pose.yaw + pose.bearing_to(*place))
        free = Clearance(self._costmaps.local_costmap, turned, None, None)
        return free.is_free(min(_START_M, math.dist(place, (pose.x, pose.y))), 0.0)

    def _may_turn(self, clearance: Clearance, speed: float, turn: float, left: float) -> bool:
        """Whether a motion is free that turns by so much, and no further."""
        ahead = self._use.follow_look_ahead
        angle = math.copysign(min(abs(left), abs(turn) * ahead), left)
        return clearance.is_free(speed * ahead, angle)

    def _may(self, state: RobotState, command: Twist2) -> bool:
        ahead = self._use.follow_look_ahead
        return state.clearance.is_free(command.linear * ahead, command.angular * ahead)

    def _turn_towards(self, state: RobotState, bearing: float, clearance: Clearance | None = None) -> Twist2:
        """Turn in place, if there is room; ``clearance`` is that of the state when not given."""
        if abs(bearing) <= self._use.follow_angle_tolerance:
            return STANDSTILL
        turn = self._limited(self._use.follow_angular_gain * bearing)
        self._held = not self._may_turn(clearance or state.clearance, 0.0, turn, bearing)
        return STANDSTILL if self._held else Twist2(0.0, turn)

    def _limited(self, turn: float) -> float:
        return max(-self._goal.max_angular, min(self._goal.max_angular, turn))

    # Along a path.

    def _along_path(self, state: RobotState, person: tuple[float, float]) -> tuple[Twist2, float]:
        """The velocity along a path to the person, standstill when there is none, and the metres left."""
        if state.now >= self._next_plan:
            self._next_plan = state.now + _PLAN_PERIOD_S
            self._plan(state, person)
        if self.path is None:
            return STANDSTILL, math.inf
        control = self._controller.control(
            state.pose,
            state.twist,
            self._costmaps.local_costmap,
            state.map_from_odom.inverse(),
            state.clearance,
            state.people,
        )
        self._trouble = control.blocked
        self._held = bool(control.blocked)
        command = control.command.slowed_to(self._goal.max_linear, self._goal.max_angular)
        return command, control.remaining

    def _plan(self, state: RobotState, person: tuple[float, float]) -> None:
        here, costmap = state.map_pose, self._costmaps.global_costmap
        there = state.map_from_odom @ Pose2(*person)
        goal = Pose2(there.x, there.y, math.atan2(there.y - here.y, there.x - here.x))
        costs = self._without_person(there) if self._aside is None else self._round_person(state)
        plan = plan_path(costmap, here, goal, self._p.planner, tolerance=_BODY_M, costs=costs)
        if isinstance(plan, Result):
            self.path, self._trouble = None, plan.reason
            self._forget_marks(state)
            return
        self.path, self._no_way_since = plan.points, None
        self._controller.set_plan(plan.points, plan.goal)

    def _forget_marks(self, state: RobotState) -> None:
        """Forget what the camera marked nearby when there has been no way for long: people have walked on."""
        self._no_way_since = self._no_way_since or state.now
        if state.now - self._no_way_since < _FORGET_AFTER_S:
            return
        self._no_way_since = None
        here = state.map_pose
        self._costmaps.global_costmap.clear_disc(CAMERA_SOURCES, (here.x, here.y), _FORGET_M)
        self._costmaps.local_costmap.clear_disc(CAMERA_SOURCES, (state.pose.x, state.pose.y), _FORGET_M)

    def _without_person(self, there: Pose2) -> NDArray[np.uint8]:
        """The costs of the global costmap; round the person those of the map alone."""
        costs = self._costmaps.global_costmap.master.copy()
        near = self._costmaps.global_costmap.distances_to(there.x, there.y) <= _BODY_M
        costs[near] = self._costmaps.static[near]
        return costs

    def _round_person(self, state: RobotState) -> NDArray[np.uint8]:
        """The costs of the global costmap; no way leads nearer to the person than the robot may come."""
        costmap, here = self._costmaps.global_costmap, state.map_pose
        person = state.map_from_odom.apply(*self._target.at(state.now, self._use.follow_coast))
        costs, away = costmap.master.copy(), costmap.distances_to(*person)
        costs[(away <= NEAREST_M) & (away < math.dist(person, (here.x, here.y)))] = LETHAL
        return costs

    # Out of sight.

    def _go_where_they_vanished(
        self, state: RobotState, unseen: float
    ) -> tuple[Twist2, Feedback, Result | None]:
        if not self._vanished:
            self._vanished = True
            self._clear_where_they_were(state)
        place = self._target.at(state.now, self._use.follow_coast)
        bearing = state.pose.bearing_to(*place)
        self._cornered_since = None
        if unseen > self._use.follow_limit:
            return STANDSTILL, self._feedback("lost"), _lost_after(unseen)
        self._faced = self._faced or abs(bearing) < _FACING_RAD or not self._has_in_sight(state, place)
        if self._whereabouts is None and not self._faced and unseen <= self._use.follow_patience:
            # They may just have walked out of the picture.
            return self._turn_towards(state, bearing), self._feedback("turning after the person"), None
        place = self._target.at(state.now, 0.0)
        if self._whereabouts is None and math.dist(place, (state.pose.x, state.pose.y)) > _STOOD_M:
            walk, left = self._along_person_path(state, place, 0.0)
            if walk is not None and self._gets_nearer(state.now, left):
                return walk, self._feedback("going along the person's path"), None
        if self._whereabouts is None:
            command, remaining = self._along_path(state, place)
            on_the_way = remaining > _ARRIVED_M and not self._is_there(state, place)
            if on_the_way and self._gets_nearer(state.now, remaining):
                feedback = self._feedback("going to where the person was seen last")
                if not command.is_zero() or unseen <= self._use.follow_patience:
                    return command, feedback, None
            if on_the_way and not self._tried:
                # It has got stuck, perhaps in a corner that it cut.
                self._way_left, self._nearer_at, self._tried = math.inf, state.now + _BACK_OUT_S, True
                self._backs_until = state.now + _BACK_OUT_S
                return STANDSTILL, self._feedback("backing out"), None
            self._begin_search(state, place)
        look = self._look_at_who_walks(state)
        if look is not None:
            return look, self._feedback("looking at who walks"), None
        if self._heading is None and (self._looks > 0 or self._goal_place is not None):
            # They are most likely ahead; but they may be right beside the robot, too.
            look = self._look_at_legs(state)
            if look is not None:
                return look, self._feedback("looking at what may be the person"), None
        command = self._look_for_them(state)
        over = state.now - self._moved > _NO_WAY_S
        return command, self._feedback("looking for the person"), _lost_after(unseen) if over else None

    def _clear_where_they_were(self, state: RobotState) -> None:
        """What the camera has marked where they walked last was they; if they still stand there, the laser
        sees their legs.
        """
        for place in self._person_path.last(_BODY_M):
            self._costmaps.local_costmap.clear_disc(CAMERA_SOURCES, place, BODY_M)
            self._costmaps.global_costmap.clear_disc(
                CAMERA_SOURCES, state.map_from_odom.apply(*place), BODY_M
            )

    def _look_at_who_walks(self, state: RobotState) -> Twist2 | None:
        """Turn to the nearest legs that walk, until the camera sees who it is; None when there are none."""
        x, y, others = state.pose.x, state.pose.y, state.people.rows[:, :2]
        walking = [
            each
            for each in self._walking.places(self._scanned)
            if math.dist(each, (x, y)) < _VIEW_M[1] and all(math.dist(each, who) > REACH_M for who in others)
        ]
        if not walking or state.now - self._scanned > CAMERA_GAP_S:
            self._looks_at_since = None
            return None
        legs = min(walking, key=lambda each: math.dist(each, (x, y)))
        bearing = state.pose.bearing_to(*legs)
        if abs(bearing) < _VIEW_RAD:
            self._looks_at_since = self._looks_at_since or state.now
            if state.now - self._looks_at_since > _UNCLEAR_S:
                self._walking.reject(legs)
                self._looks_at_since = None
        turn = Twist2(0.0, self._limited(self._use.follow_angular_gain * bearing))
        if self._may_turn(state.clearance, 0.0, turn.angular, bearing):
            return turn
        self._walking.reject(legs)
        return None

    def _look_at_legs(self, state: RobotState) -> Twist2 | None:
        """Turn to what may be the person's legs nearby, and back off when they are too near to be seen."""
        self._nearby = self._nearby or NearbyLegs(self._things.places())
        others = state.people.rows[:, :2]
        unknown = [
            each for each in all_legs(self._unknown) if all(math.dist(each, who) > REACH_M for who in others)
        ]
        before = self._nearby.since
        legs = self._nearby.next(state.now, state.pose, unknown)
        if self._nearby.since != before:
            self._begin_to_turn()
        if legs is None:
            return None
        bearing = state.pose.bearing_to(*legs)
        if abs(bearing) > _FACING_RAD:
            turn = self._turn_round(state, bearing, self._goal.max_angular)
            if turn.is_zero():
                self._nearby.leave()
            return turn
        if math.dist(legs, (state.pose.x, state.pose.y)) < TOO_NEAR_M and not self._made_room:
            self._made_room, self._backs_until = True, state.now + _MAKE_ROOM_S
        return STANDSTILL

    def _gets_nearer(self, now: float, left: float) -> bool:
        """Whether the robot comes nearer to where they vanished, of which it is some metres away."""
        if left < self._way_left - _TRAIL_STEP_M:
            self._way_left, self._nearer_at = left, now
        return now - self._nearer_at <= _NO_NEARER_S

    def _is_there(self, state: RobotState, place: Place) -> bool:
        """Whether the robot is where they vanished, or sees that they have walked on."""
        near = math.dist(place, (state.pose.x, state.pose.y)) <= _ARRIVED_M
        return near or self._looks_at(state, place)

    def _looks_at(self, state: RobotState, place: Place) -> bool:
        """Whether somebody at a place would be seen whole; as the robot sees nobody, they have walked on."""
        away = math.dist(place, (state.pose.x, state.pose.y))
        in_view = abs(state.pose.bearing_to(*place)) < _VIEW_RAD and _VIEW_M[0] < away < _VIEW_M[1]
        return in_view and self._has_in_sight(state, place)

    def _begin_search(self, state: RobotState, place: Place) -> None:
        assert self._target.seen is not None
        in_map = state.map_from_odom.apply(*place)
        turned = Pose2(0.0, 0.0, state.map_from_odom.yaw)
        velocity = turned.apply(*self._target.velocity)
        self._whereabouts = Whereabouts(self._costmaps, in_map, velocity, self._target.seen)
        self._heading = self._goal_place = None
        self._looks, self._looked_from = 0, state.map_pose
        self._next_choice = self._moved = state.now

    def _look_for_them(self, state: RobotState) -> Twist2:
        """Turn to where they may be; drive there when that cannot be seen from here."""
        assert self._whereabouts is not None
        robot = state.map_pose
        legs = [state.map_from_odom.apply(*legs) for legs in all_legs(self._unknown)]
        self._whereabouts.update(state.now, robot, legs)
        if self._heading is None and state.now >= self._next_choice:
            if self._goal_place is not None and self.path is None:
                self._whereabouts.no_way_to(self._goal_place)
            self._choose(state)
        if self._heading is not None:
            left = normalize_angle(self._heading - robot.yaw)
            if abs(left) > _FACING_RAD / 2.0:
                fast = abs(left) > 2.0 * _FACING_RAD
                turn = self._turn_round(state, left, self._goal.max_angular if fast else _LOOK_RADPS)
                if turn.is_zero():
                    # From here it cannot be looked at: make room, and drive on.
                    self._heading, self._looks = None, len(_WORTH_LOOKING)
                    self._next_choice, self._backs_until = state.now, state.now + _MAKE_ROOM_S
                return turn
            self._heading = None
        if self._goal_place is None:
            return STANDSTILL
        command, _ = self._along_path(state, state.map_from_odom.inverse().apply(*self._goal_place))
        return command

    def _turn_round(self, state: RobotState, left: float, speed: float) -> Twist2:
        """Turn in place; where there is no room for it, the other way round.

        Returns:
            Standstill when something was in the way both ways round since :meth:`_begin_to_turn`.
        """
        wanted = self._limited(math.copysign(speed, left))
        # What was begun goes on, also when the other way has become shorter.
        ways = (wanted, -wanted) if wanted * self._turning >= 0.0 else (-wanted, wanted)
        for turn in ways:
            if (turn > 0.0) in self._blocked_turns:
                continue
            if self._may(state, Twist2(0.0, turn)):
                self._turning = turn
                return Twist2(0.0, turn)
            self._blocked_turns.add(turn > 0.0)
        self._held = True
        return STANDSTILL

    def _begin_to_turn(self) -> None:
        self._turning = 0.0
        self._blocked_turns.clear()

    def _choose(self, state: RobotState) -> None:
        assert self._whereabouts is not None
        self._next_choice = state.now + _CHOICE_S
        robot = state.map_pose
        heading, share = self._whereabouts.best_view(robot)
        place = self._whereabouts.best_place(robot)
        beside = abs(normalize_angle(heading - robot.yaw)) > _FACING_RAD
        if robot.distance_to(self._looked_from) > _SAME_PLACE_M:
            self._looks, self._looked_from = 0, robot
        worth = _WORTH_LOOKING[self._looks] if self._looks < len(_WORTH_LOOKING) else math.inf
        if place is None or (share >= worth and beside):
            self._heading, self._goal_place = heading, None
            self._begin_to_turn()
            self._looks += 1
        else:
            self._goal_place, self._next_plan = place, state.now

    def _feedback(self, text: str) -> Feedback:
        return Feedback(recoveries=self._contact.back_offs, text=text)


def _lost_after(unseen: float) -> Result:
    return _lost(f"the person has been out of sight for {unseen:.1f} s")


def _lost(reason: str) -> Result:
    return failure("user_lost", reason, server_code=SERVER_CODES["user_lost"])
