"""Places from which a room can be seen."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from florence_bt.core.clock import ManualClock
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import OCCUPIED, OccupancyGrid
from florence_bt.skills.locator import views as views_module
from florence_bt.skills.locator.hotspots import Hotspot, Hotspots
from florence_bt.skills.locator.locator import Locator
from florence_bt.skills.locator.views import (
    ARC,
    BLIND_M,
    FREE_M,
    LOOK_STEP,
    LOOKS,
    MAX_VIEWS,
    RANGE_M,
    ROOMY_M,
    STEP_M,
    VIEW_REACH_M,
    WORTH_M2,
    views,
)

GOTO_USER = Path(views_module.__file__).parents[2] / "trees" / "missions" / "goto_user.yaml"
Box = tuple[tuple[float, float], tuple[float, float]]
WALLS: list[Box] = [
    ((0.0, 6.0), (0.0, 0.1)),
    ((0.0, 6.0), (3.9, 4.0)),
    ((0.0, 0.1), (0.0, 4.0)),
    ((5.9, 6.0), (0.0, 4.0)),
]
SCREEN: Box = ((2.0, 2.1), (1.0, 3.9))
"""Hides the left third of the room, but for a passage of 0.9 m."""
HOTSPOT = Pose2(4.0, 3.0, math.pi)


def room(*boxes: Box) -> OccupancyGrid:
    """6 m by 4 m within walls, and some boxes; two metres more of another room to the right."""
    grid = OccupancyGrid(0.05, Pose2(), np.zeros((80, 160), np.int8))
    for (left, right), (low, high) in [*WALLS, *boxes]:
        (row, column), (last_row, last_column) = grid.cell_of(left, low), grid.cell_of(right, high)
        grid.cells[row:last_row, column:last_column] = OCCUPIED
    return grid


def in_room(x: float, y: float) -> bool:
    return x < 6.0


def sees(view: Pose2, point: Pose2, grid: OccupancyGrid) -> bool:
    parts = np.linspace(0.0, 1.0, 40)
    line = [(view.x + part * (point.x - view.x), view.y + part * (point.y - view.y)) for part in parts]
    return all(grid.cells[grid.cell_of(x, y)] < OCCUPIED for x, y in line)


def test_from_the_hotspot_of_a_small_open_room_all_is_seen_but_what_is_near_it() -> None:
    hotspot, second = views(Pose2(3.0, 2.0), in_room, room())
    assert hotspot == Pose2(3.0, 2.0)
    assert BLIND_M + FREE_M < second.distance_to(hotspot) < RANGE_M
    assert abs(second.bearing_to(hotspot.x, hotspot.y)) < 0.2


def test_a_room_may_reach_to_the_edge_of_its_map() -> None:
    grid = OccupancyGrid(0.05, Pose2(), np.zeros((80, 120), np.int8))
    found = list(views(Pose2(3.0, 2.0), lambda x, y: True, grid))
    assert len(found) > 1 and all(0.0 < view.x < 6.0 and 0.0 < view.y < 4.0 for view in found)


def test_the_second_view_shows_what_is_hidden_from_the_hotspot() -> None:
    first, second, *_ = views(HOTSPOT, in_room, room(SCREEN))
    assert first == HOTSPOT
    behind = Pose2(1.0, 3.0)
    assert second.x < 2.4 or second.y < 1.0, "beyond the screen or in line with the passage"
    assert abs(second.bearing_to(behind.x, behind.y)) < math.pi / 2


def test_the_looks_of_a_view_show_what_the_view_is_for() -> None:
    """What is new at the back of the looks counts as hidden: another view shows it, or this one turned."""
    pillar: Box = ((2.4, 3.4), (1.3, 2.7))
    grid = room(pillar)
    found = list(views(Pose2(0.6, 2.0), in_room, grid))
    points = [Pose2(x, y) for x in np.arange(0.5, 5.8, 0.3) for y in np.arange(0.5, 3.8, 0.3)]
    free = [point for point in points if not (2.2 < point.x < 3.6 and 1.1 < point.y < 2.9)]
    unseen = [
        point
        for point in free
        if not any(
            BLIND_M <= view.distance_to(point) <= RANGE_M
            and (number == 0 or abs(view.bearing_to(point.x, point.y)) <= ARC / 2)
            and sees(view, point, grid)
            for number, view in enumerate(found)
        )
    ]
    assert len(found) > 1 and len(unseen) * 0.3**2 < WORTH_M2


def test_a_view_looks_the_way_that_goto_user_does() -> None:
    text = str(yaml.safe_load(GOTO_USER.read_text())["tree"])
    half = math.degrees(LOOK_STEP) * (LOOKS - 1) / 2
    assert f"'angle': '-{half} deg'" in text and f"min($looks, {LOOKS})" in text
    assert f"'step': '{math.degrees(LOOK_STEP):g} deg'" in text


def test_the_robot_fits_at_every_view() -> None:
    for view in itertools.islice(views(HOTSPOT, in_room, room(SCREEN)), 1, None):
        assert FREE_M <= view.x <= 5.9 - FREE_M and FREE_M <= view.y <= 3.9 - FREE_M
        assert not (2.0 - FREE_M < view.x < 2.1 + FREE_M and view.y > 1.0)


def test_a_corner_that_shows_a_little_more_is_no_better_than_a_place_with_room_around() -> None:
    _, second, *_ = views(HOTSPOT, in_room, room(SCREEN))
    assert min(second.x - 0.1, second.y - 0.1) >= ROOMY_M - STEP_M / 2


def test_where_there_is_little_room_a_view_is_there_all_the_same() -> None:
    narrow: Box = ((0.1, 1.2), (0.1, 3.9))
    assert any(view.x < 2.0 for view in views(HOTSPOT, in_room, room(SCREEN, narrow)))


def test_a_place_that_the_robot_does_not_get_to_is_no_view() -> None:
    closed: Box = ((2.0, 2.1), (0.0, 4.0))
    found = views(HOTSPOT, in_room, room(closed))
    assert found and all(view.x > 2.1 for view in found)


def test_there_are_few_views() -> None:
    screens = [
        ((x, x + 0.1), (0.95, 3.9) if n % 2 else (0.1, 3.05)) for n, x in enumerate((1.0, 2.0, 3.0, 4.8))
    ]
    assert 2 < len(list(views(HOTSPOT, in_room, room(*screens)))) <= MAX_VIEWS


def locator(grid: OccupancyGrid | None) -> Locator:
    corners = ((0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (0.0, 4.0))
    spots = [Hotspot("parlour", HOTSPOT, polygon=corners), Hotspot("hall", Pose2(7.0, 2.0))]
    found = Locator(Hotspots(spots), ManualClock())
    found.map = grid
    return found


def test_the_locator_lists_the_views_from_the_hotspot_on() -> None:
    found = locator(room(SCREEN)).get_views("parlour").outputs["poses"]
    assert found[0] == HOTSPOT and 1 < len(found) <= MAX_VIEWS
    assert found == locator(room(SCREEN)).get_views("parlour").outputs["poses"]


def test_without_a_map_there_is_the_hotspot_alone() -> None:
    assert locator(None).get_views("parlour").outputs["poses"] == (HOTSPOT,)


@pytest.mark.parametrize("label", ["attic", ""])
def test_a_room_that_is_not_there_has_none(label: str) -> None:
    result = locator(room()).get_views(label)
    assert result.code == "unknown_room" and "parlour" in result.reason


def test_a_hall_is_no_more_work_than_a_room() -> None:
    seen = 0

    def in_hall(x: float, y: float) -> bool:
        nonlocal seen
        seen += 1
        return True

    cells = np.zeros((800, 800), np.int8)
    found = list(views(Pose2(20.0, 20.0), in_hall, OccupancyGrid(0.05, Pose2(), cells)))
    assert len(found) == MAX_VIEWS
    assert seen <= (2 * VIEW_REACH_M / STEP_M + 1) ** 2
    again = list(views(Pose2(20.0, 20.0), in_hall, OccupancyGrid(0.05, Pose2(), cells)))
    assert found == again
