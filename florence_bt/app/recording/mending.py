"""Mends MCAP files whose end is missing, because their writer was killed or the power went.

The end of such a file holds its table of contents, without which readers find nothing in it. All that was
written is there: chunks, each with its messages, and perhaps the beginning of another one. The table is made
again from what is found, and what the last chunk holds so far becomes a chunk.

Source: MCAP specification (https://mcap.dev/spec).
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from io import BytesIO
from pathlib import Path
from typing import IO

import zstandard
from lz4.frame import LZ4FrameDecompressor
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    MessageIndex,
    Schema,
    Statistics,
)

from florence_bt.core.errors import FrameError

MAGIC = b"\x89MCAP0\r\n"
"""The first and the last bytes of a file."""
_HEAD = struct.Struct("<BQ")
"""Head of a record: opcode, bytes that follow."""
_MESSAGE = struct.Struct("<HIQ")
"""Beginning of a message: channel, sequence, time of the log."""
_CHUNK = struct.Struct("<QQQII")
"""Beginning of a chunk: first and last time, size, checksum, length of the name of its compression."""
_LENGTH = struct.Struct("<Q")
_NOTHING = 0
"""No record's opcode: a file system may have zeros where it wrote nothing before the power went."""

Index = dict[int, list[tuple[int, int]]]
"""By channel: the time of each message, and where it begins in its chunk."""


def is_whole(file: Path) -> bool:
    """Tell whether an MCAP file has its end.

    Raises:
        OSError: It cannot be read.
    """
    with file.open("rb") as stream:
        size = stream.seek(0, 2)
        if size < 2 * len(MAGIC):
            return False
        stream.seek(-len(MAGIC), 2)
        return stream.read() == MAGIC


def mend(file: Path) -> int:
    """Give a file its end again; killed meanwhile, it can be mended once more.

    Returns:
        How many messages it holds.

    Raises:
        FrameError: It is no MCAP file, or does not even have its beginning.
        OSError: It cannot be read or written.
    """
    with file.open("r+b") as stream:
        if stream.read(len(MAGIC)) != MAGIC:
            raise FrameError("it does not begin as one does")
        contents = _Contents()
        end = contents.read(stream)
        stream.seek(end)
        last = contents.last_chunk(stream.read(), end)
        stream.seek(end)
        stream.truncate()
        stream.write(last + contents.end(end + len(last)))
    return contents.messages


