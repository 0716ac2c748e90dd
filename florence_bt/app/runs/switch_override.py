"""Switches the manual override: ``florence override`` and ``florence release``.

This is an emergency button: it loads nothing but ROS itself before it publishes, and needs no other process
than the base's driver.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, NamedTuple, Self

import rclpy
from florence_interfaces.msg import ManualOverride
from florence_interfaces.srv import ReleaseOverride
from rclpy.executors import SingleThreadedExecutor
from std_msgs.msg import Bool, String

from florence_bt.core.errors import DeviceTimeout, FlorenceError
from florence_bt.core.topic_names import OVERRIDE_BY, OVERRIDE_STATE, RELEASE_OVERRIDE, SWITCH_OVERRIDE
from florence_bt.ros.arguments import start_ros
from florence_bt.ros.qos import LATCHED, RELIABLE

SIGHT_S = 5.0
"""Wall seconds in which the base's driver must be discovered, and in which it must answer."""
BUSY_S = 25.0
"""Wall seconds more for each of the two while a bring-up is seen on this machine, which may be busy."""
PUBLISH_AGAIN_S = 0.25
"""Period of publishing again while there is no confirmation."""
STAND_S = 2.0
"""Wall seconds in which the wheels must stand after the driver has stopped them; they do after 0.15 s."""
BY_HAND = "if the robot moves, switch it off by hand"


class NoBaseDriver(FlorenceError):
    """No process that could stop the base was found."""


class StoppedAgain(FlorenceError):
    """Somebody else has stopped the robot: a release does not undo that."""


class Stopped(NamedTuple):
    """A stop that the base's driver has confirmed.

    Attributes:
        word: What is so now, for people.
        stops: The highest count of stops (``ManualOverride``) at which nobody else has stopped the robot.
    """

    word: str
    stops: int


def stop_the_robot(by: str) -> Stopped:
    """Switch the manual override on and wait until the base's driver confirms that the base stands.

    Args:
        by: Who does it, in a few words for the journal.

    Raises:
        NoBaseDriver: No driver of a base was found.
        DeviceTimeout: It does not confirm, or the base does not obey it.
    """
    with _Switch() as switch:
        return switch.stop(by)


def release_the_robot(by: str, after: Stopped | None = None) -> str:
    """Switch the manual override off, unless somebody stops the robot meanwhile.

    Args:
        by: Who does it, in a few words.
        after: The stop that is taken back; without it, whatever has stopped the robot until now.

    Returns:
        What is so now, for people.

    Raises:
        NoBaseDriver: No driver of a base was found.
        DeviceTimeout: It does not answer.
        StoppedAgain: Somebody else has stopped the robot.
    """
    with _Switch() as switch:
        return switch.release(by, after)


class _Switch:
    def __init__(self) -> None:
        self._context = rclpy.Context()
        start_ros(self._context)
        self._node = rclpy.create_node(
            "florence_override", context=self._context, enable_rosout=False, start_parameter_services=False
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._publisher = self._node.create_publisher(Bool, SWITCH_OVERRIDE, RELIABLE)
        self._by_publisher = self._node.create_publisher(String, OVERRIDE_BY, RELIABLE)
        self._node.create_subscription(ManualOverride, OVERRIDE_STATE, self._on_state, LATCHED)
        self._state = ManualOverride()
        self._first_stops: int | None = None
        self._was_on = False
        self._heard_at = 0.0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc_info: object) -> None:
        rclpy.shutdown(context=self._context)

    def stop(self, by: str) -> Stopped:
        self._find_driver()
        published, published_at = 0, 0.0

        def stopped() -> bool:
            nonlocal published, published_at
            now = time.monotonic()
            if now >= published_at + PUBLISH_AGAIN_S:
                published, published_at = published + 1, now
                self._by_publisher.publish(String(data=by))
                self._publisher.publish(Bool(data=True))
            # The first state may be of before: one that counts our stop tells that it has arrived.
            return bool(self._state.on and self._state.stops != self._first_stops)

        if not self._spin_until(stopped):
            raise DeviceTimeout(f"the base's driver did not confirm in time; {BY_HAND}")
        begin = time.monotonic()
        self._spin_until(lambda: self._obeys() or time.monotonic() > begin + STAND_S)
        if not self._obeys():
            why = self._state.problem or "its wheels turn"
            raise DeviceTimeout(
                f"the manual override is on, but the base does not confirm that it stands ({why}); {BY_HAND}"
            )
        how = "a hand drives the base" if self._state.driven_by_hand else "the base stands"
        word = (
            f"the manual override is on, {how}: it takes commands from manual_cmd_vel only, "
            "until florence release"
        )
        counted = int(self._was_on)  # the first state was of after our first stop, or of an older one
        return Stopped(word, (self._first_stops or 0) + published - counted)

    def release(self, by: str, after: Stopped | None) -> str:
        self._find_driver()
        if not self._spin_until(lambda: self._first_stops is not None):
            raise DeviceTimeout("the base's driver does not say whether the manual override is on")
        stops = self._state.stops if after is None else after.stops
        client = self._node.create_client(ReleaseOverride, RELEASE_OVERRIDE)
        asked: list[Any] = []

        def answered() -> bool:
            if self._state.stops > stops:
                raise StoppedAgain("somebody has stopped the robot again; look, then: florence release")
            if not client.service_is_ready():
                return False
            if not asked or (asked[-1].done() and not asked[-1].result().success):
                pressed = self._state.sent_at + time.monotonic() - self._heard_at
                asked.append(
                    client.call_async(
                        ReleaseOverride.Request(stops=self._state.stops, pressed_at=pressed, by=by)
                    )
                )
            return bool(asked[-1].done() and asked[-1].result().success)

        if not self._spin_until(answered):
            raise DeviceTimeout("the base's driver did not answer; the manual override may still be on")
        return "the manual override is off: missions may start again; what was stopped stays stopped"

    def _on_state(self, message: ManualOverride) -> None:
        if self._first_stops is None:
            self._first_stops, self._was_on = message.stops, message.on
        self._state, self._heard_at = message, time.monotonic()

    def _obeys(self) -> bool:
        state = self._state
        return bool(not state.problem and (state.standing or state.driven_by_hand))

    def _find_driver(self) -> None:
        if not self._spin_until(lambda: self._publisher.get_subscription_count() > 0):
            raise NoBaseDriver(f"no driver of a base was found; is the system up? {BY_HAND.capitalize()}")

    def _spin_until(self, done: Callable[[], bool]) -> bool:
        begin = time.monotonic()
        while not done():
            passed = time.monotonic() - begin
            if passed > SIGHT_S + BUSY_S or (passed > SIGHT_S and not _bring_up_here()):
                return False
            self._executor.spin_once(timeout_sec=0.02)
        return True


def _bring_up_here() -> bool:
    from florence_bt.app.bringup.locks import bring_up_here

    return bring_up_here()
