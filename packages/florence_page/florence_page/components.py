"""What the page draws itself: one ES module each, below ``components``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from nicegui.element import Element

from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.runtime.journal.text import ReachedNode
from florence_bt.skills.robot_description.room import RoomParameters
from florence_page.parts import NOT_REACHED, SIGNS

_LIVE = {"florence-live": "components/live"}


class MapView(Element, component="components/map_view.js", esm=_LIVE):
    """The map. Emits ``place`` with x, y in metres and yaw in radians when somebody gives a pose.

    Args:
        picking: Whether dragging gives a heading from the beginning, and moves the map only with two fingers.
        plain: Whether it is only looked at: no pose is chosen, and nothing is shown on request.
        path: The way of a recorded run, to be shown in place of what happens now; poses in the map frame.
        person: Where it found somebody.
    """

    def __init__(
        self,
        *,
        picking: bool = False,
        plain: bool = False,
        path: Sequence[Sequence[float]] | None = None,
        person: tuple[float, float] | None = None,
    ) -> None:
        super().__init__()
        self._props["footprint"] = [list(corner) for corner in RoomParameters().make_footprint().corners]
        self._props["picking"] = picking
        self._props["plain"] = plain
        if path is not None:
            self._props["path"] = [list(pose) for pose in path]
            self._props["person"] = None if person is None else list(person)

    def show_chosen(self, pose: Pose2 | None) -> None:
        """Show the pose that somebody has chosen."""
        self._props["chosen"] = None if pose is None else [pose.x, pose.y, pose.yaw]
        self.update()

    def show_way(self, points: int) -> None:
        """Show the first so many points of the way of a recorded run."""
        self.run_method("show_way", points)


class TreeView(Element, component="components/tree_view.js", esm=_LIVE):
    """The tree of the running mission, or of a recorded run.

    Emits ``break`` with the place and the title of a row when somebody sets a breakpoint there, or takes it
    away, and when they pressed.

    Args:
        nodes: Every node of the recorded run, a parent before its children; None for what runs now.
        cause: The path of the node that caused the end of the recorded run.
        breaks: Whether the viewer may set breakpoints in what runs now; all see them.
    """

    def __init__(
        self, *, nodes: Sequence[ReachedNode] | None = None, cause: str = "", breaks: bool = False
    ) -> None:
        super().__init__()
        self._props["breaks"] = breaks
        self._number = {node.path: number for number, node in enumerate(nodes or ())}
        if nodes is not None:
            self._props["nodes"] = [[node.name, self._number.get(node.parent, -1)] for node in nodes]
            self._props["cause"] = self._number.get(cause, -1)

    def show_nodes(self, reached: Sequence[ReachedNode]) -> None:
        """Show how the nodes of a recorded run stand; those that are not named are not reached yet."""
        signs = [NOT_REACHED] * len(self._number)
        said = {}
        for node in reached:
            number = self._number[node.path]
            signs[number] = SIGNS[node.mark]
            if node.said:
                said[number] = node.said
        self.run_method("show_marks", {"statuses": "".join(signs), "said": said})


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
