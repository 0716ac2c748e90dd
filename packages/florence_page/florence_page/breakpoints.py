"""Breakpoints and steps on the page: a row of the tree sets one, a bar below lets the run go on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from florence_interfaces.srv import ResumeMission, SetBreakpoints
from nicegui import ui
from nicegui.events import GenericEventArguments

from florence_page.access import Role
from florence_page.acting import Actor, soon
from florence_page.components import BreakpointBar, TreeView
from florence_page.node import BREAKPOINTS

ANOTHER_TREE = "that row is another one by now: look again, and press again"
STEP, RESUME = "florence_bt/step", "florence_bt/resume"


class BreakpointControls:
    """Does what a viewer asks for in the tree and in the bar below it, if the viewer may run missions.

    Args:
        actor: Asks the mission server.
        tree: Emits ``break`` with a row.
        bar: Emits ``remove`` with a breakpoint, ``step`` and ``go_on`` with a run.
    """

    def __init__(self, actor: Actor, tree: TreeView, bar: BreakpointBar) -> None:
        self._actor = actor
        self._node = actor.ros.node
        if actor.may(Role.RUN):
            tree.on("break", self._on_break)
            bar.on("remove", self._on_remove)
            bar.on("step", lambda event: self._go_on(event, STEP))
            bar.on("go_on", lambda event: self._go_on(event, RESUME))

    async def _on_break(self, event: GenericEventArguments) -> None:
        """Set a breakpoint before a row, or take away those that are there."""
        if not self._actor.in_time(event.args):
            return
        place, title = event.args.get("node"), event.args.get("title")
        tree = self._node.tree
        if not isinstance(place, int) or not tree.has(place, title):
            ui.notify(ANOTHER_TREE, type="warning")
            return
        there = tree.breakpoints_before(place, self._node.breakpoints)
        await self._set(() if there else (tree.breakpoint_before(place),), there)

    async def _on_remove(self, event: GenericEventArguments) -> None:
        if self._actor.in_time(event.args):
            await self._set((), [str(event.args.get("name"))])

    async def _set(self, add: Sequence[str], remove: Sequence[str]) -> None:
        request = SetBreakpoints.Request(add=list(add), remove=list(remove))
        answer = await self._actor.told(
            self._actor.ros.ask(SetBreakpoints, BREAKPOINTS, request), _only_problems
        )
        if answer is None:
            return
        names = list(answer.breakpoints)
        self._actor.ros.on_thread(lambda: self._node.take_breakpoints(names))
        told = [f"set {name!r}" for name in add] + [f"took away {name!r}" for name in remove]
        self._node.get_logger().info(f"{self._actor.caller}: breakpoints: {', '.join(told)}")

    async def _go_on(self, event: GenericEventArguments, service: str) -> None:
        """Let the run that was on the screen go on, to its next leaf or to its next breakpoint."""
        if self._actor.in_time(event.args):
            request = ResumeMission.Request(run_id=str(event.args.get("run_id")), valid_until=soon())
            await self._actor.told(self._actor.ros.ask(ResumeMission, service, request), _only_problems)


def _only_problems(answer: Any) -> str:
    """Return what an answer says when it is no success: a success is seen."""
    return "" if answer.success else str(answer.message)
