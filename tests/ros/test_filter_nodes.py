"""The filter nodes and the robot description over DDS."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
import yaml

pytest.importorskip("rclpy")
from geometry_msgs.msg import Twist, Vector3
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, JointState
from sensor_msgs.msg import LaserScan as LaserScanMsg
from std_msgs.msg import Bool, String
from std_srvs.srv import SetBool
from tf2_msgs.msg import TFMessage

from florence_bt.core.errors import ConfigError
from florence_bt.core.sensing import CameraModel, DepthImage, LaserScan
from florence_bt.ros import shared_clock
from florence_bt.ros.conversions import (
    camera_info_to_ros,
    depth_to_ros,
    scan_from_ros,
    scan_to_ros,
    stamp_from_ros,
    stamp_to_ros,
)
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE, SENSOR, TF
from florence_bt.ros.tf import TransformListener
from florence_bt.skills.filters.depth_to_laser.node import FakeLaserNode
from florence_bt.skills.filters.laser_combinator.node import LaserCombinatorNode
from florence_bt.skills.filters.laser_filter.node import LaserFilterNode
from florence_bt.skills.filters.velocity_filter.node import VelocityFilterNode
from florence_bt.skills.robot_description.description import default_file
from florence_bt.skills.robot_description.node import RobotDescriptionNode

pytestmark = pytest.mark.ros

CAMERA = CameraModel(320, 240, 262.5, 262.5, 159.5, 119.5)
PERIOD_S = 0.07
KINECT_SCANS = {"filtered_kinect_scan", "filtered_kinect_low_scan", "filtered_kinect_overhang_scan"}
"""Between two readings of the played sensors; longer than the throttle's period."""
CONFIG = yaml.safe_load((default_file().parents[1] / "config" / "robot.yaml").read_text(encoding="utf-8"))


class Sensors(FlorenceNode):
    """Plays the laser and the Kinect, and hears what becomes of them."""

    def __init__(self) -> None:
        super().__init__("sensors")
        self.heard: dict[str, LaserScan] = {}
        self.laser = self.create_publisher(LaserScanMsg, "scan", SENSOR)
        self.picture = self.create_publisher(Image, "camera/depth/image", SENSOR)
        self.info = self.create_publisher(CameraInfo, "camera/depth/camera_info", SENSOR)
        for topic in ("scan_combined", "filtered_scan", "filtered_laser_scan", *KINECT_SCANS):
            self.listen_to(topic)

    def listen_to(self, topic: str) -> None:
        def remember(message: LaserScanMsg) -> None:
            self.heard[topic] = scan_from_ros(message)

        self.create_subscription(LaserScanMsg, topic, remember, SENSOR)

    def send_laser(self, distance: float) -> None:
        ranges = np.full(512, distance, np.float32)
        ranges[:5] = 0.1  # the robot's own structure
        scan = LaserScan(
            self.timebase.now(), "base_laser_round_link", -math.pi / 2, math.pi / 511, 0.02, 5.6, ranges
        )
        self.laser.publish(scan_to_ros(scan))

    def send_picture(self, distance: float, shape: tuple[int, int] = (240, 320)) -> None:
        depth = np.full(shape, distance, np.float32)
        image = DepthImage(self.timebase.now(), "camera_depth_optical_frame", CAMERA, depth)
        self.info.publish(camera_info_to_ros(CAMERA, image.frame_id, image.stamp))
        self.picture.publish(depth_to_ros(image))


