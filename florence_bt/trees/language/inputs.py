"""Inputs that a caller gives a mission: service, action, command line or another program."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from florence_bt.core.declaration import Kind, Port
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.plain_yaml import parse_yaml
from florence_bt.trees.language.literals import read_literal
from florence_bt.trees.language.model import Mission
from florence_bt.trees.language.quantities import example_of, out_of_range, read_value


def parse_inputs(mission: Mission, given: Mapping[str, Any]) -> dict[str, Any]:
    """Check the inputs of a call and fill in the defaults.

    Args:
        mission: The mission to be called.
        given: By name: texts, read exactly like values in a mission file (``30 s``), or values in SI units.

    Returns:
        Every input of the mission in SI units.

    Raises:
        ConfigError: Everything that is wrong with the inputs, in one error.
    """
    problems: list[str] = []
    valid: list[str] = []
    inputs: dict[str, Any] = {}
    misspelt: set[str] = set()
    for name, value in given.items():
        if name not in mission.inputs:
            problems.append(f"{mission.name} has no input {name!r}")
            similar = [one for one in get_close_matches(name, mission.inputs, n=1) if one not in given]
            misspelt.update(similar)
            shown = [_argument(one, value) for one in similar if isinstance(value, str) and len(value) < 100]
            valid += shown or closest_first(name, mission.inputs) or ["no inputs at all"]
    for name, port in mission.inputs.items():
        if name in given:
            try:
                inputs[name] = _read(given[name], port)
            except ConfigError as error:
                problems.append(f"{name}: {error.problem}")
                valid += [_argument(name, text) for text in error.valid]
        elif name in misspelt:
            continue  # not reported as missing too
        elif port.required:
            problems.append(f"{name} is missing: {port.description or port.kind.value}")
            valid.append(_argument(name, example_of(port.kind)))
        else:
            inputs[name] = port.default
    if problems:
        raise ConfigError("; ".join(problems), valid=dict.fromkeys(valid))
    return inputs


def _argument(name: str, value: str) -> str:
    """Write an input as it is typed on the command line, where blanks and brackets need quotes."""
    return f"{name}={shlex.quote(value)}"


def _read(value: Any, port: Port) -> Any:
    if isinstance(value, str):
        of_poses = Kind.POSE in (port.kind, port.kind.item)
        read = _read_poses(value, port.kind) if of_poses else read_value(value, port.kind)
        problem = out_of_range(read, port)
    else:
        number = isinstance(value, int) and not isinstance(value, bool)
        read = float(value) if number and float in port.kind.python_types else value
        read = tuple(read) if isinstance(read, list) else read
        problem = port.problem_with(read)
    if problem:
        raise ConfigError(problem)
    return read


def _read_poses(text: str, kind: Kind) -> Any:
    """Read a pose or a list of poses."""
    try:
        source = parse_yaml(text.encode(), Path("input"))
    except ConfigError:
        return read_value(text, kind)
    return read_literal(source, kind)
