"""Frames of the sensor stream: 19, N, then N bytes of number and data, checksum (REFERENCE 1.6).

The manuals disagree on whether the header counts for the checksum, so the decoder finds out which form the
base in front of it uses. It knows the layout it asked for, and so drops a wrong start at the first byte that
does not fit; then it looks again one byte further on, so that noise never takes a good frame with it.
"""

from __future__ import annotations

import enum
import struct
from collections.abc import Sequence

from florence_bt.drivers.turtlebot.codec.packets import layout, members

HEADER = 19
"""The first byte of a frame. Source: REFERENCE 1.6."""
_CHANGE_FORM_AFTER = 3
"""Frames in a row that fit the other form only, after which that is the base's. Chosen."""


class ChecksumForm(enum.Enum):
    """The forms of a checksum: what adds up to zero modulo 256, beside length, data and the checksum."""

    WITHOUT_HEADER = 0
    """The Create 1's manual."""
    WITH_HEADER = HEADER
    """The Create 2's manual, and libcreate for every model."""


class StreamDecoder:
    """Turns the bytes of a stream into frames, in pieces of any size.

    Attributes:
        checksum_form: The form that fits this base; None until the first frame.
        good_frames: Frames decoded so far.
        bad_frames: Frames with a wrong checksum so far.
        noise_bytes: Bytes that belonged to no good frame so far.
    """

    def __init__(self, packet_ids: Sequence[int]) -> None:
        """Prepare for the packets that the stream was asked for.

        Args:
            packet_ids: Packets or groups, in the order of the request.
        """
        self._values = struct.Struct(">xx" + "".join("x" + layout([packet_id]) for packet_id in packet_ids))
        self._ids = [packet.id for packet_id in packet_ids for packet in members(packet_id)]
        self._fixed = _fixed_bytes(packet_ids, self._values.size)
        self._size = self._values.size + 1
        self._buffer = bytearray()
        self._other_form_in_a_row = 0
        self.checksum_form: ChecksumForm | None = None
        self.good_frames = 0
        self.bad_frames = 0
        self.noise_bytes = 0

    @property
    def frame_size(self) -> int:
        """Bytes of a frame with its header and checksum."""
        return self._size

    def feed(self, data: bytes) -> list[dict[int, int]]:
        """Take bytes as they came and give back the good frames that they complete, in order.

        Returns:
            Of each frame the counts as they came over the wire, by packet number.
        """
        self._buffer += data
        frames = []
        while self._skip_to_start() and len(self._buffer) >= self._size:
            frame = bytes(self._buffer[: self._size])
            if self._checksum_fits(frame):
                self.good_frames += 1
                del self._buffer[: self._size]
                frames.append(dict(zip(self._ids, self._values.unpack(frame[:-1]), strict=True)))
            else:
                self.bad_frames += 1
                self._drop(1)
        return frames

    def _skip_to_start(self) -> bool:
        """Drop bytes until the buffer begins like a frame; False when nothing is left."""
        while self._buffer:
            start = self._buffer.find(HEADER)
            if start != 0:
                self._drop(len(self._buffer) if start < 0 else start)
            elif all(
                self._buffer[place] == value for place, value in self._fixed if place < len(self._buffer)
            ):
                return True
            else:
                self._drop(1)
        return False

    def _drop(self, count: int) -> None:
        self.noise_bytes += count
        del self._buffer[:count]

    def _checksum_fits(self, frame: bytes) -> bool:
        """Tell whether the frame fits the form of this base, which is learnt from what fits."""
        without_header = sum(frame[1:])
        fitting = next((form for form in ChecksumForm if (without_header + form.value) % 256 == 0), None)
        if fitting is None:
            self._other_form_in_a_row = 0
            return False
        if fitting is self.checksum_form:
            self._other_form_in_a_row = 0
            return True
        # A broken first frame can fit the wrong form by chance: several in a row prove the other one.
        self._other_form_in_a_row += 1
        if self.checksum_form is None or self._other_form_in_a_row >= _CHANGE_FORM_AFTER:
            self.checksum_form = fitting
            self._other_form_in_a_row = 0
            return True
        return False


def _fixed_bytes(packet_ids: Sequence[int], size: int) -> list[tuple[int, int]]:
    """Return the (place, value) of every byte of a frame that is known beforehand."""
    fixed = [(0, HEADER), (1, size - 2)]
    place = 2
    for packet_id in packet_ids:
        fixed.append((place, packet_id))
        place += 1 + struct.calcsize(">" + layout([packet_id]))
    return fixed
