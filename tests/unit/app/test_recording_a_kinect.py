"""Recording a Kinect: how it ends, early and late, and what is left in the folder then."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from florence_bt.app.devices.kinect_recording import Recorded, record
from florence_bt.core.errors import ConfigError, DeviceError, DeviceLost
from florence_bt.drivers.kinect.driver import KinectParameters
from florence_bt.drivers.kinect.frames import DepthEncoding, DepthFrame, Frame, VideoFrame
from florence_bt.drivers.kinect.motor.codec import MotorState
from florence_bt.drivers.kinect.recording import FILE, recorded, recorded_depth

RAW = np.full((240, 320), 800, np.uint16)


class Camera:
    """Sends a depth and a colour image in turn every eighth of a second; then something happens."""

    def __init__(self, images: int, then: BaseException | None = None) -> None:
        self.now = 100.0
        self.colour: bool | None = None
        self.closed = False
        self._frames = self._all(images)
        self._then = then

    def _all(self, images: int) -> Iterator[Frame]:
        for number in range(images):
            if number % 2 == 0:
                yield DepthFrame(320, 240, self.now, RAW, DepthEncoding.RAW)
            else:
                yield VideoFrame(320, 240, self.now, bytes(320 * 240 * 3))

    def read(self, timeout_s: float) -> Frame | None:
        self.now += 0.125
        frame = next(self._frames, None)
        if frame is None and self._then is not None:
            raise self._then
        return frame

    def request(self, *, colour: bool) -> None:
        self.colour = colour

    def close(self) -> None:
        self.closed = True


class Motor:
    def __init__(self, index: int) -> None:
        self.index = index

    def read(self, timeout_s: float) -> MotorState:
        return MotorState((0, 819, 0), 0, 0)

    def close(self) -> None:
        """Nothing to give back."""


def run(
    camera: Camera, folder: Path, source: str = "usb", seconds: float = 1.0
) -> tuple[Recorded, list[int]]:
    asked: list[int] = []

    def open_motor(index: int) -> Motor:
        asked.append(index)
        return Motor(index)

    def open_camera(parameters: KinectParameters) -> Camera:
        assert parameters.source == source
        return camera

    made = record(
        source,
        folder,
        seconds,
        wall_time=lambda: camera.now,
        open_camera=open_camera,
        open_motor=open_motor,  # type: ignore[arg-type]
    )
    return made, asked


def test_a_second_of_a_kinect_on_usb(tmp_path: Path) -> None:
    camera = Camera(100)
    made, asked = run(camera, tmp_path / "new")
    assert (made.depth_images, made.colour_images, made.readings) == (5, 4, 5)
    assert made.seconds == 1.0
    assert (made.without_motor, made.interrupted, asked) == ("", False, [0])
    assert (camera.colour, camera.closed) == (True, True)
    assert len(list(recorded(tmp_path / "new"))) == 14


def test_the_accelerometer_is_that_of_the_kinect(tmp_path: Path) -> None:
    assert run(Camera(100), tmp_path / "second", "usb:1")[1] == [1]
    made, asked = run(Camera(100), tmp_path / "named", "usb:A00367")
    assert asked == []
    assert "serial number" in made.without_motor
    made, asked = run(Camera(100), tmp_path / "socket", "runs/up/ports/kinect")
    assert asked == []
    assert made.without_motor == "only a Kinect on USB has one"


def test_an_interrupted_recording_can_be_played(tmp_path: Path) -> None:
    made, _ = run(Camera(5, KeyboardInterrupt()), tmp_path / "part", seconds=60.0)
    assert made.interrupted
    assert made.depth_images == 3
    assert len(list(recorded_depth(tmp_path / "part"))) == 3


def test_every_image_is_on_the_disk_at_once(tmp_path: Path) -> None:
    """Also a recording whose program was killed can be played."""
    folder = tmp_path / "killed"
    seen: list[int] = []

    class Watched(Camera):
        def read(self, timeout_s: float) -> Frame | None:
            if len(seen) < 4 and (folder / FILE).exists():
                seen.append(len(list(recorded(folder))))
            return super().read(timeout_s)

    run(Watched(100), folder)
    assert seen == [0, 2, 3, 5]  # a depth image comes with a reading


def test_an_unplugged_kinect_leaves_what_came_before(tmp_path: Path) -> None:
    camera = Camera(5, DeviceLost("the Kinect went away"))
    with pytest.raises(DeviceLost, match=r"went away; .*part holds the 3 depth images"):
        run(camera, tmp_path / "part", seconds=60.0)
    assert camera.closed
    assert len(list(recorded_depth(tmp_path / "part"))) == 3


def test_a_copied_recording_ends_with_its_source(tmp_path: Path) -> None:
    made, _ = run(Camera(5, DeviceLost("the recording is over")), tmp_path / "copy", "recording:x", 60.0)
    assert (made.depth_images, made.interrupted) == (3, False)


@pytest.mark.parametrize("end", [KeyboardInterrupt(), DeviceLost("the Kinect went away"), None])
def test_a_folder_without_an_image_can_be_used_again(tmp_path: Path, end: BaseException | None) -> None:
    with pytest.raises((KeyboardInterrupt, DeviceError)):
        run(Camera(0, end), tmp_path / "again")
    made, _ = run(Camera(100), tmp_path / "again")
    assert made.depth_images == 5


@pytest.mark.parametrize("seconds", [0.0, -1.0, 3601.0, float("nan")])
def test_no_time_at_all(tmp_path: Path, seconds: float) -> None:
    with pytest.raises(ConfigError, match="cannot record for"):
        run(Camera(1), tmp_path / "none", seconds=seconds)
    assert not (tmp_path / "none").exists()
