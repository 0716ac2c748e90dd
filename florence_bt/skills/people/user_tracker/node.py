"""The user tracker on ROS (``user_tracker_ni_node``): pictures in, tracked users, their frames and looks out.

Stopped it takes no pictures and no frames at all. The filter of the document's section 4.2 is a pure
function, published beside the unfiltered users.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

import numpy as np
from florence_interfaces.action import LookForUser as LookAction
from florence_interfaces.msg import DetectedUser, TrackedUsers
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from sensor_msgs.msg import CameraInfo, Image
from sensor_msgs.msg import LaserScan as LaserScanMsg
from std_msgs.msg import Bool
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from florence_bt.core.clock import Timer
from florence_bt.core.errors import FlorenceError
from florence_bt.core.geometry import Pose2
from florence_bt.core.limits import CheckedParameters, Limits, NotNegative
from florence_bt.core.outcome import Outcome, Result
from florence_bt.core.sensing import CameraModel, ColourImage, DepthImage, TrackedUser
from florence_bt.core.transforms import Transform3, TransformUnavailable
from florence_bt.ros.action_server import SingleGoalServer
from florence_bt.ros.conversions import (
    camera_model_from_ros,
    colour_from_ros,
    depth_from_ros,
    grid_from_ros,
    scan_from_ros,
    scan_to_ros,
    stamp_from_ros,
)
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE, SENSOR
from florence_bt.ros.tf import TransformBroadcaster, TransformListener
from florence_bt.skills.people.user_tracker.bindings import LOOK_CODES_BY_NUMBER
from florence_bt.skills.people.user_tracker.body_scan import body_scan
from florence_bt.skills.people.user_tracker.camera_view import CameraView, view_of
from florence_bt.skills.people.user_tracker.colour_detector import ColourDetector
from florence_bt.skills.people.user_tracker.detector import detect_people
from florence_bt.skills.people.user_tracker.evidence import Verdict, Verifier, verdicts
from florence_bt.skills.people.user_tracker.known_obstacles import KnownObstacles
from florence_bt.skills.people.user_tracker.laser_view import laser_view
from florence_bt.skills.people.user_tracker.look import GOAL_LIMITS, LookForUser, Wanted
from florence_bt.skills.people.user_tracker.markers import markers_of
from florence_bt.skills.people.user_tracker.parameters import (
    ColourParameters,
    DetectorParameters,
    LookParameters,
    TrackerParameters,
)
from florence_bt.skills.people.user_tracker.tracker import UserTracker, filter_users, on_the_floor

WARNING_PERIOD_S = 5.0
EMPTY_PICTURE = DepthImage(
    0.0, "", CameraModel(1, 1, 1.0, 1.0, 0.0, 0.0), np.full((1, 1), np.nan, np.float32)
)
MOST_WAIT_S = 2.0
"""A picture waits this long for the pose it was taken at; the robot was somewhere else by then."""


@dataclass(frozen=True, slots=True)
class UserTrackerNodeParameters(CheckedParameters):
    """Parameters of the node beside those of the detector, the tracker and the look.

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


