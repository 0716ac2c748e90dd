"""The page's button that stops the robot: it goes on until a driver confirms, or tells that none does."""

from __future__ import annotations

import asyncio
import threading
from typing import Any

import pytest

pytest.importorskip("nicegui")
pytest.importorskip("rclpy")

from std_msgs.msg import Bool

from florence_bt.app.page import ros_thread
from florence_bt.app.page.ros_thread import RosThread
from florence_bt.core.errors import DeviceTimeout
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE
from florence_bt.ros.topics import MANUAL_OVERRIDE, SWITCH_OVERRIDE

pytestmark = pytest.mark.ros


class DeafDriver(FlorenceNode):
    """A base's driver that misses the first commands."""

    def __init__(self, misses: int) -> None:
        super().__init__("driver")
        self.heard: list[bool] = []
        self._misses = misses
        self._state = self.create_publisher(Bool, MANUAL_OVERRIDE, LATCHED)
        self.create_subscription(Bool, SWITCH_OVERRIDE, self._on_switch, RELIABLE)

    def _on_switch(self, message: Bool) -> None:
        self.heard.append(message.data)
        if len(self.heard) > self._misses:
            self._state.publish(Bool(data=message.data))


def test_a_stop_is_repeated_until_the_driver_confirms_it(ros: Any) -> None:
    driver = ros.add(DeafDriver(misses=2))
    with RosThread() as page:
        stopping = threading.Thread(target=lambda: asyncio.run(page.override(True, "a test")))
        stopping.start()
        ros.spin_until(lambda: not stopping.is_alive(), what="the confirmation")
        assert page.node.overridden and len(driver.heard) >= 3 and all(driver.heard)


def test_a_stop_that_nobody_confirms_is_told(ros: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ros_thread, "CONFIRM_S", 0.5)
    with RosThread() as page, pytest.raises(DeviceTimeout, match="by hand"):
        asyncio.run(page.override(True, "a test"))


def test_who_switches_last_has_it(ros: Any) -> None:
    driver = ros.add(DeafDriver(misses=1))

    async def both(page: RosThread) -> None:
        await asyncio.gather(page.override(False, "one"), page.override(True, "another"))

    with RosThread() as page:
        switching = threading.Thread(target=lambda: asyncio.run(both(page)))
        switching.start()
        ros.spin_until(lambda: not switching.is_alive(), what="both to end")
        assert page.node.overridden and False not in driver.heard[1:]
