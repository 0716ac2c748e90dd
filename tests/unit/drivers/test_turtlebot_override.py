"""The manual override in the base's driver, and the file that keeps it over restarts."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.drivers.turtlebot.override_file import OverrideFile


def test_the_file_keeps_the_override(tmp_path: Path) -> None:
    kept = OverrideFile(tmp_path / "override")
    assert not kept.is_on()
    kept.keep(True)
    kept.keep(True)
    assert kept.is_on() and OverrideFile(tmp_path / "override").is_on()
    kept.keep(False)
    kept.keep(False)
    assert not kept.is_on()


def test_when_it_was_switched_on_last_outlives_the_release_and_restarts(tmp_path: Path) -> None:
    kept = OverrideFile(tmp_path / "override")
    assert kept.switched_on == 0.0
    before = time.time()
    kept.keep(True)
    kept.keep(False)
    for each in (kept, OverrideFile(tmp_path / "override")):
        # A file's date may be of the tick before (ext4: 4 ms).
        assert before - 0.1 <= each.switched_on <= time.time()


@pytest.mark.parametrize("content", [b"", b"\xff\xfe\x00", b"off", b"x" * 100_000])
def test_damage_does_not_drop_it(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "override"
    OverrideFile(file).keep(True)
    file.write_bytes(content)
    assert OverrideFile(file).is_on()


def test_what_cannot_be_known_counts_as_on(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert OverrideFile(tmp_path / "file" / "override").is_on()
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    assert OverrideFile(tmp_path / "loop").is_on()


def test_a_file_that_cannot_be_written_says_what_the_next_start_will_find(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="after a restart the manual override will be off"):
        OverrideFile(tmp_path / "missing" / "override").keep(True)
    (tmp_path / "override").mkdir()
    with pytest.raises(ConfigError, match="after a restart the manual override will be on"):
        OverrideFile(tmp_path / "override").keep(False)


def test_without_a_file_nothing_is_kept() -> None:
    kept = OverrideFile(None)
    kept.keep(True)
    assert not kept.is_on()
