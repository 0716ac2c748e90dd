"""The options of ``florence up`` as arguments of ``launch/florence.launch.py``: the same table for both."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import typer

from florence_bt.cli.application import app
from florence_bt.core.errors import ConfigError, closest_first

ON, OFF = ("true", "1"), ("false", "0")
"""Spellings of true and false in ROS 2 launch, in capitals or not."""
NAMESPACE = "namespace"
"""The argument that launch itself passes on: it puts it below the namespaces of an outer launch file."""
_NOT_OURS = ("--help", "--ros-args")


@dataclass(frozen=True, slots=True)
class LaunchArgument:
    """An option of ``florence up`` as ROS 2 launch knows arguments.

    Attributes:
        name: As in ``name:=value``.
        option: As in ``florence up``; empty for its argument, the folder of a robot.
        description: For ``ros2 launch --show-args``.
        default: Its text when it is not given; empty: the option is left out.
        is_flag: Whether it is true or false.
        is_list: Whether it may have several values, separated by colons.
    """

    name: str
    option: str
    description: str
    default: str
    is_flag: bool
    is_list: bool


def launch_arguments() -> list[LaunchArgument]:
    """Return the arguments of the launch file: every option of ``florence up``."""
    commands: Any = typer.main.get_command(app)
    options = [each for each in commands.commands["up"].params if each.opts[0] not in _NOT_OURS]
    return [_argument(each) for each in options]


def _argument(option: Any) -> LaunchArgument:
    named = option.param_type_name == "option"
    flag, several = named and bool(option.is_flag), named and bool(option.multiple)
    more = f" Several, separated by {os.pathsep!r}." if several else ""
    return LaunchArgument(
        option.opts[0].removeprefix("--").replace("-", "_"),
        option.opts[0] if named else "",
        f"{option.help}{more}",
        OFF[0] if flag else "",
        flag,
        several,
    )


def command_words(values: Mapping[str, str]) -> list[str]:
    """Return the command line behind ``florence`` for arguments of the launch file.

    Args:
        values: By name; those that are missing or empty are not given.

    Raises:
        ConfigError: There is no such argument, or a flag is neither true nor false.
    """
    known = {each.name: each for each in launch_arguments()}
    words = ["up"]
    for name, value in values.items():
        if name not in known:
            raise ConfigError(f"there is no argument {name!r}", valid=closest_first(name, known))
        argument = known[name]
        if argument.is_flag:
            if value.lower() not in (*ON, *OFF):
                raise ConfigError(f"{name}:={value}", valid=[f"{name}:=true", f"{name}:=false"])
            words += [argument.option] * (value.lower() in ON)
            continue
        if not argument.option and value.startswith("-"):
            value = os.path.join(os.curdir, value)  # a folder of this name, and no option
        given = value.split(os.pathsep) if argument.is_list else [value]
        words += [word for each in given if each for word in (argument.option, each) if word]
    return words
