"""The locator as a component: what it takes from topics and frames, and keeps."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.geometry import FramedPose, Pose2
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.core.topics import FOUND, MAP, ZONES, FoundUser
from florence_bt.core.transforms import Transform3
from florence_bt.core.zones import KEEP_OUT, Zone
from florence_bt.simulation.rig.wires import Wires
from florence_bt.skills.locator.hotspots import Hotspot, Hotspots
from florence_bt.skills.locator.locating import (
    GOAL,
    SAVE_PERIOD_S,
    SIGHTINGS,
    Locating,
    LocatorParameters,
    Sighting,
)
from florence_bt.skills.locator.locator import LastSeen

KITCHEN, BEDROOM = Hotspot("kitchen", Pose2(1.0, 1.0)), Hotspot("bedroom", Pose2(5.0, 1.0))
WET = Zone("wet floor", KEEP_OUT, ((2.0, 0.0), (3.0, 0.0), (3.0, 1.0)))


class Surroundings:
    """A locator of two rooms, and who tells it things."""

    def __init__(self, **own: Any) -> None:
        self.clock = ManualClock(100.0)
        self.wires = Wires(self.clock, [("base_footprint", "base_link", Transform3.identity())])
        hotspots = Hotspots([KITCHEN, BEDROOM])
        hotspots.zones = (WET,)
        self.zones: list[Any] = []
        self.locating = Locating(
            self.wires.ports("florenceLocator"),
            hotspots,
            LocatorParameters(**own),
            lambda zones, grid: self.zones.append((tuple(zones), grid)),
        )
        self.other = self.wires.ports("other")

    def send(self, topic: Any, value: Any) -> None:
        self.other.output(topic).send(value)
        self.clock.advance(0.0)

    def ask(self, name: str, **request: Any) -> Any:
        return self.wires.services[f"florenceLocator/{name}"](request)

    def robot_is_at(self, pose: Pose2) -> None:
        self.other.send_frame("map", "odom", self.clock.now(), pose)
        self.other.send_frame("odom", "base_footprint", self.clock.now(), Pose2())
        self.clock.advance(0.0)


def test_whom_a_look_has_found_is_there_and_faces_the_robot() -> None:
    around = Surroundings(initial_user_room="kitchen")
    around.robot_is_at(Pose2(5.0, 3.0))
    around.send(FOUND, FoundUser(True, 5.0, 1.5))
    seen = around.ask("getUserSeen")
    assert (seen.valid, seen.room, seen.source, seen.age) == (True, "bedroom", "detected_user", 0.0)
    assert around.ask("getUserPosXYPhi").phi == pytest.approx(math.pi / 2)
    around.send(FOUND, FoundUser(False, 1.0, 1.0))
    assert around.ask("getUserPosRoom").room == "bedroom", "an answer that nobody was found"


def test_whom_a_look_finds_off_the_map_is_refused_and_counted() -> None:
    around = Surroundings(initial_user_room="kitchen")
    around.send(MAP, OccupancyGrid(0.5, Pose2(), np.zeros((8, 16), np.int8)))
    around.send(FOUND, FoundUser(True, 90.0, 1.5))
    assert around.wires.refused == {FOUND.name: 1} and around.ask("getUserPosRoom").room == "kitchen"


def test_the_robot_is_where_the_frames_say_and_nowhere_without() -> None:
    around = Surroundings()
    assert not around.ask("getRobotPosXYPhi").valid and not around.ask("getRobotPosRoom").valid
    around.robot_is_at(Pose2(4.5, 1.0, 0.5))
    where = around.ask("getRobotPosXYPhi")
    assert (where.valid, where.x, where.y, where.phi) == (True, 4.5, 1.0, pytest.approx(0.5))
    assert around.ask("getRobotPosRoom").room == "bedroom"
    assert around.ask("getRooms").message == "bedroom, kitchen", "the nearest first"


def test_a_goal_stays_when_its_drive_is_over() -> None:
    around = Surroundings()
    assert not around.ask("getGoalPosXYPhi").valid
    around.send(GOAL, FramedPose(Pose2(4.0, 2.0), "map"))
    for none in (FramedPose(Pose2()), FramedPose(Pose2(math.nan, 0.0), "map")):
        around.send(GOAL, none)
    assert around.ask("getGoalPosXYPhi").x == 4.0


def test_home_sensors_say_in_which_room_the_user_is() -> None:
    around = Surroundings()
    around.send(SIGHTINGS, Sighting("bedroom", LastSeen("pir", 90.0, 95.0)))
    seen = around.ask("getUserSeen")
    assert (seen.room, seen.source, seen.age) == ("bedroom", "pir", 5.0)
    around.send(SIGHTINGS, Sighting("attic", LastSeen("pir", 98.0, 99.0)))
    assert around.ask("getUserSeen").room == "bedroom"


def test_zones_are_told_at_once_and_with_each_map() -> None:
    around = Surroundings()
    heard: list[Any] = []
    around.other.listen(ZONES, heard.append)
    around.clock.advance(0.0)
    assert heard == [(WET,)] and around.zones == [((WET,), None)]
    grid = OccupancyGrid(0.5, Pose2(), np.zeros((8, 16), np.int8))
    around.send(MAP, grid)
    assert around.zones[1:] == [((WET,), grid)]


def test_habits_are_kept_now_and_then_and_in_the_end(tmp_path: Path) -> None:
    file = tmp_path / "habits.json"
    around = Surroundings(habits_file=str(file))
    around.clock.advance(SAVE_PERIOD_S + 1.0)
    assert not file.exists(), "there is nothing to keep"
    around.ask("setUserPosRoom", room="bedroom")
    around.clock.advance(SAVE_PERIOD_S)
    assert list(json.loads(file.read_text())) == ["bedroom"]
    around.ask("setUserPosRoom", room="kitchen")
    around.locating.close()
    assert sorted(json.loads(file.read_text())) == ["bedroom", "kitchen"]


def test_a_hotspot_that_is_put_is_in_the_file_or_not_kept(tmp_path: Path) -> None:
    file = tmp_path / "hotspots.yaml"
    file.write_text("hotspots:\n- {label: kitchen, x: 1, y: 1}\n")
    around = Surroundings(hotspots_file=str(file))
    assert around.ask("setHotspot", label="tv", x=2.0, y=2.0, phi=0.0).success
    assert around.ask("getHotspot", label="tv").x == 2.0 and "tv" in file.read_text()
    file.write_text("damaged")
    refused = around.ask("setHotspot", label="tv", x=9.0, y=2.0, phi=0.0)
    assert not refused.success and around.ask("getHotspot", label="tv").x == 2.0
    assert not around.ask("reloadHotspots").success
    file.write_text("hotspots:\n- {label: bath, x: 1, y: 1}\n")
    assert around.ask("reloadHotspots").success and not around.ask("getHotspot", label="tv").valid
