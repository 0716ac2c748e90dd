"""What the page draws itself: one ES module each, below ``components``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from nicegui.element import Element

from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.skills.robot_description.room import RoomParameters
from florence_bt.trees.drawings.ascii import TreeRow
from florence_page.parts import tree_parts

_LIVE = {"florence-live": "components/live"}


class MapView(Element, component="components/map_view.js", esm=_LIVE):
    """The map. Emits ``place`` with x, y in metres and yaw in radians when somebody gives a pose.

    Args:
        picking: Whether dragging gives a heading from the beginning, and moves the map only with two fingers.
        plain: Whether it is only looked at: no pose is chosen, and nothing is shown on request.
        path: The way of a recorded run, to be shown in place of what happens now; poses in the map frame.
    """

    def __init__(
        self,
        *,
        picking: bool = False,
        plain: bool = False,
        path: Sequence[Sequence[float]] | None = None,
    ) -> None:
        super().__init__()
        self._props["footprint"] = [list(corner) for corner in RoomParameters().make_footprint().corners]
        self._props["picking"] = picking
        self._props["plain"] = plain
        if path is not None:
            self._props["path"] = [list(pose) for pose in path]

    def show_chosen(self, pose: Pose2 | None) -> None:
        """Show the pose that somebody has chosen."""
        self._props["chosen"] = None if pose is None else [pose.x, pose.y, pose.yaw]
        self.update()

    def show_way(self, points: int, person: tuple[float, float] | None) -> None:
        """Show the first so many points of the way of a recorded run, and where it had found somebody."""
        self.run_method("show_way", points, person)


class TreeView(Element, component="components/tree_view.js", esm=_LIVE):
    """The tree of the running mission, or of a recorded run.

    Emits ``break`` with the place and the title of a row when somebody sets a breakpoint there, or takes it
    away, and when they pressed.

    Args:
        rows: The nodes of a recorded run, a parent before its children; None for what runs now.
        cause: The place of the row that caused the end of the recorded run.
        breaks: Whether the viewer may set breakpoints in what runs now; all see them.
    """

    def __init__(
        self, *, rows: Sequence[TreeRow] | None = None, cause: int | None = None, breaks: bool = False
    ) -> None:
        super().__init__()
        self._props["breaks"] = breaks
        if rows is not None:
            self._props["nodes"] = tree_parts(rows)["tree"]
            self._props["cause"] = -1 if cause is None else cause

    def show_rows(self, rows: Sequence[TreeRow]) -> None:
        """Show how the nodes of a recorded run stood."""
        self.run_method("show_tree", tree_parts(rows))


class RunKeys(Element, component="components/run_keys.js"):
    """Keys that go through a recorded run, as in the terminal; emits ``go`` with the key."""


class BreakpointBar(Element, component="components/breakpoint_bar.js", esm=_LIVE):
    """The breakpoints that are set, and where a paused run stands, with the buttons and keys to go on.

    Emits ``step`` and ``go_on`` with the id of the run, ``remove`` with the name of a breakpoint, each with
    when somebody pressed.

    Args:
        acts: Whether the viewer may do that; all see it.
    """

    def __init__(self, *, acts: bool) -> None:
        super().__init__()
        self._props["acts"] = acts


class StatusView(Element, component="components/status_view.js", esm=_LIVE):
    """A line: the mission and its state, the battery, what holds the robot up."""


RECONNECT_S = 300.0
"""Seconds for which the session of a browser that is cut off is kept: it goes on where it was."""
ABOVE_BAR = "h-[calc(100dvh-var(--florence-bar,0px))]"
"""The class of what fills the window above the bar of the robot, if there is one."""


class RobotBar(Element, component="components/robot_bar.js", esm=_LIVE):
    """STOP THE ROBOT with what is known of it, driving by hand, and the release: on every page."""


class DrivePad(Element, component="components/drive_pad.js", esm=_LIVE):
    """Drives the robot by hand: a pad, while the override is on and somebody wants to drive."""


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