def test_from_depth_picture_and_scan_to_filtered_scan(ros: Any) -> None:
    ros.add(RobotDescriptionNode(parameters=CONFIG["robot_description"]))
    ros.add(FakeLaserNode(parameters=CONFIG["kinect_laser"]))
    ros.add(LaserCombinatorNode(parameters=CONFIG["laser_combinator"]))
    ros.add(LaserFilterNode(parameters=CONFIG["laser_filter"]))
    sensors = ros.add(Sensors())

    def send() -> None:
        sensors.send_laser(math.inf)
        sensors.send_picture(2.0)

    sensors.create_timer(PERIOD_S, send)

    def ahead(scan: LaserScan) -> Any:
        return np.abs(scan.angles()) < math.radians(20)

    def all_heard() -> bool:
        # Until the first picture has become a scan, and when it is late, the laser goes alone.
        made = [sensors.heard.get(topic) for topic in ("scan_combined", "filtered_scan")]
        walls = [scan is not None and bool((scan.ranges[ahead(scan)] < 3.0).all()) for scan in made]
        return all(walls) and set(sensors.heard) >= {"filtered_laser_scan", *KINECT_SCANS}

    ros.spin_until(all_heard, what="the six scans")
    combined = sensors.heard["scan_combined"]
    # The Kinect's wall, 2 m before it, stands 0.144 m nearer to the laser.
    wall = (2.0 - 0.1444) / np.cos(combined.angles()[ahead(combined)])
    assert combined.ranges[ahead(combined)] == pytest.approx(wall, abs=0.03)
    assert combined.frame_id == "base_laser_round_link"

    filtered = sensors.heard["filtered_scan"]
    assert np.isnan(filtered.ranges[:5]).all()
    assert filtered.ranges[20] == np.float32(5.5999)
    assert filtered.ranges[ahead(filtered)] == pytest.approx(wall, abs=0.03)

    laser = sensors.heard["filtered_laser_scan"]
    assert laser.ranges[ahead(laser)] == pytest.approx(5.5999), (
        "the Kinect's wall is not in the laser's own scan"
    )
    kinect = sensors.heard["filtered_kinect_scan"]
    assert kinect.frame_id == "camera_depth_frame"
    seen = ~np.isnan(kinect.ranges)
    assert np.abs(kinect.angles()[seen]).max() < math.radians(33)
    assert kinect.ranges[180] == pytest.approx(2.0, abs=0.01)
    low = sensors.heard["filtered_kinect_low_scan"]
    assert np.isnan(low.ranges).all(), "the wall stands there"
    overhangs = sensors.heard["filtered_kinect_overhang_scan"]
    assert overhangs.ranges[180] == np.float32(3.9999), "the wall does not hang over"

    ros.spin_until(lambda: sensors.count_subscribers("/tf") == 0, what="the mounting is known")
    sensors.heard.clear()
    ros.spin_until(all_heard, what="the scans are combined without the moving frames")


def test_pictures_that_make_no_sense_are_dropped(ros: Any) -> None:
    ros.add(FakeLaserNode())
    sensors = ros.add(Sensors())
    sensors.listen_to("kinect_scan")
    sends = itertools.cycle(
        (
            lambda: sensors.info.publish(CameraInfo()),
            lambda: sensors.send_picture(2.0, shape=(120, 160)),
            lambda: sensors.picture.publish(Image(encoding="rgb8", height=2, width=2, step=6)),
            lambda: sensors.send_picture(1.5),
        )
    )
    sensors.create_timer(PERIOD_S, lambda: next(sends)())
    ros.spin_until(lambda: "kinect_scan" in sensors.heard)
    assert sensors.heard["kinect_scan"].ranges[180] == pytest.approx(1.5, abs=0.01)


def test_the_laser_filter_listens_where_it_is_told(ros: Any) -> None:
    ros.add(LaserFilterNode(parameters={"input_topic": "scan", "robot_radius": 0.05}))
    sensors = ros.add(Sensors())

    sensors.create_timer(PERIOD_S, lambda: sensors.send_laser(np.inf))
    ros.spin_until(lambda: "filtered_scan" in sensors.heard)
    assert sensors.heard["filtered_scan"].ranges[0] == np.float32(0.1)
    assert sensors.heard["filtered_scan"].ranges[100] == np.float32(5.5999)
    assert sensors.count_publishers("filtered_kinect_scan") == 0


class Driver(FlorenceNode):
    """Sends velocities by a simulated clock of its own and hears the filtered ones."""

    def __init__(self) -> None:
        super().__init__("driver")
        self.time = 100.0
        self.heard: list[Twist] = []
        self.clock = self.create_publisher(Clock, "/clock", RELIABLE)
        self.command = self.create_publisher(Twist, "cmd_vel", RELIABLE)
        self.create_subscription(Twist, "filtered_cmd_vel", self.heard.append, 100)
        self.stop = self.create_client(SetBool, "velocity_filter/hard_stop")

    def set_time(self, seconds: float) -> None:
        self.time = seconds
        self.clock.publish(Clock(clock=stamp_to_ros(seconds)))


