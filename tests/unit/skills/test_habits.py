"""Where the user usually is: what counts, and the file that keeps it."""

from __future__ import annotations

import json
import os
import threading
import time
from pathlib import Path

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.skills.locator.habits import HOURS, RoomHabits, load_habits
from florence_bt.skills.locator.hotspots import Hotspot, Hotspots
from florence_bt.skills.locator.locator import LastSeen, Locator

EIGHT = time.mktime((2026, 3, 2, 8, 0, 0, 0, 0, -1))
"""Eight o'clock of some day, local time, seconds since 1970."""
HOUR, DAY = 3600.0, 86400.0


def test_an_hour_counts_once_for_each_room() -> None:
    habits = RoomHabits()
    for minute in range(60):
        habits.saw("kitchen", EIGHT + 60.0 * minute)
    habits.saw("hall", EIGHT + 60.0)
    habits.saw("kitchen", EIGHT + HOUR)
    habits.saw("kitchen", EIGHT + DAY)
    assert habits.count("kitchen", EIGHT + 5 * DAY + 1800.0) == 2
    assert habits.count("kitchen", EIGHT + HOUR) == 1
    assert habits.count("hall", EIGHT) == 1
    assert habits.count("kitchen", EIGHT - HOUR) == habits.count("study", EIGHT) == 0


def test_the_file_gives_the_same_counts_back(tmp_path: Path) -> None:
    file = tmp_path / "habits.json"
    habits = load_habits(file)
    assert not habits.unsaved
    habits.saw("kitchen", EIGHT)
    assert habits.unsaved
    habits.save(file)
    assert not habits.unsaved and [path.name for path in tmp_path.iterdir()] == ["habits.json"]
    again = load_habits(file)
    assert again.count("kitchen", EIGHT) == 1
    again.saw("kitchen", EIGHT + DAY)
    assert again.count("kitchen", EIGHT) == 2


@pytest.mark.parametrize(
    "text", ["", "[1]", '{"kitchen": 1}', '{"kitchen": [1, 2]}', json.dumps({"kitchen": ["1"] * HOURS})]
)
def test_a_damaged_file_is_told(tmp_path: Path, text: str) -> None:
    file = tmp_path / "habits.json"
    file.write_text(text)
    with pytest.raises(ConfigError, match="habits of the user"):
        load_habits(file)


def test_a_file_that_cannot_be_written_leaves_the_counts_unsaved(tmp_path: Path) -> None:
    habits = RoomHabits()
    habits.saw("kitchen", EIGHT)
    with pytest.raises(ConfigError, match="cannot write"):
        habits.save(tmp_path / "missing" / "habits.json")
    assert habits.unsaved


def test_the_rooms_of_this_hour_are_likely_behind_the_one_of_the_last_sighting() -> None:
    rooms = {"kitchen": 0.0, "hall": 3.0, "bedroom": 6.0, "study": 9.0}
    clock = ManualClock(EIGHT)
    locator = Locator(Hotspots(Hotspot(label, Pose2(x, 0.0)) for label, x in rooms.items()), clock, "hall")
    locator.robot = Pose2()
    assert locator.likely_rooms() == ("hall", "kitchen", "bedroom", "study"), (
        "what is believed is not counted"
    )
    for day in range(2):
        clock.advance(DAY)
        assert locator.set_user_room("study").succeeded
        if day == 0:
            assert locator.set_user_position(Pose2(6.1, 0.0)).succeeded
    clock.advance(DAY)
    locator.take_sighting("hall", LastSeen("hall_pir", clock.now(), clock.now()))
    assert locator.likely_rooms() == ("hall", "study", "bedroom", "kitchen")
    clock.advance(HOUR)
    assert locator.likely_rooms() == ("hall", "kitchen", "bedroom", "study")


def test_a_pipe_in_place_of_the_file_is_refused_and_not_waited_for(tmp_path):
    pipe = tmp_path / "habits.json"
    os.mkfifo(pipe)
    found = []

    def load():
        with pytest.raises(ConfigError, match="it is a pipe"):
            load_habits(pipe)
        found.append(True)

    reader = threading.Thread(target=load, daemon=True)
    reader.start()
    reader.join(30.0)
    assert found
