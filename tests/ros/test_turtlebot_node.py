"""The TurtleBot node against the emulated Create behind a pseudo-terminal."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")
pytest.importorskip("florence_interfaces")
from diagnostic_msgs.msg import DiagnosticArray
from florence_interfaces.msg import Create2Sensors, ManualOverride, StopReason, TurtlebotSensorState
from florence_interfaces.srv import PlaySong, ReleaseOverride, SetDigitalOutputs, SetLeds, SetTurtlebotMode
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState, Imu, JointState
from std_msgs.msg import Bool
from std_srvs.srv import SetBool

from florence_bt.drivers.turtlebot.driver import LET_GO_S
from florence_bt.drivers.turtlebot.node import TurtlebotNode
from florence_bt.drivers.turtlebot.report import RateLimiter
from florence_bt.ros.base_messages import gyro_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE
from florence_bt.ros.tf import TransformListener
from florence_bt.simulation.emulators.create import CreateEmulator, Mode
from florence_bt.simulation.emulators.pty_port import PseudoTerminal
from florence_bt.simulation.sensors.base_noise import PERFECT_BASE, BaseSensors

pytestmark = pytest.mark.ros


class Device:
    """A base that does at once what it is told, its emulator and its port, on a thread of their own."""

    def __init__(self, link: Path) -> None:
        self.wheels = (0.0, 0.0)
        self._rolled = (0.0, 0.0)
        self._link = link
        self.create = CreateEmulator(self, BaseSensors(self, 0, PERFECT_BASE))
        self._line: PseudoTerminal | None = PseudoTerminal(link)
        self._lock = threading.Lock()
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def set_wheels(self, left_mps: float, right_mps: float) -> None:
        self.wheels = (left_mps, right_mps)

    def travel(self) -> tuple[float, float]:
        return self._rolled

    def yaw_rate(self) -> float:
        return (self.wheels[1] - self.wheels[0]) / 0.26

    def bumpers(self) -> tuple[bool, bool]:
        return (False, False)

    def params(self, *, model: str) -> None:
        with self._lock:
            self.create = CreateEmulator(self, BaseSensors(self, 0, PERFECT_BASE), model=model)

    def unplug(self) -> None:
        with self._lock:
            assert self._line is not None
            self._line.unplug()
            self._line = None

    def plug_in(self) -> None:
        with self._lock:
            self._line = PseudoTerminal(self._link)

    def close(self) -> None:
        self._end.set()
        self._thread.join()
        if self._line is not None:
            self._line.close()

    def _run(self) -> None:
        before = time.monotonic()
        while not self._end.wait(0.004):
            now = time.monotonic()
            left, right = self.wheels
            self._rolled = (
                self._rolled[0] + left * (now - before),
                self._rolled[1] + right * (now - before),
            )
            before = now
            with self._lock:
                if self._line is not None:
                    answer = self.create.receive(self._line.read(), now) + self.create.poll(now)
                    self._line.write(answer)


@pytest.fixture
def device(tmp_path: Path) -> Iterator[Device]:
    made = Device(tmp_path / "create")
    yield made
    made.close()


class Listener(FlorenceNode):
    """Keeps the newest message of every topic."""

    def __init__(self) -> None:
        super().__init__("listener")
        self.seen: dict[str, list[Any]] = {}
        for kind, topic in (
            (Odometry, "odom"),
            (Imu, "imu/data"),
            (Imu, "imu/raw"),
            (JointState, "joint_states"),
            (BatteryState, "battery_state"),
            (TurtlebotSensorState, "turtlebot_node/sensor_state"),
            (Create2Sensors, "turtlebot_node/create2_sensors"),
            (DiagnosticArray, "diagnostics"),
        ):
            self.seen[topic] = []
            self.create_subscription(kind, topic, self.seen[topic].append, RELIABLE)
        self.stops: list[tuple[str, str]] = []
        self.create_subscription(
            StopReason, "turtlebot_node/stop_reason", lambda m: self.stops.append((m.code, m.text)), LATCHED
        )
        self.transforms = TransformListener(self)
        self.command = self.create_publisher(Twist, "cmd_vel", RELIABLE)
        self.manual = self.create_publisher(Twist, "manual_cmd_vel", RELIABLE)
        self.switch = self.create_publisher(Bool, "florenceLocator/manualOverride", RELIABLE)
        self.overridden: list[bool] = []
        self.create_subscription(
            Bool, "manual_override", lambda message: self.overridden.append(message.data), LATCHED
        )

    def newest(self, topic: str) -> Any:
        return self.seen[topic][-1] if self.seen[topic] else None

    def diagnoses(self) -> list[Any]:
        return list(self.newest("diagnostics").status) if self.seen["diagnostics"] else []

    def drive(self, linear: float, angular: float, *, by_hand: bool = False) -> None:
        message = Twist()
        message.linear.x, message.angular.z = linear, angular
        (self.manual if by_hand else self.command).publish(message)


def call(ros: Any, listener: Listener, kind: Any, name: str, **fields: Any) -> Any:
    client = listener.create_client(kind, f"turtlebot_node/{name}")
    ros.spin_until(client.service_is_ready)
    future = client.call_async(kind.Request(**fields))
    ros.spin_until(future.done)
    listener.destroy_client(client)
    return future.result()


def start(ros: Any, tmp_path: Path, **parameters: Any) -> tuple[TurtlebotNode, Listener]:
    listener = ros.add(Listener())
    # The silence of a machine that is held up is none of the base's.
    settings = {"port": str(tmp_path / "create"), "reconnect_delay_s": 0.05, "data_timeout": 300.0}
    node = ros.add(TurtlebotNode(parameters=settings | parameters))
    assert node.unknown_parameters() is None
    return node, listener


def test_drives_and_tells(ros: Any, device: Device, tmp_path: Path) -> None:
    node, listener = start(ros, tmp_path)
    ros.spin_until(lambda: listener.newest("imu/data"), what="the gyro's rest offset")
    assert listener.newest("odom").pose.covariance[0] == 1e-9

    def moved() -> bool:
        listener.drive(0.2, 0.5)
        return listener.newest("odom").pose.pose.position.x > 0.1

    ros.spin_until(moved)

    def goes_as_told() -> bool:
        listener.drive(0.2, 0.5)
        rate = listener.newest("imu/data").angular_velocity.z
        return bool(device.wheels == (0.135, 0.265) and rate == pytest.approx(0.5, abs=0.02))

    ros.spin_until(goes_as_told)
    odometry = listener.newest("odom")
    assert (odometry.header.frame_id, odometry.child_frame_id) == ("odom", "base_footprint")
    assert odometry.pose.covariance[35] == 1e3
    imu = listener.newest("imu/data")
    assert imu.header.frame_id == "gyro_link"
    pose = listener.transforms.buffer.lookup_pose("odom", "base_footprint")
    assert pose.yaw > 0.1
    # Silence on cmd_vel stops the base.
    ros.spin_until(lambda: device.wheels == (0.0, 0.0))
    state = ros.spin_until(lambda: listener.newest("turtlebot_node/sensor_state"))
    assert (state.oi_mode, state.user_digital_outputs) == (3, 1)
    total = sum(state.distance for state in listener.seen["turtlebot_node/sensor_state"])
    assert total > 0.1
    well = ["RUNNING", "Full", "OK", "None", "OK", "OK", "OK", "OK"]
    ros.spin_until(lambda: [status.message for status in listener.diagnoses()] == well, what="all is well")
    # The node's end stops a base that drives.
    ros.spin_until(lambda: [listener.drive(0.2, 0.0), device.wheels == (0.2, 0.2)][1])
    ros.close_node(node)
    ros.spin_until(lambda: device.wheels == (0.0, 0.0), what="the last word of the node")


def test_rates(ros: Any, device: Device, tmp_path: Path) -> None:
    node, listener = start(ros, tmp_path)
    decoder, seen = node._driver.decoder, listener.seen["odom"]

    def half_of_the_frames() -> bool:
        """Of those that come, however many a busy machine lets come; what it held up comes all at once."""
        seen.clear()
        listener.seen["turtlebot_node/sensor_state"].clear()
        before = decoder.good_frames
        ros.spin_until(lambda: len(seen) > 60)
        return bool(0.35 * (decoder.good_frames - before) < 60)

    ros.spin_until(half_of_the_frames)
    stamps = [message.header.stamp for message in seen[-40:]]
    seconds = [stamp.sec + 1e-9 * stamp.nanosec for stamp in stamps]
    assert (len(seconds) - 1) / (seconds[-1] - seconds[0]) < 35.0
    assert len(seen) > 2 * len(listener.seen["turtlebot_node/sensor_state"])


def test_services(ros: Any, device: Device, tmp_path: Path) -> None:
    _, listener = start(ros, tmp_path)
    ros.spin_until(lambda: listener.newest("odom"))
    assert call(
        ros, listener, SetDigitalOutputs, "set_digital_outputs", digital_out_0=0, digital_out_2=1
    ).done
    ros.spin_until(lambda: device.create.digital_outputs == 4)
    assert not call(ros, listener, SetTurtlebotMode, "set_operation_mode", mode=4).valid_mode
    assert call(ros, listener, SetTurtlebotMode, "set_operation_mode", mode=1).valid_mode
    ros.spin_until(lambda: device.create.mode is Mode.PASSIVE)
    assert not call(ros, listener, SetDigitalOutputs, "set_digital_outputs", digital_out_0=1).done
    assert call(ros, listener, SetTurtlebotMode, "set_operation_mode", mode=2).valid_mode
    ros.spin_until(lambda: device.create.mode is Mode.SAFE)
    ros.spin_until(lambda: device.create.digital_outputs == 4)


def test_lights_songs_and_the_dock(ros: Any, device: Device, tmp_path: Path) -> None:
    _, listener = start(ros, tmp_path)
    ros.spin_until(lambda: listener.newest("odom"))
    lights = {"leds": SetLeds.Request.PLAY, "power_colour": 255, "power_intensity": 128}
    assert call(ros, listener, SetLeds, "set_leds", **lights).success
    ros.spin_until(lambda: device.create.leds == (2, 255, 128))
    assert call(ros, listener, PlaySong, "play_song", notes=[69], durations=[0.5]).success
    refused = call(ros, listener, PlaySong, "play_song", notes=[69], durations=[])
    assert (refused.success, "one duration for each note" in refused.message) == (False, True)
    assert call(ros, listener, SetBool, "dock", data=True).success
    ros.spin_until(lambda: device.create.mode is Mode.PASSIVE and listener.stops[-1][0] == "docking")
    assert "drive mode" in call(ros, listener, SetLeds, "set_leds", **lights).message
    assert call(ros, listener, SetBool, "dock", data=False).success
    ros.spin_until(lambda: device.create.mode is Mode.FULL and device.wheels == (0.0, 0.0))
    assert listener.newest("turtlebot_node/create2_sensors") is None


def test_light_bumpers_and_encoders_of_a_create_2(ros: Any, device: Device, tmp_path: Path) -> None:
    device.params(model="create2")
    device.create.faults.light_bumps = (0, 0, 4000, 0, 0, 0)
    _, listener = start(ros, tmp_path, robot_type="create2")

    def rolls() -> bool:
        listener.drive(0.2, 0.0)
        sensors = listener.newest("turtlebot_node/create2_sensors")
        return sensors is not None and sensors.left_encoder > 100

    ros.spin_until(rolls)
    sensors = listener.newest("turtlebot_node/create2_sensors")
    assert (sensors.light_bumper, sensors.light_bump_center_left_signal) == (4, 4000)


def test_bad_commands_stop(ros: Any, device: Device, tmp_path: Path) -> None:
    _, listener = start(ros, tmp_path)
    ros.spin_until(lambda: [listener.drive(0.2, 0.0), device.wheels == (0.2, 0.2)][1])
    ros.spin_until(lambda: [listener.drive(math.nan, 0.0), device.wheels == (0.0, 0.0)][1])
    ros.spin_until(lambda: [listener.drive(50.0, 0.0), device.wheels == (0.5, 0.5)][1])


def test_the_override_stops_the_base_and_leaves_it_to_the_person_who_drives_by_hand(
    ros: Any, device: Device, tmp_path: Path
) -> None:
    _, listener = start(ros, tmp_path, override_file=str(tmp_path / "override"))

    def drives(speed: float) -> bool:
        listener.drive(0.2, 0.0)
        listener.drive(0.1, 0.0, by_hand=True)
        return device.wheels == (speed, speed)

    ros.spin_until(lambda: drives(0.2), what="the drive; nobody drives by hand now")
    ros.spin_until(lambda: listener.switch.get_subscription_count() and listener.overridden == [False])
    listener.switch.publish(Bool(data=True))
    ros.spin_until(lambda: [listener.drive(0.2, 0.0), device.wheels == (0.0, 0.0)][1], what="the stop")
    assert ros.spin_until(lambda: listener.overridden[-1]) and (tmp_path / "override").exists()
    for _ in range(20):
        listener.drive(0.2, 0.0)
        ros.spin_for(0.02)
        assert device.wheels == (0.0, 0.0), "while the override is on, nobody else drives the base"
    # Who drove on by hand without effect, too, has to let go first.
    listener.drive(0.0, 0.0, by_hand=True)
    ros.spin_until(lambda: drives(0.1), what="the drive by hand")
    # The button again stops the person, too, who drives on only after letting go.
    for let_go in (lambda: listener.drive(0.0, 0.0, by_hand=True), lambda: ros.spin_for(1.5 * LET_GO_S)):
        listener.switch.publish(Bool(data=True))
        ros.spin_until(lambda: not drives(0.1) and device.wheels == (0.0, 0.0), what="the end of the drive")
        for _ in range(20):
            ros.spin_for(0.02)
            drives(0.1)
            assert device.wheels == (0.0, 0.0), "the hand has not let go"
        let_go()
        ros.spin_until(lambda: drives(0.1), what="the drive by hand after it let go")
    assert listener.overridden[-1]
    listener.switch.publish(Bool(data=False))
    ros.spin_until(lambda: not listener.overridden[-1] and not (tmp_path / "override").exists())
    ros.spin_until(lambda: drives(0.2), what="the drive after the release")


def test_it_says_whether_the_base_stands_and_why_nothing_reaches_it(
    ros: Any, device: Device, tmp_path: Path
) -> None:
    _, listener = start(ros, tmp_path, data_timeout=0.5)
    states: list[ManualOverride] = []
    listener.create_subscription(ManualOverride, "manual_override_state", states.append, LATCHED)
    ros.spin_until(
        lambda: states and states[-1].standing and not states[-1].problem, what="a base that stands"
    )
    ros.spin_until(lambda: [listener.drive(0.2, 0.0), not states[-1].standing][1], what="a base that drives")
    listener.switch.publish(Bool(data=True))
    ros.spin_until(lambda: states[-1].on and states[-1].standing, what="the stop")
    assert states[-1].stops == 1 and not states[-1].driven_by_hand
    ros.spin_until(
        lambda: [listener.drive(0.1, 0.0, by_hand=True), states[-1].driven_by_hand][1], what="the hand"
    )
    device.unplug()
    ros.spin_until(lambda: states[-1].problem, what="the word that no command reaches the base")
    assert states[-1].on and not states[-1].standing
    device.plug_in()
    ros.spin_until(lambda: states[-1].standing and not states[-1].problem, what="the base again")


def release(ros: Any, listener: Listener, stops: int, pressed_at: float) -> str:
    client = listener.create_client(ReleaseOverride, "release_manual_override")
    ros.spin_until(client.service_is_ready)
    future = client.call_async(ReleaseOverride.Request(stops=stops, pressed_at=pressed_at, by="a test"))
    ros.spin_until(future.done)
    return "" if future.result().success else future.result().message


def test_a_release_is_for_what_the_person_saw(ros: Any, device: Device, tmp_path: Path) -> None:
    node, listener = start(ros, tmp_path)
    states: list[ManualOverride] = []
    listener.create_subscription(ManualOverride, "manual_override_state", states.append, LATCHED)
    ros.spin_until(lambda: states and listener.switch.get_subscription_count())
    for count in (1, 2):
        listener.switch.publish(Bool(data=True))
        ros.spin_until(lambda count=count: states[-1].stops == count)
    now = node.steady.now
    assert "since" in release(ros, listener, 1, now())
    for wrong in (now() - 1.5, now() + 60.0, math.nan):
        assert "too late" in release(ros, listener, 2, wrong)
    assert states[-1].on
    assert release(ros, listener, 2, now()) == ""
    ros.spin_until(lambda: not states[-1].on)


def test_the_driver_says_when_the_override_was_switched_on_last(
    ros: Any, device: Device, tmp_path: Path
) -> None:
    """Who was not there meanwhile, or hung, sees only that it is off: the messages before are gone."""

    def dates_of(listener: Listener) -> list[int]:
        found: list[int] = []

        def note(message: ManualOverride) -> None:
            if message.switched_on.sec not in found:
                found.append(message.switched_on.sec)

        listener.create_subscription(ManualOverride, "manual_override_state", note, LATCHED)
        return found

    node, listener = start(ros, tmp_path, override_file=str(tmp_path / "override"))
    dates = dates_of(listener)
    ros.spin_until(lambda: listener.switch.get_subscription_count() and dates == [0])
    listener.switch.publish(Bool(data=True))
    ros.spin_until(lambda: len(dates) == 2 and listener.overridden[-1])
    listener.switch.publish(Bool(data=False))
    ros.spin_until(lambda: not listener.overridden[-1])
    assert abs(dates[-1] - time.time()) < 60.0
    ros.close_node(node)
    _, listener = start(ros, tmp_path, override_file=str(tmp_path / "override"))
    later = dates_of(listener)
    ros.spin_until(lambda: later and listener.overridden == [False])
    assert abs(later[-1] - dates[-1]) <= 1


def test_the_override_outlives_the_driver_whatever_is_in_its_file(
    ros: Any, device: Device, tmp_path: Path
) -> None:
    file = tmp_path / "override"
    node, listener = start(ros, tmp_path, override_file=str(file))
    ros.spin_until(lambda: listener.switch.get_subscription_count() and listener.overridden == [False])
    listener.switch.publish(Bool(data=True))
    ros.spin_until(lambda: listener.overridden == [False, True])
    ros.close_node(node)
    file.write_bytes(b"\xff\x00 damaged")
    _, listener = start(ros, tmp_path, override_file=str(file))
    ros.spin_until(lambda: listener.overridden, what="what the new driver says")
    assert listener.overridden == [True]
    ros.spin_until(lambda: [listener.drive(0.2, 0.0), listener.newest("odom")][1])
    for _ in range(20):
        listener.drive(0.2, 0.0)
        ros.spin_for(0.02)
        assert device.wheels == (0.0, 0.0)


def test_the_plug_is_pulled_and_put_back(ros: Any, device: Device, tmp_path: Path) -> None:
    _, listener = start(ros, tmp_path)
    ros.spin_until(lambda: listener.newest("odom"))
    device.unplug()

    def told() -> list[Any]:
        return [message.status[0] for message in listener.seen["diagnostics"]]

    ros.spin_until(lambda: any(status.level == b"\x02" for status in told()))
    first = next(status for status in told() if status.level == b"\x02")
    assert "went away" in first.message  # told at once, not with the next second
    ros.spin_until(lambda: "no such port" in told()[-1].message)
    ros.spin_until(lambda: listener.stops[-1][0] == "no_response" and "no such port" in listener.stops[-1][1])
    device.plug_in()
    count = len(listener.seen["odom"])
    ros.spin_until(lambda: len(listener.seen["odom"]) > count + 5)
    ros.spin_until(lambda: told()[-1].message == "RUNNING")
    ros.spin_until(lambda: listener.stops[-1] == ("", ""))


def test_what_holds_the_base_is_latched_with_the_sensors_name(
    ros: Any, device: Device, tmp_path: Path
) -> None:
    _, listener = start(ros, tmp_path)
    ros.spin_until(lambda: listener.stops == [("", "")])
    device.create.faults.left_bumper = True
    pressed = ("bumper", "the left bumper is pressed: forward motion is held")
    ros.spin_until(lambda: listener.stops[-1] == pressed)
    late = ros.add(Listener())
    ros.spin_until(lambda: late.stops == [pressed], what="the latched message")
    device.create.faults.left_bumper = False
    ros.spin_until(lambda: listener.stops[-1] == ("", ""))
    assert len(listener.stops) == 3


def test_silence_opens_the_port_again(ros: Any, device: Device, tmp_path: Path) -> None:
    _, listener = start(ros, tmp_path, operation_mode=2, data_timeout=0.3)
    ros.spin_until(lambda: [listener.drive(0.2, 0.0), device.wheels == (0.2, 0.2)][1])
    device.create.faults.silent = True
    ros.spin_until(lambda: device.wheels == (0.0, 0.0))
    device.create.faults.silent = False
    count = len(listener.seen["odom"])
    ros.spin_until(lambda: len(listener.seen["odom"]) > count + 5)
    ros.spin_until(lambda: device.create.mode is Mode.SAFE, what="the mode that was asked for")


def test_joints_battery_and_the_raw_gyro(ros: Any, device: Device, tmp_path: Path) -> None:
    _, listener = start(ros, tmp_path)
    ros.spin_until(lambda: listener.newest("imu/raw") and listener.newest("joint_states"))
    ros.spin_until(lambda: [listener.drive(0.2, 0.0), max(listener.newest("joint_states").position) > 3.0][1])
    joints = listener.newest("joint_states")
    assert joints.name == [
        "left_wheel_joint",
        "right_wheel_joint",
        "front_castor_joint",
        "back_castor_joint",
    ]
    assert joints.position[0] == pytest.approx(joints.position[1], abs=1.0)

    def at_speed() -> bool:
        listener.drive(0.2, 0.0)
        return bool(listener.newest("joint_states").velocity[0] == pytest.approx(0.2 / 0.033, rel=0.15))

    ros.spin_until(at_speed)
    raw = listener.newest("imu/raw")
    assert raw.angular_velocity.z == pytest.approx(0.0, abs=0.02)
    assert (raw.header.frame_id, raw.linear_acceleration_covariance[0]) == ("gyro_link", -1.0)
    battery = ros.spin_until(lambda: listener.newest("battery_state"))
    assert battery.percentage == pytest.approx(0.9, abs=0.01)
    assert battery.power_supply_status == BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
    late: list[Any] = []
    listener.create_subscription(BatteryState, "battery_state", late.append, LATCHED)
    ros.spin_until(lambda: late)
    assert late[0].header.stamp == listener.newest("battery_state").header.stamp, "it waited for the next one"
    device.create.faults.dock = True
    ros.spin_until(
        lambda: (
            listener.newest("battery_state").power_supply_status
            == BatteryState.POWER_SUPPLY_STATUS_NOT_CHARGING
        )
    )
    assert call(ros, listener, SetTurtlebotMode, "set_operation_mode", mode=1).valid_mode
    ros.spin_until(
        lambda: (
            listener.newest("battery_state").power_supply_status == BatteryState.POWER_SUPPLY_STATUS_CHARGING
        )
    )


@pytest.mark.parametrize(
    ("fault", "word"),
    [
        ({"left_bumper": True}, "bumper"),
        ({"wheel_drops": 8}, "wheel"),
        ({"cliffs": (True, False, False, False)}, "cliff"),
    ],
)
def test_contact_stops_and_is_told_before_the_next_report_is_due(
    ros: Any, device: Device, tmp_path: Path, fault: dict[str, Any], word: str
) -> None:
    node, listener = start(ros, tmp_path)
    node._driving._state_limiter = RateLimiter(
        1e-3
    )  # one sensor state in a thousand seconds, unless there is news
    ros.spin_until(lambda: [listener.drive(0.2, 0.0), device.wheels == (0.2, 0.2)][1])
    count = len(listener.seen["turtlebot_node/sensor_state"])
    for name, value in fault.items():
        setattr(device.create.faults, name, value)
    ros.spin_until(lambda: device.wheels == (0.0, 0.0))
    ros.spin_until(lambda: len(listener.seen["turtlebot_node/sensor_state"]) > count)
    ros.spin_until(
        lambda: any(word in status.message and status.level == b"\x01" for status in listener.diagnoses())
    )


def test_a_create_2(ros: Any, device: Device, tmp_path: Path) -> None:
    device.params(model="create2")
    _, listener = start(ros, tmp_path, robot_type="create2")
    ros.spin_until(lambda: [listener.drive(0.2, 0.0), listener.newest("odom")][1])
    ros.spin_until(lambda: [listener.drive(0.2, 0.0), listener.newest("odom").pose.pose.position.x > 0.1][1])
    assert ros.spin_until(listener.diagnoses)[0].hardware_id == "iRobot Create 2"
    assert not listener.seen["imu/data"]


def test_what_nobody_listens_to_is_not_made(
    ros: Any, device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = 0

    def count(*arguments: Any) -> Imu:
        nonlocal made
        made += 1
        return gyro_to_ros(*arguments)

    monkeypatch.setattr("florence_bt.drivers.turtlebot.node.gyro_to_ros", count)
    node, listener = start(ros, tmp_path)
    ros.spin_until(
        lambda: listener.newest("imu/data") and listener.newest("imu/raw"), what="both listened to"
    )
    ros.close_node(listener)
    ros.spin_until(lambda: node.count_subscribers("imu/data") == 0, what="nobody listens")
    made = 0
    other = ros.add(FlorenceNode("other"))
    heard: list[Odometry] = []
    other.create_subscription(Odometry, "odom", heard.append, RELIABLE)
    ros.spin_until(lambda: len(heard) >= 5, what="the base goes on")
    assert made == 0


def test_the_legacy_raw_gyro(ros: Any, device: Device, tmp_path: Path) -> None:
    _, listener = start(ros, tmp_path, legacy_imu_raw=True)
    raw = ros.spin_until(lambda: listener.newest("imu/raw"))
    assert raw.angular_velocity.z == pytest.approx(-(512 / 150) * math.radians(1) * 1.35, abs=1e-3)
