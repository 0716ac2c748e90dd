"""The socket format, written here by hand from the README, and the driver's images."""

import struct
import zlib
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from florence_bt.core.errors import ConfigError
from florence_bt.drivers.kinect.codec import METRES_OF_RAW, pack_11_bit
from florence_bt.drivers.kinect.driver import KinectDriver, KinectParameters
from florence_bt.drivers.kinect.frames import DepthFrame, Frame, FrameParser, VideoFrame
from tests.sweeps import examples


def frame_bytes(kind: int, width: int, height: int, stamp: float, payload: bytes) -> bytes:
    head = b"FKF1" + struct.pack(">BxHHdI", kind, width, height, stamp, len(payload))
    return head + struct.pack(">I", zlib.crc32(head + b"\0\0\0\0" + payload)) + payload


RAW = np.arange(700, 700 + 32, dtype=np.uint16).reshape(4, 8)
DEPTH = DepthFrame(8, 4, 1.25, pack_11_bit(RAW))
VIDEO = VideoFrame(4, 2, 1.5, bytes(range(24)))
DEPTH_BYTES = frame_bytes(1, 8, 4, 1.25, DEPTH.payload)
VIDEO_BYTES = frame_bytes(2, 4, 2, 1.5, VIDEO.payload)
STREAM = DEPTH_BYTES + VIDEO_BYTES + DEPTH_BYTES
WHOLE: list[Frame] = [DEPTH, VIDEO, DEPTH]


def test_whole_and_byte_by_byte() -> None:
    assert FrameParser().feed(STREAM) == WHOLE
    parser = FrameParser()
    assert [frame for byte in STREAM for frame in parser.feed(bytes([byte]))] == WHOLE
    assert parser.skipped == 0


@settings(deadline=None)
@given(st.lists(st.integers(0, len(STREAM)), max_size=10))
def test_pieces_of_any_size(cuts: list[int]) -> None:
    parser = FrameParser()
    edges = [0, *sorted(cuts), len(STREAM)]
    assert [frame for a, b in pairwise(edges) for frame in parser.feed(STREAM[a:b])] == WHOLE


@settings(deadline=None)
@given(before=st.binary(max_size=100), between=st.binary(max_size=100))
def test_garbage_between_frames_costs_none(before: bytes, between: bytes) -> None:
    parser = FrameParser()
    assert parser.feed(before + DEPTH_BYTES + between + VIDEO_BYTES) == [DEPTH, VIDEO]
    assert parser.skipped == len(before) + len(between)


@settings(max_examples=examples(300))
@given(at=st.integers(0, len(STREAM) - 1), change=st.integers(1, 255))
def test_a_wrong_byte_costs_its_frame_and_no_other(at: int, change: int) -> None:
    broken = bytearray(STREAM)
    broken[at] ^= change
    got = FrameParser().feed(bytes(broken))
    assert len(got) == 2
    assert all(frame in WHOLE for frame in got)


@settings(deadline=None)
@given(st.integers(0, len(DEPTH_BYTES) - 1))
def test_a_frame_cut_short_costs_itself(length: int) -> None:
    parser = FrameParser()
    got = parser.feed(DEPTH_BYTES[:length] + VIDEO_BYTES + DEPTH_BYTES)
    assert got == [VIDEO, DEPTH]


@pytest.mark.parametrize(
    ("kind", "width", "height", "length"),
    [(0, 8, 4, 44), (3, 8, 4, 44), (1, 0, 4, 0), (1, 4000, 4, 22000), (1, 8, 4, 45), (2, 4, 2, 44)],
)
def test_headers_that_make_no_sense_are_no_headers(kind: int, width: int, height: int, length: int) -> None:
    assert FrameParser().feed(frame_bytes(kind, width, height, 0.0, bytes(length)) + VIDEO_BYTES) == [VIDEO]


def test_contents() -> None:
    assert (DEPTH.raw() == RAW).all()
    np.testing.assert_array_equal(DEPTH.metres(), METRES_OF_RAW[RAW])
    assert VIDEO.pixels().shape == (2, 4, 3)
    assert VIDEO.pixels()[1, 0].tolist() == [12, 13, 14]


def test_images_carry_the_time_of_their_arrival() -> None:
    driver = KinectDriver(KinectParameters(depth_time_offset=-0.055))
    image = driver.depth(DEPTH, 100.0)
    assert image is not None
    assert image.stamp == pytest.approx(99.945)
    assert image.frame_id == "camera_depth_optical_frame"
    assert (image.camera.width, image.camera.height) == (8, 4)
    colour = driver.colour(VIDEO, 100.0)
    assert (colour.stamp, colour.frame_id) == (100.0, "camera_rgb_optical_frame")
    assert colour.pixels.shape == (2, 4, 3)


def _passed(wanted: float, offered: float, seconds: float = 10.0, jitter: float = 0.0) -> float:
    driver = KinectDriver(KinectParameters(depth_rate=wanted))
    random = np.random.default_rng(3)
    for count in range(round(offered * seconds)):
        driver.depth(DEPTH, 50.0 + count / offered + jitter * random.uniform(-1.0, 1.0))
    return driver.depth_images / seconds


@pytest.mark.parametrize(
    ("wanted", "offered", "passed"),
    [(0.0, 30.0, 30.0), (10.0, 30.0, 10.0), (20.0, 30.0, 20.0), (30.0, 10.0, 10.0)],
)
def test_the_rate_limit(wanted: float, offered: float, passed: float) -> None:
    assert _passed(wanted, offered) == pytest.approx(passed, rel=0.03)


def test_the_rate_limit_lets_a_jittering_camera_of_that_rate_pass() -> None:
    assert _passed(30.0, 30.0, jitter=0.003) == pytest.approx(30.0, rel=0.03)


def test_silence_and_rate() -> None:
    driver = KinectDriver(KinectParameters())
    assert driver.silent(0.0)
    for count in range(10):
        driver.depth(DEPTH, count * 0.1)
    assert not driver.silent(1.0)
    assert driver.rate(1.0) == pytest.approx(10.0)
    assert driver.silent(3.5)


@pytest.mark.parametrize(
    "wrong",
    [
        {"depth_rate": -1.0},
        {"depth_time_offset": 2.0},
        {"reconnect_delay_s": 0.0},
        {"silence_timeout_s": 0.0},
    ],
)
def test_wrong_parameters_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigError):
        KinectParameters(**wrong)  # type: ignore[arg-type]


def test_a_camera_that_sees_no_distance_is_blind_until_it_sees_one() -> None:
    driver = KinectDriver(KinectParameters())
    assert not driver.blind, "nothing has come"
    nothing = DepthFrame(8, 4, 1.0, pack_11_bit(np.full((4, 8), 2047, np.uint16)))
    driver.depth(nothing, 1.0)
    assert driver.blind
    driver.depth(DEPTH, 2.0)
    assert not driver.blind
