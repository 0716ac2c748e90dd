"""Holds the robot still from the supervisor: by the velocity filter, else by the base's port."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from std_srvs.srv import SetBool

from florence_bt.app.bringup.config import config_of
from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.simulated import hardware_settings
from florence_bt.app.runs.client import MissionClient
from florence_bt.core.errors import DeviceError
from florence_bt.drivers.serial_port import SecondHandle, SerialPort
from florence_bt.drivers.turtlebot.codec import commands
from florence_bt.drivers.turtlebot.codec.packets import OiMode
from florence_bt.drivers.turtlebot.parameters import TurtlebotNodeParameters, TurtlebotParameters
from florence_bt.drivers.turtlebot.sequences import FILL_PARTIAL_COMMAND_KEEPING_MODE, stand
from florence_bt.ros.parameters import fill_dataclass


class Writer(Protocol):
    """A port to write to."""

    def write(self, data: bytes) -> None:
        """Send bytes; raises DeviceError."""

    def close(self) -> None:
        """Give the port back."""


def stop_base(options: BringUp, open_port: Callable[[str, int], Writer] = SerialPort) -> str:
    """Stop the base of a bring-up, and its stream of sensor data; its own driver must be gone.

    Args:
        options: The bring-up.
        open_port: Opens a path at a baud rate.

    Returns:
        What was done, for people.
    """
    try:
        node, base = _parameters(options)
        port = open_port(node.port, node.baud_rate or base.model.baud_rate)
        _send(port, stand(OiMode(base.operation_mode)) + commands.pause_stream())
    except Exception as error:
        # Any error: the caller has other processes to end.
        return f"the base may still be driving, switch it off: {error}"
    return "the base was sent a stop command"


class HungDriverStop:
    """Stops the base past its own driver, which has the port open and does not answer.

    Args:
        options: The bring-up.

    Raises:
        ConfigError: The configuration is wrong.
    """

    def __init__(self, options: BringUp) -> None:
        node, base = _parameters(options)
        self._port, self._mode = node.port, OiMode(base.operation_mode)

    def stop(self) -> str:
        """Stop the base; never waits. The sensors go on, for the driver that may come back.

        Returns:
            Why the base may still be driving, for people; empty when the stop command was sent.
        """
        try:
            _send(SecondHandle(self._port), stand(self._mode))
        except DeviceError as error:
            return str(error)
        return ""


def _send(port: Writer, data: bytes) -> None:
    try:
        port.write(FILL_PARTIAL_COMMAND_KEEPING_MODE + data)
    finally:
        port.close()


def _parameters(options: BringUp) -> tuple[TurtlebotNodeParameters, TurtlebotParameters]:
    read = _reader(options)
    return fill_dataclass(TurtlebotNodeParameters, read), fill_dataclass(TurtlebotParameters, read)


def _reader(options: BringUp) -> Callable[[str, Any], Any]:
    """Return a reader of the base node's parameters as its process was given them: null leaves one out."""
    port = str(hardware_settings(options).base_port) if options.in_flat else None
    given = config_of(options).of("turtlebot_node", port=port)

    def read(name: str, default: Any) -> Any:
        value = given.get(name)
        return default if value is None else value

    return read


HARD_STOP, STOP_ALL = "velocity_filter/hard_stop", "velocity_filter/stop_all"
"""Hold what programs command, and what a person commands by hand, too."""
FILTER_BUDGET_S = 0.2
"""Wall seconds to wait for the velocity filter, which answers within 20 ms; then the base's port is used."""


class RobotHold:
    """Stops the base at once, past every limit, and holds it; under the manual override the hand drives on.

    Attributes:
        held: Whether the velocity filter was asked to hold the robot and not yet to let it go.

    Args:
        client: Talks to the velocity filter.
        port: Stops the base when the filter does not answer.
    """

    def __init__(self, client: MissionClient, port: HungDriverStop) -> None:
        self._client = client
        self._port = port
        self._hard_stop = client.node.create_client(SetBool, HARD_STOP)
        self._stop_all = client.node.create_client(SetBool, STOP_ALL)
        self.held = False

    def hold(self, *, driver_answers: bool, hand: bool = False) -> str:
        """Stop the base; takes :data:`FILTER_BUDGET_S` at most.

        Args:
            driver_answers: Whether the process of the base's driver is known to answer.
            hand: Whether to stop the person, too, who drives by hand under the override: all ends.

        Returns:
            Why the base may still be driving, for people; empty when the stop command was sent.
        """
        service = self._stop_all if hand else self._hard_stop
        # Also a process that does not answer is asked: it holds the robot when it comes back.
        answer = service.call_async(SetBool.Request(data=True))
        self.held = True
        there = driver_answers and service.service_is_ready()
        if there and self._client.spin_until(answer.done, FILTER_BUDGET_S):
            return ""
        return self.stop_by_port()

    def stop_by_port(self) -> str:
        """Stop the base by its port; never waits. The result is that of :meth:`hold`."""
        return self._port.stop()

    def release(self) -> None:
        """Let the robot go: the next velocity command counts again."""
        self._hard_stop.call_async(SetBool.Request(data=False))
        self.held = False
