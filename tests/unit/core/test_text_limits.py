"""Files at their limits: sizes, kinds, encodings, and where an error of each stands."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.text_files import (
    decode,
    decode_utf8,
    is_utf16,
    read_bytes,
    readable,
    refuse_existing,
    refuse_to_replace,
)

FILE = Path("m.yaml")


def error_of(data: bytes, most: int = 100) -> ConfigError:
    with pytest.raises(ConfigError) as caught:
        decode(data, FILE, most)
    return caught.value


def test_a_file_may_have_as_many_bytes_as_the_limit(tmp_path: Path) -> None:
    file = tmp_path / "m.yaml"
    for size in (0, 9, 10):
        file.write_bytes(b"x" * size)
        assert read_bytes(file, 10) == b"x" * size
    file.write_bytes(b"x" * 11)
    with pytest.raises(
        ConfigError, match=r"more than 10 bytes \(would have worked: a file of at most 10 bytes\)"
    ):
        read_bytes(file, 10)
    assert decode_utf8(b"x" * 10, FILE, 10) == "x" * 10
    with pytest.raises(ConfigError, match="more than 10 bytes"):
        decode_utf8(b"x" * 11, FILE, 10)


def test_what_is_no_regular_file_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, pipe, plug = (tmp_path / name for name in ("folder", "pipe", "socket"))
    folder.mkdir()
    os.mkfifo(pipe)
    with socket.socket(socket.AF_UNIX) as server:
        monkeypatch.chdir(tmp_path)  # a socket's path must be short
        server.bind("socket")
        kinds = ((folder, "a folder"), (pipe, "a pipe"), (plug, "a socket"), (Path("/dev/null"), "a device"))
        for file, kind in kinds:
            with pytest.raises(ConfigError, match=f"cannot be read: it is {kind}.*a regular file"):
                read_bytes(file)
            with pytest.raises(ConfigError, match=f"cannot be written: it is {kind}.*a new name"):
                refuse_to_replace(file)
    link, target = tmp_path / "link", tmp_path / "target"
    target.write_bytes(b"1")
    link.symlink_to(target)
    assert read_bytes(link) == b"1"
    with pytest.raises(ConfigError, match="cannot be written: it is a link"):
        refuse_to_replace(link)
    refuse_to_replace(target)
    refuse_to_replace(tmp_path / "nothing")
    with pytest.raises(ConfigError, match="cannot be read: No such file"):
        read_bytes(tmp_path / "nothing")
    with pytest.raises(ConfigError, match="null byte"):
        read_bytes(tmp_path / "a\0b")


def test_a_file_that_is_there_is_replaced_only_when_that_is_said(tmp_path: Path) -> None:
    there, free = tmp_path / "there", tmp_path / "free"
    there.touch()
    refuse_existing(free, overwrite=False)
    refuse_existing(there, free, overwrite=True)
    with pytest.raises(ConfigError, match=r"there is a file .*there.*another name, --overwrite"):
        refuse_existing(free, there, overwrite=False)


@pytest.mark.parametrize(
    ("data", "line", "column", "problem"),
    [
        (b"a: 1\nb: \x07\n", 2, 4, "is not allowed"),
        (b"a\r\nb\rc\x00", 3, 2, "is not allowed"),
        (b"a: 1\n  \tb: 2\n", 2, 3, "a tab in the indentation"),
        (b"\ta: 1", 1, 1, "a tab in the indentation"),
        (b"a: 1\r\tb: 2", 2, 1, "a tab in the indentation"),
        (b"a: caf\xe9\nb", 1, 7, "byte 0xe9 is not UTF-8"),
        (b"\xef\xbb\xbfa: 1\nb: \xff", 2, 4, "byte 0xff is not UTF-8"),
        (b"\xff\xfea\x00", 1, 1, "written in UTF-16"),
        (b"\xff\x00\x00", 1, 1, "the file is not text (byte 0xff is not UTF-8)"),
    ],
)
def test_what_is_wrong_with_a_text_is_told_with_its_place(
    data: bytes, line: int, column: int, problem: str
) -> None:
    error = error_of(data)
    assert (error.file, error.line, error.column) == (str(FILE), line, column)
    assert problem in str(error)


def test_tabs_after_text_and_characters_of_any_language_are_allowed() -> None:
    text = "a: 1\t# one\nb: caf\u00e9 \u4e2d \U0001f916\n"
    assert decode(text.encode(), FILE) == text
    assert decode(b"\xef\xbb\xbf" + text.encode(), FILE) == text


def test_what_people_see_of_any_file() -> None:
    assert readable("caf\u00e9".encode()) == readable("\ufeffcaf\u00e9".encode()) == "caf\u00e9"
    assert readable("caf\u00e9".encode("utf-16")) == "caf\u00e9"
    assert readable(b"caf\xe9") == "caf\ufffd"
    assert readable(b"a\x00b") is None
    assert [is_utf16(data) for data in (b"\xff\xfea\x00", b"\xfe\xff\x00a", b"a", b"")] == [
        True,
        True,
        False,
        False,
    ]
