"""Stops the base by its serial port when the process of its driver died.

The base has no watchdog (REFERENCE 1.2): it keeps the last speed that it was given.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

from florence_bt.drivers.serial_port import BytePort, SerialPort
from florence_bt.drivers.turtlebot.driver import TurtlebotDriver
from florence_bt.drivers.turtlebot.parameters import TurtlebotNodeParameters, TurtlebotParameters
from florence_bt.wiring.config import load_config, section
from florence_bt.wiring.options import BringUp
from florence_bt.wiring.simulated import hardware_settings

T = TypeVar("T")

END_OF_HALF_A_COMMAND = bytes(4)
"""The driver may have died amid a command, which would take our first bytes for its last: at most four, of
Drive Direct. What is too much is no command and is passed over."""


def stop_base(options: BringUp, open_port: Callable[[str, int], BytePort] = SerialPort) -> str:
    """Tell the base of a bring-up to stop; its own driver must be gone.

    Args:
        options: The bring-up.
        open_port: Opens a path at a baud rate.

    Returns:
        What became of it, for people.
    """
    try:
        given = _given(options)
        node, base = _filled(TurtlebotNodeParameters, given), _filled(TurtlebotParameters, given)
        port = open_port(node.port, node.baud_rate or base.model.baud_rate)
        try:
            port.write(END_OF_HALF_A_COMMAND + TurtlebotDriver(base).shutdown())
        finally:
            port.close()
    except Exception as error:
        # Whatever it is: who calls has other processes to end.
        return f"the base may still be driving, switch it off: {error}"
    return "the base was told to stop"


def _given(options: BringUp) -> dict[str, Any]:
    """The parameters of the base's node, as its process was given them."""
    config = load_config(Path(options.config_file) if options.config_file else None)
    port = str(hardware_settings(options).base_port) if options.simulated else None
    return section(config, "turtlebot_node", port=port)


def _filled(cls: type[T], given: dict[str, Any]) -> T:
    names = {field.name for field in fields(cls)}  # type: ignore[arg-type]
    return cls(**{name: value for name, value in given.items() if name in names})
