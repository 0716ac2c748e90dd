"""From a file to bytes or a text, and back. What is too large, no regular file, or no text is refused."""

from __future__ import annotations

import os
import re
import stat
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.core.file_sets import mend, replace_files
from florence_bt.core.odd_characters import named

MAX_BYTES = 1_000_000
"""Largest text file that is read."""
MAX_MISSION_BYTES = 100_000
"""Largest mission file that is read (chosen: 25 times the largest of Florence's own)."""
NOT_UTF8 = "is not UTF-8"
"""In every message about a byte that no UTF-8 text has there."""

# What YAML 1.1 calls printable, without the line breaks that editors do not count as such.
_FORBIDDEN = re.compile(
    "[^\t\n\r\x20-\x7e\xa0-\u2027\u202a-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]"
)
LINE_BREAK = re.compile("\r\n|\r|\n")
"""The end of a line, for YAML and for editors alike."""
_TAB_INDENT = re.compile("(?:^|(?<=[\r\n])) *\t")
_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


def read_bytes(path: Path, most: int = MAX_BYTES) -> bytes:
    """Read the bytes of a regular file; a set of files that was not written to its end is mended first.

    Args:
        path: The file; a link to a regular file is followed.
        most: How many bytes it may have.

    Raises:
        ConfigError: The file is missing, unreadable, not regular, or too large.
    """
    try:
        mend(path.parent)
    except OSError as error:
        problem = f"files beside it were not written to their end, and cannot be mended: {error.strerror}"
        raise ConfigError(problem, file=path, valid=["a folder you may write to"]) from error
    try:
        # Looked at before it is opened, which can wake a device, and after: it may be another file by then.
        _refuse_irregular(path, path.stat())
        with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
            status = os.fstat(file.fileno())
            _refuse_irregular(path, status)
            data = file.read(most + 1) if status.st_size <= most else b""
        if max(status.st_size, len(data)) > most:
            raise _too_large(path, most)
    except OSError as error:
        raise ConfigError(f"the file cannot be read: {error.strerror}", file=path) from error
    except ValueError as error:
        raise ConfigError(f"the file cannot be read: {error}", file=str(path)) from error
    return data


def _refuse_irregular(path: Path, status: os.stat_result) -> None:
    if not stat.S_ISREG(status.st_mode):
        what = next((name for test, name in _KINDS if test(status.st_mode)), "no regular file")
        raise ConfigError(f"the file cannot be read: it is {what}", file=path, valid=["a regular file"])


def replace_text(file: Path, text: str) -> None:
    """Write a file whole or not at all; one that is there keeps its permissions.

    Raises:
        OSError: It cannot be written; what was there is untouched.
    """
    replace_files({file: text.encode()})


def refuse_to_replace(file: Path) -> None:
    """Refuse a name that no file may be written to: a link, or what is no regular file.

    Raises:
        ConfigError: It is one.
        OSError: It cannot be looked at.
    """
    try:
        mode = file.lstat().st_mode
    except FileNotFoundError:
        return
    if not stat.S_ISREG(mode):
        kinds = ((stat.S_ISLNK, "a link"), *_KINDS)
        what = next((name for test, name in kinds if test(mode)), "no regular file")
        raise ConfigError(f"the file cannot be written: it is {what}", file=file, valid=["a new name"])


def refuse_existing(*files: Path, overwrite: bool) -> None:
    """Refuse files that are there already, unless they may be replaced.

    Raises:
        ConfigError: There is one.
    """
    for file in files:
        if os.path.exists(file) and not overwrite:
            raise ConfigError(f"there is a file {str(file)!r}", valid=["another name", "--overwrite"])


def decode(data: bytes, path: Path, most: int = MAX_BYTES) -> str:
    """Decode the text of a YAML file.

    Args:
        data: As of :func:`decode_utf8`.
        path: The file, named in errors.
        most: How many bytes it may have.

    Raises:
        ConfigError: Too many bytes, another encoding, a character that YAML forbids, or a tab in an
            indentation.
    """
    text = decode_utf8(data, path, most)
    forbidden = _FORBIDDEN.search(text)
    if forbidden is not None:
        problem = f"the character {named(forbidden[0])} is not allowed"
        raise _at(text[: forbidden.start()], path, problem, "the text without it")
    tab = _TAB_INDENT.search(text)
    if tab is not None:
        raise _at(text[: tab.end() - 1], path, "a tab in the indentation", "spaces")
    return text


def decode_utf8(data: bytes, path: Path, most: int = MAX_BYTES) -> str:
    """Decode the text of any file.

    Args:
        data: UTF-8, with or without a byte order mark.
        path: The file, named in errors.
        most: How many bytes it may have.

    Raises:
        ConfigError: Too many bytes, or another encoding.
    """
    if len(data) > most:
        raise _too_large(path, most)
    body = data.removeprefix(BOM_UTF8)  # errors count from where the text begins
    try:
        return body.decode("utf-8")
    except UnicodeDecodeError as error:
        raise _no_utf8(data, body[: error.start + 1], path) from error


def _no_utf8(data: bytes, until: bytes, path: Path) -> ConfigError:
    """Say what is wrong with a file in another encoding.

    Args:
        data: The whole file.
        until: From the first character to the first byte that is not UTF-8.
        path: The file.
    """
    problem, save = f"byte 0x{until[-1]:02x} {NOT_UTF8}", "saving the file as UTF-8"
    if is_utf16(data):
        problem = "the file is written in UTF-16"
    elif readable(data) is None:
        problem, save = f"the file is not text ({problem})", "a text file in UTF-8"
    else:
        return _at(until[:-1].decode("utf-8"), path, problem, save)
    return ConfigError(problem, file=path, line=1, column=1, valid=[save])


def _at(before: str, path: Path, problem: str, *valid: str) -> ConfigError:
    """Make an error at the place that comes after some text."""
    lines = LINE_BREAK.split(before)
    return ConfigError(problem, file=path, line=len(lines), column=len(lines[-1]) + 1, valid=valid)


def _too_large(path: Path, most: int) -> ConfigError:
    return ConfigError(
        f"the file has more than {most} bytes", file=path, valid=[f"a file of at most {most} bytes"]
    )


def is_utf16(data: bytes) -> bool:
    """Tell whether a file has the byte order mark of UTF-16, as some editors write it."""
    return data.startswith((BOM_UTF16_LE, BOM_UTF16_BE))


def readable(data: bytes) -> str | None:
    """Decode a file as people should see it, with replacement characters for what cannot be read.

    Args:
        data: The whole file.

    Returns:
        The text, None when the file is not text at all.
    """
    if is_utf16(data):
        return data.decode("utf-16", errors="replace")
    return None if b"\x00" in data else data.decode("utf-8-sig", errors="replace")
