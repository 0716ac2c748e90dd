"""The robot's configuration: parameters per node from one YAML file."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.paths import find_data
from florence_bt.core.plain_yaml import EmptyFile, YamlMapping, YamlNode, YamlScalar, YamlSequence, read_yaml
from florence_bt.core.settings_file import SettingsReader
from florence_bt.ros.parameters import check_parameters

if TYPE_CHECKING:
    from florence_bt.ros.node import FlorenceNode

Parameters = dict[str, Any]
_NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)[eE][-+]?\d+")
"""A number with an exponent as YAML 1.2 and ROS read it (YAML 1.2.2, 10.3.2). YAML 1.1, as PyYAML reads it,
takes ``1e-1`` for a text, because it has no point."""


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
    reader = _ConfigReader(file if file is not None else find_data("config", "robot.yaml"))
    return {node.text.removeprefix("/"): reader.node(node.text, value) for node, value in reader.nodes()}


class _ConfigReader(SettingsReader):
    def nodes(self) -> tuple[tuple[YamlScalar, YamlNode], ...]:
        """Return the name of each node and its part of the file."""
        try:
            root: YamlNode | None = read_yaml(self.file)
        except EmptyFile:
            root = None
        if not isinstance(root, YamlMapping):
            valid = ["navigate: {...}"]
            raise ConfigError("must map node names to their parameters", file=self.file, valid=valid)
        seen: set[str] = set()
        for node, _ in root.entries:
            name = node.text.removeprefix("/")
            if name in seen:
                raise self.error(f"the node {name!r} is there twice", node, ["one of the two"])
            seen.add(name)
        return root.entries

    def node(self, name: str, section: YamlNode) -> Parameters:
        """Return the parameters of a node."""
        entries = self.parameters(name, section).entries
        return {key.text: self._value(name, key.text, value) for key, value in entries}

    def parameters(self, name: str, section: YamlNode) -> YamlMapping:
        """Return the part of the file with the parameters of a node."""
        alone = isinstance(section, YamlMapping) and len(section.entries) == 1
        inner = section.get("ros__parameters") if isinstance(section, YamlMapping) and alone else None
        parameters = inner or section
        if not isinstance(parameters, YamlMapping):
            problem = f"{name} must map parameter names to values"
            raise self.error(problem, parameters, [f"{name}: {{...}}"])
        return parameters

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
        """Return the value as YAML types it."""
        if source.quoted:
            return source.text
        if _NUMBER.fullmatch(source.text):
            return float(source.text)
        loader = yaml.SafeLoader("")
        node = yaml.ScalarNode(loader.resolve(yaml.ScalarNode, source.text, (True, False)), source.text)
        try:
            return loader.construct_object(node)
        except (ValueError, OverflowError) as error:  # a date or a number that Python does not have
            raise self.error(
                f"a value cannot be read: {error}", source, ["quotes round the value"]
            ) from error


def section(config: Mapping[str, Parameters], node: str, **overrides: Any) -> Parameters:
    """Return the parameters of one node, with overrides that are not None."""
    return {
        **config.get(node, {}),
        **{name: value for name, value in overrides.items() if value is not None},
    }


NodeClass = Callable[[], "type[FlorenceNode]"]
"""Imports the class of a node, which may take a second."""


def check_config(file: Path, nodes: Mapping[str, NodeClass]) -> None:
    """Refuse a configuration of which a node would not take a value.

    Args:
        file: The file.
        nodes: Node -> its class; only those that the file names are asked for.

    Raises:
        ConfigError: An unknown node or parameter, or a value that does not fit; with the place in the file.
    """
    config, reader = load_config(file), _ConfigReader(file)
    for key, section_ in reader.nodes():
        node = key.text.removeprefix("/")
        if node not in nodes:
            raise reader.error(f"unknown node {node!r}", key, closest_first(node, nodes))
        kind = nodes[node]()
        try:
            check_parameters(kind.parameter_classes, config[node], kind.replaced_parameters)
        except ConfigError as error:
            part = reader.parameters(key.text, section_)
            entries = {name.text: value for name, value in part.entries}
            place = next((entries[name] for name in error.parameters if name in entries), key)
            raise reader.error(f"{node}: {error.problem}", place, error.valid) from error
