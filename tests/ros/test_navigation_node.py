"""Map server, localiser and navigation over DDS, with a robot that is played in simulated time."""

from __future__ import annotations

import dataclasses
import math
import threading
from collections.abc import Callable, Iterator
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")
from action_msgs.msg import GoalStatus
from builtin_interfaces.msg import Duration
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from florence_interfaces.action import ApproachMe, FollowUser
from florence_interfaces.msg import StopReason
from geometry_msgs.msg import Point, PoseArray, PoseStamped, PoseWithCovarianceStamped, Twist
from nav2_msgs.action import (
    BackUp,
    ComputePathToPose,
    DriveOnHeading,
    FollowPath,
    NavigateThroughPoses,
    NavigateToPose,
    Spin,
    Wait,
)
from nav2_msgs.srv import (
    ClearCostmapAroundRobot,
    ClearCostmapExceptRegion,
    ClearEntireCostmap,
    LoadMap,
    SaveMap,
)
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from nav_msgs.msg import Odometry as OdometryMsg
from nav_msgs.msg import Path
from nav_msgs.srv import GetMap, GetPlan
from rclpy.action import ActionClient
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan as LaserScanMsg
from std_msgs.msg import Bool
from std_srvs.srv import Empty

from florence_bt.app.bringup.skills_ros import make_skills
from florence_bt.app.maps.save import save_published_map
from florence_bt.core.errors import ConfigError, DeviceTimeout
from florence_bt.core.geometry import STANDSTILL, Pose2, angle_difference
from florence_bt.core.outcome import Outcome, Result, success
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.core.skill import Skill
from florence_bt.ros import shared_clock
from florence_bt.ros.conversions import (
    duration_to_ros,
    grid_from_ros,
    grid_to_ros,
    odometry_to_ros,
    pose_from_ros,
    pose_stamped_to_ros,
    pose_with_covariance_to_ros,
    scan_to_ros,
    stamp_from_ros,
    stamp_to_ros,
    twist_from_ros,
)
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.open_goals import OpenGoals
from florence_bt.ros.qos import LATCHED, RELIABLE, SENSOR
from florence_bt.ros.tf import StaticTransformBroadcaster, TransformBroadcaster, TransformListener
from florence_bt.skills.navigation.localisation.node import LocaliserNode
from florence_bt.skills.navigation.localisation.saved_pose import load_pose, save_pose
from florence_bt.skills.navigation.map_server import map_file as map_file_module
from florence_bt.skills.navigation.map_server.map_file import load_map
from florence_bt.skills.navigation.map_server.map_writer import save_map
from florence_bt.skills.navigation.map_server.node import MapServerNode
from florence_bt.skills.navigation.navigate import navigation as navigation_module
from florence_bt.skills.navigation.navigate.navigation import OVERRIDDEN
from florence_bt.skills.navigation.navigate.navigator import Navigator
from florence_bt.skills.navigation.navigate.node import NavigationNode
from florence_bt.skills.navigation.navigate.parameters import REPLACED_PARAMETERS, NavigatorParameters
from florence_bt.skills.navigation.navigate.results import SERVER_CODES
from florence_bt.trees.language.declarations import own_declarations
from tests.unit.skills.navigation_world import UPSIDE_DOWN_LASER, WALLS, World, make_map

pytestmark = pytest.mark.ros

SIMULATED = {"use_sim_time": True}
START = Pose2(1.0, 2.4, 0.0)


class Robot(FlorenceNode):
    """Plays the base and the laser, and hears what navigation says."""

    def __init__(self) -> None:
        super().__init__("robot", parameters=SIMULATED)
        self.world = World(START, seed=2)
        self.world.now = 100.0
        self.commands: list[Twist] = []
        self.clock = self.create_publisher(Clock, "/clock", RELIABLE)
        self.odom = self.create_publisher(OdometryMsg, "odom", RELIABLE)
        self.scan = self.create_publisher(LaserScanMsg, "scan", SENSOR)
        self.filtered = self.create_publisher(LaserScanMsg, "filtered_scan", SENSOR)
        self.create_subscription(Twist, "cmd_vel", self.on_command, RELIABLE)
        StaticTransformBroadcaster(self).send([("base_footprint", "laser", UPSIDE_DOWN_LASER)])
        self.frames = TransformListener(self)
        self.broadcaster = TransformBroadcaster(self)

    def on_command(self, message: Twist) -> None:
        self.commands.append(message)
        self.world.command = twist_from_ros(message)

    def tell_pose(self) -> None:
        world = self.world
        self.odom.publish(odometry_to_ros(world.odometry(), "odom", "base_footprint"))
        self.broadcaster.send("odom", "base_footprint", self.time_of(world.now), world.odom)

    def tell_scan(self) -> None:
        scan = self.world.scan()
        raw = np.where(scan.ranges >= scan.range_max - 1e-3, np.inf, scan.ranges).astype(np.float32)
        self.scan.publish(scan_to_ros(dataclasses.replace(scan, ranges=raw)))
        self.filtered.publish(scan_to_ros(scan))

    def tell_time(self) -> None:
        self.clock.publish(Clock(clock=stamp_to_ros(self.world.now)))


class Reader:
    """A subscription of a node under test, and the stamp of what it was given last."""

    def __init__(self, subscription: Any) -> None:
        self.topic = subscription.topic_name
        self.stamp = -math.inf
        self._type = subscription.msg_type
        self._callback = subscription.callback
        subscription.callback = self._take

    def _take(self, message: Any) -> None:
        plain = deserialize_message(message, self._type) if isinstance(message, bytes) else message
        for part in getattr(plain, "transforms", [plain]):
            if getattr(part, "child_frame_id", "base_footprint") == "base_footprint":
                self.stamp = max(self.stamp, stamp_from_ros(part.header.stamp))
        self._callback(message)


