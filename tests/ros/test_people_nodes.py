"""The user tracker and the approach over real ROS."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytest.importorskip("florence_interfaces.srv")

from florence_interfaces.action import LookForUser
from florence_interfaces.msg import DetectedUser, RunState, TrackedUsers
from florence_interfaces.srv import ProposeApproach
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from rclpy.action import ActionClient
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo, Image
from sensor_msgs.msg import LaserScan as LaserScanMsg
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger
from visualization_msgs.msg import Marker, MarkerArray

from florence_bt.app.bringup.skills_ros import make_skills
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import CameraModel, ColourImage, DepthImage, LaserScan, OccupancyGrid
from florence_bt.core.transforms import Transform3
from florence_bt.ros.action_server import REFUSED
from florence_bt.ros.clock import RosClock
from florence_bt.ros.conversions import (
    camera_info_to_ros,
    colour_to_ros,
    depth_to_ros,
    grid_to_ros,
    scan_to_ros,
)
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE, SENSOR
from florence_bt.ros.tf import StaticTransformBroadcaster, TransformBroadcaster, TransformListener
from florence_bt.skills.people.approach_user.approaching import UNCHECKED
from florence_bt.skills.people.approach_user.node import ApproachNode
from florence_bt.skills.people.user_tracker import tracking as tracker_node
from florence_bt.skills.people.user_tracker.bindings import LOOK_CODES_BY_NUMBER
from florence_bt.skills.people.user_tracker.colour_detector import ColourNetworkUnusable
from florence_bt.skills.people.user_tracker.detector import Detection
from florence_bt.skills.people.user_tracker.evidence import Candidate, Verdict
from florence_bt.skills.people.user_tracker.node import UserTrackerNode
from florence_bt.trees.language.declarations import own_declarations

LOOK_FOR_USER = own_declarations()["look_for_user"]
NO_USER_SEEN, NO_IMAGE, _ = LOOK_CODES_BY_NUMBER

pytestmark = pytest.mark.ros

CAMERA = CameraModel(320, 240, 262.5, 262.5, 159.5, 119.5)
FRAME = "camera_depth_optical_frame"
OPTICAL_IN_BASE = Transform3.from_xyz_rpy((-0.087, 0.0, 0.54), (-math.pi / 2, 0.0, -math.pi / 2))


def person_picture(distance: float) -> np.ndarray:
    """Legs, a round chest and a head straight ahead of the camera, nothing else."""
    v, u = np.mgrid[0:240, 0:320]
    depth = np.full((240, 320), np.nan, np.float32)
    for lateral, radius, low, high in (
        (0.1, 0.07, 0.0, 0.85),
        (-0.1, 0.07, 0.0, 0.85),
        (0.0, 0.2, 0.85, 1.45),
        (0.0, 0.1, 1.45, 1.72),
    ):
        # The ray through column u meets the upright cylinder at the depth z.
        slope = -(u - CAMERA.cx) / CAMERA.fx
        a, b, c = 1.0 + slope**2, distance + slope * lateral, distance**2 + lateral**2 - radius**2
        root = b**2 - a * c
        z = (b - np.sqrt(np.maximum(root, 0.0))) / a
        height = 0.54 - (v - CAMERA.cy) / CAMERA.fy * z
        hit = (root > 0.0) & (height >= low) & (height <= high)
        depth = np.where(hit & ~(depth <= z), z, depth)
    return depth.astype(np.float32)


class Robot(FlorenceNode):
    """Publishes pictures and frames, and hears what the tracker says."""

    def __init__(self) -> None:
        super().__init__("robot")
        self.depth: np.ndarray | None = None
        self.colour: np.ndarray | None = None
        self.frames_late = 0.0
        self.map_from_odom = Pose2(1.0, 2.0, math.pi / 2)
        self.users: list[TrackedUsers] = []
        self.filtered: list[TrackedUsers] = []
        self.detected: list[DetectedUser] = []
        self._static = StaticTransformBroadcaster(self)
        self._static.send([("base_footprint", FRAME, OPTICAL_IN_BASE)])
        self._moving = TransformBroadcaster(self)
        self._info = self.create_publisher(CameraInfo, "camera/depth/camera_info", SENSOR)
        self.pictures = self.create_publisher(Image, "camera/depth/image", SENSOR)
        self.colours = self.create_publisher(Image, "camera/rgb/image_color", SENSOR)
        self.create_subscription(TrackedUsers, "tracked_users", self.users.append, RELIABLE)
        self.create_subscription(TrackedUsers, "filtered_tracked_users", self.filtered.append, RELIABLE)
        self.create_subscription(DetectedUser, "detected_user", self.detected.append, RELIABLE)
        self.look = ActionClient(self, LookForUser, "look_for_user")
        self.create_timer(0.05, self._tick)

    def _tick(self) -> None:
        now = self.timebase.now()
        known = now - self.frames_late
        self._moving.send("map", "odom", known, self.map_from_odom)
        self._moving.send("odom", "base_footprint", known, Pose2())
        stamp = self.stamp(now)
        self._info.publish(camera_info_to_ros(CAMERA, FRAME, stamp))
        if self.colour is not None:
            self.colours.publish(colour_to_ros(ColourImage(stamp, FRAME, CAMERA, self.colour)))
        if self.depth is not None:
            self.pictures.publish(depth_to_ros(DepthImage(stamp, FRAME, CAMERA, self.depth)))


def call(ros: Any, node: Node, service_type: Any, name: str, request: Any) -> Any:
    client = node.create_client(service_type, name)
    ros.spin_until(client.service_is_ready, what=name)
    future = client.call_async(request)
    ros.spin_until(future.done, what=f"the answer of {name}")
    node.destroy_client(client)
    return future.result()


def look(ros: Any, robot: Robot, window: float) -> Any:
    ros.spin_until(robot.look.server_is_ready, what="the action server")
    handle = robot.look.send_goal_async(LookForUser.Goal(window=window))
    ros.spin_until(handle.done, what="acceptance")
    result = handle.result().get_result_async()
    ros.spin_until(result.done, what="the result of the look")
    return result.result()


@pytest.fixture
def robot(ros: Any) -> Robot:
    return ros.add(Robot())


@pytest.fixture
def tracker(ros: Any) -> UserTrackerNode:
    return ros.add(UserTrackerNode(parameters={"keep_pictures_s": 0.1}))


def test_the_tracker_takes_pictures_only_while_it_runs(
    ros: Any, robot: Robot, tracker: UserTrackerNode
) -> None:
    def hears_frames() -> bool:
        return any(each.topic_name.startswith("/tf") for each in tracker.subscriptions)

    robot.depth = person_picture(2.0)
    assert robot.pictures.get_subscription_count() == 0
    assert not hears_frames()
    assert call(ros, robot, Trigger, "user_tracker_ni_node/Start", Trigger.Request()).success
    ros.spin_until(lambda: robot.users and robot.users[-1].num_users_tracked == 1, what="a tracked user")
    assert list(robot.users[-1].user_ids_ni) == [1]
    ros.spin_until(lambda: robot.filtered and robot.filtered[-1].num_users_tracked == 1, what="the filter")
    assert call(ros, robot, Trigger, "user_tracker_ni_node/Stop", Trigger.Request()).success
    assert hears_frames()
    ros.spin_until(lambda: robot.pictures.get_subscription_count() == 0, what="the end of the subscription")
    assert not hears_frames()
    robot.users.clear()
    ros.spin_for(0.3)
    assert robot.users == []
    assert call(ros, robot, Trigger, "user_tracker_ni_node/Start", Trigger.Request()).success
    ros.spin_until(
        lambda: robot.users and robot.users[-1].num_users_tracked == 1, what="a user after a restart"
    )
    assert list(robot.users[-1].user_ids_ni) == [1], "device ids count from 1 again"


def test_the_detector_is_loaded_before_the_first_look(ros: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    detected: list[DepthImage] = []
    monkeypatch.setattr(
        tracker_node, "detect_people", lambda depth, *_arguments, **_options: detected.append(depth) or []
    )
    ros.add(UserTrackerNode())
    assert len(detected) == 1


def test_a_look_finds_the_person_in_the_map_frame(ros: Any, robot: Robot, tracker: UserTrackerNode) -> None:
    robot.depth = person_picture(2.0)
    call(ros, robot, Trigger, "user_tracker_ni_node/Start", Trigger.Request())
    # The hot loops are compiled before the look begins, which has a limit.
    ros.spin_until(lambda: robot.users and robot.users[-1].num_users_tracked == 1, what="a tracked user")
    result = look(ros, robot, 15.0)
    assert result.status == 4
    assert result.result.found and result.result.pictures >= 3
    # 2.0 m before the camera, which looks along the map's y axis from (1, 2 - 0.087).
    assert result.result.x == pytest.approx(1.0, abs=0.05)
    assert result.result.y == pytest.approx(2.0 - 0.087 + 2.0, abs=0.08)
    assert result.result.distance == pytest.approx(2.0, abs=0.08)
    ros.spin_until(lambda: robot.detected, what="detected_user")
    assert robot.detected[0].command
    assert robot.detected[0].user_position_y == pytest.approx(result.result.y)


def test_the_frame_of_who_left_the_picture_goes_on_with_their_legs_in_the_scans(
    ros: Any, robot: Robot, tracker: UserTrackerNode
) -> None:
    grid = OccupancyGrid(0.05, Pose2(-5.0, -5.0), np.zeros((200, 200), np.int8))
    robot.create_publisher(OccupancyGridMsg, "map", LATCHED).publish(grid_to_ros(grid, "map", 0.0))
    frames = TransformListener(robot).buffer
    scans = robot.create_publisher(LaserScanMsg, "filtered_scan", SENSOR)
    beside = [0.0]

    def publish_scan() -> None:
        ends = [(1.85, beside[0] + side) for side in (-0.06, -0.03, 0.0, 0.03, 0.06)]
        bearings = [math.atan2(y, x) for x, y in ends]
        ranges = np.full(2001, 5.6 - 1e-4, np.float32)
        for bearing, end in zip(bearings, ends, strict=True):
            ranges[round((bearing + 1.0) * 1000.0)] = math.hypot(*end)
        now = robot.timebase.now()
        scan = LaserScan(robot.stamp(now), "base_footprint", -1.0, 0.001, 0.1, 5.6, ranges)
        scans.publish(scan_to_ros(scan))

    robot.create_timer(0.1, publish_scan)
    robot.depth = person_picture(2.0)
    call(ros, robot, Trigger, "user_tracker_ni_node/Start", Trigger.Request())
    ros.spin_until(
        lambda: robot.filtered and robot.filtered[-1].num_users_tracked == 1, what="a tracked user"
    )
    robot.depth = np.full((240, 320), np.nan, np.float32)
    ros.spin_until(lambda: robot.filtered[-1].num_users_tracked == 0, what="the camera to lose them")
    beside[0] = 0.3
    # The robot looks along the map's y axis from (1, 2): its left is towards smaller x.
    ros.spin_until(
        lambda: "user_1" in frames.frames() and frames.lookup_pose("map", "user_1").x < 0.75,
        what="the frame to follow the legs",
    )
    place = frames.lookup_pose("map", "user_1")
    assert (place.x, place.y) == pytest.approx((0.7, 3.9), abs=0.12)
    assert robot.filtered[-1].num_users_tracked == 0, "the camera does not see them"


def test_people_keep_their_ids_when_the_clock_is_set(
    ros: Any, robot: Robot, tracker: UserTrackerNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    ahead = [0.0]
    monkeypatch.setattr(RosClock, "_read", lambda _clock: time.time() + ahead[0])
    robot.depth = person_picture(2.0)
    call(ros, robot, Trigger, "user_tracker_ni_node/Start", Trigger.Request())
    ros.spin_until(lambda: robot.users and robot.users[-1].num_users_tracked == 1, what="a tracked user")
    known = list(robot.users[-1].user_ids_ni)
    for ahead[0] in (3600.0, 0.0, -3600.0, -3603.0):
        robot.users.clear()
        ros.spin_until(lambda: len(robot.users) >= 5, what="pictures that are used")
        assert all(list(users.user_ids_ni) == known for users in robot.users)
    assert look(ros, robot, 15.0).result.found


def test_who_lies_on_the_floor_is_told_and_shown(
    ros: Any, robot: Robot, tracker: UserTrackerNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    lying: list[bool] = []
    shown: list[MarkerArray] = []
    robot.create_subscription(Bool, "user_lying", lambda message: lying.append(message.data), RELIABLE)
    robot.create_subscription(MarkerArray, "user_markers", shown.append, RELIABLE)
    robot.depth = person_picture(2.0)
    call(ros, robot, Trigger, "user_tracker_ni_node/Start", Trigger.Request())
    ros.spin_until(lambda: shown and len(shown[-1].markers) == 3, what="the markers of who stands")
    assert shown[-1].markers[2].text == "1 standing" and True not in lying
    fallen = Detection(2.0, 0.0, 2.0, posture="lying", height=0.3)
    monkeypatch.setattr(tracker_node, "detect_people", lambda *_, **__: [fallen])
    ros.spin_until(lambda: lying and lying[-1], what="the news that somebody lies on the floor")
    ros.spin_until(lambda: "lying" in shown[-1].markers[2].text, what="the markers of who lies")
    old, body, _ = shown[-1].markers
    assert (old.action, body.header.frame_id, body.type) == (Marker.DELETEALL, "map", Marker.CYLINDER)
    assert (body.pose.position.x, body.pose.position.y) == pytest.approx((1.0, 4.0), abs=0.1)
    assert body.scale.z < 1.8 and body.color.r > body.color.b


def test_a_correction_of_the_robots_place_ends_no_track(
    ros: Any, robot: Robot, tracker: UserTrackerNode
) -> None:
    robot.depth = person_picture(2.0)
    call(ros, robot, Trigger, "user_tracker_ni_node/Start", Trigger.Request())
    ros.spin_until(lambda: robot.users and robot.users[-1].num_users_tracked == 1, what="a tracked user")
    robot.map_from_odom = Pose2(4.0, 2.0, math.pi / 2)
    ros.spin_for(1.0)  # the frames between the two places are not looked at
    robot.users.clear()
    result = look(ros, robot, 15.0).result
    assert result.x == pytest.approx(4.0, abs=0.05), "told in the map frame as it is now"
    assert {tuple(users.user_ids_ni) for users in robot.users} == {(1,)}


def test_a_picture_waits_for_the_pose_it_was_taken_at(
    ros: Any, robot: Robot, tracker: UserTrackerNode
) -> None:
    robot.depth = person_picture(2.0)
    robot.frames_late = 1.2
    call(ros, robot, Trigger, "user_tracker_ni_node/Start", Trigger.Request())
    ros.spin_until(
        lambda: robot.users and robot.users[-1].num_users_tracked == 1, what="a user with late frames"
    )


def test_a_service_does_not_wait_behind_pictures(
    ros: Any, robot: Robot, tracker: UserTrackerNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot.depth = person_picture(2.0)
    call(ros, robot, Trigger, "user_tracker_ni_node/Start", Trigger.Request())
    ros.spin_until(lambda: robot.users, what="a picture that was looked at")
    stop = robot.create_client(Trigger, "user_tracker_ni_node/Stop")
    ros.spin_until(stop.service_is_ready, what="the service")
    robot.depth = None
    ros.spin_for(1.0)
    served: list[str] = []

    def detect(*_: object, **__: object) -> list[Detection]:
        served.append("a picture")
        return []

    monkeypatch.setattr(tracker_node, "detect_people", detect)
    now = robot.timebase.now()
    for number in range(5):  # as many as wait at most
        stamp = now - 0.5 + 0.1 * number
        robot.pictures.publish(depth_to_ros(DepthImage(stamp, FRAME, CAMERA, person_picture(2.0))))
    answer = stop.call_async(Trigger.Request())
    answer.add_done_callback(lambda _: served.append("the service"))
    ros.spin_until(answer.done, what="the answer")
    ros.spin_until(lambda: "the service" in served, what="the callback of the answer")
    assert served == ["a picture", "the service"]


def test_a_look_at_nobody_fails_in_time_and_leaves_the_tracker_as_it_was(
    ros: Any, robot: Robot, tracker: UserTrackerNode
) -> None:
    robot.depth = np.full((240, 320), 3.0, np.float32)
    while (result := look(ros, robot, 0.8)).result.error_code == NO_IMAGE:
        pass  # on a busy machine
    assert result.status == 6
    assert not result.result.found and result.result.error_code == NO_USER_SEEN
    assert result.result.pictures >= 5
    told = rf"no user seen within 0\.[678] s in {result.result.pictures} images"
    assert re.search(told, result.result.error_msg), "nothing was seen for 0.6 s, or the window was over"
    ros.spin_until(lambda: robot.pictures.get_subscription_count() == 0, what="the tracker to stop again")


def test_a_look_without_any_picture_ends_in_time_and_says_so(
    ros: Any, robot: Robot, tracker: UserTrackerNode
) -> None:
    result = look(ros, robot, 0.6)
    assert (result.status, result.result.error_code, result.result.pictures) == (6, NO_IMAGE, 0)
    assert "0 usable images within 0.6 s" in result.result.error_msg


def test_a_mission_is_told_that_there_was_no_image(ros: Any, robot: Robot, tracker: UserTrackerNode) -> None:
    look = make_skills(ros.add(FlorenceNode("missions")))["look_for_user"]
    run = look.start(LOOK_FOR_USER.complete({"window": 0.6}))
    result = ros.spin_until(run.poll, what="the end of the look")
    assert result.code == "no_image"
    assert result.code in LOOK_FOR_USER.failures
    assert "0 usable images within 0.6 s" in result.reason


def test_pictures_without_a_pose_are_not_usable(ros: Any, robot: Robot, tracker: UserTrackerNode) -> None:
    robot.depth = person_picture(2.0)
    robot.frames_late = 60.0
    result = look(ros, robot, 2.0).result
    assert (result.error_code, result.pictures) == (NO_IMAGE, 0)


def test_a_window_that_is_too_long_is_refused(ros: Any, robot: Robot, tracker: UserTrackerNode) -> None:
    refused = look(ros, robot, 100.0)
    assert (refused.status, refused.result.error_code) == (6, REFUSED)
    assert refused.result.error_msg.startswith("window: ")
    assert robot.pictures.get_subscription_count() == 0, "nothing has begun"


@pytest.mark.parametrize("window", [-1.0, math.nan])
def test_a_look_with_a_senseless_window_ends_with_the_reason(
    ros: Any, robot: Robot, tracker: UserTrackerNode, window: float
) -> None:
    end = look(ros, robot, window)
    assert end.status == 6
    assert end.result.error_msg == f"window is {window:g} (would have worked: 0 to 3600 s)"
    assert robot.pictures.get_subscription_count() == 0, "nothing has begun"


def test_a_look_can_be_cancelled(ros: Any, robot: Robot, tracker: UserTrackerNode) -> None:
    ros.spin_until(robot.look.server_is_ready)
    goal = robot.look.send_goal_async(LookForUser.Goal(window=15.0))
    ros.spin_until(goal.done)
    end = goal.result().get_result_async()
    goal.result().cancel_goal_async()
    ros.spin_until(end.done, what="the cancelled look")
    assert end.result().status == 5


def test_a_broken_picture_is_left_out(ros: Any, robot: Robot, tracker: UserTrackerNode) -> None:
    call(ros, robot, Trigger, "user_tracker_ni_node/Start", Trigger.Request())
    ros.spin_until(lambda: robot.pictures.get_subscription_count() == 1)
    for _ in range(5):
        robot.pictures.publish(Image(height=3, width=4, encoding="32FC1", step=16, data=[0] * 7))
        ros.spin_for(0.05)
    robot.depth = person_picture(2.0)
    ros.spin_until(
        lambda: robot.users and robot.users[-1].num_users_tracked == 1, what="a user after nonsense"
    )


# ---- approach -----------------------------------------------------------------------------------------


class Source:
    """A second source that always says the same."""

    def __init__(self, says: Verdict) -> None:
        self.says = says
        self.asked: list[tuple[ColourImage, Candidate]] = []

    def verdict(self, picture: ColourImage, candidate: Candidate) -> Verdict:
        self.asked.append((picture, candidate))
        return self.says


def track_with(ros: Any, robot: Robot, source: Source, *, pictures: bool = True, **parameters: Any) -> None:
    """Start a tracker that waits for a second source as long as it takes."""
    robot.depth = person_picture(2.0)
    robot.colour = np.full((480, 640, 3), 90, np.uint8) if pictures else None
    waits = {"opinion_s": 600.0, "colour_age_s": 60.0, "colour_period_s": 0.0, **parameters}
    ros.add(UserTrackerNode(parameters=waits, verifier=source))
    assert call(ros, robot, Trigger, "user_tracker_ni_node/Start", Trigger.Request()).success


def test_a_second_source_looks_at_the_candidate_and_confirms_it(ros: Any, robot: Robot) -> None:
    source = Source(Verdict.PERSON)
    track_with(ros, robot, source)
    ros.spin_until(lambda: robot.users and robot.users[-1].num_users_tracked == 1, what="a tracked user")
    picture, candidate = source.asked[0]
    assert picture.pixels.shape == (480, 640, 3)
    # 0.4 m wide and 1.72 m high, 2 m before a camera 0.54 m above the floor; the floor is out of view.
    assert candidate.region.left < 0.5 < candidate.region.right
    assert 0.1 < candidate.region.right - candidate.region.left < 0.3
    assert candidate.region.top < 0.1 and candidate.region.bottom > 0.6


def test_whom_the_second_source_denies_is_never_tracked(ros: Any, robot: Robot) -> None:
    source = Source(Verdict.NOBODY)
    track_with(ros, robot, source, rejections=2)
    ros.spin_until(lambda: len(source.asked) >= 4 and len(robot.users) >= 8, what="some looks")
    assert all(users.num_users_tracked == 0 for users in robot.users)


def test_without_colour_pictures_the_depth_decides_alone(ros: Any, robot: Robot) -> None:
    source = Source(Verdict.NOBODY)
    track_with(ros, robot, source, pictures=False, verdict_s=0.2)
    ros.spin_until(lambda: robot.users and robot.users[-1].num_users_tracked == 1, what="a tracked user")
    assert source.asked == []


def test_a_colour_detector_that_is_not_installed_is_named_at_the_start(
    ros: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    with pytest.raises(ColourNetworkUnusable, match="make colour, or colour_detector: false"):
        UserTrackerNode(parameters={"colour_detector": True})


class Caller(FlorenceNode):
    """Publishes what the approach listens to and hears its status."""

    def __init__(self) -> None:
        super().__init__("caller")
        self.words: list[str] = []
        self.costmap = self.create_publisher(OccupancyGridMsg, "global_costmap/costmap", LATCHED)
        self.states = self.create_publisher(RunState, "florence_bt/run_state", LATCHED)
        self.create_subscription(
            String, "approach_user/status", lambda message: self.words.append(message.data), RELIABLE
        )


@pytest.fixture
def caller(ros: Any) -> Caller:
    ros.add(ApproachNode())
    return ros.add(Caller())


@pytest.fixture
def propose(ros: Any, caller: Caller) -> Callable[..., Any]:
    def ask(**changes: Any) -> Any:
        fields = {"user_x": 3.0, "user_y": 2.0, "robot_x": 1.0, "robot_y": 2.0, "trial": 1, **changes}
        return call(ros, caller, ProposeApproach, "approach_user/propose", ProposeApproach.Request(**fields))

    return ask


def test_a_proposal_without_a_costmap_says_that_it_is_unchecked(propose: Callable[..., Any]) -> None:
    answer = propose()
    assert answer.valid
    assert (answer.x, answer.y, answer.phi) == pytest.approx((2.5, 2.0, 0.0), abs=1e-6)
    assert answer.message == UNCHECKED


def test_a_proposal_in_an_obstacle_is_refused(ros: Any, caller: Caller, propose: Callable[..., Any]) -> None:
    cells = np.zeros((80, 80), np.int8)
    cells[39:42, 49:52] = 99
    caller.costmap.publish(grid_to_ros(OccupancyGrid(0.05, Pose2(), cells), "map", 0.0))
    ros.spin_until(lambda: propose().message != UNCHECKED, what="the costmap")
    taken, free = propose(), propose(trial=2)
    assert not taken.valid and "cost 99" in taken.message
    assert free.valid and free.message == ""
    assert (free.x, free.y) == pytest.approx((2.646, 1.646), abs=1e-3) or free.y == pytest.approx(
        2.354, abs=1e-3
    )
    assert not propose(trial=7).valid
    assert not propose(safe_distance=9.0).valid
    assert not propose(user_x=math.nan).valid


def test_the_status_follows_the_missions(ros: Any, caller: Caller) -> None:
    ros.spin_until(lambda: caller.states.get_subscription_count() == 1)
    ros.spin_until(lambda: caller.count_publishers("approach_user/status") == 1)
    caller.states.publish(RunState(state="IDLE"))
    caller.states.publish(RunState(run_id="1", mission="goto_room", state="ACTIVE"))
    ros.spin_for(0.3)
    assert caller.words == []
    caller.states.publish(RunState(run_id="2", mission="goto_user", state="ACTIVE"))
    ros.spin_until(lambda: caller.words.count("ACTIVE") >= 3, what="ACTIVE again and again")
    caller.states.publish(RunState(run_id="2", mission="goto_user", state="SUCCEEDED"))
    ros.spin_until(lambda: caller.words.count("SUCCEEDED") == 6, what="the last word and five repeats")
    ros.spin_for(0.5)
    assert caller.words.count("SUCCEEDED") == 6
