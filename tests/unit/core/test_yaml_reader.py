"""Typed values of a settings file, and where an error of each stands."""

from pathlib import Path

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.plain_yaml import parse_yaml
from florence_bt.core.yaml_reader import YamlReader

FILE = Path("home.yaml")
TEXT = """\
name: hall
kinds: [contact, motion]
hold: 2.5
"""


def read(text=TEXT):
    reader = YamlReader(FILE)
    return reader, reader.mapping(parse_yaml(text.encode(), FILE), ("name", "kinds", "hold"), ("name",))


def place_and_message(call):
    with pytest.raises(ConfigError) as raised:
        call()
    error = raised.value
    return (error.file, error.line, error.column), str(error)


def test_values_are_read_by_their_type():
    reader, values = read()
    assert reader.text(values["name"], "name") == "hall"
    assert reader.choice(values["name"], "room", ("kitchen", "hall")) == "hall"
    assert [item.text for item in reader.sequence(values["kinds"], "kinds")] == ["contact", "motion"]
    assert reader.number(values["hold"], "hold") == 2.5


def test_the_values_of_a_mapping_are_read_by_a_table():
    reader, entries = read("hold: 2.5\nname: hall\n")
    readers = {"name": reader.text, "hold": reader.number, "kinds": reader.sequence}
    assert reader.values(entries, readers) == {"name": "hall", "hold": 2.5}
    place, message = place_and_message(lambda: reader.values(entries, {**readers, "name": reader.number}))
    assert place[1:] == (2, 7) and "name must be a finite number" in message


@pytest.mark.parametrize(
    ("method", "key", "arguments", "line", "column", "said"),
    [
        ("text", "kinds", ("kinds",), 2, 8, "kinds must be text"),
        ("choice", "name", ("room", ("kitchen", "hallway")), 1, 7, "room cannot be 'hall'"),
        ("sequence", "name", ("name",), 1, 7, "name must be a list"),
        ("number", "name", ("name",), 1, 7, "name must be a finite number, not 'hall'"),
    ],
)
def test_a_value_of_another_type_is_named_with_its_place(method, key, arguments, line, column, said):
    reader, values = read()
    place, message = place_and_message(lambda: getattr(reader, method)(values[key], *arguments))
    assert place == (str(FILE), line, column)
    assert said in message


def test_an_unknown_choice_and_an_unknown_key_name_what_is_near():
    reader, values = read()
    _, message = place_and_message(lambda: reader.choice(values["name"], "room", ("kitchen", "hallway")))
    assert "would have worked: hallway" in message
    place, message = place_and_message(lambda: read("name: hall\nholt: 1\n"))
    assert place[1:] == (2, 1) and "'holt' is not known here" in message and "hold" in message


def test_a_key_that_is_needed_and_missing_and_what_is_not_a_mapping():
    message = place_and_message(lambda: read("hold: 1\n"))[1]
    assert "'name' is missing" in message and "would have worked: name: ..." in message
    assert "a mapping is needed here" in place_and_message(lambda: read("- 1\n"))[1]


@pytest.mark.parametrize("number", [".inf", "nan", "''"])
def test_a_number_is_finite(number):
    reader, values = read(f"name: hall\nhold: {number}\n")
    assert "must be a finite number" in place_and_message(lambda: reader.number(values["hold"], "hold"))[1]
