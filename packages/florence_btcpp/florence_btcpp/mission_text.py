"""Mission files as text: nodes as plain tables and lists, and their YAML."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from florence_bt.core.errors import ConfigError
from florence_bt.core.odd_characters import needs_quotes
from florence_bt.core.plain_yaml import YamlMapping, YamlNode, YamlSequence, parse_yaml

WIDTH = 140
"""Length from which a line is broken."""
_FLOW = 112
"""Longest table that is kept on one line."""


class Quoted(str):
    """A text that is written in quotes, because without them it would be read as something else."""

    __slots__ = ()


Written = dict[str, Any] | list[Any] | str | None
"""A table, a list, a scalar, or nothing."""


def write_yaml(document: dict[str, Any], *, blank_before: tuple[str, ...] = ()) -> str:
    """Write a table as the text of a file.

    Args:
        document: What is written; its keys keep their order.
        blank_before: Top-level keys that get an empty line before them.
    """
    chunks = []
    for key, value in document.items():
        text = yaml.serialize(_node({key: value}, 0), Dumper=_Dumper, width=WIDTH, allow_unicode=True)
        chunks.append(("\n" if key in blank_before else "") + text)
    return "".join(chunks)


def write_flow(value: Any) -> str:
    """Write a value on one line: ``{x: 1 m, y: 2 m}``."""
    node = _node(value, 0)
    _make_flow(node)
    text = yaml.serialize(node, Dumper=_Dumper, width=10**9, allow_unicode=True)
    return text.removesuffix("\n").removesuffix("\n...").strip()


def read_flow(text: str) -> Any:
    """Read what :func:`write_flow` wrote.

    Raises:
        ConfigError: It is not YAML of that kind.
    """
    try:
        return _plain(parse_yaml(text.encode(), Path("value")))
    except ConfigError as error:
        raise ConfigError(error.problem, valid=error.valid) from error


class _Dumper(yaml.Dumper):
    """Without implicit types (``true`` needs no quotes, for it is written on purpose), and lists indented."""

    yaml_implicit_resolvers: dict[Any, Any] = {}  # noqa: RUF012  (the name and form that PyYAML gives it)

    def increase_indent(self, flow: bool = False, indentless: bool = False) -> None:
        super().increase_indent(flow, False)


def _node(value: Any, depth: int) -> yaml.Node:
    if isinstance(value, dict):
        pairs = [
            (_scalar(key, quoted=isinstance(key, Quoted)), _node(v, depth + 1)) for key, v in value.items()
        ]
        mapping = yaml.MappingNode("tag:yaml.org,2002:map", pairs, flow_style=not value)
        if depth and value and _is_small(value):
            _make_flow(mapping)
        return mapping
    if isinstance(value, (list, tuple)):
        items = [_node(item, 0 if isinstance(item, dict) else depth + 1) for item in value]
        flow = all(isinstance(item, str) for item in value)
        return yaml.SequenceNode("tag:yaml.org,2002:seq", items, flow_style=flow)
    return _scalar("" if value is None else str(value), quoted=isinstance(value, Quoted))


def _scalar(text: str, *, quoted: bool = False) -> yaml.ScalarNode:
    return yaml.ScalarNode("tag:yaml.org,2002:str", text, style='"' if quoted or needs_quotes(text) else None)


def _is_small(value: dict[str, Any]) -> bool:
    """Tell whether a table holds only scalars, and fits on a line: the inputs of a skill, a port, a pose."""
    flat = all(
        isinstance(item, str) or (isinstance(item, dict) and _is_pose(item)) for item in value.values()
    )
    return flat and sum(len(key) + len(str(item)) + 4 for key, item in value.items()) <= _FLOW


def _is_pose(value: dict[str, Any]) -> bool:
    return set(value) == {"x", "y", "yaw"}


def _make_flow(node: yaml.Node) -> None:
    if isinstance(node, yaml.CollectionNode):
        node.flow_style = True
        for item in node.value:
            for part in item if isinstance(item, tuple) else (item,):
                _make_flow(part)


def _plain(source: YamlNode) -> Any:
    match source:
        case YamlMapping(entries=entries):
            return {key.text: _plain(item) for key, item in entries}
        case YamlSequence(items=items):
            return [_plain(item) for item in items]
    return Quoted(source.text) if source.quoted else source.text