class _Contents:
    """The contents of a file, as its table of contents says them."""

    def __init__(self) -> None:
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._chunks: list[ChunkIndex] = []
        self._counts: Counter[int] = Counter()
        self._outside_chunks = False
        self._newest: Index = {}
        """Of the newest chunk."""
        self._first, self._last = 2**64 - 1, 0

    @property
    def messages(self) -> int:
        """Count the messages that were found."""
        return self._counts.total()

    def read(self, stream: IO[bytes]) -> int:
        """Read whole records; gives where those end that are kept, or the table of contents begins."""
        position = stream.seek(len(MAGIC))
        size = stream.seek(0, 2)
        while True:
            stream.seek(position)
            head = stream.read(_HEAD.size)
            kind, length = _HEAD.unpack(head) if len(head) == _HEAD.size else (_NOTHING, 0)
            end = position + _HEAD.size + length
            if end > size or kind in (_NOTHING, Opcode.DATA_END, Opcode.FOOTER):
                return self._end_of_newest() if self._lacks_indexes() else position
            if kind == Opcode.CHUNK:
                self._take_chunk(stream.read(length), position)
            elif kind == Opcode.MESSAGE_INDEX and self._chunks:
                (channel,) = struct.unpack("<H", stream.read(2))
                self._chunks[-1].message_index_offsets[channel] = position
                self._chunks[-1].message_index_length += end - position
            elif kind in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):
                index, _ = self._look_through(head + stream.read(length))
                self._outside_chunks |= bool(index)
                self._count(index)
            position = end

    def _lacks_indexes(self) -> bool:
        """Tell whether the file ends amid the indexes behind its last chunk."""
        return bool(self._chunks) and self._newest.keys() != self._chunks[-1].message_index_offsets.keys()

    def _end_of_newest(self) -> int:
        return self._chunks[-1].chunk_start_offset + self._chunks[-1].chunk_length

    def last_chunk(self, data: bytes, position: int) -> bytes:
        """Return what belongs there instead of the rest of the file, in front of its end.

        That are the indexes of the last chunk, or a chunk of the messages at the beginning of one that was
        not ended; empty when there are neither.

        Args:
            data: The rest of the file.
            position: Where it begins there.
        """
        if self._lacks_indexes():
            return self._indexes(position)
        if len(data) < _HEAD.size + _CHUNK.size or data[0] != Opcode.CHUNK:
            return b""
        known = _uncompressed(data[_HEAD.size :])
        index, used = self._look_through(known)
        if not index:
            return b""
        first, last = self._count(index)
        known = known[:used]
        begun = RecordBuilder()
        Chunk("", known, last, first, zlib.crc32(known), used).write(begun)
        chunk = begun.end()
        self._add_chunk(ChunkIndex(len(chunk), position, "", used, last, 0, {}, first, used), index)
        return chunk + self._indexes(position + len(chunk))

    def _add_chunk(self, chunk: ChunkIndex, index: Index) -> None:
        self._chunks.append(chunk)
        self._newest = index

    def _indexes(self, position: int) -> bytes:
        """Return the indexes of the newest chunk, and note them.

        Args:
            position: Where they begin.
        """
        records = RecordBuilder()
        offsets = {}
        for channel, entries in self._newest.items():
            offsets[channel] = position + records.count
            MessageIndex(channel, entries).write(records)
        self._chunks[-1].message_index_offsets = offsets
        self._chunks[-1].message_index_length = records.count
        return bytes(records.end())

    def end(self, position: int) -> bytes:
        """Return the end of the file.

        Args:
            position: Where it begins.
        """
        tail = RecordBuilder()
        DataEnd(0).write(tail)
        start = position + tail.count
        if self._outside_chunks:  # then a reader has to read it all
            start = 0
        else:
            for each in (*self._schemas.values(), *self._channels.values(), *self._chunks):
                each.write(tail)
            Statistics(
                attachment_count=0,
                channel_count=len(self._channels),
                channel_message_counts=dict(self._counts),
                chunk_count=len(self._chunks),
                message_count=self.messages,
                message_end_time=self._last,
                message_start_time=self._first if self._counts else 0,
                metadata_count=0,
                schema_count=len(self._schemas),
            ).write(tail)
        Footer(start, 0, 0).write(tail)
        return tail.end() + MAGIC

    def _take_chunk(self, content: bytes, position: int) -> None:
        """Note a whole chunk; one that is damaged is left out of the table."""
        first, last, size, checksum, _ = _CHUNK.unpack_from(content)
        known = _uncompressed(content)
        if len(known) != size or (checksum and zlib.crc32(known) != checksum):
            return
        index, _ = self._look_through(known)
        self._count(index)
        chunk = Chunk.read(ReadDataStream(BytesIO(content)))
        length = _HEAD.size + len(content)
        found = ChunkIndex(length, position, chunk.compression, len(chunk.data), last, 0, {}, first, size)
        self._add_chunk(found, index)

    def _look_through(self, data: bytes) -> tuple[Index, int]:
        """Take schemas and channels, and find the messages; also gives where the last whole record ends."""
        index: Index = {}
        position = 0
        while position + _HEAD.size <= len(data):
            kind, length = _HEAD.unpack_from(data, position)
            begin = position + _HEAD.size
            if begin + length > len(data):
                break
            if kind == Opcode.MESSAGE:
                channel, _, log_time = _MESSAGE.unpack_from(data, begin)
                index.setdefault(channel, []).append((log_time, position))
            elif kind == Opcode.SCHEMA:
                schema = Schema.read(ReadDataStream(BytesIO(data[begin : begin + length])))
                self._schemas[schema.id] = schema
            elif kind == Opcode.CHANNEL:
                found = Channel.read(ReadDataStream(BytesIO(data[begin : begin + length])))
                self._channels[found.id] = found
            position = begin + length
        return index, position

    def _count(self, index: Index) -> tuple[int, int]:
        """Count messages, and return the first and the last of their times."""
        times = [moment for entries in index.values() for moment, _ in entries]
        self._counts.update({channel: len(entries) for channel, entries in index.items()})
        first, last = min(times, default=self._first), max(times, default=self._last)
        self._first, self._last = min(self._first, first), max(self._last, last)
        return first, last


def _uncompressed(content: bytes) -> bytes:
    """Return the records of a chunk, as far as they are there; none of one that is damaged."""
    *_, name_length = _CHUNK.unpack_from(content)
    begin = _CHUNK.size + name_length + _LENGTH.size
    if len(content) < begin:
        return b""
    name = content[_CHUNK.size : _CHUNK.size + name_length]
    (size,) = _LENGTH.unpack_from(content, begin - _LENGTH.size)
    data = content[begin : begin + size]
    try:
        if name == b"zstd":
            return zstandard.ZstdDecompressor().decompressobj().decompress(data)
        if name == b"lz4":
            return bytes(LZ4FrameDecompressor().decompress(data))
    except (zstandard.ZstdError, RuntimeError):
        return b""
    return data if not name else b""
