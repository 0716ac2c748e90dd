"""The page's part of a stop: the base's driver confirms it, for that very press, or the reason is told."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

pytest.importorskip("nicegui")
pytest.importorskip("rclpy")

from florence_page.ros_thread import RosThread
from geometry_msgs.msg import Twist

from florence_bt.core.errors import FlorenceError
from florence_bt.ros.qos import RELIABLE
from tests.ros.override_driver import OverrideDriver

pytestmark = pytest.mark.ros


def told(ros: Any, ask: Callable[[], Awaitable[Any]]) -> Any:
    """Ask the page while the driver is served."""
    found: list[Any] = []

    def run() -> None:
        try:
            found.append(asyncio.run(ask()))  # type: ignore[arg-type]
        except FlorenceError as error:
            found.append(error)

    asking = threading.Thread(target=run)
    asking.start()
    ros.spin_until(lambda: not asking.is_alive(), what="the answer of the page")
    return found[0]


def heard(ros: Any, page: RosThread) -> None:
    ros.spin_until(lambda: page.node.override.last is not None, what="the driver's word")


def test_a_stop_is_confirmed_by_the_driver_for_that_very_press(ros: Any) -> None:
    driver = ros.add(OverrideDriver(on=True))
    with RosThread() as page:
        heard(ros, page)
        assert told(ros, lambda: page.stop("a", "a test")) == (True, "the robot is stopped")
        assert driver.switched == [True], "that it was on already confirms no press"
        driver.override.release()
        ros.spin_until(lambda: not page.node.overridden)
        assert told(ros, lambda: page.stop("a", "a test"))[0]
        assert driver.switched == [True, False], "a press that comes again after its release stops nobody"
        assert told(ros, lambda: page.stop("b", "a test"))[0] and driver.switched[-1]


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"standing": False}, "the wheels still turn"),
        ({"standing": False, "problem": "the base says nothing"}, "the base says nothing"),
    ],
)
def test_a_base_that_does_not_stand_confirms_nothing(ros: Any, changes: dict[str, Any], why: str) -> None:
    driver = ros.add(OverrideDriver())
    driver.say(**changes)
    with RosThread() as page:
        heard(ros, page)
        assert told(ros, lambda: page.stop("a", "a test")) == (False, why)
        driver.say(standing=True, problem="")
        assert told(ros, lambda: page.stop("a", "a test"))[0], "the next time the browser asks"


def test_a_robot_that_a_hand_drives_is_not_said_to_be_stopped(ros: Any) -> None:
    driver = ros.add(OverrideDriver(on=True))
    driver.say(standing=False, driven_by_hand=True)
    with RosThread() as page:
        heard(ros, page)
        confirmed, word = told(ros, lambda: page.stop("a", "a test"))
        assert confirmed and "a hand drives it" in word


def test_whoever_presses_the_hand_of_the_page_lets_go(ros: Any) -> None:
    """A press on another page, in a terminal, or of a button on the robot."""
    driver = ros.add(OverrideDriver(on=True))
    commands: list[float] = []
    driver.create_subscription(
        Twist, "manual_cmd_vel", lambda twist: commands.append(twist.linear.x), RELIABLE
    )
    hand = object()
    with RosThread() as page:
        heard(ros, page)

        def push(forward: float = 1.0) -> None:
            page.on_thread(lambda: page.driving.push(hand, forward, 0.0))
            ros.spin_for(0.05)

        ros.spin_until(lambda: push() or (commands and commands[-1] > 0.0), what="the drive")
        driver.override.stop()
        ros.spin_until(lambda: push() or commands[-1] == 0.0, what="the end of the drive")
        for _ in range(10):
            push()
        assert commands[-1] == 0.0, "the hand pushes as before"
        push(0.0)
        ros.spin_until(lambda: push() or commands[-1] > 0.0, what="the drive by a hand that begins anew")


def test_one_press_is_one_stop_however_often_the_browser_asks(ros: Any) -> None:
    driver = ros.add(OverrideDriver())
    driver.say(standing=False)
    with RosThread() as page:
        heard(ros, page)
        for _ in range(3):
            assert not told(ros, lambda: page.stop("a", "a test"))[0], "its wheels turn"
        assert driver.switched == [True]


def test_without_a_driver_nothing_is_confirmed_until_one_is_there(ros: Any) -> None:
    with RosThread() as page:
        assert told(ros, lambda: page.stop("a", "a test")) == (False, "the base's driver says nothing")
        assert isinstance(told(ros, lambda: page.release(0, 0.0, "a test")), FlorenceError)
        driver = ros.add(OverrideDriver())
        heard(ros, page)
        end = time.monotonic() + 60.0
        while not told(ros, lambda: page.stop("a", "a test"))[0]:
            assert time.monotonic() < end
        assert driver.override.on


def test_a_driver_that_says_nothing_any_more_confirms_nothing(ros: Any) -> None:
    driver = ros.add(OverrideDriver(on=True))
    with RosThread() as page:
        heard(ros, page)
        ros.close_node(driver)
        confirmed, why = told(ros, lambda: page.stop("a", "a test"))
        assert not confirmed and why
        ros.spin_until(
            lambda: told(ros, lambda: page.stop("a", "a test"))[1] == "the base's driver says nothing",
            what="that its silence is noticed",
        )


def test_a_release_is_for_the_stop_that_was_on_the_screen(ros: Any) -> None:
    driver = ros.add(OverrideDriver())
    with RosThread() as page:
        heard(ros, page)
        told(ros, lambda: page.stop("a", "a test"))
        seen = page.node.override.last.stops
        driver.override.stop()
        ros.spin_until(lambda: page.node.override.last.stops > seen)
        done, why = told(ros, lambda: page.release(seen, 0.1, "a test"))
        assert not done and "since" in why and driver.override.on
        done, why = told(ros, lambda: page.release(seen + 1, 5.0, "a test"))
        assert not done and "too late" in why and driver.override.on
        assert told(ros, lambda: page.release(seen + 1, 0.1, "a test"))[0] and not driver.override.on