@pytest.fixture
def driven(ros: Any, monkeypatch: pytest.MonkeyPatch) -> tuple[Any, VelocityFilterNode, Driver]:
    monkeypatch.setattr(shared_clock, "IDLE_S", 600.0)  # each time is told once: the filter must listen
    node = ros.add(VelocityFilterNode(parameters={"use_sim_time": True, **CONFIG["velocity_filter"]}))
    driver = ros.add(Driver())
    ros.spin_until(
        lambda: (
            driver.clock.get_subscription_count()
            and driver.command.get_subscription_count()
            and driver.count_publishers("filtered_cmd_vel")
            and driver.stop.service_is_ready()
        )
    )
    driver.set_time(100.0)
    ros.spin_until(lambda: node.timebase.now() == 100.0)
    return ros, node, driver


def step(ros: Any, node: VelocityFilterNode, driver: Driver, seconds: float = 0.02) -> float:
    """Advance the clock by one period and give the speed that came out."""
    before = len(driver.heard)
    driver.set_time(driver.time + seconds)
    ros.spin_until(lambda: len(driver.heard) > before, what="a filtered velocity")
    return float(driver.heard[-1].linear.x)


def send(ros: Any, node: VelocityFilterNode, driver: Driver, speed: float) -> float:
    """Send a command to a filter at rest, wait until it has come, and give the first speed."""
    driver.command.publish(Twist(linear=Vector3(x=speed)))
    ros.spin_until(lambda: node.limiting.tickers["cmd_vel"].running)
    return step(ros, node, driver)


def test_the_velocity_filter_follows_simulated_time(driven: Any) -> None:
    ros, node, driver = driven
    assert driver.heard == []
    speeds = [send(ros, node, driver, 0.1)] + [step(ros, node, driver) for _ in range(5)]
    assert speeds == pytest.approx([0.02, 0.04, 0.06, 0.08, 0.1, 0.1])
    # The clock stands still, and so does the filter.
    ros.spin_for(0.2)
    assert len(driver.heard) == 6
    assert step(ros, node, driver, 0.1) == pytest.approx(0.1)
    # More than a quarter of a second since the command.
    assert step(ros, node, driver, 0.1) == pytest.approx(0.05)


def test_a_hard_stop_holds_until_it_is_released(driven: Any) -> None:
    ros, node, driver = driven
    assert send(ros, node, driver, 0.5) == pytest.approx(0.02)
    assert step(ros, node, driver) == pytest.approx(0.04)
    answer = driver.stop.call_async(SetBool.Request(data=True))
    ros.spin_until(answer.done)
    assert answer.result().success
    ros.spin_until(lambda: driver.heard[-1].linear.x == 0.0)
    driver.command.publish(Twist(linear=Vector3(x=0.5)))
    assert step(ros, node, driver) == 0.0
    answer = driver.stop.call_async(SetBool.Request(data=False))
    ros.spin_until(answer.done)
    assert step(ros, node, driver) == 0.0
    driver.command.publish(Twist(linear=Vector3(x=math.nan)))
    driver.command.publish(Twist(linear=Vector3(x=0.5)))

    def moves() -> bool:
        return step(ros, node, driver) > 0.0

    ros.spin_until(moves)


def test_who_drives_by_hand_has_a_filter_of_their_own(driven: Any) -> None:
    ros, node, driver = driven
    heard: list[float] = []
    driver.create_subscription(
        Twist, "filtered_manual_cmd_vel", lambda message: heard.append(message.linear.x), RELIABLE
    )
    manual = driver.create_publisher(Twist, "manual_cmd_vel", RELIABLE)
    ros.spin_until(
        lambda: manual.get_subscription_count() and node.count_subscribers("filtered_manual_cmd_vel")
    )
    manual.publish(Twist(linear=Vector3(x=0.1)))
    ros.spin_until(lambda: node.limiting.tickers["manual_cmd_vel"].running)
    for speed in (0.02, 0.04):
        count = len(heard)
        driver.set_time(driver.time + 0.02)
        ros.spin_until(lambda count=count: len(heard) > count)
        assert heard[-1] == pytest.approx(speed)
    assert driver.heard == []
    answer = driver.stop.call_async(SetBool.Request(data=True))
    ros.spin_until(lambda: answer.done() and heard[-1] == 0.0, what="the hard stop of the drive by hand")


