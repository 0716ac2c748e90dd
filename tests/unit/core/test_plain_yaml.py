import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.core.errors import ConfigError
from florence_bt.core.plain_yaml import (
    MAX_DEPTH,
    MAX_PARTS,
    MAX_TEXT,
    Position,
    YamlMapping,
    YamlScalar,
    YamlSequence,
    parse_yaml,
    read_yaml,
)
from florence_bt.core.text_files import MAX_BYTES

FILE = Path("m.yaml")


def parse(text):
    return parse_yaml(text.encode() if isinstance(text, str) else text, FILE)


def test_scalars_stay_text_and_know_their_place():
    table = parse("a: no\nb:\n  - 12:30\n  - '7'\n  - |\n    long\n")
    assert table == YamlMapping(
        (
            (YamlScalar("a", False, Position(1, 1)), YamlScalar("no", False, Position(1, 4))),
            (
                YamlScalar("b", False, Position(2, 1)),
                YamlSequence(
                    (
                        YamlScalar("12:30", False, Position(3, 5)),
                        YamlScalar("7", True, Position(4, 5)),
                        YamlScalar("long\n", True, Position(5, 5)),
                    ),
                    Position(3, 3),
                ),
            ),
        ),
        Position(1, 1),
    )
    assert table.get("b").items[1].quoted
    assert table.get("c") is None and table.key("b").position == Position(2, 1)


@pytest.mark.parametrize("text", ["", "~", "null"])
def test_empty_values(text):
    assert parse(f"a: {text}\n").get("a").empty
    assert not parse(f"a: '{text}'\n").get("a").empty


def test_a_byte_order_mark_is_skipped():
    assert parse(b"\xef\xbb\xbfa: b\n").get("a").text == "b"


def test_lines_of_windows_are_counted_as_lines():
    table = parse("a: 1\r\nb:\r\n  - c\r\n")
    assert table.get("b").items[0] == YamlScalar("c", False, Position(3, 5))


def test_merge_keys_and_anchors_in_quotes_are_texts():
    assert parse("a: '<<'\n'<<': '&x'\n").get("<<").text == "&x"


@pytest.mark.parametrize(
    ("text", "line", "column", "begun"),
    [
        ("a: [1,\n  2\n\n\n", 2, 4, "begun in line 1"),
        ("a: 1\nb: 'x\n\n", 2, 6, "a quote is not closed"),
    ],
)
def test_what_is_not_closed_is_placed_at_the_end_of_what_is_written(text, line, column, begun):
    with pytest.raises(ConfigError, match=begun) as error:
        parse(text)
    assert (error.value.line, error.value.column) == (line, column)


