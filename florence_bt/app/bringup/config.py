"""The robot's configuration: parameters per node from one YAML file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.paths import find_data
from florence_bt.core.plain_yaml import EmptyFile, parse_yaml
from florence_bt.core.text_files import read_bytes

Parameters = dict[str, Any]

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def load_config(file: Path | None = None) -> dict[str, Parameters]:
    """Read a configuration.

    Args:
        file: The file; ``config/robot.yaml`` of this package when not given. The form of ROS 2 parameter
            files (``node: {ros__parameters: {...}}``, also with ``/`` before the node) is read too.

    Returns:
        Node name -> parameter name -> value.

    Raises:
        ConfigError: The file cannot be read or has another form.
    """
    path = file if file is not None else find_data("config", "robot.yaml")
    data = read_bytes(path)
    try:
        # Refuses what could grow without end; the values are typed as YAML types them.
        parse_yaml(data, path)
        content = yaml.load(data, Loader=_LOADER)
    except EmptyFile:
        content = None
    except (ValueError, OverflowError) as error:  # a date or a number that Python does not have
        raise ConfigError(
            f"a value cannot be read: {error}", file=path, valid=["quotes round the value"]
        ) from error
    except yaml.YAMLError as error:
        raise ConfigError(f"not YAML: {str(error).splitlines()[0]}", file=path, line=1, column=1) from error
    if not isinstance(content, Mapping):
        raise ConfigError("must map node names to their parameters", file=path, valid=["navigate: {...}"])
    return {str(node).removeprefix("/"): _parameters(node, value, path) for node, value in content.items()}


def _parameters(node: str, section: object, path: Path) -> Parameters:
    inner = section.get("ros__parameters") if isinstance(section, Mapping) and len(section) == 1 else None
    parameters = section if inner is None else inner
    if not isinstance(parameters, Mapping):
        raise ConfigError(f"{node} must map parameter names to values", file=path, valid=[f"{node}: {{...}}"])
    for name, value in parameters.items():
        parts = value if isinstance(value, list) else [value]
        if value is not None and not all(isinstance(part, bool | int | float | str) for part in parts):
            problem = f"{node}: the parameter {name!r} is not a number, text, a boolean or a list of them"
            raise ConfigError(problem, file=path, valid=[f"{node}: {{name: value}}"])
    return dict(parameters)


def section(config: Mapping[str, Parameters], node: str, **overrides: Any) -> Parameters:
    """The parameters of one node, with overrides that are not None."""
    return {
        **config.get(node, {}),
        **{name: value for name, value in overrides.items() if value is not None},
    }


def refuse_unknown_nodes(config: Mapping[str, Parameters], known: set[str], file: str) -> None:
    """Raise when the file configures nodes that do not exist.

    Raises:
        ConfigError: With the names that look alike.
    """
    for node in config:
        if node not in known:
            raise ConfigError(f"unknown node {node!r}", file=file, valid=closest_first(node, known))
