"""The real libfreenect path: fakenect, libfreenect's own player, plays recordings to our source.

Needs Debian's packages libfreenect0.5 and libfreenect-bin; skipped without them.
"""

import os
import shutil
import subprocess
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from florence_bt.cli.application import app
from florence_bt.core.errors import DeviceLost
from florence_bt.drivers.kinect.camera import View
from florence_bt.drivers.kinect.driver import KinectDriver, KinectParameters
from florence_bt.drivers.kinect.fakenect import INDEX, NOTES, FakenectWriter
from florence_bt.drivers.kinect.frames import DepthEncoding, DepthFrame, Frame, VideoFrame
from florence_bt.drivers.kinect.freenect_library import NAMES
from florence_bt.drivers.kinect.freenect_source import FOLDER_VARIABLE, FreenectSource, find_fakenect
from florence_bt.drivers.kinect.recording import Reading
from florence_bt.drivers.kinect.sources import FrameSource, open_source
from florence_bt.simulation.emulators.kinect_frames import KinectFrameServer

try:
    FAKENECT = find_fakenect()
except DeviceLost as missing:
    pytest.skip(str(missing), allow_module_level=True)

RANDOM = np.random.default_rng(5)
RAW = RANDOM.integers(0, 2048, (3, 480, 640)).astype(np.uint16)
PIXELS = RANDOM.integers(0, 256, (3, 480, 640, 3)).astype(np.uint8)
SMALL_RAW = RANDOM.integers(400, 1100, (240, 320)).astype(np.uint16)
SMALL_PIXELS = RANDOM.integers(0, 256, (240, 320, 3)).astype(np.uint8)


@pytest.fixture(autouse=True)
def folder_variable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(FOLDER_VARIABLE, "")


def write(folder: Path, count: int = 3, view: View = View.DEPTH) -> Path:
    with FakenectWriter(folder) as writer:
        for n in range(count):
            moment = 1000.0 + n / 100
            depth = DepthFrame(640, 480, 5.0 + n, RAW[n], DepthEncoding.RAW, view)
            writer.add(depth, moment)
            writer.add(VideoFrame(640, 480, 5.0 + n, PIXELS[n]), moment + 0.001)
            writer.add_reading(Reading((1, 819, -2), 10, 0), moment + 0.002)
    return folder


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write(tmp_path / "recording")


@pytest.fixture
def source(folder: Path) -> Iterator[FreenectSource]:
    source = FreenectSource(folder=str(folder))
    yield source
    source.close()


def everything(source: FrameSource) -> list[Frame]:
    frames = []
    with pytest.raises(DeviceLost, match="is over"):
        while True:
            if (frame := source.read(0.1)) is not None:
                frames.append(frame)
    return frames


def test_every_image_comes_bit_by_bit(source: FreenectSource) -> None:
    frames = everything(source)
    depth = [frame for frame in frames if isinstance(frame, DepthFrame)]
    colour = [frame for frame in frames if isinstance(frame, VideoFrame)]
    assert [frame.timestamp for frame in depth] == [5.0, 6.0, 7.0]
    for n in range(3):
        np.testing.assert_array_equal(depth[n].raw(), RAW[n])
        np.testing.assert_array_equal(colour[n].pixels(), PIXELS[n])


def test_only_depth_while_nobody_wants_colour(source: FreenectSource) -> None:
    source.request(colour=False)
    assert all(isinstance(frame, DepthFrame) for frame in everything(source))


def test_colour_can_be_asked_for_later(source: FreenectSource) -> None:
    source.request(colour=False)
    while source.read(0.1) is None:
        pass
    source.request(colour=True)
    assert any(isinstance(frame, VideoFrame) for frame in everything(source))


def test_the_recording_starts_again_when_it_is_opened_again(folder: Path) -> None:
    for _ in range(2):
        source = FreenectSource(folder=str(folder))
        assert len(everything(source)) == 6
        source.close()
        source.close()
    with pytest.raises(DeviceLost, match="closed"):
        source.read(0.0)


