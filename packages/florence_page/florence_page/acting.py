"""What a viewer may do to the robot, and the words in which the page asks and tells."""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, TypeVar

from builtin_interfaces.msg import Time
from florence_interfaces.srv import RunMission, SetHotspot
from nicegui import ui
from nicegui.events import GenericEventArguments

from florence_bt.app.runs.client import LOCATOR, RUN_MISSION
from florence_bt.core.errors import FlorenceError
from florence_bt.core.geometry import Pose2
from florence_bt.ros.conversions import stamp_to_ros
from florence_page.access import Role
from florence_page.presses import EXPIRY_S, LATE, counts
from florence_page.ros_thread import RosThread

T = TypeVar("T")
Pressed = TypeVar("Pressed", bound=ui.element)


def tell_failure(error: FlorenceError) -> None:
    """Tell the viewer what went wrong."""
    ui.notify(str(error), type="negative", multi_line=True)


class Actor:
    """Does what a viewer asks for, and tells the viewer what came of it.

    Args:
        ros: Talks to the robot.
        role: What the viewer may do.
        judge: Tells whether a press, as a browser sent it, still counts.

    Attributes:
        caller: Who asks, for the journal.
    """

    def __init__(self, ros: RosThread, role: Role, judge: Callable[[Any], bool] = counts) -> None:
        self.ros = ros
        self.role = role
        self._judge = judge
        self.caller = f"page ({role.name.lower()})"

    def may(self, role: Role) -> bool:
        """Tell whether the viewer has a role, or one that includes it."""
        return self.role >= role

    def in_time(self, sent: Any) -> bool:
        """Tell whether a press, as a browser sent it, still counts; that it does not is told."""
        counts = self._judge(sent)
        if not counts:
            ui.notify(LATE, type="warning")
        return counts

    def on_press(self, element: Pressed, do: Callable[[], Any], event: str = "click") -> Pressed:
        """Let a button act, unless its press comes late: what a broken line has held was meant for then."""

        async def pressed(event: GenericEventArguments) -> None:
            if not self.in_time(event.args):
                return
            done = do()
            if isinstance(done, Awaitable):
                await done

        element.on(event, pressed, js_handler="() => emit(window.florence_press())")
        return element

    async def told(self, work: Awaitable[Any], message: Callable[[Any], str] = lambda answer: "") -> Any:
        """Wait for an answer and tell it; what went wrong is told, too, and gives None."""
        try:
            answer = await work
        except FlorenceError as error:
            tell_failure(error)
            return None
        text = message(answer)
        if text:
            ui.notify(text, multi_line=True)
        return answer

    def attempt(self, work: Callable[[], T]) -> T | None:
        """Do something at once; what went wrong is told, and gives None."""
        try:
            return work()
        except FlorenceError as error:
            tell_failure(error)
            return None

    async def start(self, mission: str, inputs: Mapping[str, str]) -> bool:
        """Start a mission with the inputs that were given; without a text an input has its default.

        Returns:
            Whether it was accepted; why not is told.
        """
        given = {name: text.strip() for name, text in inputs.items() if text.strip()}
        request = RunMission.Request(
            mission=mission,
            input_names=list(given),
            input_values=list(given.values()),
            caller=self.caller,
            valid_until=soon(),
        )
        answer = await self.told(
            self.ros.ask(RunMission, RUN_MISSION, request),
            lambda answer: "" if answer.accepted else answer.message,
        )
        return answer is not None and bool(answer.accepted)

    def tell_pose(self, pose: Pose2) -> None:
        """Tell the localiser where the robot stands."""
        self.ros.tell_pose(pose)
        self.ros.node.get_logger().info(f"{self.caller} told the localiser that the robot is at {pose}")

    async def set_hotspot(self, label: str, pose: Pose2) -> None:
        """Add a hotspot at a pose, or move the one with that label there: the locator tells every map."""
        request = SetHotspot.Request(label=label, x=pose.x, y=pose.y, phi=pose.yaw)
        work = self.ros.ask(SetHotspot, f"{LOCATOR}/setHotspot", request)
        answer = await self.told(work, lambda answer: f"{label}: {answer.message}")
        if answer is not None and answer.success:
            self.ros.node.get_logger().info(f"{self.caller} put the hotspot {label!r} at {pose}")


def soon() -> Time:
    """Return the date until which a request of somebody who has just pressed counts."""
    return stamp_to_ros(time.time() + EXPIRY_S)


async def confirmed(question: str, yes: str, actor: Actor) -> bool:
    """Ask the viewer whether something shall be done."""
    with ui.dialog() as dialog, ui.card():
        ui.label(question).mark("question")
        with ui.row():
            actor.on_press(ui.button(yes), lambda: dialog.submit(True)).mark("yes")
            ui.button("Cancel", on_click=dialog.close).props("flat")
    agreed = await dialog
    dialog.delete()
    return bool(agreed)
