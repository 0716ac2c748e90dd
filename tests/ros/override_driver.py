"""A base's driver that only stops and releases: the real switch of the override before a made-up base."""

from __future__ import annotations

from collections.abc import Callable

from florence_bt.core.ports import Ports
from florence_bt.drivers.turtlebot.override_file import OverrideFile
from florence_bt.drivers.turtlebot.override_switch import BaseWord, OverrideSwitch
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.ports import RosPorts


class OverrideDriver(FlorenceNode):
    """Switches the override, and says of its base what a test wants.

    Attributes:
        switched: Each switch: whether it stopped the base.
        base: What the base says.
    """

    def __init__(
        self, name: str = "driver", *, on: bool = False, connect: Callable[[FlorenceNode], Ports] = RosPorts
    ) -> None:
        super().__init__(name)
        self.switched: list[bool] = []
        self.base = BaseWord(standing=True, driven_by_hand=False, problem="")
        self.override = OverrideSwitch(
            connect(self), OverrideFile(None), self.switched.append, lambda: self.base
        )
        self.on_close(self.override.close)
        if on:
            self.override.stop()
            self.switched.clear()

    def say(self, **changes: object) -> None:
        """Change what the base says, and tell it."""
        self.base = self.base._replace(**changes)  # type: ignore[arg-type]
        self.override.tell_state()