class ByHand:
    """A person who drives by hand, and what the filter holds."""

    def __init__(self, ros: Any, node: VelocityFilterNode, driver: Driver) -> None:
        self._ros, self._node, self._driver = ros, node, driver
        self.heard: list[float] = []
        driver.create_subscription(
            Twist, "filtered_manual_cmd_vel", lambda message: self.heard.append(message.linear.x), RELIABLE
        )
        self._commands = driver.create_publisher(Twist, "manual_cmd_vel", RELIABLE)
        self._override = driver.create_publisher(Bool, "manual_override", LATCHED)
        self.stop_all = driver.create_client(SetBool, "velocity_filter/stop_all")
        ros.spin_until(
            lambda: (
                self._commands.get_subscription_count()
                and node.count_subscribers("filtered_manual_cmd_vel")
                and self._override.get_subscription_count()
                and self.stop_all.service_is_ready()
            )
        )

    def call(self, service: Any, on: bool) -> None:
        answer = service.call_async(SetBool.Request(data=on))
        self._ros.spin_until(answer.done)
        assert answer.result().success

    def switch(self, on: bool) -> None:
        self._override.publish(Bool(data=on))

    def expect_held(self, *topics: str) -> None:
        def held() -> set[str]:
            return {topic for topic, ticker in self._node.limiting.tickers.items() if ticker.filter.stopped}

        self._ros.spin_until(lambda: held() == set(topics), what=f"the stop of {topics}")

    def drive(self) -> None:
        """Command a speed until the base is given one."""

        def moves() -> bool:
            self._commands.publish(Twist(linear=Vector3(x=0.5)))
            self._driver.set_time(self._driver.time + 0.02)
            return bool(self.heard) and self.heard[-1] > 0.0

        self._ros.spin_until(moves, what="the drive by hand")


def test_under_the_override_a_hard_stop_does_not_even_slow_the_hand_down(driven: Any) -> None:
    ros, node, driver = driven
    person = ByHand(ros, node, driver)
    person.switch(True)
    person.drive()
    person.call(driver.stop, True)
    person.expect_held("cmd_vel")
    count = len(person.heard)
    ros.spin_until(lambda: [person.drive(), len(person.heard) > count + 3][1])
    assert min(person.heard[count:]) > 0.0


def test_an_override_that_is_switched_on_during_a_hard_stop_lets_the_hand_pass(driven: Any) -> None:
    ros, node, driver = driven
    person = ByHand(ros, node, driver)
    person.call(driver.stop, True)
    person.expect_held("cmd_vel", "manual_cmd_vel")
    person.switch(True)
    person.expect_held("cmd_vel")
    person.drive()
    person.call(driver.stop, True)
    person.expect_held("cmd_vel")
    person.switch(False)
    person.expect_held("cmd_vel", "manual_cmd_vel")
    ros.spin_until(lambda: person.heard[-1] == 0.0, what="the stop at the release of the override")
    person.call(driver.stop, False)
    person.expect_held()


def test_the_last_stop_holds_the_hand_too(driven: Any) -> None:
    ros, node, driver = driven
    person = ByHand(ros, node, driver)
    person.switch(True)
    person.drive()
    person.call(person.stop_all, True)
    ros.spin_until(lambda: person.heard[-1] == 0.0, what="the stop of the drive by hand")
    person.call(driver.stop, True)
    person.expect_held("cmd_vel", "manual_cmd_vel")
    person.call(driver.stop, False)
    person.expect_held()


def test_the_velocity_filter_ends_with_a_zero(driven: Any) -> None:
    ros, node, driver = driven
    assert send(ros, node, driver, 0.5) > 0.0
    ros.close_node(node)
    ros.spin_until(lambda: driver.heard[-1].linear.x == 0.0)


