"""Marks of what the robot touched: they stay in the costmaps, whatever it drove for and how that ended."""

from __future__ import annotations

from typing import TYPE_CHECKING

from florence_bt.skills.navigation.navigate.costmap import Costmap

if TYPE_CHECKING:
    from florence_bt.skills.navigation.navigate.state import CycleState

_OFF_M = 0.05
"""The robot is off what it touched when it has moved so far: until then a mark would hold it there."""


class ContactMarks:
    """Marks what was touched, once the robot is off it: no ray clears that.

    Args:
        global_costmap: In the map frame.
        local_costmap: In the odometry frame.
    """

    def __init__(self, global_costmap: Costmap, local_costmap: Costmap) -> None:
        self._global, self._local = global_costmap, local_costmap
        self._touched: CycleState | None = None
        self._is_known = False

    def touch(self, state: CycleState) -> None:
        """Note that something is touched in this cycle."""
        if self._touched is None or self._is_known:
            self._touched, self._is_known = state, False

    def saw(self, state: CycleState) -> None:
        """Take the state of a cycle of any goal, after which the costmaps have what was touched."""
        if state.stop.holds_forward:
            self.touch(state)
            return
        there = self._touched
        if there is None:
            return
        if there.localised and not self._is_known:
            self._global.add_contact(there.map_pose, state.now)
        self._is_known = True
        # Without room behind it the robot still stands there, and must get away from it.
        if there.pose.distance_to(state.pose) > _OFF_M:
            self._local.add_contact(there.pose, state.now)
            self._touched = None
