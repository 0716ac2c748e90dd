"""The smallest home that can be explored: two rooms with a door between them."""

from __future__ import annotations

from pathlib import Path

SOURCE = """\
name: two_rooms
start: {x: 1, y: 1.5, phi_deg: 0}
floor: "#aaaaaa"
walls:
  height: 2.5
  thickness: 0.1
  colour: "#ffffff"
  door_height: 2.0
  lines:
    - {name: south, from: [0, 0], to: [6, 0]}
    - {name: east, from: [6, 0], to: [6, 3]}
    - {name: north, from: [0, 3], to: [6, 3]}
    - {name: west, from: [0, 0], to: [0, 3]}
    - {name: middle, from: [3, 0], to: [3, 3], doors: [{name: door, centre: 0.8, width: 0.9}]}
rooms:
  den: {x: [0, 3], y: [0, 3], hotspot: {x: 1.5, y: 1.5, phi_deg: 0}}
  kitchen: {x: [3, 6], y: [0, 3], hotspot: {x: 4.5, y: 1.5, phi_deg: 0}}
hotspots: {}
seats:
  - {room: den, x: 2.4, y: 2.4}
models: {}
furniture: []
"""


def write_two_rooms(folder: Path) -> Path:
    """Write the home's source file; return it."""
    file = folder / "two_rooms.source.yaml"
    file.write_text(SOURCE, encoding="utf-8")
    return file
