"""A Kinect through libfreenect on the wall clock: ``--device kinect=usb``, or a recording played by fakenect.

With ``--device kinect=usb`` its motor is tested too; the head moves by five degrees, if ``--may-drive``.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from florence_bt.core.errors import DeviceLost
from florence_bt.drivers.kinect.driver import KinectDriver, KinectParameters
from florence_bt.drivers.kinect.fakenect import FakenectWriter
from florence_bt.drivers.kinect.frames import DepthEncoding, DepthFrame, Frame, VideoFrame
from florence_bt.drivers.kinect.freenect_source import FOLDER_VARIABLE, find_fakenect
from florence_bt.drivers.kinect.motor import codec
from florence_bt.drivers.kinect.motor.usb_motor import UsbMotor
from florence_bt.drivers.kinect.sources import FrameSource, open_source
from florence_bt.simulation.emulators.kinect_motor import KinectMotorBackend

pytestmark = pytest.mark.slow

DevicePath = Callable[..., tuple[str, str] | None]
PICTURES = 75
LONGEST_S = 60.0


@pytest.fixture
def source(device_path: DevicePath, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[FrameSource]:
    found = device_path("kinect")
    if found is None:
        try:
            find_fakenect()
        except DeviceLost as missing:
            pytest.skip(str(missing))
        monkeypatch.setenv(FOLDER_VARIABLE, "")
        record(tmp_path / "recording")
        found = ("kinect", f"recording:{tmp_path / 'recording'}")
    opened = open_source(KinectParameters(source=found[1]))
    yield opened
    opened.close()


def record(folder: Path) -> None:
    raw = np.tile(np.linspace(600, 1000, 640).astype(np.uint16), (480, 1))
    pixels = np.random.default_rng(1).integers(0, 256, (480, 640, 3)).astype(np.uint8)
    with FakenectWriter(folder) as writer:
        for count in range(PICTURES):
            moment = 10.0 + count / 30
            writer.add(DepthFrame(640, 480, moment, raw, DepthEncoding.RAW), moment)
            writer.add(VideoFrame(640, 480, moment, pixels), moment + 0.015)


@pytest.fixture
def motor(device_path: DevicePath) -> Iterator[UsbMotor]:
    found = device_path("kinect")
    opened = UsbMotor() if found is not None else UsbMotor(backend=KinectMotorBackend(time.monotonic))
    yield opened
    opened.close()


def frames_of(source: FrameSource, count: int, kind: type = DepthFrame) -> list[Frame]:
    """Frames until this many of a kind have come, however slow this machine is."""
    frames: list[Frame] = []
    end = time.monotonic() + LONGEST_S
    while sum(isinstance(frame, kind) for frame in frames) < count:
        assert time.monotonic() < end, f"only {len(frames)} images came: has the camera its 12 V?"
        if (frame := source.read(0.1)) is not None:
            frames.append(frame)
    return frames


def test_depth_and_colour_at_their_rate(source: FrameSource) -> None:
    frames = frames_of(source, 30)
    depth = [frame for frame in frames if isinstance(frame, DepthFrame)]
    colour = [frame for frame in frames if isinstance(frame, VideoFrame)]
    for images in (depth, colour):  # by the device's own clock: a busy machine is late, the device is not
        gaps = np.diff([image.timestamp for image in images])
        assert np.median(gaps) == pytest.approx(1.0 / 30.0, rel=0.2)
    driver = KinectDriver(KinectParameters())
    image = driver.depth(depth[-1], 0.0)
    assert image is not None
    seen = image.depth[np.isfinite(image.depth)]
    assert seen.size > 0.1 * image.depth.size, "turn the camera to something 1 to 4 m away"
    assert 0.3 < np.median(seen) < 10.0
    found = driver.coloured_points(driver.colour(colour[-1], 0.0))
    assert found is not None and found[1].shape == (240, 320, 4)


def test_colour_stops_and_comes_back(source: FrameSource) -> None:
    source.request(colour=False)
    frames_of(source, 10)
    assert all(isinstance(frame, DepthFrame) for frame in frames_of(source, 10))
    source.request(colour=True)
    assert frames_of(source, 1, VideoFrame)


def test_gravity_and_light(motor: UsbMotor) -> None:
    state = motor.read(0.0)
    assert np.linalg.norm(state.acceleration) == pytest.approx(codec.GRAVITY, rel=0.1)
    assert state.acceleration[1] > 5.0
    for option in (2, 1):
        motor.send(codec.led_request(option))
        motor.read(0.0)


def test_the_head_tilts(motor: UsbMotor, device_path: DevicePath, may_drive: bool) -> None:
    if device_path("kinect") is not None and not may_drive:
        pytest.skip("the head may not move: give --may-drive")
    for target in (5.0, 0.0):
        motor.send(codec.tilt_request(target))
        states = [motor.read(0.1) for _ in range(30)]
        assert states[-1].status == codec.TiltStatus.STOPPED
        assert states[-1].tilt_deg == pytest.approx(target, abs=2.0)
