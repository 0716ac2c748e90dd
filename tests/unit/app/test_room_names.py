"""florence map rooms and florence hotspot name: from a map to rooms with names."""

import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from florence_bt.app.maps.proposal import ask_names, proposed_hotspots, write_proposal
from florence_bt.cli.application import app
from florence_bt.cli.exit_codes import OK, USAGE
from florence_bt.core.geometry import Pose2
from florence_bt.skills.locator.hotspots import Hotspot, load_hotspots
from florence_bt.skills.navigation.map_server.map_file import load_map

ROOT = Path(__file__).parents[3]


@pytest.fixture
def home(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for file in ("maps/flat.yaml", "maps/flat.pgm"):
        shutil.copy(ROOT / file, tmp_path)
    return tmp_path


def florence(*arguments, code=OK, typed=None):
    done = CliRunner().invoke(app, list(arguments), catch_exceptions=False, input=typed)
    assert done.exit_code == code, done.output
    return done.output


def test_rooms_are_proposed_and_named(home):
    told = florence("map", "rooms", "flat.yaml", "--out", "places/home.yaml")
    assert "room_6" in told and "room_7" not in told
    assert Path("places/home.png").read_bytes().startswith(b"\x89PNG")
    assert load_hotspots("places/home.yaml").labels() == tuple(f"room_{n}" for n in range(1, 7))
    checked = florence("hotspot", "check", "--hotspots", "places/home.yaml", "--map", "flat.yaml")
    assert "no problem found" in checked
    assert "--overwrite" in florence("map", "rooms", "flat.yaml", "--out", "places/home.yaml", code=USAGE)
    florence("hotspot", "name", "room_2=bedroom", "--hotspots", "places/home.yaml")
    typed = "living room\nbedroom\nkitchen\nhall\n\nbathroom\n"  # room_3 is no second bedroom
    florence("hotspot", "name", "--hotspots", "places/home.yaml", typed=typed)
    labels = load_hotspots("places/home.yaml").labels()
    assert labels == ("living room", "bedroom", "kitchen", "hall", "room_5", "bathroom")


def test_proposed_places_are_those_of_the_flat(home):
    true, grid = load_hotspots(ROOT / "hotspots" / "flat.yaml"), load_map("flat.yaml")
    proposed = proposed_hotspots(grid)
    assert write_proposal(grid, Path("home.yaml")) == len(proposed)
    assert tuple(load_hotspots("home.yaml")) == tuple(proposed)
    found = {true.room_of(spot.pose.x, spot.pose.y) for spot in proposed}
    assert found == {room.label for room in true.rooms()}


def test_rooms_are_asked_for_by_their_numbers_alone():
    rooms = [Hotspot("room_1", Pose2(1, 2)), Hotspot("kitchen", Pose2()), Hotspot("room_2", Pose2(3, 4))]
    asked = []

    def ask(question):
        asked.append(question)
        return "" if "room_1" in question else "hall "

    assert ask_names(rooms, ("kitchen",), ask) == {"room_2": "hall"}
    assert len(asked) == 2


@pytest.mark.parametrize(
    "arguments",
    [
        ("map", "rooms", "nowhere.yaml"),
        ("map", "rooms", "flat.yaml", "--picture", "rooms.txt"),
        ("hotspot", "name", "room_9=kitchen", "--hotspots", "home.yaml"),
        ("hotspot", "name", "room_1", "--hotspots", "home.yaml"),
        ("hotspot", "name", "room_1=room_2", "--hotspots", "home.yaml"),
    ],
)
def test_what_is_wrong_is_told(home, arguments):
    write_proposal(load_map("flat.yaml"), Path("home.yaml"))
    before = Path("home.yaml").read_text()
    florence(*arguments, code=USAGE)
    assert Path("home.yaml").read_text() == before
