"""What the page draws itself: one ES module each, below ``components``."""

from __future__ import annotations

from typing import Any

from nicegui.element import Element

from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.skills.robot_description.room import RoomParameters

_LIVE = {"florence-live": "components/live"}


class MapView(Element, component="components/map_view.js", esm=_LIVE):
    """The map. Emits ``place`` with x, y in metres and yaw in radians when somebody gives a pose.

    Args:
        picking: Whether dragging gives a heading from the beginning, and moves the map only with two fingers.
    """

    def __init__(self, *, picking: bool = False) -> None:
        super().__init__()
        self._props["footprint"] = [list(corner) for corner in RoomParameters().make_footprint().corners]
        self._props["picking"] = picking

    def show_chosen(self, pose: Pose2 | None) -> None:
        """Show the pose that somebody has chosen."""
        self._props["chosen"] = None if pose is None else [pose.x, pose.y, pose.yaw]
        self.update()


class TreeView(Element, component="components/tree_view.js", esm=_LIVE):
    """The tree of the running mission."""


class StatusView(Element, component="components/status_view.js", esm=_LIVE):
    """A line: the mission and its state, the battery, what holds the robot up."""


FARTHEST_M = 10_000.0
"""Chosen: no map of a home reaches farther."""


def pose_from_browser(sent: Any) -> Pose2 | None:
    """Return the pose that a browser says somebody chose; None when it is no pose.

    Args:
        sent: What came, of any type and size.
    """
    values: list[Any] = [sent.get(name) for name in ("x", "y", "yaw")] if isinstance(sent, dict) else [None]
    if not all(isinstance(each, int | float) for each in values):
        return None
    try:
        pose = Pose2(*map(float, values))
    except OverflowError:  # JSON has numbers that no float holds
        return None
    near = pose.is_finite() and max(abs(pose.x), abs(pose.y)) <= FARTHEST_M
    return Pose2(pose.x, pose.y, normalize_angle(pose.yaw)) if near else None
