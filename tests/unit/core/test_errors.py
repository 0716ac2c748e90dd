"""Errors say where, what, and what would have worked; names that look like a wrong one come first."""

from pathlib import Path

import pytest

from florence_bt.core.errors import MAX_COMPARED, CommandRejected, ConfigError, close_matches, closest_first


def test_an_error_of_a_file_names_the_place_and_what_would_have_worked():
    error = ConfigError("no room 'hal'", file=Path("m.yaml"), line=3, column=7, valid=["hall", "attic"])
    assert str(error) == "m.yaml:3:7: no room 'hal' (would have worked: hall, attic)"
    assert (error.file, error.valid) == ("m.yaml", ("hall", "attic"))
    assert str(ConfigError("too fast")) == "too fast"
    assert str(ConfigError("too fast", line=2)) == "2: too fast"


def test_a_command_that_was_rejected_is_named_with_its_status():
    assert str(CommandRejected("BM", "02")) == "'BM' was refused with status '02'"
    error = CommandRejected("BM", "02", "the laser is on")
    assert str(error) == "'BM' was refused with status '02': the laser is on"
    assert (error.command, error.status) == ("BM", "02")


@pytest.mark.parametrize(
    ("wanted", "found"),
    [
        ("kichen", ("kitchen",)),
        ("door", ("back_door", "front_door")),
        ("Front Door", ("front_door",)),
        ("xylophone", ("back_door", "front_door", "hall", "kitchen")),
    ],
)
def test_names_that_look_like_the_wrong_one_come_first_and_else_all(wanted, found):
    assert closest_first(wanted, ["kitchen", "front_door", "hall", "back_door"]) == found


def test_of_very_many_names_those_beside_the_wrong_one_are_compared():
    names = [f"room_{number:05}" for number in range(20_000)]
    assert closest_first("room_12345x", names)[0] == "room_12345"
    assert closest_first("zzz", names) == tuple(names[-MAX_COMPARED // 2 :])
    assert close_matches("room_00500x", names)[0] == "room_00500"
    assert close_matches("zzz", ["hall"]) == []