class Scene:
    """Everything together. Simulated time goes on when everybody has what was said and has done its work."""

    def __init__(self, ros: Any, map_file: FilePath) -> None:
        self.ros = ros
        self.map_file = map_file
        self.robot = ros.add(Robot())
        self.client = ros.add(FlorenceNode("client"))
        self.poses = ActionClient(self.client, NavigateToPose, "navigate_to_pose")
        self.spins = ActionClient(self.client, Spin, "spin")
        # Later than the loop lets go of the node: what it has noticed of a destroyed client ends the process.
        self.client.on_destroy(self.poses.destroy)
        self.client.on_destroy(self.spins.destroy)
        self.driven: list[FlorenceNode] = []
        self.readers: list[Reader] = []
        self.commands_sent = 0
        self.laser_works = True

    def add(self, node: Any) -> Any:
        """Serve a node under test."""
        self.ros.add(node)
        self.driven.append(node)
        topics = ("/odom", "/tf", "/scan", "/filtered_scan")
        self.readers += [Reader(part) for part in node.subscriptions if part.topic_name in topics]
        return node

    def meet(self) -> None:
        """Let discovery tell everybody of everybody: until each reader was given something."""
        for _ in range(2000):
            if all(reader.stamp > 0.0 for reader in self.readers):
                return
            self.robot.world.advance(0.01)
            self.robot.tell_pose()
            self.robot.tell_scan()
            self.robot.tell_time()
            self.ros.spin_for(0.05)
        pytest.fail(f"reached nobody: {[reader.topic for reader in self.readers if reader.stamp < 0.0]}")

    def play(self) -> None:
        """Let 0.1 s pass."""
        for seconds, scanning in ((0.06, False), (0.04, self.laser_works)):
            self.robot.world.advance(seconds)
            self.robot.tell_pose()
            if scanning:
                self.robot.tell_scan()
            self.ros.spin_until(lambda scanning=scanning: self._was_told(scanning), what="what was published")
            due = [self._when_time_has_come(node) for node in self.driven]
            self.robot.tell_time()
            self.ros.spin_until(lambda due=due: all(due_here for (due_here,) in due), what="the time")
            self.ros.spin_until(lambda: len(self.robot.commands) == self.commands_sent, what="the commands")

    def _was_told(self, scanning: bool) -> bool:
        now = self.robot.world.now - 1e-6
        return all(
            reader.stamp > now for reader in self.readers if scanning or not reader.topic.endswith("scan")
        )

    def _when_time_has_come(self, node: FlorenceNode) -> list[bool]:
        """A flag that is set when a node has done all that was to be done until now."""
        flag = [False]

        def come() -> None:
            flag[0] = True

        # A hair earlier: the message on /clock has whole nanoseconds.
        node.timebase.call_at(node.time_of(self.robot.world.now) - 1e-6, come)
        return flag

    def jump(self, seconds: float) -> None:
        """Set the clock, and have everybody know it."""
        self.robot.world.now += seconds

        def known() -> bool:
            self.robot.tell_time()
            nodes = (self.robot, *self.driven)
            return all(node.stamp() == pytest.approx(self.robot.world.now) for node in nodes)

        self.ros.spin_until(known, what="the other time")
        for reader in self.readers:
            reader.stamp = -math.inf

    def play_until(self, condition: Callable[[], Any], limit_s: float = 40.0) -> Any:
        """Play the robot until a condition holds; the limit is in simulated seconds."""
        for _ in range(round(limit_s * 10)):
            value = condition()
            if value:
                return value
            self.play()
        pytest.fail(f"did not come true within {limit_s} s of simulated time")

    def add_navigation(self, *, localised: bool = True) -> None:
        self.add(MapServerNode(parameters={"map_file": str(self.map_file), **SIMULATED}))
        initial = {"initial_x": START.x + 0.1, "initial_y": START.y, "initial_yaw": 0.05}
        if localised:
            self.add(LocaliserNode(parameters={**initial, **SIMULATED}))
        self.navigation = self.add(NavigationNode(parameters=SIMULATED))
        (velocity,) = (part for part in self.navigation.publishers if part.topic_name == "/cmd_vel")
        publish = velocity.publish

        def count_and_publish(message: Twist) -> None:
            self.commands_sent += 1
            publish(message)

        velocity.publish = count_and_publish
        self.ros.spin_until(lambda: self.poses.server_is_ready() and self.spins.server_is_ready())
        self.ros.spin_until(
            lambda: self.navigation.navigation.navigator and velocity.get_subscription_count()
        )
        self.meet()
        if localised:
            self.play_until(self.is_located)

    def send(self, client: ActionClient, goal: Any, **options: Any) -> Any:
        """Send a goal; the time stands still until it is answered."""
        future = client.send_goal_async(goal, **options)
        self.ros.spin_until(future.done, what="the answer to the goal")
        return future.result()

    def result_of(self, handle: Any) -> Any:
        future = handle.get_result_async()
        self.play_until(future.done, 60.0)
        return future.result()

    def is_located(self) -> bool:
        """Whether both transforms that make the robot's pose in the map were heard."""
        return {"odom", "base_footprint"} <= set(self.robot.frames.buffer.frames())

    def estimate(self) -> Pose2:
        return self.robot.frames.buffer.lookup_pose("map", "base_footprint")


def to(pose: Pose2, frame: str = "map") -> NavigateToPose.Goal:
    return NavigateToPose.Goal(pose=pose_stamped_to_ros(pose, frame, 0.0))


@pytest.fixture
def map_file(tmp_path: FilePath) -> FilePath:
    save_map(make_map(), tmp_path / "rooms.yaml")
    return tmp_path / "rooms.yaml"


@pytest.fixture
def scene(ros: Any, map_file: FilePath) -> Scene:
    return Scene(ros, map_file)


def test_the_map_is_latched_and_served(ros: Any, map_file: FilePath) -> None:
    ros.add(MapServerNode(parameters={"map_file": str(map_file)}))
    client = ros.add(FlorenceNode("client"))
    maps: list[OccupancyGridMsg] = []
    client.create_subscription(OccupancyGridMsg, "map", maps.append, LATCHED)
    service = client.create_client(GetMap, "static_map")
    ros.spin_until(lambda: maps and service.service_is_ready())
    future = service.call_async(GetMap.Request())
    ros.spin_until(future.done)
    for message in (maps[0], future.result().map):
        assert message.header.frame_id == "map"
        assert np.array_equal(grid_from_ros(message).cells, load_map(map_file).cells)