def test_late_listeners_learn_the_frames_and_the_description(ros: Any) -> None:
    ros.add(RobotDescriptionNode())
    late = ros.add(FlorenceNode("late"))
    transforms, texts = TransformListener(late), []
    late.create_subscription(String, "robot_description", texts.append, LATCHED)
    ros.spin_until(lambda: texts and transforms.buffer.frames())
    laser = transforms.buffer.lookup("base_footprint", "base_laser_round_link")
    assert laser.translation == pytest.approx([0.05734, 0.0, 0.1298], abs=1e-4)
    assert laser.rotation == pytest.approx(np.diag([1.0, -1.0, -1.0]), abs=1e-9)
    assert '<robot name="florence">' in texts[0].data


def test_the_wheels_follow_the_odometry(ros: Any) -> None:
    ros.add(RobotDescriptionNode(parameters={"use_sim_time": True}))
    base = ros.add(FlorenceNode("base", parameters={"use_sim_time": True}))
    moved: list[Any] = []
    base.create_subscription(TFMessage, "/tf", moved.append, TF)
    joints = base.create_publisher(JointState, "joint_states", RELIABLE)
    ros.spin_until(lambda: joints.get_subscription_count() and base.count_publishers("/tf"))
    message = JointState(name=["left_wheel_joint", "front_castor_joint"], position=[math.pi / 2, 0.0])
    message.header.stamp.sec = 7
    joints.publish(message)
    ros.spin_until(lambda: moved)
    (wheel,) = moved[0].transforms
    assert (wheel.header.frame_id, wheel.child_frame_id) == ("base_link", "left_wheel_link")
    assert wheel.header.stamp.sec == 7
    assert wheel.transform.rotation.y == pytest.approx(math.sqrt(0.5))


def test_wheels_that_stand_are_told_of_once_a_second(ros: Any) -> None:
    ros.add(RobotDescriptionNode(parameters={"use_sim_time": True}))
    base = ros.add(FlorenceNode("base", parameters={"use_sim_time": True}))
    stamps: list[float] = []

    def take(message: Any) -> None:
        stamps.append(stamp_from_ros(message.transforms[0].header.stamp))

    base.create_subscription(TFMessage, "/tf", take, TF)
    told: list[Any] = []
    base.create_subscription(JointState, "joint_states", told.append, RELIABLE)
    joints = base.create_publisher(JointState, "joint_states", RELIABLE)
    ros.spin_until(lambda: joints.get_subscription_count() == 2 and base.count_publishers("/tf"))
    for tenth in range(26):
        turned = max(0, tenth - 23)  # the wheel begins to turn at 2.4 s
        message = JointState(name=["left_wheel_joint"], position=[float(turned)])
        message.header.stamp = stamp_to_ros(tenth / 10)
        joints.publish(message)
        ros.spin_until(lambda heard=tenth: len(told) > heard)
    ros.spin_until(lambda: stamps and stamps[-1] == 2.5)
    assert stamps == [0.0, 1.0, 2.0, 2.4, 2.5]


@pytest.mark.parametrize(
    ("make", "parameters", "problem"),
    [
        (FakeLaserNode, {"range_min": 9.0}, "range_min"),
        (LaserCombinatorNode, {"range_max_source": "kinekt"}, "range_max_source"),
        (LaserFilterNode, {"input_topic": ""}, "input_topic"),
        (VelocityFilterNode, {"max_linear_acc": 0.0}, "max_linear_acc"),
        (RobotDescriptionNode, {"file": "no_such.xacro"}, "no_such.xacro"),
    ],
)
def test_wrong_parameters_are_named(ros: Any, make: Any, parameters: dict[str, Any], problem: str) -> None:
    with pytest.raises(ConfigError, match=problem):
        make(parameters=parameters)


def test_the_robots_configuration_has_no_unknown_parameters(ros: Any) -> None:
    for make in (
        FakeLaserNode,
        LaserCombinatorNode,
        LaserFilterNode,
        VelocityFilterNode,
        RobotDescriptionNode,
    ):
        node = make()
        name = node.get_name()
        ros.add(node)
        configured = ros.add(make(parameters=CONFIG[name], namespace="robot"))
        assert configured.unknown_parameters() is None
