"""Folders of libfreenect's ``record``, which fakenect plays to its programs.

A folder with one file per image and per reading of the accelerometer, and ``INDEX.txt`` with their names in
order. A name is the kind (``d`` depth, ``r`` colour, ``a`` accelerometer), the moment in seconds and the
device's own time. Images have 640 x 480 pixels; smaller ones are written with each pixel repeated. Depth is
raw, 16 bits little-endian (against PGM's rule; fakenect wants it so).
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.closing import Closing
from florence_bt.core.errors import ConfigError, DeviceLost, FrameError
from florence_bt.drivers.kinect.camera import View
from florence_bt.drivers.kinect.frames import DepthEncoding, DepthFrame, Frame, VideoFrame
from florence_bt.drivers.kinect.recording import Reading

INDEX = "INDEX.txt"
NOTES = "florence.json"
"""File of what the format has no place for; other programs pass over it."""
WIDTH, HEIGHT = 640, 480
"""Pixels of the pictures. Source: REFERENCE 5.2."""
DEPTH_HEAD, COLOUR_HEAD = b"P5 640 480 65535\n", b"P6 640 480 255\n"
TICKS_PER_SECOND = 60e6
"""Of the Kinect's clock, whose stamps are in the names of the files; REFERENCE does not have it."""
_READING = struct.Struct("<hhhbxi")
"""Accelerations x, y, z (819 a g), tilt in half degrees, status: the C structure of libfreenect."""