def test_maps_are_loaded_and_saved_by_service(ros: Any, map_file: FilePath, tmp_path: FilePath) -> None:
    (saved := tmp_path / "saved").mkdir()
    parameters = {"map_file": str(map_file), "save_map_timeout": 30.0, "save_folder": str(saved)}
    server = ros.add(MapServerNode(parameters=parameters))
    client = ros.add(FlorenceNode("client"))
    maps: list[OccupancyGridMsg] = []
    client.create_subscription(OccupancyGridMsg, "map", maps.append, LATCHED)
    loader = client.create_client(LoadMap, "map_server/load_map")
    saver = client.create_client(SaveMap, "map_saver/save_map")
    ros.spin_until(lambda: maps and loader.service_is_ready() and saver.service_is_ready())

    def ask(service: Any, **request: Any) -> Any:
        future = service.call_async(service.srv_type.Request(**request))
        ros.spin_until(future.done)
        return future.result()

    other = OccupancyGrid(0.1, Pose2(3.0, 4.0), np.full((20, 30), 100, np.int8))
    save_map(other, tmp_path / "other.yaml")
    (tmp_path / "bad.yaml").write_text("image: other.pgm\nresolution: 0\norigin: [0, 0, 0]\n")
    (tmp_path / "empty.pgm").write_bytes(b"P5\n3 2\n255\n")
    good = (tmp_path / "other.yaml").read_text()
    (tmp_path / "cut.yaml").write_text(good.replace("other.pgm", "empty.pgm"))
    for url, result in (
        ("other.yaml", LoadMap.Response.RESULT_MAP_DOES_NOT_EXIST),
        (f"{tmp_path}/none.yaml", LoadMap.Response.RESULT_MAP_DOES_NOT_EXIST),
        (f"{tmp_path}/bad.yaml", LoadMap.Response.RESULT_INVALID_MAP_METADATA),
        (f"{tmp_path}/cut.yaml", LoadMap.Response.RESULT_INVALID_MAP_DATA),
        (f"{tmp_path}/{'x' * 65_536}.yaml", LoadMap.Response.RESULT_MAP_DOES_NOT_EXIST),
    ):
        assert ask(loader, map_url=url).result == result
    assert len(maps) == 1
    answer = ask(loader, map_url=f"file://{tmp_path}/other.yaml")
    assert (answer.result, answer.map.info.width) == (LoadMap.Response.RESULT_SUCCESS, 30)
    ros.spin_until(lambda: len(maps) == 2)
    assert grid_from_ros(maps[1]).origin == other.origin

    for name in ("own", "deeper/own"):
        assert ask(saver, map_url=str(saved / f"{name}.yaml"), image_format="png").result
        assert np.array_equal(load_map(saved / f"{name}.yaml").cells, other.cells)
    assert ask(saver, map_url="relative").result
    assert (saved / "relative.yaml").is_file()
    (saved / "out").symlink_to(tmp_path)
    for wrong in (
        {"map_url": f"{tmp_path}/x.yaml"},
        {"map_url": "../x.yaml"},
        {"map_url": "out/x.yaml"},
        {"map_url": ""},
        {"map_url": f"{saved}/{'x' * 65_536}"},
        {"map_url": f"{saved}/x.yaml", "image_format": "gif"},
        {"map_url": f"{saved}/x.yaml", "map_topic": "nobody/publishes this"},
    ):
        assert not ask(saver, **wrong).result, wrong
    assert not [*tmp_path.glob("**/x.*")]
    publisher = client.create_publisher(OccupancyGridMsg, "explored", LATCHED)
    ros.spin_until(
        lambda: ("/explored", ["nav_msgs/msg/OccupancyGrid"]) in server.get_topic_names_and_types()
    )
    publisher.publish(grid_to_ros(make_map(), "map", client.timebase.now()))
    assert ask(saver, map_url="explored.yaml", map_topic="explored").result
    assert np.array_equal(load_map(saved / "explored.yaml").cells, make_map().cells)


def test_a_disk_that_hangs_holds_nobody_up_and_further_requests_are_refused(
    ros: Any, map_file: FilePath, monkeypatch: pytest.MonkeyPatch
) -> None:
    may_go_on, hangs = threading.Event(), threading.Event()

    def slow(path: FilePath, *rest: Any) -> Any:
        hangs.set()
        may_go_on.wait(60.0)
        return map_file_module.read_description(path, *rest)

    ros.add(MapServerNode(parameters={"map_file": str(map_file)}))
    monkeypatch.setattr("florence_bt.skills.navigation.map_server.node.read_description", slow)
    client = ros.add(FlorenceNode("client"))
    loader = client.create_client(LoadMap, "map_server/load_map")
    getter = client.create_client(GetMap, "static_map")
    ros.spin_until(lambda: loader.service_is_ready() and getter.service_is_ready())
    first = loader.call_async(LoadMap.Request(map_url=str(map_file)))
    ros.spin_until(hangs.is_set)
    second, served = (
        loader.call_async(LoadMap.Request(map_url=str(map_file))),
        getter.call_async(GetMap.Request()),
    )
    ros.spin_until(lambda: second.done() and served.done())
    assert not first.done()
    assert second.result().result != LoadMap.Response.RESULT_SUCCESS
    may_go_on.set()
    ros.spin_until(first.done)
    assert first.result().result == LoadMap.Response.RESULT_SUCCESS


def test_a_map_that_is_swapped_ends_the_drive_and_the_next_one_uses_it(
    scene: Scene, tmp_path: FilePath
) -> None:
    cupboard = (5.0, 2.0, 5.6, 2.8)
    save_map(make_map((*WALLS, cupboard)), tmp_path / "other.yaml")
    loader = scene.client.create_client(LoadMap, "map_server/load_map")
    scene.add_navigation()
    goal = Pose2(7.0, 2.4, 0.0)
    handle = scene.send(scene.poses, to(goal))
    scene.play_until(lambda: scene.robot.world.pose.x > 2.0)
    answer = loader.call_async(LoadMap.Request(map_url=f"{tmp_path}/other.yaml"))
    scene.ros.spin_until(answer.done, what="the map server's answer")
    assert answer.result().result == LoadMap.Response.RESULT_SUCCESS
    ended = scene.result_of(handle)
    assert ended.status == GoalStatus.STATUS_ABORTED
    assert "the map was replaced" in ended.result.error_msg
    scene.play_until(lambda: scene.robot.world.twist == STANDSTILL)
    scene.robot.world.boxes.append(cupboard)
    assert scene.result_of(scene.send(scene.poses, to(goal))).status == GoalStatus.STATUS_SUCCEEDED
    assert scene.robot.world.pose.distance_to(goal) < 0.15
    assert scene.robot.world.hits == 0


@pytest.fixture
def slow_map(monkeypatch: pytest.MonkeyPatch) -> Iterator[threading.Event]:
    """Costmaps are made only after this was set."""
    may_be_made = threading.Event()

    def make_late(*arguments: Any) -> Navigator:
        may_be_made.wait(60.0)
        return Navigator(*arguments)

    monkeypatch.setattr(navigation_module, "Navigator", make_late)
    yield may_be_made
    may_be_made.set()


