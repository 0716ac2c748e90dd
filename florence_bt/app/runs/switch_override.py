"""Switches the manual override: ``florence override`` and ``florence release``.

This is an emergency button: it loads nothing but ROS itself before it publishes, and needs no other process
than the base's driver.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import rclpy
from rclpy.executors import SingleThreadedExecutor
from std_msgs.msg import Bool, String

from florence_bt.core.errors import DeviceTimeout, FlorenceError
from florence_bt.ros.arguments import start_ros
from florence_bt.ros.qos import LATCHED, RELIABLE
from florence_bt.ros.topics import MANUAL_OVERRIDE, OVERRIDE_BY, SWITCH_OVERRIDE

SIGHT_S = 5.0
"""Wall seconds in which the base's driver must be discovered, and in which it must answer."""
BUSY_S = 25.0
"""Wall seconds more for each of the two while a bring-up is seen on this machine, which may be busy."""
REPEAT_S = 0.25
"""How often to publish again while there is no confirmation."""


class NoBaseDriver(FlorenceError):
    """No process that could stop the base was found."""


def switch_override(on: bool, by: str) -> str:
    """Switch the manual override and wait until the base's driver confirms it.

    Args:
        on: Whether it is switched on.
        by: Who does it, in a few words for the journal.

    Returns:
        The state now, for people.

    Raises:
        NoBaseDriver: No driver of a base was found.
        DeviceTimeout: It does not confirm.
    """
    context = rclpy.Context()
    start_ros(context)
    try:
        _OverrideSwitch(context, by).set(on)
    finally:
        rclpy.shutdown(context=context)
    if on:
        how_long = "it ends with florence release"
        return f"the manual override is on: the base takes commands from manual_cmd_vel only; {how_long}"
    return "the manual override is off: missions may start again; what was stopped stays stopped"


class _OverrideSwitch:
    def __init__(self, context: rclpy.Context, by: str) -> None:
        self._node = rclpy.create_node(
            "florence_override", context=context, enable_rosout=False, start_parameter_services=False
        )
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self._node)
        self._publisher = self._node.create_publisher(Bool, SWITCH_OVERRIDE, RELIABLE)
        self._by = String(data=by)
        self._by_publisher = self._node.create_publisher(String, OVERRIDE_BY, RELIABLE)
        self._node.create_subscription(Bool, MANUAL_OVERRIDE, self._on_override, LATCHED)
        self._is_on: bool | None = None

    def set(self, on: bool) -> None:
        if not self._spin_until(lambda: self._publisher.get_subscription_count() > 0):
            raise NoBaseDriver(
                "no driver of a base was found; is the system up? If the robot moves, switch it off by hand"
            )
        published = 0.0

        def confirmed() -> bool:
            nonlocal published
            now = time.monotonic()
            if now >= published + REPEAT_S:
                published = now
                self._by_publisher.publish(self._by)
                self._publisher.publish(Bool(data=on))
            return self._is_on is on

        if not self._spin_until(confirmed):
            raise DeviceTimeout(
                "the base's driver did not confirm in time; if the robot moves, switch it off by hand"
            )

    def _spin_until(self, done: Callable[[], bool]) -> bool:
        begin = time.monotonic()
        while not done():
            passed = time.monotonic() - begin
            if passed > SIGHT_S + BUSY_S or (passed > SIGHT_S and not _bring_up_here()):
                return False
            self._executor.spin_once(timeout_sec=0.02)
        return True

    def _on_override(self, message: Bool) -> None:
        self._is_on = bool(message.data)


def _bring_up_here() -> bool:
    from florence_bt.app.bringup.locks import bring_up_here

    return bring_up_here()
