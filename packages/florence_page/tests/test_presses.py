"""What counts as a press, and the two buttons that are requests of their own."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import pytest

pytest.importorskip("nicegui")
pytest.importorskip("rclpy")

import httpx
from fastapi import FastAPI
from florence_page.access import ROLE, Role
from florence_page.presses import LATE, RELEASE, STOP, Press, add_presses, beat, counts

from florence_bt.core.errors import FlorenceError


class Robot:
    """Notes what it is asked, and answers as it is told."""

    def __init__(self) -> None:
        self.asked: list[tuple[Any, ...]] = []
        self.answer: Any = (True, "the robot is stopped")

    async def stop(self, press: str, by: str) -> tuple[bool, str]:
        self.asked.append((press, by))
        return self.answer

    async def release(self, stops: int, ago_s: float, by: str) -> tuple[bool, str]:
        if isinstance(self.answer, Exception):
            raise self.answer
        self.asked.append((stops, by))
        assert 0.0 <= ago_s <= 1.0
        return self.answer


@pytest.fixture
def robot() -> Robot:
    return Robot()


class Browser:
    """Sends requests to an application."""

    def __init__(self, app: Any) -> None:
        self._app = app

    def post(self, path: str, **body: Any) -> httpx.Response:
        async def send() -> httpx.Response:
            transport = httpx.ASGITransport(app=self._app)
            async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as sender:
                return await sender.post(path, **body)

        return asyncio.run(send())


def client(robot: Robot, role: Role = Role.RUN) -> Browser:
    app = FastAPI()
    add_presses(app, robot)  # type: ignore[arg-type]

    async def with_role(scope: Any, receive: Any, send: Any) -> None:
        scope[ROLE] = role
        await app(scope, receive, send)

    return Browser(with_role)


@pytest.mark.parametrize(
    ("passed", "age", "expected"),
    [
        (0.0, 0.0, True),
        (5.0, 4.5, True),  # an old picture, but pressed a moment ago
        (0.9, 0.0, True),
        (1.1, 0.0, False),
        (5.0, 0.2, False),
        (0.5, 3.0, False),
        (0.5, -0.1, False),
        (-1.0, 0.0, False),
        (math.nan, 0.0, False),
        (0.5, math.nan, False),
    ],
)
def test_a_press_counts_for_a_second(passed: float, age: float, expected: bool) -> None:
    assert Press(100.0, age).counts(100.0 + passed) is expected


@pytest.mark.parametrize(
    "sent",
    [
        None,
        7,
        "now",
        [],
        {},
        {"beat": 1},
        {"beat": None, "age": 0},
        {"beat": "1", "age": "0"},
        {"beat": 1e400},
    ],
)
def test_what_is_no_press_does_not_count(sent: Any) -> None:
    assert not counts(sent)
    assert counts({"beat": beat(), "age": 0})


def test_a_stop_is_answered_with_what_is_so(robot: Robot) -> None:
    browser = client(robot)
    assert browser.post(STOP, json={"id": "a1"}).json() == {"confirmed": True, "word": "the robot is stopped"}
    robot.answer = (False, "the base's driver says nothing")
    assert browser.post(STOP, json={"id": "a1"}).json()["confirmed"] is False
    assert robot.asked == [("a1", "page (run)")] * 2


@pytest.mark.parametrize(
    "body", ["", "[]", "{}", '{"id": 7}', '{"id": ""}', '{"id": "' + "x" * 65 + '"}', "\xff", '{"id":']
)
def test_what_is_no_stop_is_refused_with_a_word(robot: Robot, body: str) -> None:
    answer = client(robot).post(STOP, content=body.encode("latin-1"))
    assert answer.status_code == 422 and answer.json()["detail"] and robot.asked == []


def test_a_press_is_small(robot: Robot) -> None:
    assert client(robot).post(STOP, content=b" " * 100_000).status_code == 413


@pytest.mark.parametrize("path", [STOP, RELEASE])
def test_who_may_only_look_presses_nothing(robot: Robot, path: str) -> None:
    body = {"id": "a", "beat": beat(), "age": 0, "stops": 1}
    assert client(robot, Role.LOOK).post(path, json=body).status_code == 403 and robot.asked == []


def test_a_release_that_comes_late_does_nothing_and_says_so(robot: Robot) -> None:
    browser = client(robot)
    late = browser.post(RELEASE, json={"beat": beat() - 1.2, "age": 0.0, "stops": 3}).json()
    assert late == {"done": False, "word": LATE} and robot.asked == []
    robot.answer = (True, "the manual override is off")
    assert browser.post(RELEASE, json={"beat": beat(), "age": 0.0, "stops": 3}).json()["done"]
    assert robot.asked == [(3, "page (run)")]


def test_why_nothing_was_released_is_told(robot: Robot) -> None:
    robot.answer = FlorenceError("not released: the base's driver says nothing")
    body = {"beat": beat(), "age": 0.0, "stops": 3}
    assert client(robot).post(RELEASE, json=body).json() == {"done": False, "word": str(robot.answer)}
    for wrong in ({"stops": -1}, {"stops": 2**32}, {"stops": "1"}, {"stops": True, "beat": "now"}):
        assert client(robot).post(RELEASE, json=body | wrong).status_code == 422
