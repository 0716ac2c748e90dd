"""Recordings of a Kinect: one MCAP file in a folder, of messages of ROS 2, read and written without ROS.

Depth images are ``sensor_msgs/msg/Image`` with the raw values of the device (``mono16``), or with millimetres
(``16UC1``) where the library has converted them. The frame is the :class:`View`, the stamp the device's time;
a message's own time is when it came. Readings of accelerometer and motor are JSON. Source of the layout: CDR
of the OMG (DDS-XTypes 1.3, 7.4), as ROS 2 uses it.
"""

from __future__ import annotations

import json
import struct
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.closing import Closing
from florence_bt.core.errors import ConfigError, DeviceLost
from florence_bt.core.installation import how_to_get
from florence_bt.drivers.kinect.camera import View
from florence_bt.drivers.kinect.frames import (
    LARGEST_SIDE,
    DepthEncoding,
    DepthFrame,
    Frame,
    VideoFrame,
)

FILE = "kinect.mcap"
DEPTH, COLOUR, READING = "/kinect/depth", "/kinect/colour", "/kinect/reading"
"""The topics."""
RAW, MILLIMETRES, RGB = "mono16", "16UC1", "rgb8"
"""Encodings of ROS (sensor_msgs/image_encodings.hpp)."""
LARGEST_RECORD = 1 << 27
"""Bytes; a file that announces a longer record is damaged. Chosen."""
LONGEST_GAP_S = 1.0
"""A longer pause between two parts of a recording, or one below 0, was a clock that was set, or no camera."""
IMAGE_SCHEMA = f"""\
std_msgs/Header header
uint32 height
uint32 width
string encoding
uint8 is_bigendian
uint32 step
uint8[] data
{"=" * 80}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{"=" * 80}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
_CDR = b"\0\1\0\0"
"""Little-endian."""
_TIME, _PAIR, _LENGTH = struct.Struct("<iI"), struct.Struct("<II"), struct.Struct("<I")
_NS = 1_000_000_000
"""Nanoseconds of a second."""


@dataclass(frozen=True, slots=True)
class Reading:
    """A reading of accelerometer and motor.

    Attributes:
        acceleration: x, y, z; 819 a g.
        tilt: Half degrees.
        status: 0 stopped, 1 at the limit, 4 moving.
    """

    acceleration: tuple[int, int, int]
    tilt: int
    status: int


class RecordingWriter(Closing):
    """Writes a recording; use it in a ``with``. Whatever ends it, what was written can be played.

    Args:
        folder: Is made; may exist, but not with a recording in it.

    Attributes:
        depth_images: How many were written.
        colour_images: How many were written.

    Raises:
        ConfigError: The folder cannot be made or holds a recording.
    """

    def __init__(self, folder: Path) -> None:
        from mcap.writer import Writer

        self._file = folder / FILE
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._stream = self._file.open("xb")
        except FileExistsError as error:
            raise ConfigError(f"{folder} holds a recording already", valid=["another folder"]) from error
        except OSError as error:
            raise ConfigError(f"{folder} cannot be written to: {error}", valid=["another folder"]) from error
        # Each message is a chunk of its own, which is whole on the disk at once.
        self._writer = Writer(self._stream, chunk_size=1)
        self._writer.start(profile="ros2", library="florence")
        image = self._writer.register_schema("sensor_msgs/msg/Image", "ros2msg", IMAGE_SCHEMA.encode())
        self._channels = {
            topic: self._writer.register_channel(topic, "cdr", image) for topic in (DEPTH, COLOUR)
        }
        self._channels[READING] = self._writer.register_channel(READING, "json", 0)
        self.depth_images = self.colour_images = 0

    def add(self, frame: Frame, moment: float) -> None:
        """Write an image.

        Args:
            frame: The image.
            moment: When it came, seconds since 1970.
        """
        if isinstance(frame, DepthFrame):
            self.depth_images += 1
            self._write(DEPTH, moment, _depth_to_cdr(frame))
        else:
            self.colour_images += 1
            pixels = frame.pixels()
            self._write(
                COLOUR, moment, _image_to_cdr(frame.timestamp, "colour", RGB, pixels, 3 * frame.width)
            )

    def add_reading(self, reading: Reading, moment: float) -> None:
        """Write a reading of accelerometer and motor; the moment is as in :meth:`add`."""
        self._write(READING, moment, json.dumps(asdict(reading)).encode())

    def close(self) -> None:
        """End the recording; one without images leaves no file, so that the folder may be used again."""
        if self._stream.closed:
            return
        self._writer.finish()
        self._stream.close()
        if not self.depth_images and not self.colour_images:
            self._file.unlink(missing_ok=True)

    def _write(self, topic: str, moment: float, data: bytes) -> None:
        ns = round(moment * _NS)
        self._writer.add_message(self._channels[topic], log_time=ns, publish_time=ns, data=data)
        self._stream.flush()


def file_of(place: Path) -> Path:
    """Return the file of a recording, which is named by its folder, or itself."""
    return place if place.suffix == ".mcap" else place / FILE


def recorded(place: Path) -> Iterator[tuple[float, Frame | Reading]]:
    """Yield what a recording holds in order, each with the moment when it came, seconds since 1970.

    A recording whose program was killed has no end, which is as good as one. Where the clock of the machine
    was set meanwhile, pauses are cut to :data:`LONGEST_GAP_S`, and all later moments are shifted.

    Args:
        place: Its folder or file.

    Raises:
        DeviceLost: It is no recording, or damaged.
    """
    try:
        from mcap.exceptions import EndOfFile
        from mcap.records import Channel, Message
        from mcap.stream_reader import StreamReader
    except ModuleNotFoundError as error:
        raise DeviceLost(f"recordings need {error.name!r}: {how_to_get('mcap')}") from error
    file = file_of(place)
    topics: dict[int, str] = {}
    before: float | None = None
    told = 0.0
    try:
        with file.open("rb") as stream:
            reader = StreamReader(stream, validate_crcs=True, record_size_limit=LARGEST_RECORD)
            for record in reader.records:
                if isinstance(record, Channel):
                    topics[record.id] = record.topic
                elif isinstance(record, Message) and topics.get(record.channel_id) in _READERS:
                    moment = record.log_time / _NS
                    pause = moment if before is None else min(max(moment - before, 0.0), LONGEST_GAP_S)
                    told, before = told + pause, moment
                    yield told, _READERS[topics[record.channel_id]](record.data)
    except EndOfFile:
        return
    except OSError as error:
        raise DeviceLost(
            f"{place} is not a recording of a Kinect ({error.strerror}); make one with `florence kinect "
            "record`, or of a folder of libfreenect's record with `florence kinect convert`"
        ) from error
    except Exception as error:
        # Damaged files raise whatever their first wrong byte leads to.
        raise DeviceLost(f"the recording {file} is damaged: {error}") from error


def recorded_depth(place: Path) -> Iterator[tuple[float, DepthFrame]]:
    """Yield the depth images of a recording in order, each with its moment in seconds after the first.

    Raises:
        DeviceLost: As :func:`recorded`, or it has no depth image.
    """
    first = None
    for moment, part in recorded(place):
        if isinstance(part, DepthFrame):
            first = moment if first is None else first
            yield moment - first, part
    if first is None:
        raise DeviceLost(f"the recording {place} holds no depth image")


class RecordingSource:
    """Plays a recording as fast as it was made; a :class:`~florence_bt.drivers.kinect.sources.FrameSource`.

    Args:
        place: Its folder or file.
        now: Steady seconds.
        sleep: Waits for some seconds.

    Raises:
        DeviceLost: It is no recording, or damaged; names the file.
    """

    def __init__(
        self,
        place: Path,
        now: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._place = place
        self._now = now
        self._sleep = sleep
        self._colour = True
        self._parts: Iterator[tuple[float, Frame | Reading]] | None = recorded(place)
        self._first, self._begun = recorded_first(place), now()
        self._next: tuple[float, Frame] | None = None

    def read(self, timeout_s: float) -> Frame | None:
        """Wait for the next frame; see :class:`~florence_bt.drivers.kinect.sources.FrameSource`."""
        if self._next is None:
            self._next = self._advance()
        moment, frame = self._next
        wait = moment - self._first - (self._now() - self._begun)
        self._sleep(max(0.0, min(wait, timeout_s)))
        if wait > timeout_s:
            return None
        self._next = None
        return frame

    def _advance(self) -> tuple[float, Frame]:
        if self._parts is None:
            raise DeviceLost(f"the recording {self._place} is closed")
        for moment, part in self._parts:
            if isinstance(part, DepthFrame) or (isinstance(part, VideoFrame) and self._colour):
                return moment, part
        raise DeviceLost(f"the recording {self._place} is over; it starts again")

    def request(self, *, colour: bool) -> None:
        """Tell whether colour images are wanted besides the depth images."""
        self._colour = colour

    def close(self) -> None:
        """Let go of the file; harmless when called twice."""
        self._parts = None


def recorded_first(place: Path) -> float:
    """Return the moment of the first depth image of a recording.

    Raises:
        DeviceLost: As :func:`recorded_depth`.
    """
    for moment, part in recorded(place):
        if isinstance(part, DepthFrame):
            return moment
    raise DeviceLost(f"the recording {place} holds no depth image")


# ---- messages --------------------------------------------------------------------------------------------


def _depth_to_cdr(frame: DepthFrame) -> bytes:
    if frame.encoding is DepthEncoding.MILLIMETRES:
        values = np.frombuffer(frame.payload, np.uint16).reshape(frame.height, frame.width)
        encoding = MILLIMETRES
    else:
        values, encoding = frame.raw(), RAW
    return _image_to_cdr(frame.timestamp, frame.view.value, encoding, values.astype("<u2"), 2 * frame.width)


def _image_to_cdr(stamp: float, frame_id: str, encoding: str, image: NDArray[np.generic], step: int) -> bytes:
    height, width = image.shape[:2]
    data = image.tobytes()
    return b"".join(
        (
            _CDR,
            _TIME.pack(*divmod(round(stamp * _NS), _NS)),
            _padded(_text(frame_id)),
            _PAIR.pack(height, width),
            _padded(_text(encoding) + b"\0"),  # and whether it is big-endian: no
            _PAIR.pack(step, len(data)),
            data,
        )
    )


def _image_from_cdr(data: bytes) -> tuple[float, str, str, int, int, bytes]:
    """Return the stamp, the frame, the encoding, width, height and the values of an image.

    Raises:
        ValueError: It is not one, or too large.
    """
    seconds, nanoseconds = _TIME.unpack_from(data, 4)
    frame_id, at = _text_at(data, 12)
    height, width = _PAIR.unpack_from(data, at)
    encoding, at = _text_at(data, at + _PAIR.size, more=1)
    _, size = _PAIR.unpack_from(data, at)
    values = data[at + _PAIR.size :]
    pixel = 3 if encoding == RGB else 2
    if not (
        0 < width <= LARGEST_SIDE
        and 0 < height <= LARGEST_SIDE
        and len(values) == size == pixel * width * height
    ):
        raise ValueError(f"an image of {width} x {height} pixels with {len(values)} bytes")
    return seconds + nanoseconds / _NS, frame_id, encoding, width, height, values


def _depth_from_cdr(data: bytes) -> DepthFrame:
    stamp, frame_id, encoding, width, height, values = _image_from_cdr(data)
    depth_encoding = {RAW: DepthEncoding.RAW, MILLIMETRES: DepthEncoding.MILLIMETRES}[encoding]
    return DepthFrame(width, height, stamp, np.frombuffer(values, "<u2"), depth_encoding, View(frame_id))


def _colour_from_cdr(data: bytes) -> VideoFrame:
    stamp, _, encoding, width, height, values = _image_from_cdr(data)
    if encoding != RGB:
        raise ValueError(f"colours as {encoding}")
    return VideoFrame(width, height, stamp, values)


def _reading_from_json(data: bytes) -> Reading:
    values = json.loads(data)
    return Reading(tuple(values["acceleration"]), values["tilt"], values["status"])


_READERS: dict[str, Callable[[bytes], Frame | Reading]] = {
    DEPTH: _depth_from_cdr,
    COLOUR: _colour_from_cdr,
    READING: _reading_from_json,
}


def _padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 4)


def _text(text: str) -> bytes:
    written = text.encode() + b"\0"
    return _LENGTH.pack(len(written)) + written


def _text_at(data: bytes, at: int, more: int = 0) -> tuple[str, int]:
    """Return a text, and where the next part begins after some bytes more."""
    (length,) = _LENGTH.unpack_from(data, at)
    end = at + _LENGTH.size + length
    return data[at + _LENGTH.size : end - 1].decode(), end + more + -(end + more) % 4
