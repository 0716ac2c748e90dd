"""Files that are no UTF-8: which encoding is named, and what people see of them."""

from __future__ import annotations

import gzip
from codecs import BOM_UTF8
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.core.errors import ConfigError
from florence_bt.core.text_files import decode, encoding_of, readable

GERMAN = "mission: fahrt\ndescription: In die Küche fahren, „gleich“ 3 € zahlen.\n"
FRENCH = "mission: visite\ndescription: à côté du café, là\n"
GREEK = "mission: a\ndescription: Στην κουζίνα\n"
RUSSIAN = "mission: a\ndescription: На кухню\n"


@pytest.mark.parametrize("codec", ["utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-32-le", "utf-32-be"])
@pytest.mark.parametrize("text", [GERMAN, FRENCH, GREEK, "a: b\n"])
def test_two_and_four_bytes_for_each_character(codec, text):
    data = text.encode(codec)
    assert encoding_of(data) == codec[:6].upper()
    assert readable(data) == text


@pytest.mark.parametrize(
    ("text", "codec", "name"), [(FRENCH, "latin-1", "Latin-1"), (GERMAN, "cp1252", "Windows-1252")]
)
def test_one_byte_for_each_character(text, codec, name):
    data = text.encode(codec)
    assert encoding_of(data) == name
    assert readable(data) == text


@pytest.mark.parametrize(
    ("data", "shown"),
    [
        (GREEK.encode("iso8859-7"), "mission: a\ndescription: ���� �������\n"),
        (RUSSIAN.encode("koi8-r"), "mission: a\ndescription: �� �����\n"),
        ("description: Küche\n".encode("mac-roman"), "description: K�che\n"),
        ("description: Küche\n".encode("cp437"), "description: K�che\n"),
        ("a: Küche ".encode() + b"T\xfcr\n", "a: Küche T�r\n"),  # UTF-8 with one byte of another file
        ("a: Küche".encode()[:-4], "a: K�"),  # cut off in the middle of a character
    ],
)
def test_what_is_not_sure_is_not_named(data, shown):
    assert encoding_of(data) is None
    assert readable(data) == shown


@pytest.mark.parametrize(
    "data", [gzip.compress(b"mission: a\n", mtime=0), bytes(range(256)), b"\x89PNG\0\0\0\r"]
)
def test_what_is_no_text_is_not_shown(data):
    assert encoding_of(data) is None
    assert readable(data) is None


@given(st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"])))
def test_utf_8_is_shown_as_it_is(text):
    assert readable(text.encode("utf-8")) == text.removeprefix("\ufeff")


@given(st.binary())
def test_no_bytes_break_it(data):
    encoding_of(data)
    readable(data)
    for file in (data, b"\xef\xbb\xbf" + data):
        try:
            assert decode(file, Path("f.yaml")).encode() == data.removeprefix(BOM_UTF8)
        except ConfigError as error:
            assert error.file == "f.yaml" and error.line >= 1 and error.column >= 1
