"""The ROS arguments of this process: what stands behind ``--ros-args``, and its namespace.

They count for the whole process, as ROS has it: every node that is made here gets them.
https://design.ros2.org/articles/ros_command_line_arguments.html

This module loads nothing of ROS before :func:`start_ros`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from florence_bt.core.errors import ConfigError
from florence_bt.ros.environment import Reach, stay_on_this_machine

if TYPE_CHECKING:
    from rclpy.context import Context

NAMESPACE_VARIABLE = "FLORENCE_NAMESPACE"
"""Environment variable: the namespace of the robot when the command line says none."""
OWN_TRANSFORMS = ("-r", "/tf:=tf", "-r", "/tf_static:=tf_static")
"""Arguments that go with a namespace: frames of two robots have the same names. Nav2's bring-up does it the
same way (nav2_bringup, launch/bringup_launch.py). A rule of the user for the same topic goes before it."""
_BEGIN, _END = "--ros-args", "--"
_REMAP, _PARAMETER, _FILE = ("-r", "--remap"), ("-p", "--param"), ("--params-file",)
_NAMESPACE = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)*")
_arguments: tuple[str, ...] = ()


def split_ros_arguments(words: Sequence[str]) -> tuple[list[str], list[str]]:
    """Take the ROS arguments out of a command line: those from ``--ros-args`` to ``--`` or to the end.

    Returns:
        The other words, and the ROS arguments without those two marks.
    """
    others: list[str] = []
    ours: list[str] = []
    inside = False
    for word in words:
        if word == _BEGIN:
            inside = True
        elif inside and word == _END:
            inside = False
        else:
            (ours if inside else others).append(word)
    return others, ours


def use_arguments(words: Sequence[str]) -> None:
    """Let these be the ROS arguments of this process, for what starts ROS from now on."""
    global _arguments
    _arguments = tuple(words)


def ros_arguments() -> tuple[str, ...]:
    """Return the ROS arguments of this process, without ``--ros-args``."""
    return _arguments


def use_namespace(text: str, *, chosen: bool = True) -> None:
    """Put the nodes of this process into a namespace, as the rule ``__ns:=`` does.

    Args:
        text: The namespace; a leading slash may be left out.
        chosen: Whether the command line says so; otherwise a rule ``__ns:=`` there counts instead.

    Raises:
        ConfigError: It is none, or the ROS arguments name another one.
    """
    wanted = "/" + text.strip("/") if text.strip("/") else ""
    if not _NAMESPACE.fullmatch(wanted):
        raise ConfigError(f"{text!r} is not a namespace", valid=["/robot1: letters, digits and _"])
    given = namespace_in(_arguments)
    if given is None and wanted:
        use_arguments((*_arguments, "-r", f"__ns:={wanted}"))
    elif given is not None and chosen and given != wanted:
        raise ConfigError(f"the namespace is {wanted or '/'} and {given or '/'}", valid=["one of the two"])


def namespace_in(words: Sequence[str]) -> str | None:
    """Return the namespace that ROS arguments name, as ``/robot1``, empty for the root, or None.

    As in rcl the first rule counts.
    """
    for rule in _values(words, _REMAP):
        name, _, value = rule.partition(":=")
        if name in ("__ns", "rosservice://__ns", "rostopic://__ns"):
            return value.rstrip("/")
    return None


def namespace() -> str:
    """Return the namespace of this process, as ``/robot1``; empty for the root."""
    return namespace_in(_arguments) or ""


def where_else(namespaces: Iterable[str]) -> str:
    """Say where systems of other namespaces are, and how to reach one; empty when there is none."""
    found = sorted(set(namespaces))
    return f"elsewhere one runs: --namespace {' or '.join(found)}" if found else ""


def renamed_nodes(words: Sequence[str]) -> list[str]:
    """Return the rules that give nodes another name, or some nodes another namespace."""
    rules = (rule.partition(":=")[0] for rule in _values(words, _REMAP))
    return [name for name in rules if name.endswith(("__node", "__name", ":__ns"))]


def parameters_in(words: Sequence[str]) -> Iterator[tuple[bool, str]]:
    """Yield what sets parameters, in turn: (whether it is a file, the file or the rule ``name:=value``)."""
    for flag, value in _pairs(words):
        if flag in (*_PARAMETER, *_FILE):
            yield flag in _FILE, value


def without_parameters(words: Sequence[str]) -> list[str]:
    """Return the ROS arguments but those that set parameters."""
    kept: list[str] = []
    skip = False
    for word in words:
        if skip:
            skip = False
        elif word in (*_PARAMETER, *_FILE):
            skip = True
        else:
            kept.append(word)
    return kept


def _pairs(words: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield each word with the one that follows, the last one with nothing."""
    return zip(words, (*words[1:], ""), strict=False)


def _values(words: Sequence[str], flags: Sequence[str]) -> Iterator[str]:
    return (value for flag, value in _pairs(words) if flag in flags)


def start_ros(context: Context | None = None, *, first: Sequence[str] = ()) -> Reach:
    """Start ROS with the arguments of this process; others stay out unless the environment lets them in.

    Args:
        context: The context; the process's own one when not given.
        first: Remapping rules that go before those of the user.

    Returns:
        Who can reach the nodes.

    Raises:
        ConfigError: ROS does not understand an argument.
    """
    import rclpy
    from rclpy.signals import SignalHandlerOptions

    from florence_bt.ros.rclpy_internals import load_no_generator

    load_no_generator()
    reach = stay_on_this_machine()
    rules = [word for rule in first for word in ("-r", rule)]
    words = [*rules, *_arguments, *(OWN_TRANSFORMS if namespace() else ())]
    try:
        rclpy.init(
            args=[_BEGIN, *words] if words else [],
            context=context,
            signal_handler_options=SignalHandlerOptions.NO,
        )
    except RuntimeError as error:
        if not _arguments:
            raise
        problem = str(error).removeprefix("failed to initialize rcl: ").partition(", at /")[0]
        raise ConfigError(
            f"ROS does not take the arguments {' '.join(_arguments)}: {problem}",
            valid=["-r from:=to", "-p node:name:=value", "--params-file FILE", "--log-level debug"],
        ) from error
    return reach
