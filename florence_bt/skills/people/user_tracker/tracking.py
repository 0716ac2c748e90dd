"""The user tracker as a component: pictures in; tracked users, their frames and looks out.

Stopped it takes no pictures and no frames at all. The filter of the document's section 4.2 is a pure
function, published beside the unfiltered users.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

import numpy as np

from florence_bt.core import topic_names
from florence_bt.core.clock import Timer
from florence_bt.core.errors import FlorenceError
from florence_bt.core.geometry import Pose2
from florence_bt.core.limits import CheckedParameters, Limits, NotNegative
from florence_bt.core.outcome import Outcome, Result
from florence_bt.core.ports import (
    Action,
    Connection,
    Delivery,
    Fields,
    Frames,
    NoFields,
    Picture,
    Ports,
    Service,
    Topic,
)
from florence_bt.core.sensing import (
    CameraModel,
    ColourImage,
    DepthImage,
    LaserScan,
    OccupancyGrid,
    TrackedUser,
)
from florence_bt.core.topics import COLOUR, DEPTH, FOUND, MAP, FoundUser
from florence_bt.core.transforms import Transform3, TransformTooOld, TransformUnavailable
from florence_bt.skills.people.user_tracker.bindings import LOOK_CODES_BY_NUMBER
from florence_bt.skills.people.user_tracker.body_scan import body_scan
from florence_bt.skills.people.user_tracker.camera_view import CameraView, view_of
from florence_bt.skills.people.user_tracker.detector import Network, detect_people, network_says
from florence_bt.skills.people.user_tracker.evidence import Verdict, Verifier, verdicts
from florence_bt.skills.people.user_tracker.known_obstacles import KnownObstacles
from florence_bt.skills.people.user_tracker.laser_view import laser_view
from florence_bt.skills.people.user_tracker.look import GOAL_LIMITS, LookForUser, Wanted
from florence_bt.skills.people.user_tracker.parameters import (
    DetectorParameters,
    LookParameters,
    TrackerParameters,
)
from florence_bt.skills.people.user_tracker.tracker import UserTracker, filter_users, on_the_floor

EMPTY_PICTURE = DepthImage(
    0.0, "", CameraModel(1, 1, 1.0, 1.0, 0.0, 0.0), np.full((1, 1), np.nan, np.float32)
)
MOST_WAIT_S = 2.0
"""A picture waits this long for the pose it was taken at; the robot was somewhere else by then."""
MOST_IMAGES_WAITING = 10
"""Pictures that wait so at most (chosen: 0.3 MB each); of more, the newest are left out."""


@dataclass(frozen=True, slots=True)
class UserTrackingParameters(CheckedParameters):
    """Parameters of the component beside those of the detector, the tracker and the look.

    Attributes:
        period_s: Pictures that come sooner after the last one are left out, seconds.
        colour_detector: Whether a learned detector looks at who is proposed in the colour pictures, too. It
            does not know simulated people.
        colour_period_s: It is asked at most this often, seconds.
        colour_most: Of how many candidates at a time.
        colour_age_s: A colour picture may differ this much in time from the depth picture, seconds.
        keep_pictures_s: Pictures and frames are listened to for this long after a stop, seconds: between two
            looks the tracker is stopped for a moment, and it would take a while to find them again.
        use_map: Whether the map takes walls and furniture out of the pictures.
        map_frame: The frame of the map.
        odom_frame: The frame in which people are tracked: a correction of the robot's place moves nobody.
        base_frame: The frame of the robot on the floor.
    """

    period_s: NotNegative = 0.06
    colour_detector: bool = False
    colour_period_s: NotNegative = 0.3
    colour_most: Annotated[int, Limits(1)] = 4
    colour_age_s: NotNegative = 0.2
    keep_pictures_s: NotNegative = 20.0
    use_map: bool = True
    map_frame: str = "map"
    odom_frame: str = "odom"
    base_frame: str = "base_footprint"


@dataclass(frozen=True, slots=True)
class UserIds:
    """The tracked users, as ``florence_interfaces/TrackedUsers`` has them.

    Attributes:
        user_ids: Persistent ids.
        user_ids_ni: Ids of the device, in the same order.
        num_users_tracked: How many there are.
    """

    user_ids: list[int]
    user_ids_ni: list[int]
    num_users_tracked: int

    @classmethod
    def of(cls, users: Sequence[TrackedUser]) -> UserIds:
        """Take the ids of some users."""
        return cls([user.user_id for user in users], [user.device_id for user in users], len(users))


@dataclass(frozen=True, slots=True)
class ShownUsers:
    """The users as viewers show them.

    Attributes:
        users: Those who are present, in the frame.
        frame: Its name.
        stamp: When they were seen, seconds.
    """

    users: Sequence[TrackedUser]
    frame: str
    stamp: float


@dataclass(frozen=True, slots=True)
class LookGoal:
    """A goal of ``florence_interfaces/LookForUser``; see there."""

    window: float = 0.0
    user_id: int = 0
    x: float = 0.0
    y: float = 0.0


def _fields_of(result: Result, pictures: int) -> dict[str, Any]:
    """Return the result's fields of a look that ended so after some pictures."""
    if not result.succeeded:
        number = {code: number for number, code in LOOK_CODES_BY_NUMBER.items()}[result.code]
        return {"found": False, "error_code": number, "error_msg": result.reason, "pictures": pictures}
    user: Pose2 = result.outputs["user"]
    place = {"x": user.x, "y": user.y, "phi": user.yaw}
    return {"found": True, "error_code": 0, "error_msg": "", "pictures": pictures, **place, **result.outputs}


