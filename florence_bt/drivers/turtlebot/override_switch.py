"""The manual override on ROS: who switches it, what the base makes of it, and who may end it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from florence_interfaces.msg import ManualOverride
from florence_interfaces.srv import ReleaseOverride
from std_msgs.msg import Bool

from florence_bt.core.clock import call_every
from florence_bt.core.errors import ConfigError
from florence_bt.core.topic_names import MANUAL_OVERRIDE, OVERRIDE_STATE, RELEASE_OVERRIDE, SWITCH_OVERRIDE
from florence_bt.drivers.turtlebot.override_file import OverrideFile
from florence_bt.ros.conversions import stamp_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE

BEAT_S = 0.5
"""Seconds between two messages on the override's state: whoever shows it knows by their absence that it is
old."""
LATE_S = 1.0
"""A release that comes later than this after the person pressed is refused."""


class BaseWord(NamedTuple):
    """What the base says, for those who stop it.

    Attributes:
        standing: The wheels are commanded to stand still, and do, as its encoders say.
        driven_by_hand: A command by hand moves it.
        problem: Why no command reaches it; empty when it answers.
    """

    standing: bool
    driven_by_hand: bool
    problem: str


class OverrideSwitch:
    """Switches the manual override of a base, keeps it in a file, and says how it stands.

    Args:
        node: Its topics and its service are this node's.
        file: Keeps it over restarts.
        switch: Gives the base to a person (true) or back; the wheels have a zero when it returns.
        base: What the base says.

    Attributes:
        on: Whether the override is on.
    """

    def __init__(
        self,
        node: FlorenceNode,
        file: OverrideFile,
        switch: Callable[[bool], None],
        base: Callable[[], BaseWord],
    ) -> None:
        self._node = node
        self._file = file
        self._switch = switch
        self._base = base
        self.on = file.is_on()
        self._stops = int(self.on)
        self._flag = node.create_publisher(Bool, MANUAL_OVERRIDE, LATCHED)
        self._state = node.create_publisher(ManualOverride, OVERRIDE_STATE, LATCHED)
        self._tell()
        self._commands = node.create_subscription(Bool, SWITCH_OVERRIDE, self._on_switch, RELIABLE)
        node.create_service(ReleaseOverride, RELEASE_OVERRIDE, self._on_release)
        self._beating = call_every(node.steady, BEAT_S, self.tell_state)
        node.on_close(self._beating.cancel)

    def tell_state(self) -> None:
        """Say how the override and the base stand now."""
        standing, by_hand, problem = self._base()
        self._state.publish(
            ManualOverride(
                on=self.on,
                stops=self._stops,
                sent_at=self._node.steady.now(),
                switched_on=stamp_to_ros(self._file.switched_on),
                standing=standing,
                driven_by_hand=by_hand,
                problem=problem,
            )
        )

    def _tell(self) -> None:
        self._flag.publish(Bool(data=self.on))
        self.tell_state()

    def _on_switch(self, message: Bool) -> None:
        if message.data:
            self.stop()
        elif self.on:
            self.release()
        else:
            self._tell()  # each message is answered: its sender, or a new subscriber, wants to know

    def stop(self) -> None:
        """Stop the wheels first, then tell the listeners, then the disk, then those who were absent."""
        news, self.on = not self.on, True
        self._stops += 1
        self._switch(True)
        self._tell()
        if news:
            self._node.get_logger().warning("manual override on: the base obeys manual_cmd_vel only")
            self._keep()
            self.tell_state()

    def release(self, by: str = "") -> None:
        """Give the base back."""
        self.on = False
        self._switch(False)
        self._tell()
        self._node.get_logger().warning(f"manual override off{by}: the base obeys velocity commands again")
        self._keep()

    def _keep(self) -> None:
        try:
            self._file.keep(self.on)
        except ConfigError as error:
            self._node.get_logger().error(str(error))

    def _on_release(
        self, request: ReleaseOverride.Request, response: ReleaseOverride.Response
    ) -> ReleaseOverride.Response:
        late = self._node.steady.now() - request.pressed_at
        if not self.on:
            response.success, response.message = True, "the manual override is off already"
        elif request.stops != self._stops:
            response.message = (
                "not released: somebody has stopped the robot since; look, then release it again"
            )
        elif not 0.0 <= late <= LATE_S:
            response.message = "not released: this came too late; look, then release it again"
        else:
            self.release(f", by {request.by}" if request.by else "")
            response.success, response.message = True, "the manual override is off: missions may start again"
        return response
