"""From a file to a text: what is no regular file, too large, no UTF-8 or not printable is refused here."""

from __future__ import annotations

import os
import re
import stat
from codecs import BOM_UTF8
from pathlib import Path

from florence_bt.core._encodings import encoding_of, readable
from florence_bt.core.errors import ConfigError

MAX_BYTES = 1_000_000
"""Largest file that is read."""
NOT_UTF8 = "is not UTF-8"
"""In every message about a byte that no UTF-8 text has there."""

# What YAML 1.1 calls printable, without the line breaks that editors do not count as such.
_FORBIDDEN = re.compile(
    "[^\t\n\r\x20-\x7e\xa0-\u2027\u202a-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]"
)
LINE_BREAK = re.compile("\r\n|\r|\n")
"""What ends a line, for YAML and for editors alike."""
_TAB_INDENT = re.compile("(?:^|(?<=[\r\n])) *\t")
_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


def read_bytes(path: Path) -> bytes:
    """The bytes of a regular file.

    Raises:
        ConfigError: There is no such file, it cannot be read, is none, or has more than :data:`MAX_BYTES`.
    """
    try:
        # Looked at before it is opened: opening a pipe can wait for ever, opening a device can wake it.
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            what = next((name for test, name in _KINDS if test(status.st_mode)), "no regular file")
            raise ConfigError(f"the file cannot be read: it is {what}", file=path, valid=["a regular file"])
        if status.st_size > MAX_BYTES:
            raise _too_large(path)
        with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise ConfigError(f"the file cannot be read: {error.strerror}", file=path) from error
    except ValueError as error:
        raise ConfigError(f"the file cannot be read: {error}", file=str(path)) from error
    return data


def decode(data: bytes, path: Path) -> str:
    """The text of a file.

    Args:
        data: UTF-8, with or without a byte order mark.
        path: The file, named in errors.

    Raises:
        ConfigError: Too many bytes, another encoding, a character that YAML forbids, or a tab in an
            indentation.
    """
    if len(data) > MAX_BYTES:
        raise _too_large(path)
    body = data.removeprefix(
        BOM_UTF8
    )  # before it is decoded, so that errors count from where the text begins
    try:
        text = body.decode("utf-8")
    except UnicodeDecodeError as error:
        raise _no_utf8(data, body[: error.start + 1], path) from error
    if "\0" in text and encoding_of(data) is not None:
        raise _no_utf8(data, body[:1], path)  # UTF-16 without a mark, and only ASCII characters
    forbidden = _FORBIDDEN.search(text)
    if forbidden is not None:
        problem = f"the character U+{ord(forbidden[0]):04X} is not allowed"
        raise _at(text[: forbidden.start()], path, problem, "the text without it")
    tab = _TAB_INDENT.search(text)
    if tab is not None:
        raise _at(text[: tab.end() - 1], path, "a tab in the indentation", "spaces")
    return text


def _no_utf8(data: bytes, until: bytes, path: Path) -> ConfigError:
    """What is wrong with a file in another encoding.

    Args:
        data: The whole file.
        until: From the first character to the first byte that is no UTF-8.
        path: The file.
    """
    text, encoding, save = readable(data), encoding_of(data), "saving the file as UTF-8"
    if encoding is not None and encoding.startswith("UTF"):
        return ConfigError(f"the file is written in {encoding}", file=path, line=1, column=1, valid=[save])
    problem = f"byte 0x{until[-1]:02x} {NOT_UTF8}"
    if text is None:
        return ConfigError(
            f"the file is no text ({problem})", file=path, line=1, column=1, valid=["a text file in UTF-8"]
        )
    before = until[:-1].decode("utf-8")
    if encoding is not None:
        # All before is ASCII, so one byte is one character.
        problem += f"; in {encoding} it is {text[len(before)]!r}"
        save += f" (now it is {encoding})"
    return _at(before, path, problem, save)


def _at(before: str, path: Path, problem: str, *valid: str) -> ConfigError:
    """An error at the place that comes after some text."""
    lines = LINE_BREAK.split(before)
    return ConfigError(problem, file=path, line=len(lines), column=len(lines[-1]) + 1, valid=valid)


def _too_large(path: Path) -> ConfigError:
    return ConfigError(
        f"the file has more than {MAX_BYTES} bytes", file=path, valid=[f"a file of at most {MAX_BYTES} bytes"]
    )
