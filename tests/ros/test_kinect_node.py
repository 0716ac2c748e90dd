"""The Kinect's nodes between the frame server, fakenect or the emulated motor and ROS subscribers."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from sensor_msgs.msg import CameraInfo, Image, Imu, PointCloud2
from std_msgs.msg import Float64, UInt8, UInt16

from florence_bt.core.errors import DeviceLost
from florence_bt.drivers.kinect.camera import View
from florence_bt.drivers.kinect.codec import METRES_OF_RAW, raw_from_metres
from florence_bt.drivers.kinect.fakenect import FakenectWriter
from florence_bt.drivers.kinect.frames import DepthEncoding, DepthFrame, VideoFrame
from florence_bt.drivers.kinect.freenect_source import FOLDER_VARIABLE, find_fakenect
from florence_bt.drivers.kinect.motor.node import KinectMotorNode
from florence_bt.drivers.kinect.motor.usb_motor import UsbMotor
from florence_bt.drivers.kinect.node import KinectNode
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE, SENSOR
from florence_bt.simulation.emulators.kinect_frames import KinectFrameServer
from florence_bt.simulation.emulators.kinect_motor import KinectMotorBackend

pytestmark = pytest.mark.ros

DEPTH = np.full((240, 320), 2.0, np.float32)
DEPTH[0, 0] = np.nan
COLOUR = np.arange(240 * 320 * 3, dtype=np.uint32).astype(np.uint8).reshape(240, 320, 3)


@pytest.fixture
def server(tmp_path: Path) -> Iterator[KinectFrameServer]:
    server = KinectFrameServer(tmp_path / "kinect.sock")
    yield server
    server.close()


class Spy:
    def __init__(self, ros: Any, *, colour: bool = False) -> None:
        node = ros.add(FlorenceNode("spy"))
        self.images: list[Image] = []
        self.cameras: list[CameraInfo] = []
        self.colours: list[Image] = []
        self.colour_cameras: list[CameraInfo] = []
        self.reports: list[DiagnosticStatus] = []
        node.create_subscription(Image, "camera/depth/image", self.images.append, SENSOR)
        node.create_subscription(CameraInfo, "camera/depth/camera_info", self.cameras.append, SENSOR)
        if colour:
            node.create_subscription(Image, "camera/rgb/image_color", self.colours.append, SENSOR)
            node.create_subscription(CameraInfo, "camera/rgb/camera_info", self.colour_cameras.append, SENSOR)
        node.create_subscription(
            DiagnosticArray, "diagnostics", lambda m: self.reports.extend(m.status), RELIABLE
        )


PERIOD_S = 1.0 / 50.0


def sending(server: KinectFrameServer, condition: Callable[[], Any]) -> Callable[[], Any]:
    """A condition that also sends frames, not quicker than one event at a time can be served."""
    next_frame = time.monotonic()

    def check() -> Any:
        nonlocal next_frame
        if time.monotonic() >= next_frame:
            next_frame = time.monotonic() + PERIOD_S
            server.send_raw_depth(raw_from_metres(DEPTH), 0.0)
            server.send_colour(COLOUR, 0.0)
        return condition()

    return check


def test_depth_images(ros: Any, server: KinectFrameServer) -> None:
    spy = Spy(ros)
    node = ros.add(KinectNode(parameters={"source": str(server.path)}))
    ros.spin_until(sending(server, lambda: len(spy.images) > 3 and spy.cameras), what="depth images")
    image, camera = spy.images[-1], spy.cameras[-1]
    assert (image.encoding, image.width, image.height, image.step) == ("32FC1", 320, 240, 1280)
    assert image.header.frame_id == camera.header.frame_id == "camera_depth_optical_frame"
    depth = np.frombuffer(image.data, np.float32).reshape(240, 320)
    assert np.isnan(depth[0, 0])
    np.testing.assert_allclose(depth.ravel()[1:], 2.0, atol=0.007)
    assert [camera.k[index] for index in (0, 2, 4, 5)] == [262.5, 159.5, 262.5, 119.5]
    age = node.timebase.now() - (image.header.stamp.sec + image.header.stamp.nanosec * 1e-9)
    assert 0.0 <= age < 30.0
    report = ros.spin_until(sending(server, lambda: spy.reports and spy.reports[-1]), what="diagnostics")
    assert report.level == DiagnosticStatus.OK


def test_colour_images_while_somebody_looks(ros: Any, server: KinectFrameServer) -> None:
    spy = Spy(ros, colour=True)
    ros.add(KinectNode(parameters={"source": str(server.path)}))
    ros.spin_until(sending(server, lambda: spy.colours and spy.colour_cameras), what="a colour image")
    image = spy.colours[0]
    assert (image.encoding, image.header.frame_id) == ("rgb8", "camera_rgb_optical_frame")
    np.testing.assert_array_equal(np.frombuffer(image.data, np.uint8), COLOUR.ravel())
    assert spy.colour_cameras[0].width == 320


def test_the_server_goes_and_comes_back(ros: Any, server: KinectFrameServer) -> None:
    spy = Spy(ros)
    ros.add(KinectNode(parameters={"source": str(server.path), "reconnect_delay_s": 0.1}))
    ros.spin_until(sending(server, lambda: spy.images), what="an image")
    server.close()
    ros.spin_until(lambda: spy.reports and spy.reports[-1].level == DiagnosticStatus.ERROR, what="an error")
    spy.images.clear()
    again = KinectFrameServer(server.path)
    ros.spin_until(sending(again, lambda: spy.images), what="an image again")
    again.close()


def test_silence_and_garbage(ros: Any, server: KinectFrameServer) -> None:
    spy = Spy(ros)
    ros.add(KinectNode(parameters={"source": str(server.path), "silence_timeout_s": 1.0}))
    server.faults.garbage = b"FKF1 this is no frame" * 100
    ros.spin_until(sending(server, lambda: spy.images), what="an image after the garbage")
    server.faults.silent = True
    told = ("no depth images arrive", DiagnosticStatus.ERROR)
    silent = sending(server, lambda: told in [(report.message, report.level) for report in spy.reports])
    ros.spin_until(silent, what="the report of the silence")
    server.faults.silent = False
    ros.spin_until(
        sending(server, lambda: spy.reports[-1].level == DiagnosticStatus.OK), what="the end of the silence"
    )


def test_colour_is_asked_for_only_while_somebody_looks(ros: Any, server: KinectFrameServer) -> None:
    Spy(ros)
    ros.add(KinectNode(parameters={"source": str(server.path)}))
    ros.spin_until(
        sending(server, lambda: server.client_count and not server.colour_wanted), what="no wish for colour"
    )
    Spy(ros, colour=True)
    ros.spin_until(sending(server, lambda: server.colour_wanted), what="the wish for colour")


def test_coloured_points_and_millimetres(ros: Any, server: KinectFrameServer) -> None:
    node = ros.add(FlorenceNode("spy"))
    clouds: dict[str, list[PointCloud2]] = {"rgb": [], "depth_registered": [], "depth": []}
    for name, messages in clouds.items():
        node.create_subscription(PointCloud2, f"camera/{name}/points", messages.append, SENSOR)
    raw: list[Image] = []
    node.create_subscription(Image, "camera/depth/image_raw", raw.append, SENSOR)
    ros.add(KinectNode(parameters={"source": str(server.path)}))
    ros.spin_until(sending(server, lambda: raw and all(clouds.values())), what="points of all kinds")
    cloud = clouds["rgb"][0]
    assert [(field.name, field.offset) for field in cloud.fields] == [
        ("x", 0),
        ("y", 4),
        ("z", 8),
        ("rgb", 12),
    ]
    assert (cloud.width, cloud.height, cloud.point_step, cloud.row_step) == (320, 240, 16, 5120)
    assert not cloud.is_dense and cloud.header.frame_id == "camera_depth_optical_frame"
    points = np.frombuffer(cloud.data, np.float32).reshape(240, 320, 4)
    assert np.isnan(points[0, 0, :3]).all()
    np.testing.assert_allclose(points[5, 7, :3], [2 * -152.5 / 262.5, 2 * -114.5 / 262.5, 2.0], atol=0.01)
    colours = points.view(np.uint8)[5, 7, 12:]
    np.testing.assert_array_equal(colours, [*COLOUR[5, 7, ::-1], 0])
    plain = np.frombuffer(clouds["depth"][0].data, np.float32).reshape(240, 320, 3)
    np.testing.assert_allclose(plain[1:], points[1:, :, :3], rtol=1e-6)
    millimetres = np.frombuffer(raw[0].data, np.uint16).reshape(240, 320)
    assert (raw[0].encoding, millimetres[0, 0]) == ("16UC1", 0)
    assert abs(int(millimetres[5, 7]) - 2000) < 8


def test_a_silent_camera_is_opened_again(ros: Any, server: KinectFrameServer) -> None:
    spy = Spy(ros)
    server.faults.silent = True
    parameters = {"source": str(server.path), "silence_timeout_s": 1.0, "reopen_timeout_s": 1.0}
    ros.add(KinectNode(parameters=parameters | {"reconnect_delay_s": 0.05}))
    again = sending(server, lambda: any("opened again" in report.message for report in spy.reports))
    ros.spin_until(again, what="the report that it is opened again")
    server.faults.silent = False
    ros.spin_until(sending(server, lambda: spy.images), what="images again")
    good = sending(server, lambda: spy.reports[-1].level == DiagnosticStatus.OK)
    ros.spin_until(good, what="the end of the problem")


def test_a_recording_through_libfreenect(ros: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    try:
        find_fakenect()
    except DeviceLost as missing:
        pytest.skip(str(missing))
    monkeypatch.setenv(FOLDER_VARIABLE, "")
    raw = np.random.default_rng(1).integers(400, 1000, (480, 640)).astype(np.uint16)
    pixels = np.random.default_rng(2).integers(0, 256, (480, 640, 3)).astype(np.uint8)
    with FakenectWriter(tmp_path / "recording") as writer:
        for count in range(30):
            frame = DepthFrame(640, 480, count / 30, raw, DepthEncoding.RAW, View.DEPTH)
            writer.add(frame, 50.0 + count / 30)
            writer.add(VideoFrame(640, 480, count / 30, pixels), 50.01 + count / 30)
    spy = Spy(ros, colour=True)
    source = f"recording:{tmp_path / 'recording'}"
    node = ros.add(KinectNode(parameters={"source": source, "reconnect_delay_s": 0.1}))
    ros.spin_until(lambda: spy.images and spy.colours, what="depth and colour of the recording")
    depth = np.frombuffer(spy.images[0].data, np.float32).reshape(240, 320)
    np.testing.assert_array_equal(depth, METRES_OF_RAW[raw[::2, ::2]])
    colour = np.frombuffer(spy.colours[0].data, np.uint8).reshape(240, 320, 3)
    np.testing.assert_array_equal(colour, pixels[::2, ::2])
    ros.spin_until(lambda: spy.cameras and spy.colour_cameras, what="the camera models")
    assert (spy.cameras[0].k[2], spy.colour_cameras[0].k[2]) == (157.0, 159.5)
    ros.spin_until(lambda: node._connection.lost, what="the end of the recording")
    spy.images.clear()
    ros.spin_until(lambda: spy.images, what="the recording from its start")


def test_no_library_is_a_diagnosis_with_the_package(ros: Any, tmp_path: Path) -> None:
    spy = Spy(ros)
    ros.add(KinectNode(parameters={"library": str(tmp_path / "none.so")}))
    report = ros.spin_until(lambda: spy.reports and spy.reports[-1], what="diagnostics")
    assert report.level == DiagnosticStatus.ERROR and "apt install libfreenect0.5" in report.message


class MotorSpy:
    def __init__(self, ros: Any) -> None:
        self.node = ros.add(FlorenceNode("motor_spy"))
        self.accelerations: list[Imu] = []
        self.angles: list[Float64] = []
        self.status: list[UInt8] = []
        self.reports: list[DiagnosticStatus] = []
        self.node.create_subscription(Imu, "kinect_aux/imu", self.accelerations.append, SENSOR)
        self.node.create_subscription(Float64, "kinect_aux/cur_tilt_angle", self.angles.append, RELIABLE)
        self.node.create_subscription(UInt8, "kinect_aux/cur_tilt_status", self.status.append, RELIABLE)
        self.node.create_subscription(
            DiagnosticArray, "diagnostics", lambda m: self.reports.extend(m.status), RELIABLE
        )
        self.tilt = self.node.create_publisher(Float64, "kinect_aux/tilt_angle", RELIABLE)
        self.led = self.node.create_publisher(UInt16, "kinect_aux/led_option", RELIABLE)
        self.leds = self.node.create_publisher(UInt16, "kinect_aux/led_options", RELIABLE)


def test_motor_light_and_accelerometer(ros: Any) -> None:
    seconds = [0.0]
    bus = KinectMotorBackend(lambda: seconds[0])
    spy = MotorSpy(ros)
    ros.add(KinectMotorNode(open_motor=lambda index: UsbMotor(index, bus)))
    ros.spin_until(lambda: spy.accelerations and spy.angles and spy.status, what="all three topics")
    message = spy.accelerations[0]
    assert abs(message.linear_acceleration.y - 9.80665) < 1e-9
    assert list(message.linear_acceleration_covariance) == [0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01]
    assert message.angular_velocity_covariance[0] == message.orientation_covariance[0] == -1.0
    ros.spin_until(lambda: spy.tilt.get_subscription_count(), what="the subscriber")
    spy.tilt.publish(Float64(data=float("nan")))
    spy.tilt.publish(Float64(data=-12.0))
    ros.spin_until(lambda: spy.status[-1].data == 4, what="the head to move")
    seconds[0] = 10.0
    ros.spin_until(lambda: spy.angles[-1].data == -12.0 and spy.status[-1].data == 0, what="the angle")
    spy.led.publish(UInt16(data=99))
    spy.led.publish(UInt16(data=2))
    ros.spin_until(lambda: bus.led == 2, what="red light")
    spy.leds.publish(UInt16(data=1))
    ros.spin_until(lambda: bus.led == 1, what="green light, by the document's name")


def test_a_motor_that_goes_gets_the_wishes_again(ros: Any) -> None:
    bus = KinectMotorBackend(lambda: 0.0)
    spy = MotorSpy(ros)
    ros.add(KinectMotorNode(parameters={"reconnect_delay_s": 0.05}, open_motor=lambda i: UsbMotor(i, bus)))
    ros.spin_until(lambda: spy.status and spy.led.get_subscription_count(), what="the motor")
    bus.faults.unplugged = True
    ros.spin_until(lambda: spy.reports and spy.reports[-1].level == DiagnosticStatus.ERROR, what="an error")
    spy.led.publish(UInt16(data=5))
    spy.status.clear()
    ros.spin_for(0.2)
    bus.faults.unplugged = False
    ros.spin_until(lambda: bus.led == 5 and spy.status, what="the light that was wished meanwhile")
    ros.spin_until(lambda: spy.reports[-1].level == DiagnosticStatus.OK, what="the end of the problem")
