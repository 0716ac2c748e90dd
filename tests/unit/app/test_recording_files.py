"""What recordings carry, and how much they take."""

from __future__ import annotations

import os
import time
from contextlib import suppress
from pathlib import Path

import pytest

from florence_bt.core.errors import ConfigError

foxglove = pytest.importorskip("foxglove")
rosbags_typesys = pytest.importorskip("rosbags.typesys")

from florence_bt.app.recording.files import DAY_S, FREE_MB, RecordingFiles, RecordingLimits  # noqa: E402
from florence_bt.app.recording.schemas import message_schema  # noqa: E402


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("sensor_msgs/msg/LaserScan", {"std_msgs/msg/Header", "builtin_interfaces/msg/Time"}),
        ("tf2_msgs/msg/TFMessage", {"geometry_msgs/msg/TransformStamped", "geometry_msgs/msg/Quaternion"}),
        ("std_msgs/msg/String", set()),
        ("florence_interfaces/msg/TrackedUsers", set()),
    ],
)
def test_a_schema_has_every_type_that_a_message_consists_of(name: str, parts: set[str]) -> None:
    found = set(rosbags_typesys.get_types_from_msg(message_schema(name), name))
    assert {name, *parts} <= found


def test_a_type_that_is_not_installed_is_told() -> None:
    with pytest.raises(ConfigError, match="nobody_msgs/msg/Nothing"):
        message_schema("nobody_msgs/msg/Nothing")


class Clock:
    """Seconds since 1970, as the test says."""

    def __init__(self) -> None:
        self.now = time.time()

    def __call__(self) -> float:
        return self.now


class Recording:
    """Files with one topic of incompressible messages of 100 kB."""

    def __init__(self, folder: Path, **limits: float) -> None:
        self.clock = Clock()
        self.free = 10_000.0
        context = foxglove.Context()
        schema = foxglove.Schema(
            name="std_msgs/msg/String",
            encoding="ros2msg",
            data=message_schema("std_msgs/msg/String").encode(),
        )
        self._channel = foxglove.Channel("/noise", message_encoding="cdr", schema=schema, context=context)
        self.files = RecordingFiles(
            folder,
            RecordingLimits(**limits),
            context,
            now=self.clock,
            steady=self.clock,
            free_mb=lambda folder: self.free,
        )

    def log(self, count: int, pause_s: float = 1.0) -> None:
        for _ in range(count):
            self.clock.now += pause_s
            self._channel.log(os.urandom(100_000), log_time=int(self.clock.now * 1e9))
            self.files.look()


def messages_in(file: Path) -> int:
    from mcap.reader import make_reader

    with file.open("rb") as stream:
        reader = make_reader(stream)
        assert reader.get_header().profile == "ros2"
        return sum(1 for _ in reader.iter_messages())


def test_files_follow_each_other_and_lose_nothing(tmp_path: Path) -> None:
    recording = Recording(tmp_path, file_size=1.0)
    recording.log(45)
    recording.files.close()
    written = recording.files.written
    assert len(written) > 2 and all(file.stat().st_size < 1.5e6 for file in written)
    assert sum(map(messages_in, written)) == 45


def test_the_oldest_files_go_when_all_together_are_too_large(tmp_path: Path) -> None:
    others = tmp_path / "holiday.mcap"
    others.write_bytes(bytes(3_000_000))
    recording = Recording(tmp_path, file_size=1.0, total_size=3.0)
    recording.log(90)
    recording.files.close()
    left = sorted(tmp_path.glob("recording_*.mcap"))
    assert sum(file.stat().st_size for file in left) < 4.2e6
    assert left[-1] == recording.files.written[-1] and recording.files.written[0] not in left
    assert others.exists(), "what is not a recording stays"


def test_files_of_earlier_recordings_go_when_they_are_too_old(tmp_path: Path) -> None:
    recording = Recording(tmp_path, max_age=2.0)
    for name, days in (("recording_a.mcap", 3.0), ("recording_b.mcap", 1.0)):
        (tmp_path / name).touch()
        when = recording.clock() - days * DAY_S
        os.utime(tmp_path / name, (when, when))
    recording.log(3)
    assert not (tmp_path / "recording_a.mcap").exists() and (tmp_path / "recording_b.mcap").exists()


def test_files_of_before_the_clock_was_set_are_not_too_old(tmp_path: Path) -> None:
    recording = Recording(tmp_path, file_size=1.0, total_size=3.0)
    old = tmp_path / "recording_1970-01-01_00-00-30.mcap"
    old.touch()
    os.utime(old, (30.0, 30.0))
    recording.log(3)
    assert old.exists()
    recording.log(60)
    assert not old.exists(), "but the first to go for room"


def test_two_may_record_into_one_folder(tmp_path: Path) -> None:
    first = Recording(tmp_path, file_size=1.0, total_size=3.0)
    first.log(5)
    second = Recording(tmp_path, file_size=1.0, total_size=3.0)
    assert second.files.written != first.files.written
    second.log(90)
    assert first.files.written[0].exists(), "it is being written"
    first.log(90)
    for each in (first, second):
        each.files.close()
        assert messages_in(each.files.written[-1]) >= 0, "it is whole"
    assert sum(file.stat().st_size for file in tmp_path.iterdir()) < 5.2e6


def test_a_file_that_somebody_else_removes_meanwhile_is_gone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = Recording(tmp_path, file_size=1.0, total_size=3.0)
    old = tmp_path / "recording_a.mcap"
    old.write_bytes(bytes(3_000_000))
    glob = Path.glob

    def and_gone(folder: Path, pattern: str) -> list[Path]:
        found = list(glob(folder, pattern))
        old.unlink(missing_ok=True)
        return found

    monkeypatch.setattr(Path, "glob", and_gone)
    recording.log(3)
    assert recording.files.written[0].exists()


def test_its_own_files_go_when_they_are_too_old(tmp_path: Path) -> None:
    recording = Recording(tmp_path, file_size=1.0, max_age=2.0)
    recording.log(100, pause_s=3_600.0)
    assert not recording.files.written[0].exists()
    assert recording.files.written[-1].exists() and len(list(tmp_path.iterdir())) > 2


def test_it_ends_whole_before_the_disk_is_full(tmp_path: Path) -> None:
    recording = Recording(tmp_path)
    recording.log(5)
    recording.free = FREE_MB - 1.0
    with pytest.raises(ConfigError, match="free on the disk"):
        recording.log(1)
    assert messages_in(recording.files.written[0]) == 6


def test_nothing_begins_on_a_disk_that_is_nearly_full(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="free on the disk"):
        RecordingFiles(tmp_path, RecordingLimits(), foxglove.Context(), free_mb=lambda folder: FREE_MB - 1.0)
    assert not list(tmp_path.iterdir())


def test_what_was_flushed_can_be_read_when_the_power_went(tmp_path: Path) -> None:
    from mcap.exceptions import McapError
    from mcap.stream_reader import StreamReader

    recording = Recording(tmp_path)
    recording.log(10)
    with recording.files.written[0].open("rb") as stream:
        found = 0
        with suppress(McapError):  # the end of the file is missing, as after a power cut
            for record in StreamReader(stream).records:
                found += type(record).__name__ == "Message"
    assert found >= 7


def test_a_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(ConfigError, match="another folder"):
        Recording(tmp_path / "file" / "below")


def test_one_file_is_not_larger_than_all_may_be() -> None:
    with pytest.raises(ConfigError, match="file_size"):
        RecordingLimits(file_size=100.0, total_size=50.0)
