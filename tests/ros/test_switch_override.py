"""``florence override`` and ``release``: they need the base's driver and nobody else, and say what is so."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable
from typing import Any

import pytest

pytest.importorskip("rclpy")
from florence_interfaces.msg import ManualOverride
from std_msgs.msg import Bool

from florence_bt.app.runs import switch_override as module
from florence_bt.app.runs.switch_override import NoBaseDriver, release_the_robot, stop_the_robot
from florence_bt.core.errors import DeviceTimeout, FlorenceError
from florence_bt.core.ports import Topic
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.ports import RosPorts
from florence_bt.ros.qos import LATCHED, RELIABLE
from tests.ros.override_driver import OverrideDriver

pytestmark = pytest.mark.ros

DRIVER = (
    "import rclpy\n"
    "from tests.ros.override_driver import OverrideDriver\n"
    "rclpy.init(); driver = OverrideDriver(); print('up', flush=True)\n"
    "rclpy.spin(driver)"
)


class DeafPorts(RosPorts):
    """Miss the first values of each topic."""

    def __init__(self, node: FlorenceNode, misses: int, heard: list[bool]) -> None:
        super().__init__(node)
        self._misses, self._heard = misses, heard

    def listen(self, topic: Topic[Any], take: Callable[[Any], None]) -> Any:
        def hear(value: Any) -> None:
            self._heard.append(value)
            if len(self._heard) > self._misses:
                take(value)

        return super().listen(topic, hear)


class DeafDriver(OverrideDriver):
    """Misses the first messages."""

    def __init__(self, misses: int) -> None:
        self.heard: list[bool] = []
        super().__init__(connect=lambda node: DeafPorts(node, misses, self.heard))


def run(ros: Any, start_process: Any, verb: str) -> Any:
    child = start_process(sys.executable, "-m", "florence_bt.cli", verb)
    ros.spin_until(lambda: child.process.poll() is not None, what=verb)
    return child


def test_the_command_line_switches_it(ros: Any, start_process: Any) -> None:
    driver = ros.add(OverrideDriver())
    for verb, on, word in (("override", True, "is on, the base stands"), ("release", False, "is off")):
        child = run(ros, start_process, verb)
        assert child.process.returncode == 0 and f"the manual override {word}" in child.output
        assert driver.switched[-1] is on


def test_it_is_said_again_until_the_driver_obeys(ros: Any, start_process: Any) -> None:
    driver = ros.add(DeafDriver(misses=2))
    child = run(ros, start_process, "override")
    assert child.process.returncode == 0 and len(driver.heard) > 2 and all(driver.heard)


@pytest.mark.parametrize("problem", ["", "/dev/ttyUSB0: the base sent no good frame for 2 s"])
def test_a_base_that_does_not_stand_is_no_success(ros: Any, start_process: Any, problem: str) -> None:
    """The driver is there and willing, but its cable is out, or the wheels go on turning."""
    driver = ros.add(OverrideDriver())
    driver.say(standing=False, problem=problem)
    child = run(ros, start_process, "override")
    assert child.process.returncode != 0 and "by hand" in child.output
    assert (problem or "its wheels turn") in child.output
    assert driver.switched[-1] is True, "what could be done is done"


def test_an_override_that_is_on_already_is_confirmed_by_its_own_stop(ros: Any, start_process: Any) -> None:
    driver = ros.add(OverrideDriver(on=True))
    child = run(ros, start_process, "override")
    assert child.process.returncode == 0 and driver.switched, "a hand that drives is stopped, too"


def test_without_a_driver_it_says_so(ros_domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "SIGHT_S", 0.2)
    with pytest.raises(NoBaseDriver, match="switch it off by hand"):
        stop_the_robot("a test")


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
        stop_the_robot("a test")


def test_a_release_does_not_undo_a_stop_that_came_meanwhile(
    ros: Any, start_process: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    driver = ros.add(FlorenceNode("driver"))  # it has no time to answer yet
    driver.create_subscription(Bool, "florenceLocator/manualOverride", print, RELIABLE)
    state = driver.create_publisher(ManualOverride, "manual_override_state", LATCHED)
    state.publish(ManualOverride(on=True, stops=1))
    found: list[FlorenceError] = []

    def release() -> None:
        try:
            release_the_robot("a test")
        except FlorenceError as error:
            found.append(error)

    releasing = threading.Thread(target=release)
    releasing.start()
    ros.spin_until(state.get_subscription_count, what="the release")
    ros.spin_for(0.3)
    state.publish(ManualOverride(on=True, stops=2))
    ros.spin_until(lambda: not releasing.is_alive(), what="the end of the release")
    assert "stopped the robot" in str(found[0])


def test_a_release_that_waited_in_a_hung_driver_is_refused(ros: Any, start_process: Any) -> None:
    """A driver that hangs keeps what it was sent: a release is of then."""
    child = start_process("-c", DRIVER)
    child.wait_for("up")
    assert "base stands" in stop_the_robot("a test").word
    os.kill(child.process.pid, signal.SIGSTOP)
    go_on = threading.Timer(2.0, os.kill, (child.process.pid, signal.SIGCONT))
    go_on.start()
    try:
        # The command is still there when the driver goes on, and asks again for what its person wants now.
        assert "is off" in release_the_robot("a test")
    finally:
        go_on.join()


def test_nothing_else_is_loaded_before_it_publishes(start_process: Any) -> None:
    child = start_process(
        "-c",
        "import sys, florence_bt.cli, florence_bt.app.runs.switch_override\n"
        "print([name for name in ('typer', 'rich', 'numpy', 'florence_bt.trees') if name in sys.modules])",
    )
    child.process.wait()
    assert child.output.splitlines()[-1] == "[]"
