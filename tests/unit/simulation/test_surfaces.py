"""Glass and mirrors before the laser and the Kinect, and what is elsewhere than on the map."""

import math

import numpy as np
import pytest

from florence_bt.core.sensing import FREE, OCCUPIED
from florence_bt.core.transforms import Transform3
from florence_bt.simulation.home.build_map import laser_map
from florence_bt.simulation.home.flat import load_flat
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.sensors.kinect_sensor import KinectSensor
from florence_bt.simulation.sensors.laser_sensor import LaserSensor

LASER = Transform3.from_xyz_rpy((0.0, 0.0, 0.13), (0.0, 0.0, 0.0))
CAMERA = Transform3.from_xyz_rpy((0.0, 0.0, 0.54), (-math.pi / 2, 0.0, -math.pi / 2))

HOME = """\
name: pane
start: {x: 1, y: 2, phi_deg: 0}
floor: "#aaaaaa"
walls:
  height: 2.5
  thickness: 0.1
  colour: "#ffffff"
  door_height: 2.0
  lines:
    - {name: south, from: [0, 0], to: [5, 0]}
    - {name: north, from: [0, 4], to: [5, 4]}
    - {name: west, from: [0, 0], to: [0, 4]}
    - name: east
      from: [5, 0]
      to: [5, 4]
      doors: [{name: exit, centre: 3, width: 0.8, leaf: wood, mapped_open_deg: 90}]
rooms:
  den: {x: [0, 5], y: [0, 4], hotspot: {x: 2, y: 2}}
models:
  pane: [{box: [0.02, 2.0], z: [0, 2], surface: SURFACE}]
  crate: [{box: [0.4, 0.4], z: [0, 0.4]}]
furniture:
  - {name: pane, model: pane, x: 3.01, y: 2, colour: "#bcd3d8"}
  - {name: crate, model: crate, x: 1, y: 3.4, colour: "#123456", moved_from: {x: 1, y: 0.6}}
  - {name: other, model: crate, x: 4, y: 3.4, colour: "#123456", on_map: false}
"""


def world(tmp_path, surface):
    file = tmp_path / "pane.source.yaml"
    file.write_text(HOME.replace("SURFACE", surface), encoding="utf-8")
    return SimulatedWorld(load_flat(file))


def range_at(laser, degrees):
    step = 384 + round(degrees / 360 * 1024)
    return laser.true_ranges(step, step)[0]


def test_a_plain_board_stops_every_beam(tmp_path):
    laser = LaserSensor(world(tmp_path, "plain"), LASER)
    assert range_at(laser, 0) == pytest.approx(2.0)
    assert range_at(laser, -11.25) == pytest.approx(2.0 / math.cos(math.radians(11.25)))


def test_glass_sends_back_only_what_meets_it_straight(tmp_path):
    laser = LaserSensor(world(tmp_path, "glass"), LASER)
    assert range_at(laser, 0) == pytest.approx(2.0)
    assert range_at(laser, -11.25) == pytest.approx(3.95 / math.cos(math.radians(11.25)))


def test_a_mirror_shows_the_room_behind_itself(tmp_path):
    here = world(tmp_path, "mirror")
    laser = LaserSensor(here, LASER)
    # 2 m to the mirror and 2.95 m back to the west wall.
    assert range_at(laser, -2) == pytest.approx(4.95 / math.cos(math.radians(2)), abs=1e-3)
    assert range_at(laser, -11.25) == pytest.approx(4.95 / math.cos(math.radians(11.25)))
    assert range_at(laser, 90) == pytest.approx(1.2), "the crate, without a mirror"


def test_a_mirror_met_squarely_shows_the_laser_itself(tmp_path):
    laser = LaserSensor(world(tmp_path, "mirror"), LASER)
    # 2 m there, 2 m back to its housing, which is 5 cm wide: 0.36 degrees to each side from 4 m away.
    assert range_at(laser, 0) == pytest.approx(4.0 - 0.025)
    assert range_at(laser, 1) == range_at(laser, -1) > 4.9


@pytest.mark.parametrize(("surface", "depth"), [("plain", 2.0), ("glass", 3.95), ("mirror", 4.95)])
def test_the_kinect_sees_the_same(tmp_path, surface, depth):
    kinect = KinectSensor(world(tmp_path, surface), CAMERA, 160, 120)
    picture = kinect.true_depth()
    row, column = 60, round(kinect.camera.cx + kinect.camera.fx * math.tan(math.radians(15.0)))
    assert picture[row, column] == pytest.approx(depth, abs=1e-3)
    raw, colours = kinect.measure()
    assert raw.shape == picture.shape and np.isfinite(colours.astype(float)).all()


def test_the_map_shows_how_it_was_without_glass(tmp_path):
    flat = world(tmp_path, "glass").flat
    grid = laser_map(flat)
    assert grid.cells[grid.cell_of(3.01, 2.0)] == FREE
    assert grid.cells[grid.cell_of(1.0, 0.6)] == OCCUPIED and grid.cells[grid.cell_of(1.0, 3.4)] == FREE
    assert grid.cells[grid.cell_of(4.0, 3.4)] == FREE
    assert [door.closed for door in flat.doors] == [True]
    leaf = next(solid for solid in flat.mapped if solid.name == "exit")
    assert leaf.x == pytest.approx(4.6, abs=0.01), "open on the map: it stands in the room"
