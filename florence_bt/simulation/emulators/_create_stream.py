"""The stream of sensor frames, a frame every 15 ms (REFERENCE 1.6)."""

from __future__ import annotations

from florence_bt.simulation.emulators._create_body import Body
from florence_bt.simulation.emulators._create_packets import packets_of, size_of

PERIOD_S = 0.015
LONGEST_BODY = 255
"""What the length byte can say; what finds no room is left out."""

TIME_DUST_S = 1e-9
"""What added-up floating point times may be off."""

HEADER = 19


class Stream:
    """Makes frames of what was asked for, when they are due."""

    def __init__(self, body: Body, header_in_checksum: bool) -> None:
        self._body = body
        self._header_in_checksum = header_in_checksum
        self._numbers: list[int] = []
        self._paused = False
        self._next = 0.0

    @property
    def running(self) -> bool:
        """Whether frames are sent."""
        return bool(self._numbers) and not self._paused

    @property
    def next_due(self) -> float | None:
        """When the next frame is due; None while nothing is sent."""
        return self._next if self.running else None

    def request(self, numbers: bytes, now: float) -> None:
        """Stream these packets and groups from now on; none end the stream."""
        model = self._body.model
        chosen: list[int] = []
        room = LONGEST_BODY
        for number in numbers:
            size = 1 + size_of(number, model)
            if packets_of(number, model) is not None and size <= room and len(chosen) < model.longest_stream:
                chosen.append(number)
                room -= size
        self._numbers = chosen
        self._body.stream_length = len(chosen)
        self._paused = False
        self._next = now + PERIOD_S

    def pause(self, paused: bool, now: float) -> None:
        """Be silent, or go on; the list is kept."""
        if self._paused and not paused:
            self._next = now + PERIOD_S
        self._paused = paused

    def clear(self) -> None:
        """Forget the list."""
        self._numbers = []
        self._body.stream_length = 0
        self._paused = False

    def take(self, now: float) -> bytes:
        """The frame that is due by now, or nothing."""
        late = now - self._next
        if not self.running or late < -TIME_DUST_S:
            return b""
        # A late call does not cause a burst: the base would have sent those frames earlier.
        self._next += (1 + int(max(0.0, late) / PERIOD_S)) * PERIOD_S
        return self._frame()

    def _frame(self) -> bytes:
        body = b"".join(bytes([number]) + self._body.pack(number) for number in self._numbers)
        frame = bytes([HEADER, len(body)]) + body
        checksum = -sum(frame if self._header_in_checksum else frame[1:]) % 256
        faults = self._body.faults
        if faults.bad_checksums:
            faults.bad_checksums -= 1
            checksum = (checksum + 1) % 256
        frame += bytes([checksum])
        if faults.partial_frames:
            faults.partial_frames -= 1
            frame = frame[: len(frame) // 2]
        return frame
