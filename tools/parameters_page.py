"""The page ``docs/reference/parameters.md``: every parameter of every node, from the nodes' dataclasses.

``python tools/parameters_page.py docs/reference/parameters.md`` writes it.
"""

from __future__ import annotations

import argparse
import dataclasses
import enum
import importlib
import inspect
import re
import types
import typing
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from florence_bt.app.bringup.topology import NODE_CLASSES, node_class
from florence_bt.core.limits import Limits, rules_of
from florence_bt.ros.parameters import to_parameter

_HEAD = """\
# Parameters

Every parameter of every node. This page is written from the classes that the nodes read them into, by
`python tools/parameters_page.py docs/reference/parameters.md`.

They are set in the configuration, one section for each node, and all are checked before anything starts:

```yaml
velocity_filter:
  max_linear_acc: 0.8
```

`florence up --robot FILE` reads it; `--ros-args -p` and parameter files of ROS 2 do the same
([how](ros_api.md#parameters)). A node keeps the values that it started with. `florence up` sets some itself,
such as the map's file or the port of a device, unless the configuration does.

The last column has the section of the document (S) and of [REFERENCE.md](../REFERENCE.md) (R) where the
parameter, or what it belongs to, is described. Without one it is ours. A number without a unit is a share, a
factor or a count.
"""
_UNITS = {
    "m/s^2": r"m/s\^2",
    "rad/s^2": r"rad/s\^2",
    "rad/s": r"rad/s",
    "deg/s": r"degrees per second",
    "m/s": r"m/s|metres (?:a|per) second",
    "bit/s": r"bits per second",
    "1/s": r"\b1/s\b",
    "Hz": r"Hz|(?:a|per) second\b",
    "m^2": r"square metres|\bm\^2",
    "rad": r"\brad(?:ians)?\b",
    "deg": r"\bdegrees\b(?! of freedom)",
    "m": r"\bmet(?:re|er)s?\b|(?<=[\d.] )m\b|(?<=\()m\b",
    "s": r"(?<!per wall )\bseconds?\b(?! per)|(?<=\d )s\b",
}
"""Unit -> how a description says it; the one that is said first counts, and of several there the longest."""


def parameters_page() -> str:
    """Write the page in Markdown."""
    nodes = {name: node_class(name) for name in sorted(NODE_CLASSES, key=str.lower)}
    return "\n".join([_HEAD, *(line for name, node in nodes.items() for line in _node(name, node))]) + "\n"


def parameters_of(node: type) -> Iterator[Parameter]:
    """Return the parameters of a node, in the order in which they are declared."""
    for cls in node.parameter_classes:  # type: ignore[attr-defined]
        yield from _fields(cls, "", _sources(cls, node))


@dataclasses.dataclass(frozen=True)
class Parameter:
    """A parameter, as the page tells it.

    Attributes:
        name: Its name, with a dot for each level.
        kind: Its type, in words.
        unit: Of a number; empty when it has none, such as a share or how many.
        default: In YAML; empty for none.
        limits: What it may be; empty for anything.
        source: Sections of the document and of REFERENCE.
        meaning: What it is.
    """

    name: str
    kind: str
    unit: str
    default: str
    limits: str
    source: str
    meaning: str


def _node(name: str, node: type) -> Iterator[str]:
    yield f"## {name}"
    yield ""
    summary = " ".join((inspect.getdoc(node) or "").partition("\n\n")[0].split())
    yield summary.replace("``", "`")
    yield ""
    parameters = list(parameters_of(node))
    if not parameters:
        yield "It has no parameters."
        yield ""
        return
    yield "| parameter | default | unit | may be | meaning | section |"
    yield "|---|---|---|---|---|---|"
    for each in parameters:
        cells = (
            f"`{each.name}`",
            each.default,
            each.unit,
            each.limits or each.kind,
            each.meaning,
            each.source,
        )
        yield f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"
    yield ""


