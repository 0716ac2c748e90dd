"""The Kinect node between the frame server and ROS subscribers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from sensor_msgs.msg import CameraInfo, Image

from florence_bt.drivers.kinect.node import KinectNode
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE, SENSOR
from florence_bt.simulation.emulators.kinect_frames import KinectFrameServer

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
        self.pictures: list[Image] = []
        self.cameras: list[CameraInfo] = []
        self.colours: list[Image] = []
        self.colour_cameras: list[CameraInfo] = []
        self.reports: list[DiagnosticStatus] = []
        node.create_subscription(Image, "camera/depth/image", self.pictures.append, SENSOR)
        node.create_subscription(CameraInfo, "camera/depth/camera_info", self.cameras.append, SENSOR)
        if colour:
            node.create_subscription(Image, "camera/rgb/image_color", self.colours.append, SENSOR)
            node.create_subscription(CameraInfo, "camera/rgb/camera_info", self.colour_cameras.append, SENSOR)
        node.create_subscription(
            DiagnosticArray, "diagnostics", lambda m: self.reports.extend(m.status), RELIABLE
        )


def sending(server: KinectFrameServer, condition: Callable[[], Any]) -> Callable[[], Any]:
    def check() -> Any:
        server.send_depth(DEPTH, 0.0)
        server.send_colour(COLOUR, 0.0)
        return condition()

    return check


def test_depth_pictures(ros: Any, server: KinectFrameServer) -> None:
    spy = Spy(ros)
    node = ros.add(KinectNode(parameters={"source": str(server.path)}))
    ros.spin_until(sending(server, lambda: len(spy.pictures) > 3 and spy.cameras), what="depth pictures")
    picture, camera = spy.pictures[-1], spy.cameras[-1]
    assert (picture.encoding, picture.width, picture.height, picture.step) == ("32FC1", 320, 240, 1280)
    assert picture.header.frame_id == camera.header.frame_id == "camera_depth_optical_frame"
    depth = np.frombuffer(picture.data, np.float32).reshape(240, 320)
    assert np.isnan(depth[0, 0])
    np.testing.assert_allclose(depth.ravel()[1:], 2.0, atol=0.007)
    assert [camera.k[index] for index in (0, 2, 4, 5)] == [262.5, 159.5, 262.5, 119.5]
    age = node.timebase.now() - (picture.header.stamp.sec + picture.header.stamp.nanosec * 1e-9)
    assert 0.0 <= age < 30.0
    report = ros.spin_until(sending(server, lambda: spy.reports and spy.reports[-1]), what="diagnostics")
    assert report.level == DiagnosticStatus.OK


def test_colour_pictures_while_somebody_looks(ros: Any, server: KinectFrameServer) -> None:
    spy = Spy(ros, colour=True)
    ros.add(KinectNode(parameters={"source": str(server.path)}))
    ros.spin_until(sending(server, lambda: spy.colours and spy.colour_cameras), what="a colour picture")
    picture = spy.colours[0]
    assert (picture.encoding, picture.header.frame_id) == ("rgb8", "camera_rgb_optical_frame")
    np.testing.assert_array_equal(np.frombuffer(picture.data, np.uint8), COLOUR.ravel())
    assert spy.colour_cameras[0].width == 320


def test_the_server_goes_and_comes_back(ros: Any, server: KinectFrameServer) -> None:
    spy = Spy(ros)
    ros.add(KinectNode(parameters={"source": str(server.path), "reconnect_delay_s": 0.1}))
    ros.spin_until(sending(server, lambda: spy.pictures), what="a picture")
    server.close()
    ros.spin_until(lambda: spy.reports and spy.reports[-1].level == DiagnosticStatus.ERROR, what="an error")
    spy.pictures.clear()
    again = KinectFrameServer(server.path)
    ros.spin_until(sending(again, lambda: spy.pictures), what="a picture again")
    again.close()


def test_silence_and_garbage(ros: Any, server: KinectFrameServer) -> None:
    spy = Spy(ros)
    ros.add(KinectNode(parameters={"source": str(server.path), "silence_timeout_s": 0.1}))
    server.faults.garbage = b"FKF1 this is no frame" * 100
    ros.spin_until(sending(server, lambda: spy.pictures), what="a picture after the garbage")
    server.faults.silent = True
    silent = sending(server, lambda: spy.reports and spy.reports[-1].level == DiagnosticStatus.ERROR)
    ros.spin_until(silent, what="the report of the silence")
    assert spy.reports[-1].message == "no depth pictures arrive"
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
