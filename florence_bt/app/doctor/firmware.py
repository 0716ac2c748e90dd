"""Asks the devices on the serial ports who they are, through the drivers' own codecs.

The base is only put into passive mode, in which it drives nowhere; the laser is only asked for its version.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from florence_bt.app.doctor.finding import HealthFinding, charge_of_battery, good, problem, warning
from florence_bt.core.errors import DeviceError, FlorenceError
from florence_bt.drivers.hokuyo import codec as scip
from florence_bt.drivers.serial_port import BytePort, SerialPort
from florence_bt.drivers.turtlebot.battery import battery_of
from florence_bt.drivers.turtlebot.codec import commands
from florence_bt.drivers.turtlebot.codec.models import model_named
from florence_bt.drivers.turtlebot.codec.packets import OiMode, decode_packets, packet_size
from florence_bt.drivers.turtlebot.codec.state import state_from_values

GROUP = "firmware"
DEVICE_ANSWER_S = 2.0
"""Seconds that a device has for its answer."""
MODE, CHARGING, VOLTAGE, CHARGE, CAPACITY = 35, 21, 22, 25, 26
"""Numbers of packets. Source: REFERENCE 1.5."""
ASKED = (MODE, CHARGING, VOLTAGE, CHARGE, CAPACITY)
"""Packets of the base (REFERENCE 1.5)."""
LASER_BAUD = 115200
"""Bit rate at which the laser's port is opened; over USB it means nothing."""

OpenPort = Callable[[str, int], BytePort]


def check_firmware(
    config: Mapping[str, Mapping[str, Any]],
    free: Callable[[str], bool],
    open_port: OpenPort = SerialPort,
    now: Callable[[], float] = time.monotonic,
) -> Iterator[HealthFinding]:
    """Ask base and laser.

    Args:
        config: The robot's configuration: node -> parameters.
        free: Whether a port is there, allowed and not in use; others are not opened.
        open_port: Opens a path at a baud rate.
        now: Seconds, for the limits.
    """
    base, laser = config.get("turtlebot_node", {}), config.get("hokuyo_node", {})
    for path, baud, ask in (
        (str(base.get("port", "")), _baud_of(base), _ask_base),
        (str(laser.get("port", "")), LASER_BAUD, _ask_laser),
    ):
        if path and free(path) and not (ask is _ask_laser and laser.get("ip_address")):
            yield from _asked(path, baud, ask, open_port, now)


def _baud_of(base: Mapping[str, Any]) -> int:
    model = model_named(str(base.get("robot_type", "create")))
    return int(base.get("baud_rate", 0) or model.baud_rate)


def _asked(
    path: str,
    baud: int,
    ask: Callable[[BytePort, Callable[[], float]], Iterator[HealthFinding]],
    open_port: OpenPort,
    now: Callable[[], float],
) -> Iterator[HealthFinding]:
    try:
        port = open_port(path, baud)
    except DeviceError as error:
        yield problem(GROUP, path, str(error), "see the findings about the ports")
        return
    try:
        yield from ask(port, now)
    except DeviceError as error:
        yield problem(GROUP, path, f"lost during the query: {error}", "check the cable and the power")
    finally:
        port.close()


def _ask_base(port: BytePort, now: Callable[[], float]) -> Iterator[HealthFinding]:
    port.write(commands.start() + commands.pause_stream())
    _drop_what_comes(port, now)
    port.write(commands.query_list(ASKED))
    size = sum(packet_size(packet) for packet in ASKED)
    data = _read(port, now, lambda data: len(data) >= size)
    if len(data) != size:
        said = f"{len(data)} bytes instead of {size}" if data else "nothing"
        yield problem(
            GROUP,
            f"base at {port.name}",
            f"it answers {said}",
            "switch the base on; charge it; check the cable and `robot_type` in the configuration",
        )
        return
    values = decode_packets(ASKED, data)
    mode = OiMode(values[MODE]).name.lower() if values[MODE] in range(4) else f"mode {values[MODE]}"
    yield good(GROUP, f"base at {port.name}", f"answers; {mode}, {values[VOLTAGE] / 1000:.1f} V")
    yield _battery(values)


def _battery(values: Mapping[int, int]) -> HealthFinding:
    if values[CAPACITY] <= 0:
        return warning("battery", "base", "the base does not know its capacity", "charge it fully once")
    share = battery_of(state_from_values(values)).fraction
    if share is None:
        found = f"the charge is not known: the base says {values[CHARGE]} of {values[CAPACITY]} mAh"
        return warning("battery", "base", found, "charge it fully once, also as it may be empty")
    found = f"{share:.0%} of {values[CAPACITY]} mAh"
    if values[CHARGING] in (1, 2, 3):
        return good("battery", "base", f"{found}, charging")
    return charge_of_battery(share, found)


def _ask_laser(port: BytePort, now: Callable[[], float]) -> Iterator[HealthFinding]:
    def version_in(data: bytes) -> scip.ScipReply | None:
        return next((reply for reply in scip.ReplyParser().feed(data) if reply.command == "VV"), None)

    port.write(scip.request("QT"))
    _drop_what_comes(port, now)
    port.write(scip.request("VV"))
    version = version_in(_read(port, now, lambda data: version_in(data) is not None))
    item = f"laser at {port.name}"
    if version is None:
        yield problem(
            GROUP, item, "it does not answer in SCIP 2.0", "check its power; an old one needs new firmware"
        )
        return
    try:
        tags = version.information()
    except FlorenceError as error:
        yield problem(GROUP, item, f"its answer makes no sense: {error}", "switch it off and on")
        return
    shown = ", ".join(tags[tag] for tag in ("PROD", "FIRM", "SERI") if tag in tags)
    yield good(GROUP, item, f"answers; {shown}")


def _drop_what_comes(port: BytePort, now: Callable[[], float]) -> None:
    """Drop what was on its way before the question; a stopped stream is silent soon."""
    end = now() + 0.3
    while now() < end:
        port.read(0.05)


def _read(port: BytePort, now: Callable[[], float], enough: Callable[[bytes], bool]) -> bytes:
    data = b""
    end = now() + DEVICE_ANSWER_S
    while not enough(data) and (left := end - now()) > 0.0:
        data += port.read(min(left, 0.2))
    return data
