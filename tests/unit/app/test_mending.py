"""A recording that was cut off is mended, and has what was written before."""

from __future__ import annotations

import fcntl
import io
import signal
import subprocess
import sys
from pathlib import Path

import pytest

foxglove = pytest.importorskip("foxglove")
pytest.importorskip("rosbags")

from mcap.reader import make_reader  # noqa: E402
from mcap.writer import CompressionType, Writer  # noqa: E402
from rosbags.highlevel import AnyReader  # noqa: E402

from florence_bt.app.recording.files import RecordingFiles, RecordingLimits, mend_left  # noqa: E402
from florence_bt.app.recording.mending import is_whole, mend  # noqa: E402
from florence_bt.core.errors import FrameError  # noqa: E402
from tests.sweeps import sweep  # noqa: E402

COUNT = 40
KILLED = """
import os, signal, struct, sys
from pathlib import Path
import foxglove
from florence_bt.app.recording.files import RecordingFiles, RecordingLimits
context = foxglove.Context()
schema = foxglove.Schema(name="std_msgs/msg/Float64", encoding="ros2msg", data=b"float64 data")
channel = foxglove.Channel("/number", message_encoding="cdr", schema=schema, context=context)
clock = iter(range(10**9))
files = RecordingFiles(Path(sys.argv[1]), RecordingLimits(), context, steady=lambda: 3.0 * next(clock))
for number in range(60_000):
    channel.log(b"\\0\\1\\0\\0" + struct.pack("<d", number * 0.1), log_time=1_000 + number)
    if number == 20_000:
        files.look()  # which writes what there is
os.kill(os.getpid(), signal.SIGKILL)
"""


def whole(compression: CompressionType, *, chunked: bool = True) -> bytes:
    """A file of several chunks of two topics."""
    stream = io.BytesIO()
    writer = Writer(stream, chunk_size=400, compression=compression, use_chunking=chunked)
    writer.start(profile="ros2", library="test")
    schema = writer.register_schema("std_msgs/msg/Float64", "ros2msg", b"float64 data")
    channels = [writer.register_channel(topic, "cdr", schema) for topic in ("/one", "/two")]
    for number in range(COUNT):
        data = b"\0\1\0\0" + number.to_bytes(8, "little")
        writer.add_message(channels[number % 2], 100 + number, data, 100 + number)
    writer.finish()
    return stream.getvalue()


def numbers(file: Path) -> list[int]:
    with file.open("rb") as stream:
        found = [message.data for _, _, message in make_reader(stream).iter_messages()]
    return [int.from_bytes(data[4:], "little") for data in found]


def numbers_of_rosbags(file: Path) -> list[int]:
    with AnyReader([file]) as reader:
        return [int.from_bytes(data[4:], "little") for _, _, data in reader.messages()]


def test_what_a_killed_recorder_wrote_is_there_at_the_next_start(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-c", KILLED, str(tmp_path)], check=False)
    assert done.returncode == -signal.SIGKILL
    (file,) = tmp_path.glob("recording_*.mcap")
    assert not is_whole(file)
    before = file.stat().st_mtime_ns
    files = RecordingFiles(tmp_path, RecordingLimits(), foxglove.Context())
    files.close()
    assert len(files.mended) == 1 and str(file) in files.mended[0]
    assert is_whole(file) and file.stat().st_mtime_ns == before, "it is as old as it was"
    with AnyReader([file]) as reader:
        messages = [data for _, _, data in reader.messages()]
        assert reader.message_count == len(messages) > 20_000
        assert reader.topics["/number"].msgtype == "std_msgs/msg/Float64"
    assert RecordingFiles(tmp_path, RecordingLimits(), foxglove.Context()).mended == []


@pytest.mark.parametrize("compression", CompressionType)
@pytest.mark.parametrize("share", sweep([each / 60 for each in range(1, 60)], every=4))
def test_a_file_that_ends_anywhere_has_what_came_before(
    tmp_path: Path, compression: CompressionType, share: float
) -> None:
    full, file = whole(compression), tmp_path / "cut.mcap"
    file.write_bytes(full[: int(share * len(full))])
    count = mend(file)
    assert numbers(file) == numbers_of_rosbags(file) == list(range(count))
    # Nothing more is lost than what was cut off: a chunk has ten messages.
    file.write_bytes(full[: int(min(1.0, share + 0.4) * len(full))])
    assert mend(file) > count or count == COUNT
    mended = file.read_bytes()
    mend(file)
    assert numbers(file) == list(range(len(numbers(file)))) and len(file.read_bytes()) == len(mended)


def test_a_file_without_chunks_is_mended_too(tmp_path: Path) -> None:
    full, file = whole(CompressionType.NONE, chunked=False), tmp_path / "cut.mcap"
    file.write_bytes(full[: len(full) // 3])
    count = mend(file)
    assert 0 < count < COUNT and numbers(file) == list(range(count))


def test_zeros_at_the_end_are_no_records(tmp_path: Path) -> None:
    # As a file system leaves them behind what it had written when the power went.
    full, file = whole(CompressionType.ZSTD), tmp_path / "cut.mcap"
    file.write_bytes(full[: len(full) // 2] + bytes(100_000))
    count = mend(file)
    assert 0 < count < COUNT and numbers(file) == numbers_of_rosbags(file) == list(range(count))


def test_a_chunk_that_is_damaged_is_left_out(tmp_path: Path) -> None:
    full, file = bytearray(whole(CompressionType.NONE)), tmp_path / "cut.mcap"
    place = full.index((15).to_bytes(8, "little"))
    full[place] ^= 0xFF
    file.write_bytes(full[: len(full) // 2])
    mend(file)
    found = numbers(file)
    assert 15 not in found and found and set(found) < set(range(COUNT))


def test_what_is_no_recording_or_is_being_written_is_left_as_it_is(tmp_path: Path) -> None:
    other, nothing = tmp_path / "recording_x.mcap", tmp_path / "recording_y.mcap"
    other.write_bytes(b"holiday")
    nothing.write_bytes(b"")
    with pytest.raises(FrameError):
        mend(other)
    assert len(mend_left(tmp_path)) == 2
    assert other.read_bytes() == b"holiday"

    cut = whole(CompressionType.ZSTD)[:-20]
    written = tmp_path / "recording_z.mcap"
    written.write_bytes(cut)
    with written.open("rb") as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)
        mend_left(tmp_path)
        assert written.read_bytes() == cut
    mend_left(tmp_path)
    assert numbers(written) == list(range(COUNT))
