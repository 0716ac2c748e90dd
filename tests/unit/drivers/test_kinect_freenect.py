"""The source over libfreenect, with a library that follows a script instead of a camera."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from florence_bt.core.errors import DeviceLost
from florence_bt.drivers.kinect import freenect_source
from florence_bt.drivers.kinect.camera import View
from florence_bt.drivers.kinect.driver import KinectParameters
from florence_bt.drivers.kinect.frames import DepthEncoding, DepthFrame, VideoFrame
from florence_bt.drivers.kinect.freenect_library import DepthFormat, FrameMode, FreenectLibrary
from florence_bt.drivers.kinect.freenect_source import FreenectSource, find_fakenect
from florence_bt.drivers.kinect.sources import open_source


class ScriptedLibrary:
    """Answers like :class:`FreenectLibrary`; an image of each running stream per call."""

    file = "scripted"
    plays_recordings = False

    def __init__(self, cameras: int = 1, formats: tuple[int, ...] = (0, 4), opens: bool = True) -> None:
        self.cameras, self.formats, self.opens = cameras, formats, opens
        self.running: dict[str, Callable[[int], None]] = {}
        self.buffers: dict[str, Any] = {}
        self.modes: dict[str, int] = {}
        self.lost = self.closed = False
        self.images = 0
        self.opened = ""

    def device_count(self) -> int:
        return self.cameras

    def open_device(self, device: str) -> None:
        if not self.opens:
            raise DeviceLost("Kinect '0' cannot be opened (Could not open camera: LIBUSB_ERROR_ACCESS)")
        self.opened = device

    def find_mode(self, stream: str, format_: int) -> FrameMode | None:
        if stream == "depth" and format_ not in self.formats:
            return None
        return FrameMode(format=format_)

    def start(
        self, stream: str, mode: FrameMode, buffer: np.ndarray[Any, Any], on_frame: Callable[[int], None]
    ) -> None:
        self.modes[stream] = mode.format
        self.buffers[stream] = buffer
        self.running[stream] = on_frame

    def set_buffer(self, stream: str, buffer: np.ndarray[Any, Any]) -> None:
        self.buffers[stream] = buffer

    def stop(self, stream: str) -> None:
        self.running.pop(stream, None)

    def process_events(self, timeout_s: float) -> None:
        if self.lost:
            raise DeviceLost("the Kinect went away (USB camera marked dead)")
        for stream, on_frame in list(self.running.items()):
            self.images += 1
            self.buffers[stream].fill(self.images)
            on_frame(60_000_000 * self.images)

    def close(self) -> None:
        self.closed = True


def source_of(library: ScriptedLibrary, **options: Any) -> FreenectSource:
    return FreenectSource(load=lambda file: library, **options)  # type: ignore[arg-type,return-value]


def test_images_stay_what_they_were() -> None:
    source = source_of(ScriptedLibrary())
    frames = [source.read(0.0) for _ in range(6)]
    values = [int(np.asarray(frame.payload).max()) for frame in frames if frame is not None]
    assert values == [1, 2, 3, 4, 5, 6]
    assert [type(frame) for frame in frames] == [DepthFrame, VideoFrame] * 3
    assert frames[0] is not None and frames[0].timestamp == 1.0


def test_raw_depth_from_the_depth_camera_unless_registration_is_wanted() -> None:
    frame = source_of(ScriptedLibrary()).read(0.0)
    assert isinstance(frame, DepthFrame)
    assert (frame.encoding, frame.view) == (DepthEncoding.RAW, View.DEPTH)
    library = ScriptedLibrary()
    frame = source_of(library, registered=True).read(0.0)
    assert isinstance(frame, DepthFrame)
    assert (frame.encoding, frame.view) == (DepthEncoding.MILLIMETRES, View.COLOUR)
    assert library.modes["depth"] == DepthFormat.REGISTERED


def test_colour_runs_while_it_is_wanted() -> None:
    library = ScriptedLibrary()
    source = source_of(library)
    source.request(colour=False)
    source.read(0.0)
    assert set(library.running) == {"depth"}
    source.request(colour=True)
    assert set(library.running) == {"depth"}, "the stream is started by the thread that reads"
    source.read(0.0)
    assert set(library.running) == {"depth", "video"}
    source.request(colour=False)
    while source.read(0.0) is not None and "video" in library.running:
        pass
    assert set(library.running) == {"depth"}


def test_a_camera_that_goes_is_lost_and_closed_once() -> None:
    library = ScriptedLibrary()
    source = source_of(library)
    library.lost = True
    with pytest.raises(DeviceLost, match="went away"):
        source.read(0.0)
    source.close()
    source.close()
    assert library.closed and not library.running
    for call in (lambda: source.read(0.0), lambda: source.request(colour=True)):
        with pytest.raises(DeviceLost, match="closed"):
            call()


@pytest.mark.parametrize(
    ("library", "said"),
    [
        (ScriptedLibrary(cameras=0), r"no Kinect on USB.*12 V.*recording:FOLDER"),
        (ScriptedLibrary(opens=False), r"LIBUSB_ERROR_ACCESS.*99-florence\.rules"),
        (ScriptedLibrary(formats=()), r"no raw depth.*libfreenect 0\.5"),
    ],
)
def test_what_is_missing_is_said_and_the_library_closed(library: ScriptedLibrary, said: str) -> None:
    with pytest.raises(DeviceLost, match=said):
        source_of(library)
    assert library.closed


def test_no_library_names_the_package(tmp_path: Path) -> None:
    with pytest.raises(DeviceLost, match=r"apt install libfreenect0\.5.*'library'"):
        FreenectLibrary(str(tmp_path / "libfreenect.so"))
    with pytest.raises(DeviceLost, match=r"libc.*is not libfreenect"):
        FreenectLibrary("libc.so.6")


def test_no_player_names_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(freenect_source, "FAKENECT_FOLDERS", (str(tmp_path),))
    monkeypatch.setenv("LD_LIBRARY_PATH", "")
    with pytest.raises(DeviceLost, match="apt install libfreenect-bin"):
        find_fakenect()
    player = tmp_path / "some-arch" / "fakenect" / "libfreenect.so.0.5"
    player.parent.mkdir(parents=True)
    player.touch()
    assert find_fakenect() == str(player)
    monkeypatch.setattr(freenect_source, "FAKENECT_FOLDERS", ())
    monkeypatch.setenv("LD_LIBRARY_PATH", f"/nowhere:{tmp_path / 'some-arch'}")
    assert find_fakenect() == str(player)


def test_the_number_or_serial_of_the_camera_is_passed_on() -> None:
    library = ScriptedLibrary()
    source_of(library, device="A00367A00000000A")
    assert library.opened == "A00367A00000000A"


def test_a_source_that_does_not_exist(tmp_path: Path) -> None:
    with pytest.raises(DeviceLost, match="usb"):
        open_source(KinectParameters(source=str(tmp_path / "nobody.sock")))
    with pytest.raises(DeviceLost, match="libfreenect"):
        open_source(KinectParameters(source="usb:1", library=str(tmp_path / "nothing.so")))
