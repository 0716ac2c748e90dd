"""The robot's configuration: parameters per node from YAML files, its own and those of ROS 2."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from florence_bt.core.errors import ConfigError, closest_first, raise_all
from florence_bt.core.paths import find_data
from florence_bt.core.plain_yaml import (
    EmptyFile,
    Position,
    YamlMapping,
    YamlNode,
    YamlScalar,
    YamlSequence,
    parse_yaml,
    read_yaml,
)
from florence_bt.core.yaml_reader import YamlReader
from florence_bt.ros.arguments import parameters_in
from florence_bt.ros.parameters import check_parameters, parameter_names

if TYPE_CHECKING:
    from florence_bt.app.bringup.options import BringUp
    from florence_bt.ros.node import FlorenceNode

Parameters = dict[str, Any]
_NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)[eE][-+]?\d+")
"""A number with an exponent as YAML 1.2 and ROS read it (YAML 1.2.2, 10.3.2). YAML 1.1, as PyYAML reads it,
takes ``1e-1`` for a text, because it has no point."""
_INNER = "ros__parameters"
_TOKENS = {"**": "(/[^/]+)*", "*": "/[^/]+"}
"""Wildcards of ROS parameter files: any number of names, and one."""


@dataclass(frozen=True, slots=True)
class _Parameter:
    """A parameter's value, and how to make an error about it."""

    value: Any
    error: Callable[[str, Iterable[str]], ConfigError]


@dataclass(frozen=True, slots=True)
class Section:
    """The part of a file, or a rule of the command line, with parameters of one node or of several.

    Attributes:
        name: As written: a node's name, which stands for that node in whatever namespace, or its full name,
            where ``*`` is any name and ``**`` any number of them.
        entries: Parameter -> its value.
        error: Makes an error about the name.
    """

    name: str
    entries: Mapping[str, _Parameter]
    error: Callable[[str, Iterable[str]], ConfigError]

    @property
    def values(self) -> Parameters:
        """The values by parameter."""
        return {name: entry.value for name, entry in self.entries.items()}

    @property
    def for_many(self) -> bool:
        """Tell whether it has wildcards: then it holds for those of its nodes that have such a parameter."""
        return "*" in self.name

    def is_for(self, node: str, namespace: str) -> bool:
        """Tell whether it is about a node in a namespace, which is empty or as ``/robot1``."""
        if "/" not in self.name and not self.for_many:
            return self.name == node
        tokens = self.name.strip("/").split("/")
        pattern = "".join(_TOKENS.get(token, "/" + re.escape(token)) for token in tokens)
        return re.fullmatch(pattern, f"{namespace}/{node}") is not None


class Config:
    """The parameters of every node of a system.

    Args:
        sections: Where they come from; later ones go over earlier ones.
        namespace: That of the nodes, empty or as ``/robot1``.
    """

    def __init__(self, sections: Iterable[Section], namespace: str = "") -> None:
        self.sections = tuple(sections)
        self.namespace = namespace

    def entries(self, node: str, known: Collection[str] | None = None) -> dict[str, _Parameter]:
        """Return the parameters of a node with their places.

        Args:
            node: Its name without namespace.
            known: The parameters that it has: of a section for many nodes it gets only those; None: all.
        """
        found: dict[str, _Parameter] = {}
        for part in self.sections:
            if part.is_for(node, self.namespace):
                found |= {
                    name: entry
                    for name, entry in part.entries.items()
                    if known is None or not part.for_many or name in known
                }
        return found

    def of(self, node: str, known: Collection[str] | None = None, **overrides: Any) -> Parameters:
        """Return the parameters of a node, with overrides that are not None."""
        return {
            **{name: entry.value for name, entry in self.entries(node, known).items()},
            **{name: value for name, value in overrides.items() if value is not None},
        }


def load_config(file: Path | None = None) -> dict[str, Parameters]:
    """Read a configuration that names each node.

    Args:
        file: The file; ``config/robot.yaml`` of this package when not given. The form of ROS 2 parameter
            files (``node: {ros__parameters: {...}}``) is read too.

    Returns:
        Node name without namespace -> parameter name -> value.

    Raises:
        ConfigError: The file cannot be read or has another form.
    """
    return {section.name.rpartition("/")[2]: section.values for section in read_sections(file)}


def config_of(options: BringUp) -> Config:
    """Read everything that says something about the parameters of a bring-up.

    Raises:
        ConfigError: A file cannot be read or has another form; so for a rule of the command line.
    """
    sections = list(read_sections(Path(options.config_file) if options.config_file else None))
    for is_file, text in parameters_in(options.ros_arguments):
        sections += read_sections(Path(text)) if is_file else [_rule(text)]
    return Config(sections, options.namespace)


def read_sections(file: Path | None = None) -> list[Section]:
    """Read a configuration or a parameter file of ROS 2; that of the package when not given.

    Raises:
        ConfigError: The file cannot be read or has another form.
    """
    reader = _ConfigReader(file if file is not None else find_data("config", "robot.yaml"))
    try:
        root: YamlNode | None = read_yaml(reader.file)
    except EmptyFile:
        root = None
    if not isinstance(root, YamlMapping):
        valid = ["navigate: {...}"]
        raise ConfigError("must map node names to their parameters", file=reader.file, valid=valid)
    return list(reader.sections(root))


def _rule(text: str) -> Section:
    """Read ``node:name:=value`` or ``name:=value``, which is for every node that has it."""
    target, assigned, value = text.partition(":=")
    node, _, name = target.rpartition(":")
    reader = _RuleReader(text)
    parsed = parse_yaml(value.encode(), Path(text)) if value.strip() else None
    if not assigned or not name or parsed is None:
        raise ConfigError(f"-p {text!r} sets no parameter", valid=["-p node:name:=value", "-p name:=value"])
    entry = _Parameter(reader.parameter(node or name, name, parsed), reader.error_at(parsed))
    return Section(node or "/**", {name: entry}, reader.error_at(parsed))


