"""What the camera marked above somebody's feet, once the laser sees that they have gone."""

from __future__ import annotations

import numpy as np
import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED, LETHAL
from florence_bt.skills.navigation.navigate.costmap import Costmap, CostmapParameters, Rays

ROBOT = Pose2()
PERSON = np.array([[1.5, -0.1], [1.5, 0.0], [1.5, 0.1]])


def rays(*ends: tuple[float, float]) -> Rays:
    """Of a sensor at the origin."""
    points = np.array(ends)
    return Rays(0.0, 0.0, points, np.hypot(*points.T), 0.0, 5.6)


def laser(legs_at: float | None, wall_at: float = 3.5) -> Rays:
    """Beams to 20 degrees at both sides: two legs beside each other, and a wall."""
    angles = np.radians(np.linspace(-20.0, 20.0, 161))
    ranges = np.full(len(angles), wall_at)
    if legs_at is not None:
        across = legs_at * np.tan(angles)
        ranges[(np.abs(np.abs(across) - 0.1) < 0.05)] = legs_at
    return rays(*zip(ranges * np.cos(angles), ranges * np.sin(angles), strict=True))


def costmap_with(source: str, *, legs_at: float | None) -> Costmap:
    costmap = Costmap(CostmapParameters())
    costmap.update_feet(laser(legs_at))
    costmap.add_rays(source, rays(*PERSON), ROBOT)
    assert costmap.cost_at(1.5, 0.0) == LETHAL
    return costmap


@pytest.mark.parametrize("source", ["depth", "overhangs"])
def test_who_has_walked_on_leaves_nothing(source: str) -> None:
    costmap = costmap_with(source, legs_at=1.45)
    for _ in range(4):
        costmap.update_feet(laser(None))
    assert costmap.cost_at(1.5, 0.0) == LETHAL
    costmap.update_feet(laser(None))
    assert costmap.cost_at(1.5, 0.0) < INSCRIBED


@pytest.mark.parametrize("source", ["depth", "overhangs"])
def test_beside_a_wall_of_the_map_who_has_walked_on_leaves_nothing(source: str) -> None:
    """0.3 m before the wall: the rest of a body that has gone would close the way for good."""
    costmap = costmap_with(source, legs_at=1.45)
    see_wall(costmap, times=4)
    assert costmap.cost_at(1.5, 0.0) == LETHAL
    see_wall(costmap, times=1)
    assert costmap.cost_at(1.5, 0.0) < INSCRIBED


def test_what_hangs_on_a_wall_of_the_map_stays() -> None:
    costmap = Costmap(CostmapParameters())
    see_wall(costmap, times=1)
    costmap.add_rays("overhangs", rays(*PERSON), ROBOT)
    see_wall(costmap, times=20)
    assert costmap.cost_at(1.5, 0.0) == LETHAL


def test_what_hangs_over_a_thing_that_the_map_does_not_know_stays() -> None:
    costmap = costmap_with("overhangs", legs_at=1.45)
    for _ in range(20):
        costmap.update_feet(laser(None, wall_at=1.8))
    assert costmap.cost_at(1.5, 0.0) == LETHAL


def see_wall(costmap: Costmap, times: int) -> None:
    scan = laser(None, wall_at=1.8)
    for _ in range(times):
        costmap.update_feet(scan, known=np.ones(len(scan.ends), bool))


def test_who_stands_there_stays() -> None:
    costmap = costmap_with("depth", legs_at=1.45)
    for step in range(20):
        # Between the legs it looks through now and then.
        costmap.update_feet(laser(None if step % 3 else 1.45))
    assert costmap.cost_at(1.5, 0.0) == LETHAL


def test_a_table_top_without_legs_near_stays() -> None:
    costmap = costmap_with("depth", legs_at=None)
    for _ in range(20):
        costmap.update_feet(laser(None))
    assert costmap.cost_at(1.5, 0.0) == LETHAL


def test_a_table_beside_which_somebody_stood_stays() -> None:
    costmap = costmap_with("depth", legs_at=None)
    costmap.update_feet(laser(1.45))
    costmap.add_rays("depth", rays(*PERSON), ROBOT)
    for _ in range(20):
        costmap.update_feet(laser(None))
    assert costmap.cost_at(1.5, 0.0) == LETHAL


def test_what_is_hidden_stays() -> None:
    costmap = costmap_with("depth", legs_at=1.45)
    for _ in range(20):
        costmap.update_feet(laser(None, wall_at=1.0))
    assert costmap.cost_at(1.5, 0.0) == LETHAL
