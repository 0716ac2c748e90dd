"""The whole examination, one check after the other; a check that breaks is a finding itself."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from florence_bt.app.bringup.config import Config, load_config, read_sections
from florence_bt.app.bringup.topology import refuse_wrong_parameters
from florence_bt.app.doctor.finding import HealthFinding, good, note, problem
from florence_bt.app.doctor.firmware import check_firmware
from florence_bt.app.doctor.graph import (
    GraphView,
    check_graph,
    check_settings,
    why_devices_are_not_used,
)
from florence_bt.app.doctor.home import check_home
from florence_bt.app.doctor.libraries import check_libraries
from florence_bt.app.doctor.machine import check_machine
from florence_bt.app.doctor.ports import check_ports, is_free
from florence_bt.app.doctor.usb import check_usb
from florence_bt.core.errors import FlorenceError
from florence_bt.core.installation import how_to_get

SERIAL_NODES = ("turtlebot_node", "hokuyo_node")
WATCH_S, WATCH_LONGER_S = 2.5, 15.0
"""Seconds to look at the ROS graph, and how long when a part of a system has not been seen by then."""


def examine(
    config_file: Path | None,
    folder: Path,
    *,
    hardware: bool = True,
    home_file: Path | None = None,
    hotspots_file: Path | None = None,
) -> Iterator[HealthFinding]:
    """Look at everything.

    Args:
        config_file: The robot's configuration; None for the one of the package.
        folder: Where runs and logs will go.
        hardware: Whether to look at ports, USB and firmware too.
        home_file: The home sensors; None for none.
        hotspots_file: The rooms that they are in; None for those of the package.
    """
    yield from _guarded("libraries", check_libraries)
    yield from _guarded("machine", lambda: check_machine(folder))
    config: dict[str, dict[str, Any]] = {}
    try:
        config = load_config(config_file)
        if config_file is not None:
            refuse_wrong_parameters(Config(read_sections(config_file)))
        yield good("configuration", str(config_file or "of the package"), "can be read")
    except FlorenceError as error:
        yield problem("configuration", str(config_file), str(error), "correct the file")
    view, of_ros = _ros()
    unused = why_devices_are_not_used(view)
    if hardware and unused is not None:
        yield note("ports", "devices", f"not looked at: {unused}")
    elif hardware:
        yield from _hardware(config)
    if home_file is not None:
        home = home_file
        yield from _guarded("home sensors", lambda: check_home(home, hotspots_file))
    yield from of_ros


def _hardware(config: dict[str, dict[str, Any]]) -> Iterator[HealthFinding]:
    ports = {
        node: str(config[node]["port"])
        for node in SERIAL_NODES
        # A laser with an address is on the network; its port is not used.
        if config.get(node, {}).get("port") and not config[node].get("ip_address")
    }
    yield from _guarded("ports", lambda: check_ports(ports))
    yield from _guarded("USB", check_usb)
    yield from _guarded("firmware", lambda: check_firmware(config, is_free))


def _ros() -> tuple[GraphView, list[HealthFinding]]:
    """Look at ROS: what was seen, and what that means."""
    findings = list(check_settings(os.environ))
    view = GraphView()
    try:
        from florence_bt.app.doctor.graph_watch import watch_graph
    except ModuleNotFoundError as error:
        advice = how_to_get(error.name or "rclpy")
        return view, [*findings, note("ROS", "rclpy", f"{error.name} is not installed", advice)]

    def look() -> Iterator[HealthFinding]:
        nonlocal view
        view = watch_graph(WATCH_S, WATCH_LONGER_S)
        yield from check_graph(view)

    findings += _guarded("ROS", look)
    return view, findings


def _guarded(group: str, check: Callable[[], Iterator[HealthFinding]]) -> Iterator[HealthFinding]:
    try:
        yield from check()
    except Exception as error:
        # One check that cannot be done must not hide what the others find.
        yield problem(group, "this check", f"broke down: {type(error).__name__}: {error}", "report this")
