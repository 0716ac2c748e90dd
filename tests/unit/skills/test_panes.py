"""Mirrors, glass and what was touched, on a map that is made."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import FREE, OCCUPIED, UNKNOWN, LaserScan, OccupancyGrid
from florence_bt.skills.navigation.mapping.kept_scan import keep_scan
from florence_bt.skills.navigation.mapping.map_drawer import MapDrawer
from florence_bt.skills.navigation.mapping.parameters import SlamParameters
from tests.unit.skills.navigation_world import UPSIDE_DOWN_LASER, Box, World, cast
from tests.unit.skills.test_localise_accuracy import raw

GAP = (1.4, 2.7)
"""In the lower wall, x from and to, metres."""
PANE: Box = (GAP[0], -0.02, GAP[1], 0.0)
WALL: tuple[Box, ...] = ((-0.1, -0.1, GAP[0], 0.0), (GAP[1], -0.1, 5.1, 0.0))
ROOM: tuple[Box, ...] = (
    (-0.1, 3.2, 5.1, 3.3),
    (-0.1, -0.1, 0.0, 4.1),
    (5.0, -0.1, 5.1, 4.1),
    (0.0, 2.5, 0.6, 3.2),
    (3.4, 2.7, 4.4, 3.2),
    (4.3, 0.9, 5.0, 1.7),
)
MIRRORED: tuple[Box, ...] = tuple((x0, -y1, x1, -y0) for x0, y0, x1, y1 in ROOM)
OTHER_ROOM: tuple[Box, ...] = (
    (-0.6, -3.1, 3.6, -3.0),
    (-0.6, -3.0, -0.5, -0.1),
    (3.5, -3.0, 3.6, -0.1),
    (1.9, -1.6, 2.8, -1.2),
)
START = Pose2(1.0, 1.6)
MIRROR_END = 2.05


class GlassWorld(World):
    """A world with a pane in the gap, which a beam that meets it squarely does not pass."""

    def scan(
        self, *, longest: float = 5.6, half_angle: float = math.radians(120), step: float = 0.00613592
    ) -> LaserScan:
        scan = super().scan(longest=longest, half_angle=half_angle, step=step)
        laser = self.pose @ UPSIDE_DOWN_LASER.to_pose2()
        angles = laser.yaw - (-half_angle + step * np.arange(len(scan.ranges)))
        pane = cast(laser.x, laser.y, angles, np.array([PANE]), longest)
        square = (pane < longest) & (np.sin(angles) < -math.cos(math.radians(8.0)))
        ranges = np.where(square, pane, scan.ranges).astype(np.float32)
        return replace(scan, ranges=ranges)


class MirrorWorld(World):
    """A world with a mirror in the gap: behind it stands what is before it, and the laser itself."""

    def scan(
        self, *, longest: float = 5.6, half_angle: float = math.radians(120), step: float = 0.00613592
    ) -> LaserScan:
        x, y = self.pose.apply(*UPSIDE_DOWN_LASER.translation[:2])
        itself = (x - 0.025, -y - 0.025, x + 0.025, -y + 0.025)
        shown = World(self.pose, boxes=[*ROOM, *WALL, *MIRRORED, itself])
        return shown.scan(longest=longest, half_angle=half_angle, step=step)


class WorldOfAMirrorBesideADoorway(World):
    """A world in whose gap there is a mirror up to ``MIRROR_END``, and a doorway from there on."""

    def scan(
        self, *, longest: float = 5.6, half_angle: float = math.radians(120), step: float = 0.00613592
    ) -> LaserScan:
        both = MirrorWorld(self.pose), World(self.pose, boxes=[*ROOM, *WALL, *OTHER_ROOM])
        mirror, door = (world.scan(longest=longest, half_angle=half_angle, step=step) for world in both)
        laser = self.pose @ UPSIDE_DOWN_LASER.to_pose2()
        angles = laser.yaw - (-half_angle + step * np.arange(len(mirror.ranges)))
        shows = laser.x - laser.y / np.tan(angles) < MIRROR_END
        return replace(mirror, ranges=np.where(shows, mirror.ranges, door.ranges))


def places() -> Iterable[Pose2]:
    """Up and down before the gap, with a look to each side."""
    for x in np.arange(0.9, 3.6, 0.3):
        for yaw in (-2.2, -1.6, -0.9, 0.6, 2.0):
            yield Pose2(float(x), 1.6 + 0.2 * math.sin(3.0 * x), yaw)


def drawn(world: World, touches: Sequence[Pose2] = (), *, find_panes: bool = True) -> OccupancyGrid:
    """The map after a drive of which the poses are known."""
    parameters = SlamParameters(find_panes=find_panes)
    scans, poses = [], list(places())
    for world.pose in poses:
        scans.append(keep_scan(raw(world.scan()), UPSIDE_DOWN_LASER, parameters))
    return MapDrawer(parameters).draw(scans, poses, 0, touches)


def cells_at(grid: OccupancyGrid, box: Box) -> np.ndarray:
    """The cells whose middles are in a box of the room."""
    x, y = np.meshgrid(np.arange(box[0] + 0.025, box[2], 0.05), np.arange(box[1] + 0.025, box[3], 0.05))
    found = [grid.cell_of(*each) for each in zip(x.flat, y.flat, strict=True)]
    return np.array([grid.cells[cell] if grid.contains(*cell) else UNKNOWN for cell in found])


def test_the_room_in_a_mirror_is_not_on_the_map() -> None:
    world = MirrorWorld(START)
    behind = (1.4, -1.2, 2.7, -0.3)
    assert (cells_at(drawn(world, find_panes=False), behind) == FREE).mean() > 0.5
    grid = drawn(world)
    assert (cells_at(grid, behind) == UNKNOWN).all()
    across = [
        (cells_at(grid, (x, -0.1, x + 0.05, 0.11)) == OCCUPIED).any() for x in np.arange(1.5, 2.6, 0.05)
    ]
    assert np.mean(across) > 0.9
    assert (cells_at(grid, (0.7, 0.5, 4.0, 2.2)) == FREE).mean() > 0.9


def test_a_doorway_beside_a_mirror_stays_open() -> None:
    grid = drawn(WorldOfAMirrorBesideADoorway(START))
    across = [
        (cells_at(grid, (x, -0.1, x + 0.05, 0.11)) == OCCUPIED).any()
        for x in np.arange(GAP[0] + 0.1, MIRROR_END - 0.1, 0.05)
    ]
    assert np.mean(across) > 0.9
    assert (cells_at(grid, (MIRROR_END + 0.25, -0.6, GAP[1] - 0.1, 0.4)) == FREE).all()


@pytest.mark.parametrize("room", [OTHER_ROOM, MIRRORED])
def test_a_doorway_stays_open_also_to_a_room_that_mirrors_this_one(room: tuple[Box, ...]) -> None:
    grid = drawn(World(START, boxes=[*ROOM, *WALL, *room]))
    assert (cells_at(grid, (GAP[0] + 0.1, -0.6, GAP[1] - 0.1, 0.4)) == FREE).all()


def test_glass_is_a_wall_where_it_was_looked_at_squarely() -> None:
    grid = drawn(GlassWorld(START, boxes=[*ROOM, *WALL, *OTHER_ROOM]))
    across = [
        (cells_at(grid, (x, -0.1, x + 0.05, 0.11)) == OCCUPIED).any() for x in np.arange(1.5, 2.6, 0.05)
    ]
    assert np.mean(across) > 0.9


def test_what_was_touched_is_a_wall() -> None:
    boxes = [*ROOM, *WALL, *OTHER_ROOM]
    there = (3.7, 2.0, 3.9, 2.2)
    assert (cells_at(drawn(World(START, boxes=boxes)), there) == FREE).all()
    assert (cells_at(drawn(World(START, boxes=boxes), [Pose2(3.6, 2.1, 0.1)]), there) == OCCUPIED).any()


def test_who_touches_something_in_passing_does_not_close_a_doorway() -> None:
    boxes = [*ROOM, *WALL, *OTHER_ROOM]
    middle = (GAP[0] + GAP[1]) / 2.0
    squarely, askew = Pose2(middle, 0.2, -math.pi / 2.0), Pose2(middle - 0.15, 0.15, -0.7)
    for touch, closed in ((squarely, True), (askew, False)):
        grid = drawn(World(START, boxes=boxes), [touch])
        at_ends = [cells_at(grid, (x, -0.1, x + 0.1, 0.1)) for x in (GAP[0] + 0.15, GAP[1] - 0.25)]
        assert all((cells == OCCUPIED).any() == closed for cells in at_ends), touch


def test_where_the_robot_drives_through_is_no_pane() -> None:
    world, middle = World(START, boxes=[*ROOM, *WALL, *OTHER_ROOM]), (GAP[0] + GAP[1]) / 2.0
    parameters, drawer = SlamParameters(), MapDrawer(SlamParameters())
    touch, doorway = Pose2(middle, 0.2, -math.pi / 2.0), (GAP[0] + 0.2, -0.1, GAP[1] - 0.2, 0.1)
    scans, poses = [], []
    closed = []
    for y in (1.6, 1.2, 0.8, 0.4, 0.2, -0.3, -0.8):
        world.pose = Pose2(middle, y, -math.pi / 2.0)
        poses.append(world.pose)
        scans.append(keep_scan(raw(world.scan()), UPSIDE_DOWN_LASER, parameters))
        grid = drawer.draw(scans, poses, 0, [touch] if y < 0.3 else [])
        closed.append(bool((cells_at(grid, doorway) == OCCUPIED).any()))
    assert closed == [False, False, False, False, True, False, False]