def test_the_library_as_a_parameter_and_the_folder_in_the_environment(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(FOLDER_VARIABLE, str(folder))
    source = open_source(KinectParameters(source="usb", library=FAKENECT))
    assert isinstance(source, FreenectSource)
    assert len(everything(source)) == 6
    source.close()


def test_fakenect_without_a_recording_says_what_to_set() -> None:
    with pytest.raises(DeviceLost, match="recording:FOLDER"):
        FreenectSource(library=FAKENECT)


def test_fakenect_is_not_asked_for_formats_it_would_die_of(folder: Path) -> None:
    source = FreenectSource(folder=str(folder), registered=True)
    frame = everything(source)[0]
    assert isinstance(frame, DepthFrame) and frame.encoding is DepthEncoding.RAW
    source.close()


def test_damaged_recordings_are_refused_before_fakenect_sees_them(folder: Path) -> None:
    image = next(folder.glob("d-*.pgm"))
    image.write_bytes(image.read_bytes()[:1000])
    with pytest.raises(DeviceLost, match=image.name):
        FreenectSource(folder=str(folder))


def test_the_view_of_a_recording(tmp_path: Path) -> None:
    shared = FreenectSource(folder=str(write(tmp_path / "shared", 1, View.SHARED)))
    frame = everything(shared)[0]
    shared.close()
    assert isinstance(frame, DepthFrame) and frame.view is View.SHARED
    other = write(tmp_path / "other", 1)
    (other / NOTES).unlink()
    source = FreenectSource(folder=str(other))
    frame = everything(source)[0]
    source.close()
    assert isinstance(frame, DepthFrame) and frame.view is View.DEPTH


@pytest.mark.skipif(shutil.which("fakenect-record") is None, reason="needs Debian's libfreenect-bin")
def test_libfreenects_own_recorder_reads_and_writes_the_same(folder: Path, tmp_path: Path) -> None:
    again = tmp_path / "again"
    subprocess.run(
        ["fakenect-record", str(again)],
        env=os.environ | {"LD_LIBRARY_PATH": str(Path(FAKENECT).parent), FOLDER_VARIABLE: str(folder)},
        check=True,
        capture_output=True,
        timeout=300,
    )

    def contents(place: Path, kind: str) -> list[bytes]:
        names = [name for name in (place / INDEX).read_text().splitlines() if name.startswith(kind)]
        return [(place / name).read_bytes() for name in names]

    assert contents(again, "d-") == contents(folder, "d-")
    assert contents(again, "r-") == contents(folder, "r-")
    assert contents(folder, "a-")[0] in contents(again, "a-")
    source = FreenectSource(folder=str(again))
    assert len(everything(source)) == 6
    source.close()


def test_a_recording_of_the_simulated_kinect_gives_the_same_image(tmp_path: Path) -> None:
    server = KinectFrameServer(tmp_path / "kinect.sock")
    end = threading.Event()

    def serve() -> None:
        while not end.wait(0.02):
            server.send_raw_depth(SMALL_RAW, 1.0)
            server.send_colour(SMALL_PIXELS, 1.0)

    thread = threading.Thread(target=serve)
    thread.start()
    folder = tmp_path / "seen"
    try:
        command = [
            "kinect",
            "record",
            "--source",
            str(server.path),
            "--folder",
            str(folder),
            "--seconds",
            "0.3",
        ]
        outcome = CliRunner().invoke(app, command)
        direct = open_source(KinectParameters(source=str(server.path)))
        live = [frame for _ in range(40) if (frame := direct.read(0.1)) is not None]
        direct.close()
    finally:
        end.set()
        thread.join()
        server.close()
    assert outcome.exit_code == 0, outcome.output
    assert "depth and" in outcome.output and f"recording:{folder}" in outcome.output
    source = open_source(KinectParameters(source=f"recording:{folder}"))
    played = everything(source)
    source.close()
    assert any(isinstance(frame, DepthFrame) for frame in played)
    driver = KinectDriver(KinectParameters())
    for kind in (DepthFrame, VideoFrame):
        there = next(frame for frame in live if isinstance(frame, kind))
        here = next(frame for frame in played if isinstance(frame, kind))
        if isinstance(there, DepthFrame) and isinstance(here, DepthFrame):
            a, b = driver.depth(there, 1.0), driver.depth(here, 2.0)
            assert a is not None and b is not None
            assert a.camera == b.camera
            np.testing.assert_array_equal(a.depth, b.depth)
        elif isinstance(there, VideoFrame) and isinstance(here, VideoFrame):
            np.testing.assert_array_equal(driver.colour(there, 1.0).pixels, driver.colour(here, 1.0).pixels)


def test_the_real_library_without_a_camera() -> None:
    library = next((file for name in NAMES for file in Path("/usr/lib").glob(f"*/{name}")), None)
    if library is None:
        pytest.skip("libfreenect0.5 is not installed")
    if os.access("/dev/bus/usb", os.R_OK):
        pytest.skip("a camera may be plugged in here")
    with pytest.raises(DeviceLost, match=r"no Kinect on USB.*12 V|finds no USB"):
        FreenectSource(library=str(library))
