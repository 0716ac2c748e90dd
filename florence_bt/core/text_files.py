"""From a file to bytes or a text, and back. What is too large, no regular file, or no text is refused.

Another encoding is named only when that is sure: by a byte order mark, by the pattern of the zero bytes, or
because every byte makes sense in the encoding of Western European texts and hardly could in another.
"""

from __future__ import annotations

import os
import re
import shutil
import stat
from codecs import BOM_UTF8
from collections.abc import Mapping
from pathlib import Path

from florence_bt.core.errors import ConfigError
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
"""What ends a line, for YAML and for editors alike."""
_TAB_INDENT = re.compile("(?:^|(?<=[\r\n])) *\t")
_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


def read_bytes(path: Path, most: int = MAX_BYTES) -> bytes:
    """Read the bytes of a regular file.

    Args:
        path: The file; a link to a regular file is followed.
        most: How many bytes it may have.

    Raises:
        ConfigError: The file is missing, unreadable, not regular, or too large.
    """
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


def replace_files(contents: Mapping[Path, bytes]) -> None:
    """Write some files whole or none of them; those that are there keep their permissions.

    All are on the disk before the first one takes its name, so that a full disk leaves everything as it was.

    Raises:
        OSError: One cannot be written; what was there is untouched.
    """
    fresh = {file: file.with_name(f".{file.name}.{os.getpid()}") for file in contents}
    try:
        for file, new in fresh.items():
            with new.open("wb") as out:
                out.write(contents[file])
                out.flush()
                os.fsync(out.fileno())
            if file.exists():
                shutil.copymode(file, new)
        for file, new in fresh.items():
            new.replace(file)
    finally:
        for new in fresh.values():
            new.unlink(missing_ok=True)


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


def decode(data: bytes, path: Path, most: int = MAX_BYTES) -> str:
    """Decode the text of a file.

    Args:
        data: UTF-8, with or without a byte order mark.
        path: The file, named in errors.
        most: How many bytes it may have.

    Raises:
        ConfigError: Too many bytes, another encoding, a character that YAML forbids, or a tab in an
            indentation.
    """
    if len(data) > most:
        raise _too_large(path, most)
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
        problem = f"the character {named(forbidden[0])} is not allowed"
        raise _at(text[: forbidden.start()], path, problem, "the text without it")
    tab = _TAB_INDENT.search(text)
    if tab is not None:
        raise _at(text[: tab.end() - 1], path, "a tab in the indentation", "spaces")
    return text


def _no_utf8(data: bytes, until: bytes, path: Path) -> ConfigError:
    """Say what is wrong with a file in another encoding.

    Args:
        data: The whole file.
        until: From the first character to the first byte that is not UTF-8.
        path: The file.
    """
    text, encoding, save = readable(data), encoding_of(data), "saving the file as UTF-8"
    if encoding is not None and encoding.startswith("UTF"):
        return ConfigError(f"the file is written in {encoding}", file=path, line=1, column=1, valid=[save])
    problem = f"byte 0x{until[-1]:02x} {NOT_UTF8}"
    if text is None:
        return ConfigError(
            f"the file is not text ({problem})", file=path, line=1, column=1, valid=["a text file in UTF-8"]
        )
    before = until[:-1].decode("utf-8")
    if encoding is not None:
        # All before is ASCII, so one byte is one character.
        problem += f"; in {encoding} it is {text[len(before)]!r}"
        save += f" (now it is {encoding})"
    return _at(before, path, problem, save)


def _at(before: str, path: Path, problem: str, *valid: str) -> ConfigError:
    """Make an error at the place that comes after some text."""
    lines = LINE_BREAK.split(before)
    return ConfigError(problem, file=path, line=len(lines), column=len(lines[-1]) + 1, valid=valid)


def _too_large(path: Path, most: int) -> ConfigError:
    return ConfigError(
        f"the file has more than {most} bytes", file=path, valid=[f"a file of at most {most} bytes"]
    )


LATIN_1, WINDOWS_1252, UTF_16, UTF_32 = "Latin-1", "Windows-1252", "UTF-16", "UTF-32"

_CODECS = {LATIN_1: "latin-1", WINDOWS_1252: "cp1252"}
# The mark of UTF-32 begins like that of UTF-16, so it comes first.
_MARKS = (
    (b"\xff\xfe\x00\x00", UTF_32, "utf-32"),
    (b"\x00\x00\xfe\xff", UTF_32, "utf-32"),
    (b"\xff\xfe", UTF_16, "utf-16"),
    (b"\xfe\xff", UTF_16, "utf-16"),
)
# The file begins with an ASCII character; YAML 1.2, section 5.2, distinguishes encodings in the same way.
_ZEROS = (
    (re.compile(rb"\x00\x00\x00[^\x00]"), UTF_32, "utf-32-be"),
    (re.compile(rb"[^\x00]\x00\x00\x00"), UTF_32, "utf-32-le"),
    (re.compile(rb"\x00[^\x00]"), UTF_16, "utf-16-be"),
    (re.compile(rb"[^\x00]\x00"), UTF_16, "utf-16-le"),
)
_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x84\x86-\x9f]")
_MULTI_BYTE = re.compile(rb"[\xc2-\xdf][\x80-\xbf]|[\xe0-\xef][\x80-\xbf]{2}|[\xf0-\xf4][\x80-\xbf]{3}")
"""What looks like a character of UTF-8 beyond ASCII."""
_NOT_WESTERN = re.compile(rb"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]|[\x80-\xff]{3}|[\xc2-\xf4][\x80-\xbf]{0,2}\Z")
"""Control characters; three letters in a row beyond ASCII: Greek or Russian, not German or French; and the
beginning of a character of UTF-8 at the very end, where a file was cut off."""
_TYPOGRAPHIC = re.compile(rb"[\x80\x82\x84\x85\x91-\x97\x99]")
"""Euro, quotes, dots, dashes and the trade mark of Windows-1252."""
_C1 = re.compile(rb"[\x80-\x9f]")


def encoding_of(data: bytes) -> str | None:
    """Return the encoding of a file that is not UTF-8.

    Args:
        data: The whole file.

    Returns:
        ``UTF-16``, ``UTF-32``, ``Latin-1`` or ``Windows-1252``; None when it is none of them, or not surely.
    """
    wide = _wide(data)
    if wide is not None:
        return wide[0]
    if _MULTI_BYTE.search(data) or _NOT_WESTERN.search(data) or data.isascii():
        return None
    rest = _TYPOGRAPHIC.sub(b"", data)
    if _C1.search(rest):
        return None
    return LATIN_1 if len(rest) == len(data) else WINDOWS_1252


def readable(data: bytes) -> str | None:
    """Decode a file as people should see it, with replacement characters for what cannot be read.

    Args:
        data: The whole file.

    Returns:
        The text, None when the file is not text at all.
    """
    wide = _wide(data)
    if wide is not None:
        return data.decode(wide[1], errors="replace").removeprefix("\ufeff")
    if b"\x00" in data:
        return None
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode(_CODECS.get(encoding_of(data) or "", "utf-8-sig"), errors="replace")


def _wide(data: bytes) -> tuple[str, str] | None:
    """Return name and codec of an encoding with two or four bytes a character, None when it is another."""
    for mark, name, codec in _MARKS:
        if data.startswith(mark):
            return name, codec
    for pattern, name, codec in _ZEROS:
        if pattern.match(data) and _is_text(data, codec):
            return name, codec
    return None


def _is_text(data: bytes, codec: str) -> bool:
    try:
        return _CONTROL.search(data.decode(codec)) is None
    except UnicodeDecodeError:
        return False
