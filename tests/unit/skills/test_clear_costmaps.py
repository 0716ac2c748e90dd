"""Clearing the costmaps: marks of sensors go, what is in the map stays."""

from __future__ import annotations

from florence_bt.core.geometry import Pose2
from florence_bt.skills.navigation.navigate._cell_kernels import LETHAL
from tests.unit.skills.navigation_world import WALLS, Box, Trip


def test_clearing_forgets_what_the_sensors_have_marked() -> None:
    obstacle: Box = (2.3, 2.3, 2.7, 2.5)
    trip = Trip(Pose2(1.0, 2.4, 0.0), boxes=(*WALLS, obstacle))
    assert trip.go(Pose2(1.2, 2.4, 0.0)).succeeded
    navigator = trip.navigator
    local = navigator.local_costmap
    before = int((local.master >= LETHAL).sum())
    assert navigator.cost_at(2.32, 2.4) >= LETHAL and before > 0
    navigator.clear()
    assert navigator.cost_at(2.32, 2.4) == 0
    assert navigator.cost_at(-0.02, 2.4) >= LETHAL, "a wall of the map"
    assert not (local.master >= LETHAL).any()
