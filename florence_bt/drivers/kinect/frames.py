"""Frames of the Kinect, and the format of the socket that stands in for the USB cable.

The README of this folder describes that format. A frame counts only when its header is sane and its checksum
fits; otherwise the parser looks for the next header, so that garbage costs no more than the frame it hit.
"""

from __future__ import annotations

import enum
import struct
import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from florence_bt.drivers.kinect._kernels import metres_of_millimetres, metres_of_packed, metres_of_raw
from florence_bt.drivers.kinect.camera import View
from florence_bt.drivers.kinect.codec import METRES_OF_RAW, packed_size, raw_from_metres, unpack_11_bit

MAGIC = b"FKF1"
HEADER = struct.Struct(">4sBxHHdII")
"""Magic, kind, width, height, time stamp, payload length, CRC-32 of header (with CRC 0) and payload."""

LARGEST_SIDE = 2048
"""Pixels; a header that says more is damaged. Chosen: a Kinect has 1280 x 1024 at most (REFERENCE 5.2)."""
_CRC = struct.Struct(">I")


class FrameKind(enum.IntEnum):
    """The kinds of frames."""

    DEPTH = 1
    """Raw depth, 11 bits a pixel, packed."""
    VIDEO = 2
    """Colour, 8 bits each of red, green and blue."""

    def payload_size(self, width: int, height: int) -> int:
        """Return the bytes that an image of this size takes."""
        return packed_size(width * height) if self is FrameKind.DEPTH else 3 * width * height


class DepthEncoding(enum.Enum):
    """The encodings of distances in the payload of a depth frame."""

    PACKED = "packed"
    """Raw values of 11 bits, one after the other."""
    RAW = "raw"
    """Raw values, 16 bits each."""
    MILLIMETRES = "millimetres"
    """16 bits each; 0 for nothing measured."""


@dataclass(frozen=True, slots=True)
class DepthFrame:
    """A depth image as it came: whoever wants the image converts it to metres.

    Attributes:
        width: Columns.
        height: Rows.
        timestamp: Seconds on the sender's clock.
        payload: The values, row by row, as the encoding says: bytes, or an array of shape (height, width).
        encoding: What the payload holds.
        view: From where the image was taken.
    """

    width: int
    height: int
    timestamp: float
    payload: bytes | NDArray[np.uint16]
    encoding: DepthEncoding = DepthEncoding.PACKED
    view: View = View.SHARED

    def raw(self) -> NDArray[np.uint16]:
        """Return the raw values, shape (height, width); for millimetres the nearest ones by formula A."""
        if self.encoding is DepthEncoding.PACKED:
            packed = bytes(self.payload)
            return unpack_11_bit(packed, self.width * self.height).reshape(self.height, self.width)
        if self.encoding is DepthEncoding.MILLIMETRES:
            return raw_from_metres(self.metres())
        return self._values()

    def metres(self, step: int = 1, table: NDArray[np.float32] = METRES_OF_RAW) -> NDArray[np.float32]:
        """Return the distances; NaN where nothing was measured.

        Args:
            step: Take every n-th pixel of every n-th row.
            table: Metres of each raw value, shape (2048,).

        Returns:
            Shape (height / step, width / step), rounded down.
        """
        metres = np.empty((self.height // step, self.width // step), np.float32)
        if self.encoding is DepthEncoding.PACKED:
            metres_of_packed(np.frombuffer(self.payload, np.uint8), self.width, step, table, metres)
        elif self.encoding is DepthEncoding.RAW:
            metres_of_raw(self._values(), step, table, metres)
        else:
            metres_of_millimetres(self._values(), step, metres)
        return metres

    def _values(self) -> NDArray[np.uint16]:
        return np.frombuffer(self.payload, np.uint16).reshape(self.height, self.width)


@dataclass(frozen=True, slots=True)
class VideoFrame:
    """A colour image as it came.

    Attributes:
        width: Columns.
        height: Rows.
        timestamp: Seconds on the sender's clock.
        payload: Red, green, blue bytes, row by row: bytes, or an array.
    """

    width: int
    height: int
    timestamp: float
    payload: bytes | NDArray[np.uint8]

    def pixels(self, step: int = 1) -> NDArray[np.uint8]:
        """Return the image, shape (height / step, width / step, 3); not to be written to.

        Args:
            step: Take every n-th pixel of every n-th row.
        """
        pixels = np.frombuffer(self.payload, np.uint8).reshape(self.height, self.width, 3)
        if step == 1:
            return pixels
        return np.ascontiguousarray(
            pixels[: self.height // step * step : step, : self.width // step * step : step]
        )


Frame = DepthFrame | VideoFrame


class FrameParser:
    """Cuts a stream of bytes into frames; keeps what is not complete yet.

    Attributes:
        skipped: Bytes that belonged to no frame.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self.skipped = 0

    def feed(self, data: bytes) -> list[Frame]:
        """Take the next bytes and return the frames that they complete."""
        self._buffer += data
        frames = []
        while self._align():
            kind, width, height, timestamp, length, crc = HEADER.unpack_from(self._buffer)[1:]
            if len(self._buffer) < HEADER.size + length:
                break
            payload = bytes(self._buffer[HEADER.size : HEADER.size + length])
            if zlib.crc32(payload, _header_crc(self._buffer)) != crc:
                self._skip(1)
                continue
            del self._buffer[: HEADER.size + length]
            make = DepthFrame if kind == FrameKind.DEPTH else VideoFrame
            frames.append(make(width, height, timestamp, payload))
        return frames

    def _align(self) -> bool:
        """Drop bytes until a sane header stands in front; False when more bytes are needed for that."""
        while True:
            start = self._buffer.find(MAGIC)
            if start < 0:
                # The first letters of a magic may have arrived already.
                self._skip(max(0, len(self._buffer) - (len(MAGIC) - 1)))
                return False
            self._skip(start)
            if len(self._buffer) < HEADER.size:
                return False
            if _is_sane(self._buffer):
                return True
            self._skip(1)

    def _skip(self, count: int) -> None:
        self.skipped += count
        del self._buffer[:count]


def _is_sane(header: bytearray) -> bool:
    kind, width, height, _, length, _ = HEADER.unpack_from(header)[1:]
    return (
        kind in tuple(FrameKind)
        and 0 < width <= LARGEST_SIDE
        and 0 < height <= LARGEST_SIDE
        and length == FrameKind(kind).payload_size(width, height)
    )


def _header_crc(buffer: bytearray) -> int:
    return zlib.crc32(bytes(buffer[: HEADER.size - _CRC.size]) + bytes(_CRC.size))
