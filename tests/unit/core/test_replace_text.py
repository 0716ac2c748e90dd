"""A file is written whole or not at all."""

import os

import pytest

from florence_bt.core.text_files import replace_text


def test_the_text_is_there_and_nothing_else(tmp_path):
    file = tmp_path / "flat.yaml"
    replace_text(file, "ä\r\nb\n")
    assert file.read_bytes() == "ä\r\nb\n".encode()
    file.chmod(0o640)
    replace_text(file, "new")
    assert (file.read_text(), file.stat().st_mode & 0o777) == ("new", 0o640)
    assert [path.name for path in tmp_path.iterdir()] == ["flat.yaml"]


def test_what_cannot_be_written_leaves_the_old_file(tmp_path, monkeypatch):
    file = tmp_path / "flat.yaml"
    file.write_text("old")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        replace_text(file, "new")
    assert file.read_text() == "old" and [path.name for path in tmp_path.iterdir()] == ["flat.yaml"]
    with pytest.raises(FileNotFoundError):
        replace_text(tmp_path / "none" / "flat.yaml", "new")
