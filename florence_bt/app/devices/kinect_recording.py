"""Records a Kinect, real or simulated, and converts recordings from and to folders of libfreenect."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from florence_bt.core.errors import ConfigError, DeviceError, DeviceLost, DeviceTimeout
from florence_bt.drivers.kinect.driver import KinectParameters
from florence_bt.drivers.kinect.fakenect import INDEX, FakenectWriter
from florence_bt.drivers.kinect.fakenect import recorded as recorded_by_fakenect
from florence_bt.drivers.kinect.frames import DepthFrame, Frame
from florence_bt.drivers.kinect.motor.usb_motor import UsbMotor
from florence_bt.drivers.kinect.recording import Reading, RecordingWriter, file_of, recorded
from florence_bt.drivers.kinect.sources import RECORDING, USB, FrameSource, open_source

LONGEST_S = 3600.0
PATIENCE_S = 10.0
"""Without an image for this long the camera counts as silent."""
FRAME_WAIT_S = 0.1
"""Longest wait for a frame: Ctrl-C is heard so soon. Chosen."""


@dataclass(frozen=True, slots=True)
class Recorded:
    """The contents of a recording.

    Attributes:
        seconds: Between the first and the last image.
        depth_images: How many.
        colour_images: How many.
        readings: How many of the accelerometer.
        without_motor: Why there is none; empty when there are some.
        interrupted: Whether Ctrl-C ended it early.
    """

    seconds: float
    depth_images: int
    colour_images: int
    readings: int
    without_motor: str
    interrupted: bool = False


def record(
    source: str,
    folder: Path,
    seconds: float,
    *,
    colour: bool = True,
    library: str = "",
    wall_time: Callable[[], float] | None = None,
    open_camera: Callable[[KinectParameters], FrameSource] = open_source,
    open_motor: Callable[[int], UsbMotor] = UsbMotor,
) -> Recorded:
    """Record.

    Args:
        source: As the parameter ``source`` of the Kinect's node.
        folder: Is made.
        seconds: How long, counted from the first image.
        colour: Whether colour images are recorded too.
        library: The file of libfreenect; the usual ones when empty.
        wall_time: Gives the moments of the images, seconds; by default the date at the beginning, and steady
            seconds from there: the machine's clock may be set meanwhile.
        open_camera: Opens what the source names.
        open_motor: Opens the motor, which has the accelerometer; asked only for a Kinect on USB.

    Raises:
        ConfigError: The time or the folder cannot be used.
        DeviceError: There is no camera, or it fails; what came before that is kept.
        KeyboardInterrupt: Ctrl-C before the first image; later it ends the recording early.
    """
    if not 0.0 < seconds <= LONGEST_S:
        raise ConfigError(f"cannot record for {seconds:g} s", valid=[f"more than 0, at most {LONGEST_S:g} s"])
    parameters = KinectParameters(source=source, library=library)
    with closing(open_camera(parameters)) as camera:
        camera.request(colour=colour)
        with closing(_Accelerometer(source, open_motor)) as accelerometer, RecordingWriter(folder) as writer:
            loop = _Loop(camera, accelerometer, writer, wall_time or _date_at_first())
            interrupted = _run(loop, seconds, writer, f"{folder}", copies=source.startswith(f"{RECORDING}:"))
            return Recorded(
                loop.last - loop.first,
                writer.depth_images,
                writer.colour_images,
                accelerometer.readings,
                accelerometer.problem,
                interrupted,
            )


def convert(source: Path, target: Path) -> tuple[int, int]:
    """Make a recording of a folder of libfreenect's ``record``, or the other way round.

    Args:
        source: A folder of one or the other, or the file of a recording.
        target: The folder of the other; may be the same.

    Returns:
        How many depth and colour images.

    Raises:
        ConfigError: The target holds such a recording already, or cannot be written to.
        DeviceLost: The source is neither, empty, or damaged. Unless something was read, no target is made.
    """
    foreign = (source / INDEX).exists() and not file_of(source).exists()
    parts = recorded_by_fakenect(source) if foreign else recorded(source)
    first = next(parts, None)  # before the target is made
    if first is None:
        raise DeviceLost(f"the recording {source} holds nothing")
    with RecordingWriter(target) if foreign else FakenectWriter(target) as writer:
        for moment, part in chain([first], parts):
            if isinstance(part, Reading):
                writer.add_reading(part, moment)
            else:
                writer.add(part, moment)
        return writer.depth_images, writer.colour_images


def _date_at_first() -> Callable[[], float]:
    begun = time.time() - time.monotonic()
    return lambda: begun + time.monotonic()


def _run(loop: _Loop, seconds: float, writer: RecordingWriter, folder: str, *, copies: bool) -> bool:
    """Record; True when it was interrupted. A recording that is copied ends as it is meant to."""
    try:
        loop.run(seconds)
    except KeyboardInterrupt:
        if not writer.depth_images:
            raise
        return True
    except DeviceError as error:
        if not writer.depth_images:
            raise
        if not copies:
            kept = f"{folder} holds the {writer.depth_images} depth images that came before"
            raise DeviceLost(f"{error}; {kept}") from error
    return False


class _Accelerometer:
    """The motor of a Kinect on USB, if it can be had: a recording is useful without."""

    def __init__(self, source: str, open_motor: Callable[[int], UsbMotor]) -> None:
        self.readings = 0
        self.problem = ""
        self._motor: UsbMotor | None = None
        kind, _, device = source.partition(":")
        if kind != USB:
            self.problem = "only a Kinect on USB has one"
            return
        if device and not device.isdecimal():
            self.problem = "a serial number does not say whose motor it is; name the Kinect as usb:0 or usb:1"
            return
        try:
            self._motor = open_motor(int(device or 0))
        except DeviceError as error:
            self.problem = str(error)

    def write_to(self, writer: RecordingWriter, moment: float) -> None:
        if self._motor is None:
            return
        try:
            state = self._motor.read(0.0)
        except DeviceError as error:
            self.problem = str(error)
            self.close()
            return
        if state.half_degrees is not None:
            writer.add_reading(Reading(state.counts, state.half_degrees, state.status), moment)
            self.readings += 1

    def close(self) -> None:
        motor, self._motor = self._motor, None
        if motor is not None:
            motor.close()


class _Loop:
    """Moves images from the camera to the files."""

    def __init__(
        self,
        camera: FrameSource,
        accelerometer: _Accelerometer,
        writer: RecordingWriter,
        wall_time: Callable[[], float],
    ) -> None:
        self._camera = camera
        self._accelerometer = accelerometer
        self._writer = writer
        self._wall_time = wall_time
        self._last_depth = wall_time()
        self.first = self.last = 0.0

    def run(self, seconds: float) -> None:
        while not self._writer.depth_images or self._wall_time() < self.first + seconds:
            frame = self._camera.read(FRAME_WAIT_S)
            now = self._wall_time()
            if frame is not None:
                self._take(frame, now)
            if now - self._last_depth > PATIENCE_S:
                raise DeviceTimeout(f"the Kinect sent no depth image for {PATIENCE_S:g} s")

    def _take(self, frame: Frame, now: float) -> None:
        if not self._writer.depth_images:
            self.first = now
        self.last = now
        self._writer.add(frame, now)
        if isinstance(frame, DepthFrame):
            self._last_depth = now
            self._accelerometer.write_to(self._writer, now)
