"""What encoding a file is in that is no UTF-8, and how to show it to people all the same.

An encoding is named only when that is sure: by a byte order mark, by the pattern of the zero bytes, or
because every byte makes sense in the encoding of Western European texts and hardly could in another.
"""

from __future__ import annotations

import re

LATIN_1, WINDOWS_1252, UTF_16, UTF_32 = "Latin-1", "Windows-1252", "UTF-16", "UTF-32"

_CODECS = {LATIN_1: "latin-1", WINDOWS_1252: "cp1252"}
# The mark of UTF-32 begins like that of UTF-16, so it comes first.
_MARKS = (
    (b"\xff\xfe\x00\x00", UTF_32, "utf-32"),
    (b"\x00\x00\xfe\xff", UTF_32, "utf-32"),
    (b"\xff\xfe", UTF_16, "utf-16"),
    (b"\xfe\xff", UTF_16, "utf-16"),
)
# The file begins with an ASCII character; YAML 1.2, section 5.2, tells encodings apart in the same way.
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
    """The encoding of a file that is no UTF-8.

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
    """A file as people should see it, with replacement characters for what cannot be read.

    Args:
        data: The whole file.

    Returns:
        The text, None when the file is no text at all.
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
    """Name and codec of an encoding with two or four bytes for each character, None when it is no such."""
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