def test_goals_are_accepted_while_the_costmaps_are_made_and_begin_then(
    scene: Scene, slow_map: threading.Event
) -> None:
    plans = ActionClient(scene.client, ComputePathToPose, "compute_path_to_pose")
    scene.client.on_destroy(plans.destroy)
    slow_map.set()
    scene.add_navigation()
    slow_map.clear()
    maps = scene.client.create_publisher(OccupancyGridMsg, "map", LATCHED)
    scene.ros.spin_until(lambda: maps.get_subscription_count() >= 2 and plans.server_is_ready())
    maps.publish(grid_to_ros(make_map(), "map", 0.0))
    scene.ros.spin_until(lambda: scene.navigation.navigation.makes_costmaps, what="the map")
    given_up = scene.send(scene.poses, to(Pose2(3.0, 3.4)))
    end = given_up.get_result_async()
    cancelling = given_up.cancel_goal_async()
    scene.ros.spin_until(lambda: cancelling.done() and end.done(), what="the end of the cancelled goal")
    assert end.result().status == GoalStatus.STATUS_CANCELED
    goal = Pose2(2.0, 2.4, 0.0)
    plan = scene.send(plans, ComputePathToPose.Goal(goal=to(goal).pose))
    planned = plan.get_result_async()
    handle = scene.send(scene.poses, to(goal))
    assert handle.accepted and not planned.done()
    assert not scene.robot.commands or scene.robot.commands[-1].linear.x == 0.0
    slow_map.set()
    assert scene.result_of(handle).status == GoalStatus.STATUS_SUCCEEDED
    assert planned.done() and planned.result().result.path.poses
    assert scene.robot.world.pose.distance_to(goal) < 0.15


def test_parameters_that_would_do_nothing_are_refused_with_what_to_use(ros: Any) -> None:
    node = ros.add(NavigationNode(parameters={"escape_reset_dist": 0.1, **SIMULATED}))
    assert "back_up_distance" in str(node.unknown_parameters())
    other = ros.add(NavigationNode(parameters={"scan.marking": False, **SIMULATED}))
    assert other.unknown_parameters() is None
    costmap = NavigatorParameters.read(other.read_parameters).costmap
    assert not costmap.scan.marking and costmap.depth.marking
    assert not any(other.has_parameter(name) for name in REPLACED_PARAMETERS)


def test_the_command_saves_the_map_of_the_system(
    ros: Any, map_file: FilePath, tmp_path: FilePath, start_process: Any
) -> None:
    ros.add(MapServerNode(parameters={"map_file": str(map_file)}))
    save = start_process("-m", "florence_bt.cli", "map", "save", tmp_path / "home", "--wait", "60")
    ros.spin_until(lambda: save.process.poll() is not None, what="the command")
    assert save.process.returncode == 0
    assert np.array_equal(load_map(tmp_path / "home.yaml").cells, make_map().cells)


def test_the_command_says_why_it_saves_nothing(tmp_path: FilePath, ros_domain: int) -> None:
    (tmp_path / "home.pgm").write_text("")
    options = {"topic": "map", "mode": "trinary", "form": "pgm", "overwrite": False, "patience_s": 0.1}
    with pytest.raises(ConfigError, match=r"home\.pgm.*would have worked: another name, --overwrite"):
        save_published_map(tmp_path / "home", **options)  # type: ignore[arg-type]
    with pytest.raises(DeviceTimeout, match="no map came on the topic 'map'"):
        save_published_map(tmp_path / "other", **options)  # type: ignore[arg-type]


def test_a_drive_with_everything_around_it(scene: Scene) -> None:
    scene.add_navigation()
    heard: dict[str, list[Any]] = {}
    for kind, topic, quality in (
        (Path, "plan", RELIABLE),
        (OccupancyGridMsg, "global_costmap/costmap", RELIABLE),
        (OccupancyGridMsg, "local_costmap/costmap", RELIABLE),
        (PoseWithCovarianceStamped, "amcl_pose", LATCHED),
        (PoseArray, "particle_cloud", RELIABLE),
        (PoseStamped, "navigate/current_goal", LATCHED),
    ):
        scene.client.create_subscription(kind, topic, heard.setdefault(topic, []).append, quality)
    feedback: list[Any] = []
    goal = Pose2(2.2, 2.6, 1.2)
    handle = scene.send(scene.poses, to(goal), feedback_callback=feedback.append)
    assert handle.accepted
    answer = scene.result_of(handle)
    assert (answer.status, answer.result.error_code) == (4, 0)
    world = scene.robot.world
    assert world.hits == 0
    assert world.pose.distance_to(goal) < 0.06
    assert abs(angle_difference(world.pose.yaw, goal.yaw)) < 0.1
    last = scene.robot.commands[-1]
    assert (last.linear.x, last.angular.z) == (0.0, 0.0)
    scene.play_until(lambda: all(heard.values()), 5.0)
    assert pose_from_ros(heard["navigate/current_goal"][0].pose).distance_to(goal) < 1e-6
    # The first one can come before the way is known; it says 0 then.
    distances = [message.feedback.distance_remaining for message in feedback]
    assert distances[-1] < 0.2 < max(distances)
    assert feedback[-1].feedback.current_pose.header.frame_id == "map"
    # Nothing more is said while nothing is to be done.
    count = len(scene.robot.commands)
    end = world.now + 1.0
    scene.play_until(lambda: world.now > end)
    assert len(scene.robot.commands) == count


def test_the_way_and_the_goal_of_a_drive_go_with_it(scene: Scene) -> None:
    scene.add_navigation()
    ways: list[Path] = []
    goals: list[PoseStamped] = []
    scene.client.create_subscription(Path, "plan", ways.append, RELIABLE)
    scene.client.create_subscription(PoseStamped, "navigate/current_goal", goals.append, LATCHED)
    override = scene.client.create_publisher(Bool, "manual_override", LATCHED)
    stops = scene.client.create_publisher(StopReason, "turtlebot_node/stop_reason", LATCHED)

    def shown() -> list[bool]:
        return [bool(ways and ways[-1].poses), bool(goals and goals[-1].header.frame_id)]

    def drive(x: float) -> Any:
        handle = scene.send(scene.poses, to(Pose2(x, 2.4)))
        scene.play_until(lambda: shown() == [True, True])
        return handle

    def is_over() -> bool:
        return shown() == [False, False]

    handle = drive(3.0)
    handle.cancel_goal_async()
    scene.play_until(is_over)
    drive(3.0)
    scene.send(scene.spins, Spin.Goal(target_yaw=0.1, time_allowance=duration_to_ros(9.0)))
    scene.play_until(is_over)
    drive(3.0)
    stops.publish(StopReason(code="wheel_drop", text="a wheel hangs in the air"))
    scene.play_until(is_over)
    stops.publish(StopReason())
    drive(3.0)
    override.publish(Bool(data=True))
    scene.play_until(is_over)
    override.publish(Bool(data=False))
    scene.play_until(lambda: not scene.navigation.navigation._overridden)
    assert scene.result_of(drive(scene.robot.world.pose.x + 0.3)).status == 4
    scene.play_until(is_over)
    drive(3.0)
    scene.ros.close_node(scene.navigation)
    scene.ros.spin_until(is_over, what="the last word of a node that ends")