class UserTrackerNode(FlorenceNode):
    """Tracks people while it is started, and looks for one on demand.

    Args:
        parameters: Overrides of the node's parameters.
        verifier: Is asked about candidates; the colour detector when None, if it is switched on.

    Raises:
        ColourNetworkUnusable: The colour detector is switched on, and its network is damaged or not
            installed.
    """

    parameter_classes = (
        UserTrackerNodeParameters,
        DetectorParameters,
        ColourParameters,
        TrackerParameters,
        LookParameters,
    )

    def __init__(
        self,
        *,
        parameters: Mapping[str, Any] | None = None,
        verifier: Verifier | None = None,
    ) -> None:
        super().__init__("user_tracker_ni_node", parameters=parameters)
        self._params = self.read_parameters(UserTrackerNodeParameters)
        self._detector = self.read_parameters(DetectorParameters)
        # The first call loads the compiled loops, which takes as long as twenty pictures: not during a look.
        detect_people(EMPTY_PICTURE, Transform3.identity(), None, self._detector)
        colours = self.read_parameters(ColourParameters)
        self._verifier = verifier or (ColourDetector(colours) if self._params.colour_detector else None)
        self._worker = ThreadPoolExecutor(1, "verifier")
        self._answer: Future[list[tuple[int, Verdict]]] | None = None
        self._asked = float("-inf")
        self._tracker = UserTracker(
            self.read_parameters(TrackerParameters), verifier=self._verifier is not None
        )
        self._look = LookForUser(self.read_parameters(LookParameters))
        self._look_timer: Timer | None = None
        self._started_by_look = False
        self._readings: list[Any] = []
        self._forget_timer: Timer | None = None
        self._depth_camera: CameraModel | None = None
        self._colour: Image | None = None
        self._known: KnownObstacles | None = None
        self._last_stamp = float("-inf")
        self._waiting: Image | None = None
        self._tf: TransformListener | None = None
        self._frames = TransformBroadcaster(self)
        self._users_topic = self.create_publisher(TrackedUsers, "tracked_users", RELIABLE)
        self._filtered_topic = self.create_publisher(TrackedUsers, "filtered_tracked_users", RELIABLE)
        self._lying_topic = self.create_publisher(Bool, "user_lying", RELIABLE)
        self._bodies_topic = self.create_publisher(LaserScanMsg, "people_scan", SENSOR)
        self._markers_topic = self.create_publisher(MarkerArray, "user_markers", RELIABLE)
        self._detected_topic = self.create_publisher(DetectedUser, "detected_user", RELIABLE)
        if self._params.use_map:
            self.create_subscription(OccupancyGridMsg, "map", self._on_map, LATCHED)
        self.ros_timebase.on_reset(self._forget_readings)
        self.create_service(Trigger, "~/Start", self._on_start)
        self.create_service(Trigger, "~/Stop", self._on_stop)
        self._action = SingleGoalServer(
            self, LookAction, "look_for_user", on_goal=self._on_goal, on_cancel=self._on_cancel
        )

    def close(self) -> None:
        """Take no more pictures."""
        self._tracker.stop()
        self._worker.shutdown(cancel_futures=True)

    # ---- start and stop -------------------------------------------------------------------------------

    def _on_start(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._start()
        self._started_by_look = False
        response.success, response.message = True, "tracking"
        return response

    def _on_stop(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._stop()
        response.success, response.message = True, "stopped"
        return response

    def _start(self) -> None:
        self._tracker.start()
        if self._forget_timer is not None:
            self._forget_timer.cancel()
            self._forget_timer = None
        if self._tf is None:
            self._tf = TransformListener(self)
        if not self._readings:
            self._readings = [
                self.create_subscription(CameraInfo, "camera/depth/camera_info", self._on_camera, SENSOR),
                self.create_subscription(Image, "camera/depth/image", self._on_depth, SENSOR),
                self.create_subscription(Image, "camera/rgb/image_color", self._on_colour, SENSOR),
                self.create_subscription(LaserScanMsg, "filtered_scan", self._on_scan, SENSOR),
            ]

    def _stop(self) -> None:
        self._tracker.stop()
        self._colour = self._waiting = None
        if self._readings and self._forget_timer is None:
            when = self.timebase.now() + self._params.keep_pictures_s
            self._forget_timer = self.timebase.call_at(when, self._forget_pictures)

    def _forget_pictures(self) -> None:
        self._forget_timer = None
        for subscription in self._readings:
            self.destroy_subscription(subscription)
        self._readings = []
        if self._tf is not None:
            self._tf.close()
            self._tf = None

    # ---- pictures -------------------------------------------------------------------------------------

    def _on_map(self, message: OccupancyGridMsg) -> None:
        try:
            self._known = KnownObstacles(grid_from_ros(message))
        except FlorenceError as error:
            self.get_logger().warning(f"the map is left out: {error}")

    def _on_camera(self, message: CameraInfo) -> None:
        try:
            self._depth_camera = camera_model_from_ros(message)
        except FlorenceError as error:
            self._warn(f"the camera info is left out: {error}")

    def _forget_readings(self) -> None:
        """Forget readings, as the clock has jumped: what was on its way may have a useless stamp."""
        self._colour = self._waiting = None
        self._last_stamp = self._asked = float("-inf")

    def _on_colour(self, message: Image) -> None:
        if self._tracker.running:
            self._colour = message

    def _on_depth(self, message: Image) -> None:
        # A picture may still be on its way when the tracker stops.
        if not self._tracker.running or self._depth_camera is None:
            return
        waiting, self._waiting = self._waiting, None
        if waiting is not None:
            # A picture can overtake the pose it was taken at. The first that does is kept, not the newest: on
            # a busy machine the newest is always too new.
            self._use_picture(waiting, self._taken_at(message))
        stamp = self._taken_at(message)
        if self._waiting is None and not 0.0 <= stamp - self._last_stamp < self._params.period_s:
            self._use_picture(message, stamp)

    def _use_picture(self, message: Image, now: float) -> None:
        """Detect people in a picture, or keep it until the pose it was taken at is known.

        Args:
            message: The picture.
            now: When the newest picture was taken, seconds.
        """
        assert self._depth_camera is not None
        stamp = self._taken_at(message)
        try:
            self._take_picture(self.timed(depth_from_ros(message, self._depth_camera)))
        except TransformUnavailable as error:
            if 0.0 <= now - stamp < MOST_WAIT_S:
                self._waiting = message
            else:
                self._warn(f"a depth picture is left out: {error}")
            return
        except FlorenceError as error:
            self._warn(f"a depth picture is left out: {error}")
        self._last_stamp = stamp

    def _taken_at(self, picture: Image) -> float:
        return self.time_of(stamp_from_ros(picture.header.stamp))

    def _colour_near(self, stamp: float) -> ColourImage | None:
        """Return the latest colour picture, if it is of about this moment."""
        assert self._depth_camera is not None
        if self._colour is None or abs(self._taken_at(self._colour) - stamp) > self._params.colour_age_s:
            return None
        try:
            # Only the pixels count here; the camera model of the depth picture stands in for its own.
            return self.timed(colour_from_ros(self._colour, self._depth_camera))
        except FlorenceError as error:
            self._colour = None
            self._warn(f"a colour picture is left out: {error}")
            return None

    def _take_picture(self, depth: DepthImage) -> None:
        assert self._tf is not None
        params, buffer = self._params, self._tf.buffer
        optical_in_base = buffer.lookup(params.base_frame, depth.frame_id, depth.stamp)
        robot_in_odom = buffer.lookup_pose(params.odom_frame, params.base_frame, depth.stamp)
        odom = buffer.lookup_pose(params.map_frame, params.odom_frame, depth.stamp)
        robot = odom @ robot_in_odom
        colour = self._colour_near(depth.stamp)
        found = detect_people(depth, optical_in_base, colour, self._detector, known=self._known, robot=robot)
        view = view_of(depth, optical_in_base, robot_in_odom)
        tracked = self._tracker.update(depth.stamp, [each.moved_by(robot_in_odom) for each in found], view)
        users = tuple(user.moved_by(odom) for user in tracked)
        self._bodies_topic.publish(scan_to_ros(body_scan(found, self.stamp(depth.stamp), params.base_frame)))
        self._publish(users, depth.stamp)
        if colour is not None:
            self._ask_second_source(colour, depth.stamp)
        if self._action.active:
            self._feed_look(depth.stamp, users, robot, view.moved_by(odom))

    def _on_scan(self, message: LaserScanMsg) -> None:
        """Go on with the legs of those whom the camera does not see."""
        if not self._tracker.running or self._known is None or self._tf is None:
            return
        params, buffer = self._params, self._tf.buffer
        try:
            scan = self.timed(scan_from_ros(message))
            laser_in_base = buffer.lookup(params.base_frame, scan.frame_id, scan.stamp)
            robot = buffer.lookup_pose(params.odom_frame, params.base_frame, scan.stamp)
            odom = buffer.lookup_pose(params.map_frame, params.odom_frame, scan.stamp)
        except TransformUnavailable:
            return  # it overtook the pose of the robot; the next one comes soon
        except FlorenceError as error:
            self._warn(f"a scan is left out: {error}")
            return
        laser = Transform3.from_pose2(robot) @ laser_in_base
        self._look.saw_scan(laser_view(scan, laser, odom))
        for user in self._tracker.saw_scan(scan.stamp, self._known.unmapped_ends(scan, laser, odom), robot):
            self._send_frame(user.moved_by(odom), scan.stamp)

    def _ask_second_source(self, colour: ColourImage, stamp: float) -> None:
        """Have the candidates of a picture looked at beside the depth pictures that follow."""
        if self._verifier is None or self._answer is not None:
            return
        candidates = self._tracker.candidates(self._params.colour_most)
        if not candidates or 0.0 <= stamp - self._asked < self._params.colour_period_s:
            return
        self._asked = stamp
        self._answer = self._worker.submit(verdicts, self._verifier, colour, candidates)
        self._answer.add_done_callback(lambda answer: self.call_soon(partial(self._on_verdicts, answer)))

    def _on_verdicts(self, answer: Future[list[tuple[int, Verdict]]]) -> None:
        self._answer = None
        if answer.cancelled():
            return  # the node was closed
        for number, verdict in answer.result():
            self._tracker.take_verdict(number, verdict, self._last_stamp)

    def _publish(self, users: tuple[TrackedUser, ...], stamp: float) -> None:
        present = filter_users(users)
        self._users_topic.publish(_users_to_ros(users))
        self._filtered_topic.publish(_users_to_ros(present))
        self._lying_topic.publish(Bool(data=on_the_floor(users)))
        if self._markers_topic.get_subscription_count() > 0:
            self._markers_topic.publish(markers_of(present, self._params.map_frame, self.stamp(stamp)))
        seen = self._tracker.in_view
        for user in present:
            if user.user_id in seen:
                self._send_frame(user, stamp)

    def _send_frame(self, user: TrackedUser, stamp: float) -> None:
        self._frames.send(self._params.map_frame, f"user_{user.user_id}", stamp, Pose2(user.x, user.y))

    # ---- looks ----------------------------------------------------------------------------------------

    def _on_goal(self, goal: LookAction.Goal) -> str | None:
        window = float(goal.window) or float(GOAL_LIMITS["window"].default)
        given = {"window": window, "user_id": goal.user_id, "x": float(goal.x), "y": float(goal.y)}
        for name, value in given.items():
            problem = GOAL_LIMITS[name].problem_with(value)
            if problem:
                return f"{name}: {problem}"
        if not self._tracker.running:
            self._start()
            self._started_by_look = True
        self._end_timer()
        wanted = Wanted(goal.user_id, float(goal.x), float(goal.y))
        self._look.start(self.timebase.now(), window, wanted)
        self._look_timer = self.timebase.call_at(self._look.deadline, self._judge_look)
        return None

    def _feed_look(
        self, stamp: float, users: tuple[TrackedUser, ...], robot: Pose2, view: CameraView
    ) -> None:
        before = self._look.users_seen
        self._look.feed(stamp, users, robot, undecided=self._tracker.undecided, view=view)
        if self._look.users_seen != before:
            self._action.publish_feedback(LookAction.Feedback(users_seen=self._look.users_seen))
        self._judge_look()

    def _judge_look(self) -> None:
        result = self._look.result(self.timebase.now())
        if result is None:
            return
        self._end_look()
        if result.succeeded:
            self._publish_detected(result)
        self._action.finish(_look_to_ros(result, self._look.pictures), result.outcome)

    def _publish_detected(self, result: Result) -> None:
        user = result.outputs["user"]
        self._detected_topic.publish(
            DetectedUser(command=True, user_position_x=user.x, user_position_y=user.y)
        )

    def _on_cancel(self) -> None:
        self._end_look()
        self._action.finish(LookAction.Result(error_msg="cancelled on request"), Outcome.CANCELLED)

    def _end_look(self) -> None:
        self._end_timer()
        if self._started_by_look:
            self._started_by_look = False
            self._stop()

    def _end_timer(self) -> None:
        if self._look_timer is not None:
            self._look_timer.cancel()
            self._look_timer = None

    def _warn(self, text: str) -> None:
        self.get_logger().warning(text, throttle_duration_sec=WARNING_PERIOD_S)


def _users_to_ros(users: tuple[TrackedUser, ...]) -> TrackedUsers:
    return TrackedUsers(
        user_ids=[user.user_id for user in users],
        user_ids_ni=[user.device_id for user in users],
        num_users_tracked=len(users),
    )


def _look_to_ros(result: Result, pictures: int) -> LookAction.Result:
    if not result.succeeded:
        number = {code: number for number, code in LOOK_CODES_BY_NUMBER.items()}[result.code]
        return LookAction.Result(error_code=number, error_msg=result.reason, pictures=pictures)
    user = result.outputs["user"]
    return LookAction.Result(
        found=True,
        pictures=pictures,
        user_id=result.outputs["user_id"],
        x=user.x,
        y=user.y,
        phi=user.yaw,
        distance=result.outputs["distance"],
        posture=result.outputs["posture"],
        height=result.outputs["height"],
    )
