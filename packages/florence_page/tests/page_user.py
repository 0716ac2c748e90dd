"""What tests of the page share: somebody who looks at it, and a robot that notes what it is asked."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Awaitable, Callable
from typing import Any

from florence_page.acting import Actor
from florence_page.parts import LiveParts
from nicegui.testing import User
from nicegui.testing.user_simulation import user_simulation

from florence_bt.core.errors import FlorenceError
from florence_bt.core.message_skills import AskedQuestion
from florence_bt.skills.locator.hotspots import Hotspots


class NotedRobot:
    """Stands for the page's part of ROS: answers from a table, and keeps what was asked.

    Args:
        answers: Name of a service -> its answer.
    """

    def __init__(self, answers: dict[str, Any]) -> None:
        self.answers = answers
        self.asked: list[tuple[str, Any]] = []
        self.poses: list[Any] = []
        self.node = self
        self.parts = LiveParts()
        self.lines: list[str] = []
        self.questions: tuple[AskedQuestion, ...] = ()
        self.places = Hotspots()

    async def ask(self, service_type: Any, name: str, request: Any) -> Any:
        self.asked.append((name, request))
        if name not in self.answers:
            raise FlorenceError(f"nobody serves {name}: is the system up?")
        return self.answers[name]

    def requests(self, name: str) -> list[Any]:
        return [request for asked, request in self.asked if asked == name]

    def take_away(self, question: AskedQuestion) -> None:
        self.questions = tuple(each for each in self.questions if each != question)

    def tell_pose(self, pose: Any) -> None:
        self.poses.append(pose)

    def get_logger(self) -> Any:
        return self

    def info(self, line: str) -> None:
        self.lines.append(line)


def look_at(show: Callable[[], Any], do: Callable[[User], Awaitable[None]]) -> None:
    """Let somebody look at a page and do something there."""

    async def session() -> None:
        async with user_simulation(show) as user:
            await user.open("/")
            await do(user)

    modules = dict(sys.modules)
    try:
        asyncio.run(session())
    finally:
        # NiceGUI forgets the modules of pages, and the packages that they are in.
        sys.modules.update(modules)


async def until(condition: Callable[[], Any]) -> None:
    """Let the page work until a condition holds."""
    for _ in range(6000):
        if condition():
            return
        await asyncio.sleep(0.01)
    raise AssertionError("waited a minute")


async def click(user: User, *texts: str) -> None:
    """Click what has these texts or marks, one after the other, as soon as each is there."""
    for text in texts:
        await user.should_see(text, retries=600)
        user.find(text).click()


def actor_for(robot: NotedRobot, role: Any) -> Actor:
    return Actor(robot, role, judge=lambda sent: True)  # type: ignore[arg-type]
