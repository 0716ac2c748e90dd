"""The files of a robot's folder as text: configuration, what to bring up, udev rules, a systemd unit."""

from __future__ import annotations

import ipaddress
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml

from florence_bt.app.devices.config_edit import with_value
from florence_bt.app.robot_setup.discovery import SerialDevice
from florence_bt.core.paths import find_data

RULES, UNIT = "99-florence.rules", "florence.service"
BASE_NAME, LASER_NAME = "/dev/create", "/dev/hokuyo"
"""Names that our udev rules give the devices."""
CREATE_TYPE = "create"
"""The kind of base of a configuration that names none."""
ENVIRONMENT = (
    "AMENT_PREFIX_PATH",
    "FLORENCE_NAMESPACE",
    "LD_LIBRARY_PATH",
    "PYTHONPATH",
    "RMW_IMPLEMENTATION",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_DISTRO",
    "ROS_DOMAIN_ID",
)
"""Variables that a service needs as the shell has them: where ROS 2 is, and which robot this is."""


@dataclass(frozen=True, slots=True)
class Answers:
    """The answers of the person at the keyboard, or of the machine, about a robot.

    Attributes:
        robot_type: The base: ``create``, ``create2`` or ``roomba``.
        base: Its port.
        laser: The laser's port, or its IP address.
        speech: What speaks: ``print``, ``none`` or a command.
        map_file: The map, absolute or relative to the folder; empty when there is none yet.
        hotspots: The hotspots, likewise.
        service: ``user``, ``system`` or ``none``: who starts Florence with the machine.
        emulate: Whether base and sensors are emulated.
    """

    robot_type: str
    base: str
    laser: str
    speech: str
    map_file: str
    hotspots: str
    service: str
    emulate: bool


def robot_yaml(answers: Answers, file: Path) -> str:
    """Write the configuration: that of the package with the values that were asked for."""
    text = find_data("config", "robot.yaml").read_text(encoding="utf-8")
    laser = "ip_address" if _is_address(answers.laser) else "port"
    values = [("turtlebot_node", "port", answers.base), ("hokuyo_node", laser, answers.laser)]
    if answers.robot_type != CREATE_TYPE:
        values.append(("turtlebot_node", "robot_type", answers.robot_type))
    values.append(("speech", "program", answers.speech))
    for node, name, value in values:
        text = with_value(text, file, node, name, _yaml(value))
    return text


def _is_address(text: str) -> bool:
    try:
        ipaddress.ip_address(text)
    except ValueError:
        return False
    return True


def _yaml(text: str) -> str:
    """Write a text as YAML: bare when that is surely read as the same text."""
    plain = re.fullmatch(r"/?[A-Za-z][\w./-]*", text, re.ASCII) and yaml.safe_load(text) == text
    return text if plain else json.dumps(text, ensure_ascii=False)


def florence_yaml(answers: Answers, folder: Path) -> str:
    """Write what ``florence up FOLDER`` brings up."""
    lines = [
        f"# What `florence up {folder.name}` brings up. Paths are relative to this folder; the options of",
        "# florence up --help with the same names go over what stands here.",
        "robot: robot.yaml",
        f"map: {_yaml(answers.map_file)}"
        if answers.map_file
        else "# map: maps/home.yaml  # there is none yet",
        f"hotspots: {_yaml(answers.hotspots)}",
        "# home: home.yaml  # the house's own sensors: docs/manual/home_sensors.md",
        "missions: [missions]",
        "out: runs  # logs, journal, the last pose",
        "emulate: true  # a rehearsal; without this line: the devices of robot.yaml"
        if answers.emulate
        else "# emulate: true  # a rehearsal, on emulated devices in the example flat",
    ]
    return "\n".join(lines) + "\n"


def udev_rules(devices: Mapping[str, SerialDevice | None]) -> str:
    """Write the udev rules: stable names, by serial number where a device has one.

    Args:
        devices: Name below ``/dev`` -> the device that was found; None when there was none.
    """
    general = find_data("config", "udev/99-florence.rules").read_text(encoding="utf-8")
    paragraphs = general.rstrip("\n").split("\n\n")
    for name, device in devices.items():
        if device is not None and device.serial and device.usb_id:
            vendor, _, product = device.usb_id.partition(":")
            rule = (
                f'SUBSYSTEM=="tty", ATTRS{{idVendor}}=="{vendor}", ATTRS{{idProduct}}=="{product}", '
                f'ATTRS{{serial}}=="{device.serial}", GROUP="dialout", MODE="0660", SYMLINK+="{name}"'
            )
            paragraphs = [
                f"# {name}: the device that was plugged in when florence init ran.\n{rule}"
                if f'SYMLINK+="{name}"' in paragraph
                else paragraph
                for paragraph in paragraphs
            ]
    return "\n\n".join(paragraphs) + "\n"


def systemd_unit(
    folder: Path, command: Sequence[str], service: str, user: str, environment: Mapping[str, str]
) -> str:
    """Write a systemd unit that runs ``florence up FOLDER``.

    Args:
        folder: The robot's folder, absolute.
        command: The words that start ``florence``.
        service: ``user`` or ``system``.
        user: The account of a system service.
        environment: The variables of the shell, of which :data:`ENVIRONMENT` are kept.
    """
    kept = [
        f"Environment={_word(f'{name}={environment[name]}')}" for name in ENVIRONMENT if environment.get(name)
    ]
    lines = [
        "# Starts Florence with the machine. At SIGTERM it stops the robot, then ends its processes.",
        "[Unit]",
        f"Description=Florence BT: the robot of {str(folder).replace('%', '%%')}",
        *(["After=network.target"] if service == "system" else []),
        "StartLimitIntervalSec=600",
        "StartLimitBurst=3",
        "",
        "[Service]",
        f"ExecStart={_words([*command, 'up', str(folder)])}",
        f"WorkingDirectory={str(folder).replace('%', '%%')}",
        *([f"User={user}", "SupplementaryGroups=dialout"] if service == "system" else []),
        *kept,
        "KillMode=mixed",
        "TimeoutStopSec=60",
        "SuccessExitStatus=130",
        "Restart=on-failure",
        "RestartSec=10",
        "RestartPreventExitStatus=2",
        "",
        "[Install]",
        f"WantedBy={'multi-user.target' if service == 'system' else 'default.target'}",
    ]
    return "\n".join(lines) + "\n"


def _words(words: Iterable[str]) -> str:
    return " ".join(_word(word) for word in words)


def _word(text: str) -> str:
    """Quote a word of a unit file (systemd.syntax(7), systemd.unit(5) on specifiers)."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("%", "%%").replace("$", "$$")
    return f'"{escaped}"' if any(mark in escaped for mark in " \t\\\"';") else escaped
