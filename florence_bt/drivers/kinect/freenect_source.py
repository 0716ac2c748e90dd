"""Frames of a real Kinect through libfreenect, or of a recording through libfreenect's fakenect."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable
from pathlib import Path

import numpy as np

from florence_bt.core.errors import DeviceLost
from florence_bt.drivers.kinect.camera import View
from florence_bt.drivers.kinect.fakenect import (
    HEIGHT,
    TICKS_PER_SECOND,
    WIDTH,
    check_recording,
    recorded_view,
)
from florence_bt.drivers.kinect.frames import DepthEncoding, DepthFrame, Frame, VideoFrame
from florence_bt.drivers.kinect.freenect_library import DepthFormat, FrameMode, FreenectLibrary, VideoFormat

LONGEST_QUEUE = 8
"""Frames that wait to be taken; of more the oldest go. Chosen: 0.13 s of both pictures."""
FOLDER_VARIABLE = "FAKENECT_PATH"
FAKENECT_FOLDERS = ("/usr/lib", "/usr/local/lib", "/usr/lib64")
FAKENECT_INSTALL = "sudo apt install libfreenect-bin"
UDEV = (
    "if this user may not open it, copy config/udev/99-florence.rules to /etc/udev/rules.d/ and plug it in "
    "again; if another program uses it, end that program"
)
POWER = "check its USB plug and its 12 V supply (on the robot digital output 0 of the base)"


class FreenectSource:
    """Images of 640 x 480; a :class:`~florence_bt.drivers.kinect.sources.FrameSource`.

    Images are written by the library to where they stay; nothing is copied.

    Args:
        device: The camera's number from 0, or its serial number.
        registered: Have the library move depth images to the colour camera's view, where it can.
        library: The file of the library; the usual names when empty.
        folder: A recording to play instead of a camera.
        load: Loads the library.

    Raises:
        DeviceLost: No library, no camera, or it may not be opened; the message says what to do.
    """

    def __init__(
        self,
        device: str = "0",
        *,
        registered: bool = False,
        library: str = "",
        folder: str = "",
        load: Callable[[str], FreenectLibrary] = FreenectLibrary,
    ) -> None:
        if folder:
            library = library or find_fakenect()
            os.environ[FOLDER_VARIABLE] = folder
        self._frames: deque[Frame] = deque(maxlen=LONGEST_QUEUE)
        self._library: FreenectLibrary | None = load(library)
        self._colour_wanted = True
        self._colour_runs = False
        try:
            self._recording = _recording_of(self._library)
            self._view = recorded_view(self._recording) if self._recording else View.DEPTH
            self._open(self._library, device)
            self._start_depth(self._library, registered)
        except DeviceLost:
            self.close()
            raise

    def read(self, timeout_s: float) -> Frame | None:
        """Wait for the next frame; see :class:`~florence_bt.drivers.kinect.sources.FrameSource`."""
        if not self._frames:
            library = self._open_library()
            self._apply_colour_request(library)
            try:
                library.process_events(timeout_s)
            except DeviceLost as error:
                if self._recording is None:
                    raise
                raise DeviceLost(f"the recording {self._recording} is over; it starts again") from error
        return self._frames.popleft() if self._frames else None

    def request(self, *, colour: bool) -> None:
        """Tell whether colour images are wanted besides the depth images.

        The stream is started or stopped by the next :meth:`read`, on the reader's thread.
        """
        self._open_library()
        self._colour_wanted = colour

    def close(self) -> None:
        """Close the camera; harmless when called twice."""
        library, self._library = self._library, None
        if library is not None:
            for stream in ("video", "depth"):
                library.stop(stream)
            library.close()

    def _open(self, library: FreenectLibrary, device: str) -> None:
        if library.device_count() < 1:
            raise DeviceLost(f"no Kinect on USB; {POWER}, or play a recording (source: recording:FOLDER)")
        try:
            library.open_device(device)
        except DeviceLost as error:
            raise DeviceLost(f"{error}; {UDEV}") from error

    def _start_depth(self, library: FreenectLibrary, registered: bool) -> None:
        mode = library.find_mode("depth", DepthFormat.REGISTERED) if registered else None
        if mode is not None:
            self._view, self._encoding = View.COLOUR, DepthEncoding.MILLIMETRES
        else:
            mode = _needed(library.find_mode("depth", DepthFormat.RAW_11_BIT), "raw depth")
            self._encoding = DepthEncoding.RAW
        self._depth = np.empty((HEIGHT, WIDTH), np.uint16)
        library.start("depth", mode, self._depth, self._on_depth)

    def _apply_colour_request(self, library: FreenectLibrary) -> None:
        if self._colour_wanted == self._colour_runs:
            return
        if self._colour_wanted:
            self._colour = np.empty((HEIGHT, WIDTH, 3), np.uint8)
            mode = _needed(library.find_mode("video", VideoFormat.RGB), "colour")
            library.start("video", mode, self._colour, self._on_colour)
        else:
            library.stop("video")
        self._colour_runs = self._colour_wanted

    def _on_depth(self, ticks: int) -> None:
        timestamp = ticks / TICKS_PER_SECOND
        self._frames.append(DepthFrame(WIDTH, HEIGHT, timestamp, self._depth, self._encoding, self._view))
        self._depth = np.empty((HEIGHT, WIDTH), np.uint16)
        self._open_library().set_buffer("depth", self._depth)

    def _on_colour(self, ticks: int) -> None:
        self._frames.append(VideoFrame(WIDTH, HEIGHT, ticks / TICKS_PER_SECOND, self._colour))
        self._colour = np.empty((HEIGHT, WIDTH, 3), np.uint8)
        self._open_library().set_buffer("video", self._colour)

    def _open_library(self) -> FreenectLibrary:
        if self._library is None:
            raise DeviceLost("the Kinect was closed")
        return self._library


def find_fakenect() -> str:
    """Return the file of fakenect, libfreenect's player of recordings.

    It is looked for in the folders of ``LD_LIBRARY_PATH`` and where packages put it.

    Raises:
        DeviceLost: It is not installed.
    """
    searched = [folder for folder in os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep) if folder]
    for folder in (*searched, *FAKENECT_FOLDERS):
        for pattern in ("fakenect/libfreenect.so.0*", "*/fakenect/libfreenect.so.0*"):
            for file in sorted(Path(folder).glob(pattern)):
                return str(file)
    raise DeviceLost(
        f"playing a recording needs fakenect: {FAKENECT_INSTALL}, or name its libfreenect.so with 'library'"
    )


def _recording_of(library: FreenectLibrary) -> Path | None:
    """Return the folder that fakenect will play, checked: fakenect itself ends the process when it cannot."""
    if not library.plays_recordings:
        return None
    folder = os.environ.get(FOLDER_VARIABLE)
    if not folder:
        raise DeviceLost(
            f"{library.file} is fakenect, which plays recordings: set source to recording:FOLDER, or the "
            f"environment variable {FOLDER_VARIABLE} to a folder that `florence kinect record` made"
        )
    check_recording(Path(folder))
    return Path(folder)


def _needed(mode: FrameMode | None, what: str) -> FrameMode:
    if mode is None:
        raise DeviceLost(f"this libfreenect has no {what} of 640 x 480: install libfreenect 0.5")
    return mode