def test_who_looks_later_sees_the_way_of_the_drive(scene: Scene) -> None:
    scene.add_navigation()
    first: list[Path] = []
    scene.client.create_subscription(Path, "plan", first.append, RELIABLE)
    scene.send(scene.poses, to(Pose2(3.0, 2.4)))
    scene.play_until(lambda: first)
    later: list[Path] = []
    scene.ros.add(FlorenceNode("later")).create_subscription(Path, "plan", later.append, RELIABLE)
    scene.play_until(lambda: later and later[-1].poses)


def test_bad_goals(scene: Scene) -> None:
    scene.add_navigation()
    tilted = to(Pose2(2.0, 2.4))
    tilted.pose.pose.orientation.x = 0.5
    for goal, code in (
        (to(Pose2(99.0, 0.0)), 204),
        (to(Pose2(4.05, 1.0)), 206),
        (to(Pose2(8.35, 2.0)), 204),
        (to(Pose2(math.nan, 0.0)), 200),
        (tilted, 200),
        (to(Pose2(1.0, 0.0), "moon"), 202),
    ):
        answer = scene.result_of(scene.send(scene.poses, goal))
        assert (answer.status, answer.result.error_code) == (6, code)
        assert answer.result.error_msg
    assert all((command.linear.x, command.angular.z) == (0.0, 0.0) for command in scene.robot.commands)


def test_what_the_base_says_is_the_failure_of_the_drive_and_of_the_turn(scene: Scene) -> None:
    scene.add_navigation()
    publisher = scene.client.create_publisher(StopReason, "turtlebot_node/stop_reason", LATCHED)
    scene.ros.spin_until(publisher.get_subscription_count)
    handle = scene.send(scene.poses, to(Pose2(3.0, 2.4)))
    scene.play_until(lambda: scene.robot.world.twist.linear > 0.2)
    dropped = "the left wheel hangs in the air: put the base on the floor"
    publisher.publish(StopReason(code="wheel_drop", text=dropped))
    for answer in (
        scene.result_of(handle),
        scene.result_of(
            scene.send(scene.spins, Spin.Goal(target_yaw=0.8, time_allowance=duration_to_ros(9.0)))
        ),
    ):
        assert (answer.status, answer.result.error_code) == (6, SERVER_CODES["wheel_drop"])
        assert answer.result.error_msg == dropped
    publisher.publish(StopReason())
    scene.ros.spin_until(lambda: not scene.navigation.navigation._base_stop.code)
    assert scene.result_of(scene.send(scene.poses, to(Pose2(2.0, 2.4)))).status == 4


def test_every_motion_of_nav2(scene: Scene) -> None:
    scene.add_navigation()
    world = scene.robot.world

    def do(kind: Any, name: str, **goal: Any) -> tuple[Any, list[Any]]:
        heard: list[Any] = []
        client = ActionClient(scene.client, kind, name)
        scene.client.on_destroy(client.destroy)
        handle = scene.send(
            client, kind.Goal(**goal), feedback_callback=lambda one: heard.append(one.feedback)
        )
        return scene.result_of(handle), heard

    def stamped(*poses: Pose2) -> list[PoseStamped]:
        return [pose_stamped_to_ros(pose, "map", 0.0) for pose in poses]

    allowance = duration_to_ros(20.0)
    answer, heard = do(BackUp, "backup", target=Point(x=0.3), speed=0.1, time_allowance=allowance)
    assert (answer.status, answer.result.error_code) == (4, 0)
    assert world.pose.x == pytest.approx(START.x - 0.3, abs=0.04)
    assert answer.result.total_elapsed_time.sec >= 2
    assert 0.1 < heard[-1].distance_traveled < 0.32
    answer, _ = do(
        DriveOnHeading, "drive_on_heading", target=Point(x=0.3), speed=0.2, time_allowance=allowance
    )
    assert (answer.status, world.pose.x) == (4, pytest.approx(START.x, abs=0.06))
    for kind, name, goal, number in (
        (BackUp, "backup", {"target": Point(x=0.3, y=0.1), "speed": 0.1}, 713),
        (BackUp, "backup", {"target": Point(x=0.3), "speed": 0.0}, 713),
        (DriveOnHeading, "drive_on_heading", {"target": Point(x=0.3), "speed": -0.1}, 724),
        (DriveOnHeading, "drive_on_heading", {"target": Point(x=9.0), "speed": 0.4}, 723),
        (NavigateThroughPoses, "navigate_through_poses", {"poses": []}, 309),
        (NavigateThroughPoses, "navigate_through_poses", {"poses": stamped(START, Pose2(99.0))}, 304),
        (FollowPath, "follow_path", {}, 103),
    ):
        answer, _ = do(kind, name, **goal)
        assert (answer.status, answer.result.error_code) == (6, number)
        assert answer.result.error_msg
    answer, heard = do(Wait, "wait", time=duration_to_ros(1.5))
    assert (answer.status, answer.result.total_elapsed_time.sec) == (4, 1)
    left = [one.time_left.sec + 1e-9 * one.time_left.nanosec for one in heard]
    assert left == pytest.approx([1.5, 1.0, 0.5], abs=0.11)

    answer, _ = do(ComputePathToPose, "compute_path_to_pose", goal=stamped(Pose2(1.5, 1.0, 1.0))[0])
    path = answer.result.path
    assert (answer.status, answer.result.error_code, path.header.frame_id) == (4, 0, "map")
    assert pose_from_ros(path.poses[-1].pose).distance_to(Pose2(1.5, 1.0)) < 1e-6
    outside = {"start": stamped(Pose2(99.0))[0], "use_start": True, "goal": stamped(START)[0]}
    answer, _ = do(ComputePathToPose, "compute_path_to_pose", **outside)
    assert (answer.status, answer.result.error_code) == (6, 203)

    answer, heard = do(FollowPath, "follow_path", path=path)
    assert (answer.status, answer.result.error_code) == (4, 0)
    assert world.pose.distance_to(Pose2(1.5, 1.0)) < 0.08
    assert max(one.distance_to_goal for one in heard) > 1.0 and max(one.speed for one in heard) > 0.1
    ways = stamped(Pose2(2.4, 1.2), Pose2(2.4, 2.8, 1.5))
    answer, heard = do(NavigateThroughPoses, "navigate_through_poses", poses=ways)
    assert (answer.status, answer.result.error_code, world.hits) == (4, 0, 0)
    assert {one.number_of_poses_remaining for one in heard} == {1, 2}
    assert heard[-1].estimated_time_remaining.sec < heard[2].estimated_time_remaining.sec


