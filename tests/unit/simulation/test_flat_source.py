import math
from pathlib import Path

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.simulation.home.flat import default_flat_file, load_flat
from florence_bt.simulation.home.free_space import free_space_of
from florence_bt.simulation.home.people import is_approachable

SMALL = """\
name: small
start: {x: 1, y: 1}
floor: "#aaaaaa"
walls:
  height: 2.5
  thickness: 0.1
  colour: "#ffffff"
  door_height: 2.0
  lines:
    - {name: south, from: [0, 0], to: [4, 0], doors: [{name: way_out, centre: 2, width: 0.9}]}
rooms:
  den: {x: [0, 4], y: [0, 3], hotspot: {x: 2, y: 1.5, phi_deg: 90}}
hotspots:
  lamp: {x: 1, y: 2}
seats:
  - {room: den, x: 3, y: 1}
models:
  stool:
    - {cylinder: 0.2, z: [0, 0.4]}
furniture:
  - {name: stool, model: stool, x: 3, y: 2, colour: "#123456"}
"""


def load_text(tmp_path: Path, text: str):
    file = tmp_path / "x.source.yaml"
    file.write_text(text, encoding="utf-8")
    return load_flat(file)


def test_small_flat_is_read(tmp_path):
    flat = load_text(tmp_path, SMALL)
    left, lintel, right, stool = flat.solids
    assert (left.x - left.half[0], left.x + left.half[0]) == pytest.approx((-0.05, 1.55))
    assert (right.x - right.half[0], right.x + right.half[0]) == pytest.approx((2.45, 4.05))
    assert (lintel.bottom, lintel.top) == (2.0, 2.5)
    assert stool.colour == (0x12, 0x34, 0x56) and stool.half is None and stool.radius == 0.2
    assert flat.room("den").hotspot.pose.yaw == pytest.approx(math.pi / 2)
    assert flat.room_at(3.9, 2.9).name == "den" and flat.room_at(4.1, 1) is None
    assert (flat.doors[0].x, flat.doors[0].y) == (2.0, 0.0)


@pytest.mark.parametrize(
    ("old", "new", "line", "text"),
    [
        ("model: stool", "model: stol", 21, "unknown model 'stol' (would have worked: stool)"),
        ('colour: "#123456"', "colour: blue", 21, "'#rrggbb'"),
        ("centre: 2,", "centre: 3.8,", 10, "beyond the wall's end"),
        ("to: [4, 0]", "to: [4, 1]", 10, "along x or along y"),
        ("room: den, x: 3", "room: dem, x: 3", 16, "unknown room 'dem' (would have worked: den)"),
        ("room: den, x: 3", "room: den, x: 5", 16, "outside of 'den'"),
        ("lamp: {x: 1", "lamp: {x: 9", 14, "in no room"),
        ("lamp:", "den:", 14, "a room already"),
        ("hotspot: {x: 2", "hotspot: {x: -2", 12, "outside of 'den'"),
        ("start: {x: 1", "start: {x: 10", 2, "start"),
        ("x: [0, 4], y", "x: [4, 0], y", 12, "below the second"),
        ("z: [0, 0.4]", "z: [0.4, 0]", 19, "below the second"),
        ("cylinder: 0.2", "box: [1, 1], cylinder: 0.2", 19, "either"),
        ("cylinder: 0.2", "cylinder: .nan", 19, "cylinder"),
        ("cylinder: 0.2", "radius: 0.2", 19, "no key 'radius'"),
        ("floor:", "start: {x: 2, y: 1}\nfloor:", 3, "is duplicated (first in line 2)"),
        ("name: stool,", "name: south,", 21, "given twice"),
        ("walls:", "wals:", 4, "wals"),
        ("[0, 4]", "[0, 4", 12, "not YAML: the [ before is not closed"),
        ("den: {x", "den: &den {x", 12, "anchors and aliases are not allowed"),
        ("floor:", "\tfloor:", 3, "a tab in the indentation"),
        ("door_height: 2.0", "door_height: true", 8, "walls.door_height: Input should be a valid number"),
        ("door_height: 2.0", "door_height: 2 m", 8, "walls.door_height: Input should be a valid number"),
    ],
)
def test_mistakes_are_told_with_their_line(tmp_path, old, new, line, text):
    assert old in SMALL
    with pytest.raises(ConfigError) as caught:
        load_text(tmp_path, SMALL.replace(old, new, 1))
    assert text in str(caught.value)
    assert caught.value.line == line


@pytest.mark.parametrize("text", ["", "- 1", "just text", "a: \t{", "\x00", "!!python/object:x {}"])
def test_no_flat_at_all(tmp_path, text):
    with pytest.raises(ConfigError, match="source"):
        load_text(tmp_path, text)


def test_another_encoding_is_told_as_in_a_mission(tmp_path):
    file = tmp_path / "x.source.yaml"
    file.write_bytes(b"# K\xfcche\n" + SMALL.encode())
    with pytest.raises(ConfigError, match="byte 0xfc is not UTF-8") as caught:
        load_flat(file)
    assert (caught.value.line, caught.value.column) == (1, 4)


def test_nothing_written_is_nothing_given(tmp_path):
    part = load_text(tmp_path, SMALL.replace("{cylinder: 0.2", "{box: , colour: ~, cylinder: 0.2")).solids[-1]
    assert (part.half, part.radius, part.colour) == (None, 0.2, (0x12, 0x34, 0x56))


def test_missing_file_is_a_config_error(tmp_path):
    with pytest.raises(ConfigError, match="the file cannot be read: No such file"):
        load_flat(tmp_path / "nothing.yaml")


def test_unknown_room_lists_the_rooms():
    flat = load_flat()
    with pytest.raises(ConfigError, match="kitchen"):
        flat.room("kitchn")
    with pytest.raises(ConfigError, match="bathroom, bedroom, hall"):
        flat.room("xyz")


def test_the_flat_is_a_home():
    flat = load_flat(default_flat_file())
    left, low, right, high = flat.bounds
    assert 75 <= (right - left) * (high - low) <= 85
    assert {"living_room", "kitchen", "bedroom", "bathroom", "hall"} <= {room.name for room in flat.rooms}
    assert all(0.8 <= door.width <= 0.9 for door in flat.doors)
    area = sum((room.x[1] - room.x[0]) * (room.y[1] - room.y[0]) for room in flat.rooms)
    assert area == pytest.approx((right - left) * (high - low))
    tops = [solid for solid in flat.solids if solid.name == "dining_table" and solid.top == 0.75]
    assert tops and all(solid.bottom == 0.72 for solid in tops)


def test_hotspots_have_room_to_turn_and_everything_can_be_reached():
    flat = load_flat()
    space = free_space_of(flat)
    ways = space.reachable((flat.start.x, flat.start.y), 0.35)
    for hotspot in [*(room.hotspot for room in flat.rooms), *flat.objects]:
        assert space.clearance_at(hotspot.pose.x, hotspot.pose.y) >= 0.55, hotspot.label
        assert ways[space.frame.cell_of(hotspot.pose.x, hotspot.pose.y)], hotspot.label
    for seat in flat.seats:
        assert space.clearance_at(seat.pose.x, seat.pose.y) >= 0.25


def test_every_seat_can_be_used():
    flat = load_flat()
    space = free_space_of(flat)
    for seat in flat.seats:
        assert is_approachable(flat, space, flat.room(seat.room), seat.pose), seat
