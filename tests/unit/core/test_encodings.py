"""Files that are no UTF-8: what people see of them."""

from __future__ import annotations

import gzip
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.core.errors import ConfigError
from florence_bt.core.text_files import decode, is_utf16, readable

GERMAN = "mission: fahrt\ndescription: In die Küche fahren, „gleich“ 3 € zahlen.\n"
FRENCH = "mission: visite\ndescription: à côté du café, là\n"
GREEK = "mission: a\ndescription: Στην κουζίνα\n"


@pytest.mark.parametrize("text", [GERMAN, FRENCH, GREEK, "a: b\n"])
def test_two_bytes_for_each_character(text):
    for mark, codec in ((BOM_UTF16_LE, "utf-16-le"), (BOM_UTF16_BE, "utf-16-be")):
        data = mark + text.encode(codec)
        assert is_utf16(data) and readable(data) == text


@pytest.mark.parametrize(
    ("data", "shown"),
    [
        (GREEK.encode("iso8859-7"), "mission: a\ndescription: ���� �������\n"),
        ("description: Küche\n".encode("latin-1"), "description: K�che\n"),
        ("a: Küche ".encode() + b"T\xfcr\n", "a: Küche T�r\n"),  # UTF-8 with one byte of another file
        ("a: Küche".encode()[:-4], "a: K�"),  # cut off in the middle of a character
    ],
)
def test_what_cannot_be_read_is_replaced(data, shown):
    assert readable(data) == shown


@pytest.mark.parametrize(
    "data", [gzip.compress(b"mission: a\n", mtime=0), bytes(range(256)), b"\x89PNG\0\0\0\r"]
)
def test_what_is_no_text_is_not_shown(data):
    assert readable(data) is None


@given(st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"])))
def test_utf_8_is_shown_as_it_is(text):
    assert readable(text.encode("utf-8")) == text.removeprefix("\ufeff")


@given(st.binary())
def test_no_bytes_break_it(data):
    readable(data)
    for file in (data, b"\xef\xbb\xbf" + data):
        try:
            assert decode(file, Path("f.yaml")).encode() == data.removeprefix(BOM_UTF8)
        except ConfigError as error:
            assert error.file == "f.yaml" and error.line >= 1 and error.column >= 1