def test_plans_and_costmaps_by_service(scene: Scene) -> None:
    scene.add_navigation()

    def ask(kind: Any, name: str, **request: Any) -> Any:
        client = scene.client.create_client(kind, name)
        scene.ros.spin_until(client.service_is_ready)
        future = client.call_async(kind.Request(**request))
        scene.ros.spin_until(future.done)
        return future.result()

    def marked(which: str) -> int:
        costmap = scene.navigation.navigation._costmap(which)
        return sum(int((layer == 254).sum()) for layer in costmap._layers.values())

    def pose(*numbers: float) -> PoseStamped:
        return pose_stamped_to_ros(Pose2(*numbers), "map", 0.0)

    blocked = pose(4.05, 1.0)
    assert not ask(GetPlan, "navigate/make_plan", start=pose(1.0, 1.0), goal=blocked).plan.poses
    plan = ask(GetPlan, "navigate/make_plan", start=pose(1.0, 1.0), goal=blocked, tolerance=0.5).plan
    assert len(plan.poses) > 20
    for which in ("global", "local"):
        everything = marked(which)
        assert everything
        ask(ClearCostmapAroundRobot, f"{which}_costmap/clear_around_{which}_costmap", reset_distance=4.9)
        around = marked(which)
        assert around < everything
        ask(ClearCostmapExceptRegion, f"{which}_costmap/clear_except_{which}_costmap", reset_distance=5.0)
        assert marked(which) <= around
        ask(ClearEntireCostmap, f"{which}_costmap/clear_entirely_{which}_costmap")
        assert not marked(which)
    costmap = scene.navigation.navigation._costmap("global")
    costmap._static[:] = 255
    ask(Empty, "navigate/clear_unknown_space")
    free = np.argwhere(costmap._static == 0)
    half = 2.0 * costmap.footprint.circumscribed_radius / costmap.resolution
    robot = costmap.cell_of(START.x, START.y)
    assert len(free) and np.abs(free - robot).max() <= half + 1


def test_a_goal_in_another_frame_and_a_cancel(scene: Scene) -> None:
    scene.add_navigation()
    handle = scene.send(scene.poses, to(Pose2(1.5, 0.0), "base_footprint"))
    scene.play_until(lambda: scene.robot.world.twist.linear > 0.2)
    future = handle.cancel_goal_async()
    scene.ros.spin_until(future.done)
    answer = scene.result_of(handle)
    assert answer.status == 5
    last = scene.robot.commands[-1]
    assert (last.linear.x, last.angular.z) == (0.0, 0.0)


def test_a_speed_limit_holds_until_it_is_taken_back(scene: Scene) -> None:
    scene.add_navigation()
    skill = make_skills(scene.client)["set_speed_limit"]

    def set_limit(speed: float) -> None:
        run = skill.start({"speed": speed})
        scene.ros.spin_until(run.poll, what="the speed limit")
        assert run.poll() == success()
        scene.ros.spin_for(0.5)

    set_limit(0.15)
    handle = scene.send(scene.poses, to(Pose2(3.4, 2.4)))
    scene.play_until(lambda: scene.robot.world.pose.x > START.x + 0.5)
    assert max(command.linear.x for command in scene.robot.commands) == pytest.approx(0.15)
    set_limit(0.0)
    scene.play_until(lambda: scene.robot.world.twist.linear > 0.3)
    assert scene.result_of(handle).status == 4


def test_a_laser_that_falls_silent_stops_the_robot_and_a_short_gap_only_pauses_it(scene: Scene) -> None:
    scene.add_navigation()
    handle = scene.send(scene.poses, to(Pose2(3.4, 2.4)))
    world = scene.robot.world
    scene.play_until(lambda: world.twist.linear > 0.3)
    silent_since, scene.laser_works = world.now, False
    scene.play_until(lambda: scene.robot.commands[-1] == Twist())
    # The velocity filter needs 0.18 s more to brake from full speed.
    assert world.now - silent_since < 0.3 + 1e-6
    scene.laser_works = True
    scene.play_until(lambda: world.twist.linear > 0.3)
    assert scene.result_of(handle).status == 4