class FakenectWriter(Closing):
    """Writes such a folder; use it in a ``with``. Whenever it ends, what was written can be played.

    Args:
        folder: Is made; may exist, but not with a recording in it.

    Attributes:
        depth_images: How many were written.
        colour_images: How many were written.

    Raises:
        ConfigError: The folder cannot be made or holds a recording.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        try:
            folder.mkdir(parents=True, exist_ok=True)
            # A line at a time: what stands in the index is whole on the disk, whatever ends this program.
            self._index = (folder / INDEX).open("x", encoding="ascii", buffering=1)
        except FileExistsError as error:
            raise ConfigError(f"{folder} holds a recording already", valid=["another folder"]) from error
        except OSError as error:
            raise ConfigError(f"{folder} cannot be written to: {error}", valid=["another folder"]) from error
        self._ticks = 0
        self.depth_images = self.colour_images = 0

    def add(self, frame: Frame, moment: float) -> None:
        """Write an image.

        Args:
            frame: The image.
            moment: When it came, seconds; never earlier than the one before.

        Raises:
            FrameError: Its size does not go into 640 x 480.
        """
        self._ticks = int(frame.timestamp * TICKS_PER_SECOND) & 0xFFFFFFFF
        if isinstance(frame, DepthFrame):
            if not self.depth_images:
                self._write_notes(frame.view)
            self.depth_images += 1
            self._write("d", "pgm", moment, DEPTH_HEAD + _enlarged(frame.raw()).astype("<u2").tobytes())
        elif isinstance(frame, VideoFrame):
            self.colour_images += 1
            self._write("r", "ppm", moment, COLOUR_HEAD + _enlarged(frame.pixels()).tobytes())

    def add_reading(self, reading: Reading, moment: float) -> None:
        """Write a reading of accelerometer and motor; the moment is as in :meth:`add`."""
        packed = _READING.pack(*reading.acceleration, reading.tilt, reading.status)
        self._write("a", "dump", moment, packed)

    def close(self) -> None:
        """End the recording; one without images leaves no index, so that the folder may be used again."""
        self._index.close()
        if not self.depth_images and not self.colour_images:
            (self._folder / INDEX).unlink(missing_ok=True)

    def _write(self, kind: str, ending: str, moment: float, content: bytes) -> None:
        name = f"{kind}-{moment:.6f}-{self._ticks}.{ending}"
        (self._folder / name).write_bytes(content)
        self._index.write(name + "\n")

    def _write_notes(self, view: View) -> None:
        (self._folder / NOTES).write_text(json.dumps({"view": view.value}) + "\n", encoding="ascii")


def recorded_view(folder: Path) -> View:
    """Return where a recording's depth images were taken: at the depth camera if other programs made it.

    Raises:
        DeviceLost: The folder's notes are damaged.
    """
    try:
        return View(json.loads((folder / NOTES).read_text(encoding="utf-8"))["view"])
    except FileNotFoundError:
        return View.DEPTH
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DeviceLost(f"{folder / NOTES} is damaged ({error}): delete it or record again") from error


def recorded(folder: Path) -> Iterator[tuple[float, Frame | Reading]]:
    """Yield what such a folder holds in order, each with the moment when it came, seconds since 1970.

    Raises:
        DeviceLost: The folder is not a recording, or damaged; names the file.
    """
    view = recorded_view(folder)
    for name in check_recording(folder):
        try:
            moment, ticks = (float(part) for part in name.rpartition(".")[0].split("-")[1:])
            content = (folder / name).read_bytes()
            yield moment, _part(name[0], ticks / TICKS_PER_SECOND, content, view)
        except (ValueError, struct.error) as error:
            raise DeviceLost(f"the recording {folder} is damaged: {name!r}: {error}") from error


def _part(kind: str, stamp: float, content: bytes, view: View) -> Frame | Reading:
    if kind == "a":
        x, y, z, tilt, status = _READING.unpack_from(content)
        return Reading((x, y, z), tilt, status)
    values = content.partition(b"\n")[2]
    if kind == "r":
        return VideoFrame(WIDTH, HEIGHT, stamp, values[: 3 * WIDTH * HEIGHT])
    raw = np.frombuffer(values[: 2 * WIDTH * HEIGHT], "<u2")
    return DepthFrame(WIDTH, HEIGHT, stamp, raw, DepthEncoding.RAW, view)


def check_recording(folder: Path) -> list[str]:
    """Make sure that fakenect can play a folder: it trusts the files and reads beyond the end of short ones.

    Returns:
        The names of the files in order.

    Raises:
        DeviceLost: It cannot; names the file.
    """
    try:
        names = (folder / INDEX).read_text(encoding="ascii").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise DeviceLost(
            f"{folder} is not a folder of libfreenect's record ({error}); make one with it, or with "
            "`florence kinect convert`"
        ) from error
    if not any(name.startswith("d-") for name in names):
        raise DeviceLost(f"the recording {folder} holds no depth image")
    for name in names:
        _check_file(folder, name)
    return names


def _check_file(folder: Path, name: str) -> None:
    kind, least = name[:1], {"d": 2 * WIDTH * HEIGHT, "r": 3 * WIDTH * HEIGHT, "a": 0}
    try:
        with (folder / name).open("rb") as file:
            head = file.read(64).partition(b"\n")[0]
            size = file.seek(0, 2)
    except (OSError, ValueError) as error:
        raise DeviceLost(f"the recording {folder} is damaged: {name}: {error}") from error
    if kind not in least or "/" in name or not size:
        raise DeviceLost(f"the recording {folder} is damaged: what is {name!r}?")
    if kind == "a":
        return
    if b"640 480" not in head or size - len(head) - 1 < least[kind]:
        raise DeviceLost(f"the recording {folder} is damaged: {name} is not a whole image of 640 x 480")


def _enlarged(image: NDArray[np.generic]) -> NDArray[np.generic]:
    """Return the image with each pixel repeated as often as 640 x 480 needs."""
    rows, columns = image.shape[:2]
    times = WIDTH // columns
    if (columns * times, rows * times) != (WIDTH, HEIGHT):
        raise FrameError(f"an image of {columns} x {rows} does not go into 640 x 480 (320 x 240 would)")
    return image.repeat(times, axis=0).repeat(times, axis=1)
