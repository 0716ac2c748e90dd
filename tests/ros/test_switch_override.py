"""``florence override`` and ``florence release``: they need the base's driver and nobody else."""

from __future__ import annotations

import sys
from typing import Any

import pytest

pytest.importorskip("rclpy")
from std_msgs.msg import Bool

from florence_bt.app.runs import switch_override as module
from florence_bt.app.runs.switch_override import NoBaseDriver, switch_override
from florence_bt.core.errors import DeviceTimeout
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE

pytestmark = pytest.mark.ros


class Driver(FlorenceNode):
    """Plays the base's driver; hears only of some of the messages."""

    def __init__(self, hears_from: int = 1) -> None:
        super().__init__("driver")
        self.heard: list[bool] = []
        self._hears_from = hears_from
        self._truth = self.create_publisher(Bool, "manual_override", LATCHED)
        self._truth.publish(Bool(data=False))
        self.create_subscription(Bool, "florenceLocator/manualOverride", self._on_switch, RELIABLE)

    def _on_switch(self, message: Bool) -> None:
        self.heard.append(message.data)
        if len(self.heard) >= self._hears_from:
            self._truth.publish(message)


def test_the_command_line_switches_it(ros: Any, start_process: Any) -> None:
    driver = ros.add(Driver())
    for verb, on, word in (("override", True, "is on"), ("release", False, "is off")):
        child = start_process(sys.executable, "-m", "florence_bt.cli", verb)
        ros.spin_until(lambda child=child: child.process.poll() is not None, what=verb)
        assert child.process.returncode == 0 and f"the manual override {word}" in child.output
        assert driver.heard[-1] is on


def test_it_is_said_again_until_the_driver_obeys(ros: Any, start_process: Any) -> None:
    driver = ros.add(Driver(hears_from=3))
    child = start_process(sys.executable, "-m", "florence_bt.cli", "override")
    ros.spin_until(lambda: child.process.poll() is not None, what="the end of the command")
    assert child.process.returncode == 0 and driver.heard[:3] == [True] * 3


def test_without_a_driver_it_says_so(ros_domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "SIGHT_S", 0.2)
    with pytest.raises(NoBaseDriver, match="switch it off by hand"):
        switch_override(True, "a test")


def test_a_driver_that_does_not_obey_is_an_error(
    ros: Any, start_process: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    child = start_process(
        "-c",
        "import rclpy; from std_msgs.msg import Bool; rclpy.init(); node = rclpy.create_node('offline')\n"
        "node.create_subscription(Bool, 'florenceLocator/manualOverride', print, 10)\n"
        "print('up', flush=True); rclpy.spin(node)",
    )
    child.wait_for("up")
    monkeypatch.setattr(module, "SIGHT_S", 5.0)
    with pytest.raises(DeviceTimeout, match="did not confirm"):
        switch_override(True, "a test")


def test_nothing_else_is_loaded_before_it_publishes(start_process: Any) -> None:
    child = start_process(
        "-c",
        "import sys, florence_bt.cli, florence_bt.app.runs.switch_override\n"
        "print([name for name in ('typer', 'rich', 'numpy', 'florence_interfaces', 'florence_bt.trees')"
        " if name in sys.modules])",
    )
    child.process.wait()
    assert child.output.splitlines()[-1] == "[]"