def _fields(cls: Any, prefix: str, source: str) -> Iterator[Parameter]:
    hints, rules, told = typing.get_type_hints(cls), rules_of(cls), _attributes(cls)
    for field in dataclasses.fields(cls):
        name, kind = field.name, hints[field.name]
        if dataclasses.is_dataclass(kind):
            yield from _fields(kind, f"{prefix}{name}.", _cited(inspect.getdoc(kind) or "") or source)
            continue
        meaning = told[name]
        words = _kind(kind)
        yield Parameter(
            prefix + name,
            words,
            _unit(name, meaning)
            if words.startswith(("number", "list of number")) or name == "baud_rate"
            else "",
            _default(field),
            _limits(rules.get(name), kind),
            _cited(meaning) or source,
            meaning,
        )


def _attributes(cls: type) -> dict[str, str]:
    """Return what a docstring says of each attribute, in one line."""
    text = (inspect.getdoc(cls) or "").partition("Attributes:\n")[2]
    told = {}
    for entry in re.finditer(r"^    (\w[\w, ]*?): (.*(?:\n {5,}.*)*)", text, re.MULTILINE):
        told |= {name: " ".join(entry[2].split()) for name in entry[1].split(", ")}
    return {name: meaning.replace("``", "`") for name, meaning in told.items()}


def _sources(cls: type, node: type) -> str:
    """Return the sections that a class names, or else its module, the node, or a package around it."""
    modules = [part for each in (cls, node) for part in _upwards(each.__module__)]
    own = re.sub(r"Attributes:\n(?: .*\n?|\n)*", "", inspect.getdoc(cls) or "")
    texts = (own, inspect.getdoc(inspect.getmodule(cls)), inspect.getdoc(node))
    for text in (*texts, *(importlib.import_module(module).__doc__ for module in modules)):
        if found := _cited(text or ""):
            return found
    return ""


def _upwards(module: str) -> Iterator[str]:
    while "." in module:
        yield module
        module = module.rpartition(".")[0]


def _cited(text: str) -> str:
    """Return the sections of the document and of REFERENCE that a text names."""
    plain = " ".join(text.split())
    numbers = r"\d+(?:\.\d+)*(?:(?:, | and | to )\d+(?:\.\d+)*)*"
    document = re.search(rf"[Dd]ocument(?:'s)?,? sections? ({numbers})", plain)
    ours = re.search(rf"REFERENCE(?:, section)? ({numbers})", plain)
    return "; ".join([*([f"S {document[1]}"] if document else []), *([f"R {ours[1]}"] if ours else [])])


def _kind(kind: Any) -> str:
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        words = [_kind(each) for each in arguments if each is not type(None)]
        return " or ".join([*dict.fromkeys(words), *(["none"] if type(None) in arguments else [])])
    if origin in (tuple, list, Sequence):
        return f"list of {_kind(arguments[0])}s"
    if kind in (Path, str):
        return "text"
    return {bool: "true or false", int: "whole number", float: "number"}.get(kind, "text")


def _unit(name: str, meaning: str) -> str:
    if name.endswith("_s"):
        return "s"
    if ratio := re.search(r"\((\S+\^2 / \S+\^2)\)", meaning):
        return ratio[1]
    said = {unit: re.search(words, meaning, re.IGNORECASE) for unit, words in _UNITS.items()}
    found = [(at.start(), -len(at[0]), unit) for unit, at in said.items() if at]
    return min(found)[2] if found else ""


def _default(field: dataclasses.Field[Any]) -> str:
    value = field.default_factory() if field.default_factory is not dataclasses.MISSING else field.default
    if value is dataclasses.MISSING:
        return "must be set"
    value = to_parameter(value)
    if value in (None, "", []):
        return "empty" if value in ("", []) else "none"
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    text = f"{value:.6g}" if isinstance(value, float) else re.sub("'", "", str(value))
    return f"`{text}`" if len(text) <= 60 else f"{len(value)} values"


def _limits(rule: Limits | tuple[Any, ...] | None, kind: Any) -> str:
    if isinstance(rule, tuple):
        return ", ".join(
            f"`{str(choice).lower() if isinstance(choice, bool) else choice}`" for choice in rule
        )
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        return ", ".join(f"`{member.value}`" for member in kind)
    return str(rule) if rule is not None else ""


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Write the page of all parameters.")
    parser.add_argument("page", type=Path, help="where to, e.g. docs/reference/parameters.md")
    page = parser.parse_args().page
    page.write_text(parameters_page(), encoding="utf-8")
