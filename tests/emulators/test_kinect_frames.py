"""The frame server alone, and with the driver's socket source at the other end."""

import socket
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from florence_bt.core.errors import DeviceError, DeviceLost
from florence_bt.core.socket_paths import short_path
from florence_bt.drivers.connection import DeviceReader
from florence_bt.drivers.kinect.codec import METRES_OF_RAW
from florence_bt.drivers.kinect.frames import DepthFrame, Frame, VideoFrame
from florence_bt.drivers.kinect.sources import SocketFrameSource
from florence_bt.simulation.emulators.kinect_frames import KinectFrameServer, pack_depth

DEPTH = np.linspace(0.6, 5.0, 240 * 320, dtype=np.float32).reshape(240, 320)
RAW = np.rint((3.3309495161 - 1.0 / DEPTH) / 0.0030711016).astype(np.uint16)
COLOUR = np.arange(24 * 32 * 3, dtype=np.uint32).astype(np.uint8).reshape(24, 32, 3)


@pytest.fixture
def server(tmp_path: Path) -> Iterator[KinectFrameServer]:
    server = KinectFrameServer(tmp_path / "kinect.sock")
    yield server
    server.close()


@pytest.fixture
def source(server: KinectFrameServer) -> Iterator[SocketFrameSource]:
    source = SocketFrameSource(str(server.path))
    server.poll()
    yield source
    source.close()


def receive(server: KinectFrameServer, source: SocketFrameSource, tries: int = 20) -> Frame | None:
    for _ in range(tries):
        server.poll()
        if (frame := source.read(0.01)) is not None:
            return frame
    return None


@settings(deadline=None)
@given(st.lists(st.integers(0, 2047), max_size=30))
def test_the_packing_is_the_bits_one_after_the_other(values: list[int]) -> None:
    text = "".join(f"{value:011b}" for value in values)
    text += "0" * (-len(text) % 8)
    expected = bytes(int(text[at : at + 8], 2) for at in range(0, len(text), 8))
    assert pack_depth(np.array(values, np.uint16)) == expected


def test_a_depth_image_arrives(server: KinectFrameServer, source: SocketFrameSource) -> None:
    server.send_raw_depth(RAW, 12.5)
    frame = receive(server, source)
    assert isinstance(frame, DepthFrame)
    assert frame.timestamp == 12.5
    metres = frame.metres()
    np.testing.assert_array_equal(metres, METRES_OF_RAW[RAW])
    # Half a quantisation step: 0.5 * 0.0030711016 * z^2.
    assert (np.abs(metres - DEPTH) <= 0.00155 * np.maximum(metres, DEPTH) ** 2).all()


def test_a_colour_image_arrives(server: KinectFrameServer, source: SocketFrameSource) -> None:
    server.send_colour(COLOUR, 3.0)
    frame = receive(server, source)
    assert isinstance(frame, VideoFrame)
    np.testing.assert_array_equal(frame.pixels(), COLOUR)


def test_every_client_gets_the_frames(server: KinectFrameServer) -> None:
    sources = [SocketFrameSource(str(server.path)) for _ in range(3)]
    server.poll()
    assert server.client_count == 3
    server.send_colour(COLOUR, 1.0)
    assert all(receive(server, source) is not None for source in sources)
    sources[1].close()
    server.poll()
    assert server.client_count == 2
    server.send_colour(COLOUR, 2.0)
    for source in (sources[0], sources[2]):
        assert receive(server, source) is not None
        source.close()
    server.send_colour(COLOUR, 3.0)
    assert server.client_count == 0


def test_a_slow_client_misses_frames_and_gets_only_whole_ones(
    server: KinectFrameServer, source: SocketFrameSource
) -> None:
    for count in range(100):
        server.send_raw_depth(RAW, float(count))
    assert server.dropped > 50
    stamps = []
    while (frame := receive(server, source, tries=3)) is not None:
        stamps.append(frame.timestamp)
    assert stamps == sorted(stamps)
    assert stamps[0] == 0.0
    assert len(stamps) == 100 - server.dropped
    assert source.skipped == 0
    server.send_raw_depth(RAW, 200.0)
    frame = receive(server, source)
    assert frame is not None and frame.timestamp == 200.0


def test_garbage_costs_no_frame(server: KinectFrameServer, source: SocketFrameSource) -> None:
    server.faults.garbage = b"FKF1" + bytes(range(256))
    server.send_colour(COLOUR, 1.0)
    server.send_colour(COLOUR, 2.0)
    frames = [receive(server, source) for _ in range(2)]
    assert [frame.timestamp for frame in frames if frame is not None] == [1.0, 2.0]
    assert source.skipped == 260


def test_silence(server: KinectFrameServer, source: SocketFrameSource) -> None:
    server.faults.silent = True
    server.send_colour(COLOUR, 1.0)
    assert source.read(0.0) is None
    server.faults.silent = False
    server.send_colour(COLOUR, 2.0)
    assert receive(server, source) is not None


def test_a_server_that_goes_is_a_lost_device(server: KinectFrameServer, source: SocketFrameSource) -> None:
    server.disconnect_all()
    with pytest.raises(DeviceLost, match="closed"):
        source.read(1.0)
    again = SocketFrameSource(str(server.path))
    server.poll()
    server.send_colour(COLOUR, 1.0)
    assert receive(server, again) is not None
    again.close()
    with pytest.raises(DeviceLost):
        again.read(0.0)


def test_no_server_is_a_lost_device(tmp_path: Path) -> None:
    with pytest.raises(DeviceLost, match="source"):
        SocketFrameSource(str(tmp_path / "nobody.sock"))


def test_a_stale_socket_is_replaced_and_other_files_are_not(tmp_path: Path) -> None:
    path = tmp_path / "kinect.sock"
    stale = socket.socket(socket.AF_UNIX)
    with short_path(path) as place:
        stale.bind(place)
    stale.close()
    KinectFrameServer(path).close()
    assert not path.exists()
    path.write_text("precious")
    with pytest.raises(OSError):
        KinectFrameServer(path)
    assert path.read_text() == "precious"


class Script:
    """A source that plays frames and then fails."""

    def __init__(self, frames: list[Frame | None]) -> None:
        self._frames = frames

    def read(self, timeout_s: float) -> Frame | None:
        if not self._frames:
            raise DeviceLost("unplugged")
        return self._frames.pop(0)

    def close(self) -> None:
        self._frames = []


def test_the_reader_hands_on_frames_and_the_end() -> None:
    frames: list[Frame] = []
    lost: list[DeviceError] = []
    video = VideoFrame(1, 1, 0.0, b"abc")
    reader = DeviceReader(Script([None, video, None, video]).read, frames.append, lost.append, "the Kinect")
    reader.start()
    reader._thread.join(60.0)
    reader.stop()
    assert frames == [video, video]
    assert [str(error) for error in lost] == ["unplugged"]


def test_only_what_is_asked_for_is_sent(server: KinectFrameServer, source: SocketFrameSource) -> None:
    assert server.colour_wanted
    source.request(colour=False)
    server.poll()
    assert not server.colour_wanted
    server.send_colour(COLOUR, 1.0)
    server.send_raw_depth(RAW, 2.0)
    assert isinstance(receive(server, source), DepthFrame)
    source.request(colour=True)
    server.poll()
    server.send_colour(COLOUR, 3.0)
    assert isinstance(receive(server, source), VideoFrame)


def test_a_request_to_a_closed_source(server: KinectFrameServer) -> None:
    source = SocketFrameSource(str(server.path))
    source.close()
    with pytest.raises(DeviceLost):
        source.request(colour=False)