SCAN = Topic(topic_names.FILTERED_SCAN, LaserScan, Delivery.SENSOR)
USERS = Topic(topic_names.ALL_TRACKED_USERS, UserIds, interface="florence_interfaces/msg/TrackedUsers")
PRESENT_USERS = Topic(topic_names.TRACKED_USERS, UserIds, interface="florence_interfaces/msg/TrackedUsers")
LYING = Topic(topic_names.USER_LYING, bool)
BODIES = Topic(topic_names.PEOPLE_SCAN, LaserScan, Delivery.SENSOR)
SHOWN_USERS = Topic(topic_names.USER_MARKERS, ShownUsers, interface="visualization_msgs/msg/MarkerArray")
START = Service("~/Start", "std_srvs/srv/Trigger")
STOP = Service("~/Stop", "std_srvs/srv/Trigger")
LOOK = Action("look_for_user", "florence_interfaces/action/LookForUser", LookGoal)


class UserTracking:
    """Tracks people while it is started, and looks for one on demand.

    Args:
        ports: Its connections.
        parameters: Its own.
        detector: Of the detector.
        tracker: Of the tracker.
        look: Of looks.
        verifier: Is asked about candidates; None for nobody.
        network: Tells what pictures show.
    """

    def __init__(
        self,
        ports: Ports,
        parameters: UserTrackingParameters,
        detector: DetectorParameters,
        tracker: TrackerParameters,
        look: LookParameters,
        verifier: Verifier | None = None,
        network: Network = network_says,
    ) -> None:
        self._ports = ports
        self._network = network
        self._params = parameters
        self._detector = detector
        # The first call loads the compiled loops, which takes as long as twenty pictures: not during a look.
        detect_people(EMPTY_PICTURE, Transform3.identity(), None, detector)
        self._verifier = verifier
        self._asked = float("-inf")
        self._is_asked = False
        self._tracker = UserTracker(tracker, verifier=verifier is not None)
        self._look = LookForUser(look)
        self._look_timer: Timer | None = None
        self._started_by_look = False
        self._readings: list[Connection] = []
        self._forget_timer: Timer | None = None
        self._colour: Picture[ColourImage] | None = None
        self._known: KnownObstacles | None = None
        self._last_stamp = self._started = float("-inf")
        self._waiting: deque[Picture[DepthImage]] = deque()
        self._frames: Frames | None = None
        self._users = ports.output(USERS)
        self._present = ports.output(PRESENT_USERS)
        self._lying = ports.output(LYING)
        self._bodies = ports.output(BODIES)
        self._shown = ports.output(SHOWN_USERS)
        self._found = ports.output(FOUND)
        if parameters.use_map:
            ports.listen(MAP, self._take_map)
        ports.on_time_jump(self._forget_readings)
        ports.serve(START, self._answer_start)
        ports.serve(STOP, self._answer_stop)
        self._goals = ports.serve_goals(LOOK, self._begin_look, self._cancel_look)

    def close(self) -> None:
        """Take no more pictures."""
        self._tracker.stop()

    # ---- start and stop -------------------------------------------------------------------------------

    def _answer_start(self, _: NoFields) -> Fields:
        self._start()
        self._started_by_look = False
        return {"success": True, "message": "tracking"}

    def _answer_stop(self, _: NoFields) -> Fields:
        self._stop()
        return {"success": True, "message": "stopped"}

    def _start(self) -> None:
        self._tracker.start()
        self._started = self._ports.clock.now()
        if self._forget_timer is not None:
            self._forget_timer.cancel()
            self._forget_timer = None
        if self._frames is None:
            self._frames = self._ports.listen_to_frames()
        if not self._readings:
            self._readings = [
                self._ports.listen(DEPTH, self._take_depth),
                self._ports.listen(COLOUR, self._take_colour),
                self._ports.listen(SCAN, self._take_scan),
            ]

    def _stop(self) -> None:
        self._tracker.stop()
        self._colour = None
        self._waiting.clear()
        if self._readings and self._forget_timer is None:
            when = self._ports.clock.now() + self._params.keep_pictures_s
            self._forget_timer = self._ports.clock.call_at(when, self._forget_pictures)

    def _forget_pictures(self) -> None:
        self._forget_timer = None
        for reading in self._readings:
            reading.close()
        self._readings = []
        if self._frames is not None:
            self._frames.close()
            self._frames = None

    # ---- pictures -------------------------------------------------------------------------------------

    def _take_map(self, grid: OccupancyGrid) -> None:
        self._known = KnownObstacles(grid)

    def _forget_readings(self) -> None:
        """Forget readings, as the clock has jumped: what was on its way may have a useless stamp."""
        self._colour = None
        self._waiting.clear()
        self._last_stamp = self._asked = self._started = float("-inf")

    def _take_colour(self, picture: Picture[ColourImage]) -> None:
        if self._tracker.running:
            self._colour = picture

    def _take_depth(self, picture: Picture[DepthImage]) -> None:
        # A picture may still be on its way when the tracker stops, and when it starts again.
        if not self._tracker.running or picture.stamp < self._started:
            return
        before = self._waiting[-1].stamp if self._waiting else self._last_stamp
        too_soon = 0.0 <= picture.stamp - before < self._params.period_s
        if not too_soon and len(self._waiting) < MOST_IMAGES_WAITING:
            self._waiting.append(picture)
        ready = self._take_ready(picture.stamp)
        if ready is not None:
            self._use_picture(ready, picture.stamp)

    def _take_ready(self, now: float) -> Picture[DepthImage] | None:
        """Return the newest picture that was taken at a pose that is known; older ones are left out.

        A picture can overtake the pose it was taken at. It waits, and so do those that follow it: on a busy
        machine the newest is always too new.

        Args:
            now: When the newest picture was taken, seconds.
        """
        ready = None
        while self._waiting:
            try:
                self._robot_at(self._waiting[0].stamp)
            except TransformTooOld:
                self._waiting.popleft()  # frames have been listened to since then only
            except TransformUnavailable as error:
                if self._may_wait(self._waiting[0], now):
                    break
                self._leave_out(self._waiting.popleft(), error)
            else:
                ready = self._waiting.popleft()
        return ready

    def _robot_at(self, stamp: float) -> tuple[Pose2, Pose2]:
        """Return the robot in the odometry frame, and that in the map, at a moment.

        Raises:
            TransformUnavailable: They are not known for that moment, or not yet.
        """
        assert self._frames is not None
        params, buffer = self._params, self._frames.buffer
        robot_in_odom = buffer.lookup_pose(params.odom_frame, params.base_frame, stamp)
        return robot_in_odom, buffer.lookup_pose(params.map_frame, params.odom_frame, stamp)

    @staticmethod
    def _may_wait(picture: Picture[DepthImage], now: float) -> bool:
        return 0.0 <= now - picture.stamp < MOST_WAIT_S

    def _leave_out(self, picture: Picture[DepthImage], error: FlorenceError) -> None:
        self._ports.warn(f"a depth picture is left out: {error}", DEPTH)
        self._last_stamp = picture.stamp

    def _use_picture(self, picture: Picture[DepthImage], now: float) -> None:
        """Detect people in a picture, or keep it until the place of the camera is known.

        Args:
            picture: The picture.
            now: When the newest picture was taken, seconds.
        """
        try:
            self._look_at(picture.read())
        except TransformUnavailable as error:
            if self._may_wait(picture, now):
                self._waiting.appendleft(picture)
            else:
                self._leave_out(picture, error)
        except FlorenceError as error:
            self._leave_out(picture, error)
        else:
            self._last_stamp = picture.stamp

    def _colour_near(self, stamp: float) -> ColourImage | None:
        """Return the latest colour picture, if it is of about this moment."""
        if self._colour is None or abs(self._colour.stamp - stamp) > self._params.colour_age_s:
            return None
        try:
            return self._colour.read()
        except FlorenceError as error:
            self._colour = None
            self._ports.warn(f"a colour picture is left out: {error}", COLOUR)
            return None

    def _look_at(self, depth: DepthImage) -> None:
        assert self._frames is not None
        params, buffer = self._params, self._frames.buffer
        optical_in_base = buffer.lookup(params.base_frame, depth.frame_id, depth.stamp)
        robot_in_odom, odom = self._robot_at(depth.stamp)
        robot = odom @ robot_in_odom
        colour = partial(self._colour_near, depth.stamp)
        found = detect_people(
            depth,
            optical_in_base,
            colour,
            self._detector,
            known=self._known,
            robot=robot,
            network=self._network,
        )
        view = view_of(depth, optical_in_base, robot_in_odom)
        tracked = self._tracker.update(depth.stamp, [each.moved_by(robot_in_odom) for each in found], view)
        users = tuple(user.moved_by(odom) for user in tracked)
        self._bodies.send(body_scan(found, depth.stamp, params.base_frame))
        self._tell_of(users, depth.stamp)
        self._ask_second_source(depth.stamp)
        if self._goals.active:
            shown = tuple(user for user in users if user.user_id in self._tracker.in_view)
            self._feed_look(depth.stamp, shown, robot, view.moved_by(odom))

    def _take_scan(self, scan: LaserScan) -> None:
        """Go on with the legs of those whom the camera does not see."""
        if not self._tracker.running or self._known is None or self._frames is None:
            return
        params, buffer = self._params, self._frames.buffer
        try:
            laser_in_base = buffer.lookup(params.base_frame, scan.frame_id, scan.middle_stamp)
            robot, odom = self._robot_at(scan.middle_stamp)
        except TransformUnavailable:
            return  # it overtook the pose of the robot; the next one comes soon
        laser = Transform3.from_pose2(robot) @ laser_in_base
        self._look.saw_scan(laser_view(scan, laser, odom))
        ends = self._known.unmapped_ends(scan, laser, odom)
        for user in self._tracker.saw_scan(scan.middle_stamp, ends, robot):
            self._send_frame(user.moved_by(odom), scan.middle_stamp)

    def _ask_second_source(self, stamp: float) -> None:
        """Have the candidates of a picture looked at beside the depth pictures that follow."""
        if (
            self._verifier is None
            or self._is_asked
            or 0.0 <= stamp - self._asked < self._params.colour_period_s
        ):
            return
        candidates = self._tracker.candidates(self._params.colour_most)
        colour = self._colour_near(stamp) if candidates else None
        if colour is None:
            return
        self._asked, self._is_asked = stamp, True
        self._ports.work(partial(verdicts, self._verifier, colour, candidates), self._take_verdicts)

    def _take_verdicts(self, answer: Sequence[tuple[int, Verdict]]) -> None:
        self._is_asked = False
        for number, verdict in answer:
            self._tracker.take_verdict(number, verdict, self._last_stamp)

    def _tell_of(self, users: tuple[TrackedUser, ...], stamp: float) -> None:
        present = filter_users(users)
        self._users.send(UserIds.of(users))
        self._present.send(UserIds.of(present))
        self._lying.send(on_the_floor(users))
        if self._shown.listeners:
            self._shown.send(ShownUsers(present, self._params.map_frame, stamp))
        seen = self._tracker.in_view
        for user in present:
            if user.user_id in seen:
                self._send_frame(user, stamp)

    def _send_frame(self, user: TrackedUser, stamp: float) -> None:
        self._ports.send_frame(self._params.map_frame, f"user_{user.user_id}", stamp, Pose2(user.x, user.y))

    # ---- looks ----------------------------------------------------------------------------------------

    def _begin_look(self, goal: LookGoal) -> str | None:
        window = goal.window or float(GOAL_LIMITS["window"].default)
        given = {"window": window, "user_id": goal.user_id, "x": goal.x, "y": goal.y}
        for name, value in given.items():
            problem = GOAL_LIMITS[name].problem_with(value)
            if problem:
                return f"{name}: {problem}"
        if not self._tracker.running:
            self._start()
            self._started_by_look = True
        self._end_timer()
        self._look.start(self._ports.clock.now(), window, Wanted(goal.user_id, goal.x, goal.y))
        self._look_timer = self._ports.clock.call_at(self._look.deadline, self._judge_look)
        return None

    def _feed_look(
        self, stamp: float, users: tuple[TrackedUser, ...], robot: Pose2, view: CameraView
    ) -> None:
        if stamp < self._look.started:
            return  # what was on its way shows where the robot was before, often while it turned
        before = self._look.users_seen
        self._look.feed(stamp, users, robot, undecided=self._tracker.undecided, view=view)
        if self._look.users_seen != before:
            self._goals.feedback({"users_seen": self._look.users_seen})
        self._judge_look()

    def _judge_look(self) -> None:
        result = self._look.result(self._ports.clock.now())
        if result is None:
            return
        self._end_look()
        if result.succeeded:
            user = result.outputs["user"]
            self._found.send(FoundUser(True, user.x, user.y))
        self._goals.finish(_fields_of(result, self._look.pictures), result.outcome)

    def _cancel_look(self) -> None:
        self._end_look()
        self._goals.finish({"error_msg": "cancelled on request"}, Outcome.CANCELLED)

    def _end_look(self) -> None:
        self._end_timer()
        if self._started_by_look:
            self._started_by_look = False
            self._stop()

    def _end_timer(self) -> None:
        if self._look_timer is not None:
            self._look_timer.cancel()
            self._look_timer = None
