"""Stops the base by its serial port when the process of its driver died or does not answer.

The base has no watchdog (REFERENCE 1.2): it keeps the last speed that it was given.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from florence_bt.app.bringup.config import load_config, section
from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.simulated import hardware_settings
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
    """Tell the base of a bring-up to stop, and to be silent; its own driver must be gone.

    Args:
        options: The bring-up.
        open_port: Opens a path at a baud rate.

    Returns:
        What became of it, for people.
    """
    try:
        node, base = _parameters(options)
        port = open_port(node.port, node.baud_rate or base.model.baud_rate)
        _say(port, stand(OiMode(base.operation_mode)) + commands.pause_stream())
    except Exception as error:
        # Whatever it is: who calls has other processes to end.
        return f"the base may still be driving, switch it off: {error}"
    return "the base was told to stop"


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
        """Tell the base to stop; never waits. The sensors go on, for the driver that may come back.

        Returns:
            Why the base may still be driving, for people; empty when it was told to stop.
        """
        try:
            _say(SecondHandle(self._port), stand(self._mode))
        except DeviceError as error:
            return str(error)
        return ""


def _say(port: Writer, words: bytes) -> None:
    try:
        port.write(FILL_PARTIAL_COMMAND_KEEPING_MODE + words)
    finally:
        port.close()


def _parameters(options: BringUp) -> tuple[TurtlebotNodeParameters, TurtlebotParameters]:
    read = _reader(options)
    return fill_dataclass(TurtlebotNodeParameters, read), fill_dataclass(TurtlebotParameters, read)


def _reader(options: BringUp) -> Callable[[str, Any], Any]:
    """Gives the parameters of the base's node, as its process was given them: null leaves one out."""
    config = load_config(Path(options.config_file) if options.config_file else None)
    port = str(hardware_settings(options).base_port) if options.in_flat else None
    given = section(config, "turtlebot_node", port=port)

    def read(name: str, default: Any) -> Any:
        value = given.get(name)
        return default if value is None else value

    return read