class _ConfigReader(YamlReader):
    def sections(self, root: YamlMapping, above: str = "") -> Iterator[Section]:
        """Yield the part of the file of each node, in any depth of namespaces."""
        seen: set[str] = set()
        for key, part in root.entries:
            name = f"{above}/{key.text.strip('/')}" if above else key.text
            node = name.removeprefix("/") if name.count("/") == 1 and "*" not in name else name
            if node in seen:
                raise self.error(f"the node {node!r} is there twice", key, ["one of the two"])
            seen.add(node)
            if isinstance(part, YamlMapping) and _holds_nodes(part):
                yield from self.sections(part, "/" + name.strip("/"))
            else:
                parameters = self._parameters(node, part)
                yield Section(name, dict(self._entries(node, parameters)), self.error_at(key))

    def _parameters(self, name: str, section: YamlNode) -> YamlMapping:
        """Return the part of the file with the parameters of a node."""
        alone = isinstance(section, YamlMapping) and len(section.entries) == 1
        inner = section.get(_INNER) if isinstance(section, YamlMapping) and alone else None
        parameters = inner or section
        if not isinstance(parameters, YamlMapping):
            problem = f"{name} must map parameter names to values"
            raise self.error(problem, parameters, [f"{name}: {{...}}"])
        return parameters

    def _entries(self, node: str, source: YamlMapping, above: str = "") -> Iterator[tuple[str, _Parameter]]:
        """Yield the parameters; names with dots may be written as mappings in mappings, as ROS has it."""
        for key, value in source.entries:
            name = above + key.text
            if isinstance(value, YamlMapping) and value.entries:
                yield from self._entries(node, value, name + ".")
            else:
                yield name, _Parameter(self.parameter(node, name, value), self.error_at(value))

    def error_at(self, source: YamlNode) -> Callable[[str, Iterable[str]], ConfigError]:
        """Return what makes an error about a part of the file."""
        return lambda problem, valid: self.error(problem, source, valid)

    def parameter(self, node: str, name: str, source: YamlNode) -> Any:
        """Read the value of a parameter."""
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


class _RuleReader(_ConfigReader):
    """Reads a rule of the command line, which has no lines."""

    def __init__(self, rule: str) -> None:
        super().__init__(Path(rule))
        self._rule = rule

    def error(self, problem: str, source: YamlNode | Position, valid: Iterable[str] = ()) -> ConfigError:
        """Make the error to raise about the rule."""
        return ConfigError(f"-p {self._rule}: {problem}", valid=valid)


def _holds_nodes(part: YamlMapping) -> bool:
    """Tell whether a part of a file is a namespace: somewhere below, nodes have ``ros__parameters``."""
    return any(
        isinstance(value, YamlMapping) and (value.key(_INNER) is not None or _holds_nodes(value))
        for key, value in part.entries
        if key.text != _INNER
    )


NodeClass = Callable[[], "type[FlorenceNode]"]
"""Imports the class of a node, which may take a second."""


def check_config(config: Config, nodes: Mapping[str, NodeClass]) -> None:
    """Refuse a configuration of which a node would not take a value.

    Sections for nodes of other namespaces are left alone: one file may serve several robots.

    Args:
        config: The configuration.
        nodes: Node -> its class; only those that the configuration names are asked for.

    Raises:
        ConfigError: Unknown nodes and parameters, and values that do not fit; with their places in the file.
    """
    used: set[str] = set()
    wrong: list[ConfigError] = []
    for part in config.sections:
        mine = [node for node in nodes if part.is_for(node, config.namespace)]
        try:
            _refuse_unknown_node(part, mine, nodes, config.namespace)
            if part.for_many and part.entries:
                _refuse_unknown_parameters(part, {node: nodes[node] for node in mine})
        except ConfigError as error:
            wrong.append(error)
        used.update(mine)
    for node in sorted(used):
        kind = nodes[node]()
        entries = config.entries(node, parameter_names(kind.parameter_classes))
        values = {name: entry.value for name, entry in entries.items()}
        try:
            check_parameters(kind.parameter_classes, values, kind.replaced_parameters)
        except ConfigError as error:
            part = next(part for part in reversed(config.sections) if part.is_for(node, config.namespace))
            for mistake in error.mistakes:
                about = next((entries[name] for name in mistake.parameters if name in entries), part)
                wrong.append(about.error(f"{node}: {mistake.problem}", mistake.valid))
    mistakes = (mistake for error in wrong for mistake in error.mistakes)
    raise_all(sorted(mistakes, key=lambda each: (each.file or "", each.line or 0, each.column or 0)))


def _refuse_unknown_node(part: Section, mine: list[str], nodes: Collection[str], namespace: str) -> None:
    where, slash, last = part.name.rpartition("/")
    if mine or (where and "*" not in where and where != namespace) or (part.for_many and last in nodes):
        return
    if slash and not where and namespace:
        if last in nodes:
            problem = f"the node {part.name!r} is not in the namespace {namespace}"
            raise part.error(problem, [last, f"{namespace}/{last}"])
        return
    raise part.error(f"unknown node {last!r}", closest_first(last, nodes))


def _refuse_unknown_parameters(part: Section, mine: Mapping[str, NodeClass]) -> None:
    known = {name for load in mine.values() for name in parameter_names(load().parameter_classes)}
    raise_all(
        entry.error(f"none of the nodes {part.name} has a parameter {name!r}", closest_first(name, known))
        for name, entry in part.entries.items()
        if name not in known
    )