@pytest.mark.parametrize(
    ("text", "line", "column", "problem"),
    [
        ("", 1, 1, "the file is empty"),
        ("# nothing\n", 1, 1, "the file is empty"),
        ("a: 1\na: 2\n", 2, 1, "duplicated .first in line 1"),
        ("a: {b: 1, b: 2}\n", 1, 11, "duplicated"),
        ("a:\n\tb: 1\n", 2, 1, "a tab in the indentation"),
        ("a: &x 1\nb: *x\n", 1, 4, "anchors"),
        ("a: 1\nb: *x\n", 2, 4, "anchors"),
        ("a: !!int 1\n", 1, 4, "the tag"),
        ("a: !python/object:os.system x\n", 1, 4, "the tag"),
        ("a: 1\n---\nb: 1\n", 2, 1, "second document"),
        ("? [a, b]\n: 1\n", 1, 3, "a key must be a plain text"),
        (b"a: \xff\n", 1, 4, "byte 0xff is not UTF-8"),
        (b"a: 1\nb: x\xc3\n", 2, 5, "not UTF-8"),
        ("a: [1, 2\n", None, None, "not YAML"),
        ("a: 'x\n", None, None, "not YAML"),
        ("a: b: c\n", 1, None, "not YAML"),
        ("a: 1\n  b: 2\n", 2, 4, "this line is indented deeper than line 1, which has a value already"),
        ("'a': 1\n  b: 2\n", 2, 4, "this line is indented deeper than line 1, which has a value already"),
        ("a: \x07\n", 1, 4, "the character U.0007 is not allowed"),
        ("a: b\r\nc: \x00d\n", 2, 4, "the character U.0000 is not allowed"),
        ("a: b\u2028c\n", 1, 5, "the character U.2028 .line separator. is not allowed"),
        ("a: b\ufeffc\n", 1, 5, "the character U.FEFF .byte order mark. is not allowed"),
        ("a: b\n".encode("utf-16"), 1, 1, "the file is written in UTF-16"),
        (b"\xef\xbb\xbfa: 1\nb: x\xfcy\n", 2, 5, "byte 0xfc is not UTF-8 .would"),
        (b"\xef\xbb\xbfa\xc3", 1, 2, "byte 0xc3 is not UTF-8 .would"),
        (b"\xef\xbb", 1, 1, "byte 0xef is not UTF-8 .would"),
        ("a: ü\n".encode("latin-1"), 1, 4, "byte 0xfc is not UTF-8"),
        (b"\x89PNG\r\n\x1a\n\x00\x00\x00", 1, 1, "not text .byte 0x89 is not UTF-8."),
        ("a: {<<: {b: 1}}\n", 1, 5, "merges"),
        ("a: 1\r\nb:\r\n\t- c\r\n", 3, 1, "a tab in the indentation"),
        ("a: " + "x" * (MAX_TEXT + 1), 1, 4, "a text of 10001 characters"),
        ("[" + "a, " * MAX_PARTS + "a]", 1, None, "more than 60000 keys and values"),
        ("ü: {ö: 1, ö: 2}\n", 1, 11, "duplicated"),
        ("a: " + "[" * (MAX_DEPTH + 1) + "]" * (MAX_DEPTH + 1), 1, None, "nested more than"),
        ("[" * 100_000, 1, None, "nested more than"),
    ],
)
def test_what_is_refused(text, line, column, problem):
    with pytest.raises(ConfigError, match=problem) as error:
        parse(text)
    assert error.value.file == "m.yaml"
    assert line is None or error.value.line == line
    assert column is None or error.value.column == column


def test_as_much_as_is_allowed_is_read():
    assert len(parse("a: " + "x" * MAX_TEXT).get("a").text) == MAX_TEXT
    assert len(parse("[" + "a, " * (MAX_PARTS - 2) + "a]").items) == MAX_PARTS - 1
    node = parse("[" * (MAX_DEPTH - 1) + "{a: b}" + "]" * (MAX_DEPTH - 1))
    for _ in range(MAX_DEPTH - 1):
        (node,) = node.items
    assert node.get("a").text == "b"


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(ConfigError, match="cannot be read: No such file"):
        read_yaml(tmp_path / "gone.yaml")
    with pytest.raises(ConfigError, match="cannot be read: it is a folder"):
        read_yaml(tmp_path)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(ConfigError, match="cannot be read: it is a pipe"):
        read_yaml(tmp_path / "pipe")
    with pytest.raises(ConfigError, match="cannot be read: it is a device"):
        read_yaml(Path("/dev/zero"))
    with pytest.raises(ConfigError, match="cannot be read: embedded null byte"):
        read_yaml(Path("a\0b"))
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    with pytest.raises(ConfigError, match="cannot be read: Too many levels"):
        read_yaml(tmp_path / "loop")
    (tmp_path / "big.yaml").write_bytes(b"a" * (MAX_BYTES + 1))
    with pytest.raises(ConfigError, match="more than 1000000 bytes"):
        read_yaml(tmp_path / "big.yaml")


@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(data):
    try:
        parse_yaml(data, FILE)
    except ConfigError as error:
        assert error.file == "m.yaml"


@given(st.text(alphabet="abc:-[]{}\"'|>&*!?#,\n $%@`~", max_size=60))
def test_any_text_is_read_or_refused(text):
    try:
        parse(text)
    except ConfigError as error:
        assert error.file == "m.yaml" and error.line >= 1 and error.column >= 1


@pytest.mark.parametrize(
    ("written", "column"),
    [
        ("plain text", 4),
        ("'in quotes'", 5),
        ('"in quotes"', 5),
        ("'it''s'", None),  # shorter than it was written: an offset in the text is no column of the file
        ("|\n  block", None),
        ("two\n  lines", None),
    ],
)
def test_the_column_of_the_first_character_is_known_where_the_text_stands_as_it_is(written, column):
    value = parse(f"k: {written}\n").entries[0][1]
    assert value.first_column == column
