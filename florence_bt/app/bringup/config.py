"""The robot's configuration: parameters per node from one YAML file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.paths import find_data
from florence_bt.core.plain_yaml import EmptyFile, YamlMapping, YamlNode, YamlScalar, YamlSequence, read_yaml
from florence_bt.core.settings_file import SettingsReader

Parameters = dict[str, Any]


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
    try:
        root: YamlNode | None = read_yaml(path)
    except EmptyFile:
        root = None
    if not isinstance(root, YamlMapping):
        raise ConfigError("must map node names to their parameters", file=path, valid=["navigate: {...}"])
    reader = _ConfigReader(path)
    return {node.text.removeprefix("/"): reader.node(node.text, value) for node, value in root.entries}


class _ConfigReader(SettingsReader):
    def node(self, name: str, section: YamlNode) -> Parameters:
        """The parameters of a node."""
        alone = isinstance(section, YamlMapping) and len(section.entries) == 1
        inner = section.get("ros__parameters") if isinstance(section, YamlMapping) and alone else None
        parameters = inner or section
        if not isinstance(parameters, YamlMapping):
            problem = f"{name} must map parameter names to values"
            raise self.error(problem, parameters, [f"{name}: {{...}}"])
        return {key.text: self._value(name, key.text, value) for key, value in parameters.entries}

    def _value(self, node: str, name: str, source: YamlNode) -> Any:
        parts = source.items if isinstance(source, YamlSequence) else (source,)
        values = [self._scalar(part) if isinstance(part, YamlScalar) else () for part in parts]
        if values == [None] and source is parts[0]:
            return None
        if not all(isinstance(value, bool | int | float | str) for value in values):
            problem = f"{node}: the parameter {name!r} is not a number, text, a boolean or a list of them"
            raise self.error(problem, source, [f"{node}: {{name: value}}"])
        return values if isinstance(source, YamlSequence) else values[0]

    def _scalar(self, source: YamlScalar) -> Any:
        """The value as YAML types it."""
        if source.quoted:
            return source.text
        loader = yaml.SafeLoader("")
        node = yaml.ScalarNode(loader.resolve(yaml.ScalarNode, source.text, (True, False)), source.text)
        try:
            return loader.construct_object(node)
        except (ValueError, OverflowError) as error:  # a date or a number that Python does not have
            raise self.error(
                f"a value cannot be read: {error}", source, ["quotes round the value"]
            ) from error


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
