from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from florence_bt.core.sensing import FREE, OCCUPIED, UNKNOWN
from florence_bt.simulation.home.build_map import build_files, laser_map, main
from florence_bt.simulation.home.flat import Solid, default_flat_file, load_flat

ROOT = default_flat_file().parents[1]


@pytest.fixture(scope="module")
def flat():
    return load_flat()


def test_the_files_in_the_project_are_those_of_a_fresh_build(flat):
    for name, content in build_files(flat).items():
        assert (ROOT / name).read_bytes() == content, (
            f"{name} is old: python -m florence_bt.simulation.home.build_map"
        )


def test_walls_are_occupied_floor_is_free_and_outside_is_unknown(flat):
    grid = laser_map(flat)
    assert grid.cells[grid.cell_of(5.4, 6.0)] == OCCUPIED
    assert grid.cells[grid.cell_of(0.0, 5.0)] == OCCUPIED
    assert grid.cells[grid.cell_of(-0.3, 5.0)] == UNKNOWN
    for room in flat.rooms:
        assert grid.cells[grid.cell_of(room.hotspot.pose.x, room.hotspot.pose.y)] == FREE
    for door in flat.doors:
        assert grid.cells[grid.cell_of(door.x, door.y)] == FREE


def test_only_the_legs_of_the_table_meet_the_laser(flat):
    grid = laser_map(flat)
    assert grid.cells[grid.cell_of(1.9, 2.2)] == FREE
    for x in (1.35, 2.45):
        for y in (1.85, 2.55):
            row, column = grid.cell_of(x, y)
            assert (grid.cells[row - 1 : row + 2, column - 1 : column + 2] == OCCUPIED).any()


def test_a_thin_leg_is_in_the_map_where_four_cells_meet_too(flat):
    leg = Solid("table", 6.0, 3.0, 0.0, (0.02, 0.02), 0.0, 0.0, 0.7, (0, 0, 0))
    row, column = (grid := laser_map(replace(flat, mapped=(leg,)))).cell_of(leg.x, leg.y)
    assert grid.cells[row, column] == OCCUPIED


def test_image_has_the_top_row_first(flat):
    files = build_files(flat)
    header, pixels = files["maps/flat.pgm"].split(b"\n255\n", 1)
    assert header == b"P5\n220 180"
    grid = laser_map(flat)
    image = np.frombuffer(pixels, np.uint8).reshape(180, 220)
    assert ((image[::-1] == 0) == (grid.cells == OCCUPIED)).all()
    assert ((image[::-1] == 254) == (grid.cells == FREE)).all()
    values = yaml.safe_load(files["maps/flat.yaml"])
    assert values["origin"] == [-0.5, -0.5, 0.0] and values["resolution"] == 0.05
    assert values["image"] == "flat.pgm" and values["negate"] == 0


def test_hotspots_name_every_room_and_object(flat):
    entries = yaml.safe_load(build_files(flat)["hotspots/flat.yaml"])["hotspots"]
    rooms = [entry for entry in entries if entry["kind"] == "room"]
    assert [entry["label"] for entry in rooms] == [room.name for room in flat.rooms]
    assert all(
        len(entry["polygon"]) == 4 and -3.15 < float(entry["phi"].removesuffix(" rad")) < 3.15
        for entry in rooms
    )
    assert {entry["label"] for entry in entries if entry["kind"] == "object"} >= {"tv", "fridge"}
    (dock,) = (entry for entry in entries if entry["label"] == "dock")
    assert (dock["x"], dock["y"]) == (flat.start.x, flat.start.y)
    assert set(rooms[0]) == {"label", "x", "y", "phi", "kind", "polygon"}


def test_the_command_writes_the_files(tmp_path: Path, capsys):
    assert main([str(default_flat_file()), "--output", str(tmp_path)]) == 0
    assert (tmp_path / "maps/flat.pgm").read_bytes() == (ROOT / "maps/flat.pgm").read_bytes()
    capsys.readouterr()
    assert main([str(tmp_path / "none.yaml")]) == 1
    assert "cannot be read" in capsys.readouterr().err