def test_a_drive_goes_on_whatever_the_clock_does(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """An hour ahead for 0.4 s and back, two hours ahead, an hour back, a second back: it takes no longer."""
    monkeypatch.setattr(shared_clock, "JUMP_S", 0.0)  # nobody else tells the time
    scene.add_navigation()
    world, goal = scene.robot.world, Pose2(3.4, 2.4)
    begun, jumps = world.now, (3600.0, -3600.0, 7200.0, -3600.0, -1.0)
    handle = scene.send(scene.poses, to(goal))
    for jump in jumps:
        scene.play_until(lambda: world.twist.linear > 0.1, 5.0)
        scene.jump(jump)
        for _ in range(4):
            scene.play()
    assert scene.result_of(handle).status == GoalStatus.STATUS_SUCCEEDED
    assert world.pose.distance_to(goal) < 0.15 and world.hits == 0
    assert world.now - begun - sum(jumps) < 25.0
    assert scene.estimate().distance_to(world.pose) < 0.1, "it still knows where it is"


def test_one_goal_at_a_time_on_the_base(scene: Scene) -> None:
    scene.add_navigation()
    first = scene.send(scene.poses, to(Pose2(3.0, 2.4)))
    scene.play_until(lambda: scene.robot.world.twist.linear > 0.1)
    before = scene.robot.world.pose.yaw
    spin = Spin.Goal(target_yaw=0.8, time_allowance=duration_to_ros(9.0))
    second = scene.send(scene.spins, spin)
    replaced = scene.result_of(first)
    assert (replaced.status, replaced.result.error_msg) == (6, "preempted by a newer goal")
    answer = scene.result_of(second)
    assert (answer.status, answer.result.error_code) == (4, 0)
    assert answer.result.total_elapsed_time.sec >= 1
    assert abs(angle_difference(scene.robot.world.pose.yaw, before) - 0.8) < 0.12
    # And the other way round, by the topic for people.
    third = scene.send(scene.spins, Spin.Goal(target_yaw=3.0, time_allowance=duration_to_ros(20.0)))
    scene.play_until(lambda: abs(scene.robot.world.twist.angular) > 0.2)
    publisher = scene.client.create_publisher(PoseStamped, "goal_pose", RELIABLE)
    scene.ros.spin_until(lambda: publisher.get_subscription_count())
    publisher.publish(pose_stamped_to_ros(Pose2(1.6, 2.6, 0.0), "map", 0.0))
    assert scene.result_of(third).status == 6
    goal = Pose2(1.6, 2.6, 0.0)
    scene.play_until(
        lambda: scene.robot.world.pose.distance_to(goal) < 0.06 and scene.robot.world.twist.is_zero()
    )


def test_a_person_is_followed_by_the_frames_of_the_user_tracker(scene: Scene) -> None:
    scene.add_navigation()
    robot, person, said = scene.robot, Pose2(2.9, 2.4), []
    follows = ActionClient(scene.client, FollowUser, "follow_user")
    scene.client.on_destroy(follows.destroy)
    scene.ros.spin_until(follows.server_is_ready, what="the action")

    def near() -> bool:
        robot.broadcaster.send("map", "user_7", robot.world.now, person)
        return robot.world.pose.distance_to(person) < 0.9 and robot.world.twist.is_zero()

    wanted = FollowUser.Goal(user_id=7, distance=0.8)
    handle = scene.send(follows, wanted, feedback_callback=lambda message: said.append(message.feedback))
    scene.play_until(near)
    assert robot.world.pose.distance_to(person) == pytest.approx(0.8, abs=0.12)
    assert (said[-1].x, said[-1].y, said[-1].text) == (
        pytest.approx(0.8, abs=0.15),
        pytest.approx(0.0, abs=0.15),
        "following",
    )
    handle.cancel_goal_async()
    answer = scene.result_of(handle)
    assert answer.status == 5
    assert answer.result.x == pytest.approx(0.8, abs=0.15)
    bad = scene.result_of(scene.send(follows, FollowUser.Goal(user_id=7, distance=-1.0)))
    assert (bad.status, bad.result.error_code) == (6, SERVER_CODES["bad_input"])
    nobody = scene.result_of(scene.send(follows, FollowUser.Goal(user_id=9)))
    assert (nobody.status, nobody.result.error_code) == (6, SERVER_CODES["user_lost"])
    assert robot.world.twist.is_zero()


def test_who_was_followed_and_lost_is_searched_for_until_they_are_seen(scene: Scene) -> None:
    scene.add_navigation()
    robot, person = scene.robot, Pose2(2.9, 2.4)
    skills = make_skills(scene.client)

    def seen() -> bool:
        robot.broadcaster.send("map", "user_7", robot.world.now, person)
        return bool(robot.world.twist.linear > 0.1)

    follow = skills["follow_user"].start(own_declarations()["follow_user"].complete({"user_id": 7}))
    scene.play_until(seen)
    scene.play_until(follow.poll, 30.0)
    lost = follow.poll()
    assert lost is not None and lost.code == "user_lost"
    search = skills["search_for_user"].start(own_declarations()["search_for_user"].complete({"user_id": 7}))
    scene.play_until(lambda: abs(robot.world.twist.angular) > 0.1)
    assert search.poll() is None

    def found() -> Result | None:
        robot.broadcaster.send("map", "user_7", robot.world.now, person)
        return search.poll()

    scene.play_until(found)
    assert search.poll() == success()
    scene.play_until(lambda: robot.world.twist.is_zero())


def approached(scene: Scene, skill: Skill, **inputs: float) -> Result:
    """The result of the skill ``approach_person`` of the mission server."""
    run = skill.start(own_declarations()["approach_person"].complete(inputs))
    scene.play_until(run.poll, 80.0)
    result = run.poll()
    assert result is not None
    return result


def test_a_person_is_approached_without_a_place_in_the_map(scene: Scene) -> None:
    scene.add_navigation(localised=False)
    skill = make_skills(scene.client)["approach_person"]
    world = scene.robot.world
    world.boxes.append((2.54, 2.3, 2.66, 2.5))
    assert approached(scene, skill, x=1.6, y=0.0, p2r_orientation=math.pi / 2, distance=0.9) == success()
    # The person sees the robot come from -x; a quarter further round is -y.
    assert world.pose.distance_to(Pose2(2.6, 1.5)) < 0.1
    assert abs(angle_difference(world.pose.yaw, math.pi / 2)) < 0.1
    assert world.hits == 0
    nobody = approached(scene, skill, x=-1.0, y=1.5)
    assert (nobody.outcome, nobody.code) == (Outcome.FAILED, "user_lost")
    assert "for 5 s nobody was" in nobody.reason
    near = approached(scene, skill, x=1.0, distance=0.2)
    assert near.code == "bad_input" and "0.5 m and more" in near.reason
    scene.client.create_publisher(Bool, "manual_override", LATCHED).publish(Bool(data=True))
    scene.play_until(lambda: scene.navigation.navigation._overridden)
    refused = approached(scene, skill, x=1.0)
    assert (refused.code, refused.reason) == ("rejected", OVERRIDDEN)


def test_the_nearest_person_of_the_user_tracker_is_approached(scene: Scene) -> None:
    scene.add_navigation()
    robot, said = scene.robot, []
    approaches = ActionClient(scene.client, ApproachMe, "approach_person")
    scene.client.on_destroy(approaches.destroy)
    scene.ros.spin_until(approaches.server_is_ready, what="the action")
    people = {"user_7": Pose2(2.6, 2.4), "user_9": Pose2(3.6, 3.4)}

    def near() -> bool:
        for name, person in people.items():
            robot.broadcaster.send("map", name, robot.world.now, person)
        return robot.world.pose.distance_to(people["user_7"]) < 1.0

    handle = scene.send(
        approaches, ApproachMe.Goal(), feedback_callback=lambda message: said.append(message.feedback)
    )
    scene.play_until(near)
    assert (said[-1].x, said[-1].y) == (pytest.approx(1.0, abs=0.15), pytest.approx(0.0, abs=0.15))
    handle.cancel_goal_async()
    answer = scene.result_of(handle)
    assert (answer.status, answer.result.x) == (5, pytest.approx(1.0, abs=0.15))
    assert robot.commands[-1] == Twist()
    scene.play_until(lambda: robot.world.twist.is_zero(), 1.0)


def test_a_drive_minds_whom_the_user_tracker_sees(scene: Scene) -> None:
    scene.add_navigation()
    robot, began = scene.robot, scene.robot.world.now

    def stood() -> bool:
        robot.broadcaster.send("map", "user_4", robot.world.now, robot.world.pose @ Pose2(0.3, 0.0))
        return robot.world.now > began + 2.0

    scene.send(scene.poses, to(Pose2(3.0, 2.4)))
    scene.play_until(stood)
    assert robot.world.twist.linear == 0.0
    assert robot.world.pose.distance_to(START) < 0.2
    scene.play_until(lambda: robot.world.twist.linear > 0.2)


def test_a_drive_of_the_topic_is_a_goal_that_the_override_ends(scene: Scene) -> None:
    scene.add_navigation()
    goals = OpenGoals(scene.client, ["navigate_to_pose"])
    override = scene.client.create_publisher(Bool, "manual_override", LATCHED)
    publisher = scene.client.create_publisher(PoseStamped, "goal_pose", RELIABLE)
    scene.ros.spin_until(lambda: publisher.get_subscription_count() and override.get_subscription_count())
    publisher.publish(to(Pose2(3.0, 2.4)).pose)
    scene.play_until(lambda: scene.robot.world.twist.linear > 0.2)
    assert len(goals.open()) == 1
    override.publish(Bool(data=True))
    scene.ros.spin_until(lambda: scene.robot.commands[-1].linear.x == 0.0, what="the stop")
    scene.ros.spin_until(lambda: not goals.open(), what="the end of the goal")
    commands = len(scene.robot.commands)
    publisher.publish(to(Pose2(3.0, 2.4)).pose)
    refused = scene.send(scene.poses, to(Pose2(3.0, 2.4)))
    end = scene.robot.world.now + 1.0
    scene.play_until(lambda: scene.robot.world.now > end)
    refusal = scene.result_of(refused)
    assert refusal.status == 6 and "florence release" in refusal.result.error_msg
    assert len(scene.robot.commands) == commands
    override.publish(Bool(data=False))
    scene.ros.spin_until(lambda: not scene.navigation.navigation._overridden, what="the release")
    scene.play_until(lambda: scene.robot.world.now > end + 1.0)
    assert len(scene.robot.commands) == commands, "what was stopped stays so"
    publisher.publish(to(Pose2(3.0, 2.4)).pose)
    scene.play_until(lambda: scene.robot.world.twist.linear > 0.2)
    goals.cancel(*goals.open())
    scene.play_until(lambda: scene.robot.world.twist.is_zero() and not goals.open())


def test_the_initial_pose_counts_before_the_first_scan(scene: Scene) -> None:
    scene.add(MapServerNode(parameters={"map_file": str(scene.map_file), **SIMULATED}))
    scene.add(LocaliserNode(parameters={"initial_x": 6.0, "initial_y": 4.0, **SIMULATED}))

    def believed() -> bool:
        scene.robot.world.advance(0.1)
        scene.robot.tell_pose()
        scene.robot.tell_time()
        for _ in range(10):  # the localiser keeps up with the odometry
            scene.ros.loop.spin_once(0.01)
        return scene.robot.frames.buffer.latest_stamp("odom") is not None

    scene.ros.spin_until(believed)
    assert scene.estimate().distance_to(Pose2(6.0, 4.0)) < 0.01


@pytest.mark.parametrize("with_map", [True, False])
def test_an_initial_pose_of_another_frame_or_off_the_map_is_refused_and_told(
    scene: Scene, with_map: bool
) -> None:
    maps = MapServerNode(parameters={"map_file": str(scene.map_file), **SIMULATED})
    localiser = scene.ros.add(LocaliserNode(parameters=SIMULATED))
    if with_map:
        scene.ros.add(maps)
        scene.ros.spin_until(lambda: localiser.localising.localiser is not None)
    publisher = scene.client.create_publisher(PoseWithCovarianceStamped, "initialpose", RELIABLE)
    scene.ros.spin_until(publisher.get_subscription_count)
    wrong = (Pose2(1.0, 1.0), "odom"), (Pose2(500.0, 1.0), "map")
    for count, (pose, frame) in enumerate(wrong, start=1):
        publisher.publish(pose_with_covariance_to_ros(pose, [0.0] * 36, frame, 0.0))
        if not with_map and frame == "map":
            scene.ros.spin_for(0.2)
            scene.ros.add(maps)
        scene.ros.spin_until(lambda count=count: localiser.health.refused["initialpose"] == count)
    assert localiser.localising.localiser is not None
    assert np.abs(localiser.localising.localiser.particles.mean(axis=0)).max() < 0.1, "nothing was taken"


def test_a_restarted_localiser_goes_on_where_it_was(scene: Scene, tmp_path: FilePath) -> None:
    pose_file = tmp_path / "pose.json"
    save_pose(pose_file, START @ Pose2(0.05, 0.0, 0.03), make_map())
    scene.add(MapServerNode(parameters={"map_file": str(scene.map_file), **SIMULATED}))
    scene.add(LocaliserNode(parameters={"initial_x": 6.0, "pose_file": str(pose_file), **SIMULATED}))
    diagnoses: list[DiagnosticStatus] = []
    scene.client.create_subscription(
        DiagnosticArray, "diagnostics", lambda message: diagnoses.extend(message.status), RELIABLE
    )
    scene.meet()
    scene.play_until(scene.is_located)
    assert scene.estimate().distance_to(START) < 0.03
    # What it knows better now is kept for the next start, and told.
    scene.play_until(lambda: (kept := load_pose(pose_file, make_map())) and kept.distance_to(START) < 0.03)
    scene.play_until(
        lambda: any("Place in the map" in each.name and each.level == b"\0" for each in diagnoses)
    )


def test_the_localiser_is_told_where_it_is(scene: Scene) -> None:
    scene.add(MapServerNode(parameters={"map_file": str(scene.map_file), **SIMULATED}))
    scene.add(LocaliserNode(parameters={"initial_x": 6.0, "initial_y": 4.0, **SIMULATED}))
    publisher = scene.client.create_publisher(PoseWithCovarianceStamped, "initialpose", RELIABLE)
    scene.ros.spin_until(lambda: publisher.get_subscription_count())
    scene.meet()
    scene.play_until(scene.is_located)
    assert scene.estimate().distance_to(START) > 1.0
    bad = pose_with_covariance_to_ros(Pose2(math.nan, 0.0), [0.0] * 36, "map", 0.0)
    publisher.publish(bad)
    covariance = [0.0] * 36
    covariance[0] = covariance[7] = 0.04
    covariance[35] = 0.02
    publisher.publish(pose_with_covariance_to_ros(START @ Pose2(0.1, 0.1, 0.1), covariance, "map", 0.0))
    scene.play_until(lambda: scene.estimate().distance_to(START) < 0.03)


def test_a_robot_that_was_carried_finds_itself(scene: Scene) -> None:
    scene.add_navigation()
    scene.robot.world.pose = Pose2(6.5, 3.5, 2.0)
    service = scene.client.create_client(Empty, "reinitialize_global_localization")
    scene.ros.spin_until(service.service_is_ready)
    scene.ros.spin_until(service.call_async(Empty.Request()).done, what="the answer")

    def found() -> bool:
        return scene.estimate().distance_to(scene.robot.world.pose) < 0.1

    turn = Spin.Goal(target_yaw=3.0, time_allowance=Duration(sec=30))
    for _ in range(5):  # a busy machine has few scans in one turn
        if not found():
            scene.result_of(scene.send(scene.spins, turn))
    scene.ros.spin_until(found, what="the place of the robot")
