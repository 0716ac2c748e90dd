"""JSON Schema of the values in mission files, by their kinds; what the schemas of nodes are made of."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from florence_bt.core.declaration import Kind, Port
from florence_bt.core.units import UNITS
from florence_bt.trees.language import vocabulary
from florence_bt.trees.language.quantities import COMPOUND, example_of, format_value, with_article

Schema = dict[str, Any]

NAME: Schema = {"type": "string", "pattern": f"^{vocabulary.IDENTIFIER.pattern}$"}
TEXT: Schema = {"type": ["string", "number", "boolean"]}
"""A text; one without quotes may look like a number."""
EXPRESSION: Schema = {"$ref": "#/definitions/expression"}
REFERENCE: Schema = {"$ref": "#/definitions/reference"}

_NUMBER = r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?"

_REFERENCE = rf"\$({vocabulary.IDENTIFIER.pattern}|\{{[\s\S]+\}})"

DEFINITIONS: dict[str, Schema] = {
    "reference": {
        "title": "a key, or an expression",
        "type": "string",
        "pattern": f"^{_REFERENCE}$",
        "examples": ["$key", "${$distance + 0.5 m}"],
    },
    "expression": {
        "title": "an expression",
        "description": "Compares, computes and combines: or and not == != < <= > >= + - * /, keys as $key.",
        "type": ["string", "boolean"],
        "minLength": 1,
        "examples": ["$distance < 1 m and not $found"],
    },
    "any": {
        "title": "a value",
        "anyOf": [TEXT, {"$ref": "#/definitions/pose"}, {"type": "array"}],
    },
    "pose": {
        "title": "a pose in the frame of the map",
        "type": "object",
        "properties": {axis: {"$ref": f"#/definitions/{kind}"} for axis, kind in
                       (("x", "length"), ("y", "length"), ("yaw", "angle"))},
        "required": ["x", "y", "yaw"],
        "additionalProperties": False,
    },
}  # fmt: skip
"""Schemas to which the others refer."""


def literal(kind: Kind) -> Schema:
    """Make the schema of a value of a kind that is written out."""
    if kind.item is not None:
        return {"anyOf": [{"type": "array", "items": given(kind.item)}, TEXT]}
    match kind:
        case Kind.TEXT:
            return TEXT
        case Kind.BOOLEAN:
            return {"type": "boolean"}
        case Kind.INTEGER:
            return {"type": "integer"}
        case Kind.NUMBER:
            return {"type": "number"}
        case Kind.POSE:
            return {"$ref": "#/definitions/pose"}
    return _quantity(kind)


def _quantity(kind: Kind, *others: str) -> Schema:
    """Make the schema of a number with its unit, or a text of another pattern; only 0 needs no unit.

    One pattern: of several alternatives editors show only the types.
    """
    units = "|".join(re.escape(unit) for unit in UNITS[kind])
    message = f"{with_article(kind)} is a number with its unit ({', '.join(UNITS[kind])}): {example_of(kind)}"
    compound = (COMPOUND,) if kind is Kind.DURATION else ()
    patterns = "|".join((rf"{_NUMBER}\s*({units})", *compound, *others))
    written = {
        "type": "string",
        "pattern": f"^({patterns})$",
        "examples": [example_of(kind)],
        "errorMessage": message,
    }
    return {"anyOf": [written, {"const": 0, "errorMessage": message}]}


def value(kind: Kind) -> Schema:
    """Make the schema of a value of a kind: written out, a key, or an expression."""
    title = f"{kind.value}, such as {example_of(kind)}"
    if kind in UNITS:
        return {"title": title, **_quantity(kind, _REFERENCE)}
    return {"title": title, "anyOf": [literal(kind), REFERENCE]}


def definitions() -> dict[str, Schema]:
    """Make what the other schemas refer to: one definition per kind of value, and the common ones."""
    kinds = {_definition(kind): value(kind) for kind in Kind if kind is not Kind.POSE}
    return {**kinds, **DEFINITIONS, _definition(Kind.POSE): value(Kind.POSE)}


def given(kind: Kind) -> Schema:
    """Refer to the schema of a value of a kind."""
    return {"$ref": f"#/definitions/{_definition(kind)}"}


def _definition(kind: Kind) -> str:
    """Return the name of the definition of a value of a kind; ``pose`` is a pose that is written out."""
    return "a_pose" if kind is Kind.POSE else kind.value.replace(" ", "_")


def port(port: Port, labels: Mapping[str, Iterable[str]]) -> Schema:
    """Make the schema of what an input takes.

    Args:
        port: The input.
        labels: What a text can name (a hotspot, a room) -> the names that exist, where they are known.
    """
    schema: Schema = dict(given(port.kind))
    allowed = port.choices or labels.get(port.names)
    if allowed is not None:
        named: Schema = {"enum": list(allowed)}
        if port.kind.item is not None:
            named = {"type": "array", "items": {"anyOf": [named, REFERENCE]}}
        schema = {"anyOf": [named, REFERENCE]}
    elif port.kind in (Kind.INTEGER, Kind.NUMBER) and (port.minimum, port.maximum) != (None, None):
        limits = {"minimum": port.minimum, "maximum": port.maximum}
        number = literal(port.kind) | {key: limit for key, limit in limits.items() if limit is not None}
        schema = {"anyOf": [number, REFERENCE]}
    schema["description"] = _about(port)
    if not port.required and Kind.POSE not in (port.kind, port.kind.item):
        schema["default"] = (
            port.default
            if port.kind in (Kind.BOOLEAN, Kind.INTEGER, Kind.NUMBER)
            else format_value(port.default, port.kind)
        )
    return schema


def _about(port: Port) -> str:
    parts = [port.description.rstrip(".") or f"a {port.kind.value}"]
    limits = [
        f"{word} {format_value(limit, port.kind)}"
        for word, limit in (("at least", port.minimum), ("at most", port.maximum))
        if limit is not None
    ]
    if limits:
        parts.append(", ".join(limits))
    parts.append("required" if port.required else f"default {format_value(port.default, port.kind)}")
    return "; ".join(parts)


def table(owner: str, ports: Mapping[str, Port], labels: Mapping[str, Iterable[str]]) -> Schema:
    """Make the schema of a table of inputs of a skill or a mission."""
    required = [name for name, each in ports.items() if each.required]
    schema: Schema = {
        "title": f"inputs of {owner}",
        "description": f"the inputs of {owner}",
        "type": "object",
        "properties": {name: port(each, labels) for name, each in ports.items()},
        "additionalProperties": False,
    }
    if required:
        schema["required"] = required
    return schema


def words(texts: Mapping[str, str]) -> Schema:
    """Make the schema of a choice of words with meanings; editors show these when they offer them."""
    return {"enum": list(texts), "enumDescriptions": list(texts.values())}


def where(*conditions: Schema) -> Schema:
    """Make the schema of what must hold for a rule to count.

    One by one: editors take a schema with ``properties`` and ``required`` for something to offer.
    """
    return conditions[0] if len(conditions) == 1 else {"allOf": list(conditions)}


def refused(message: str) -> Schema:
    """Make the schema of what nothing fits, with the reason for editors."""
    return {"type": "null", "errorMessage": message}


def targets(ports: Mapping[str, Port]) -> Schema:
    """Make the schema of ``out``: outputs and the keys that receive them."""
    key = {"type": "string", "pattern": rf"^\$?{vocabulary.IDENTIFIER.pattern}$"}
    return {
        "type": "object",
        "properties": {
            name: key | {"description": f"{each.description or name} ({each.kind.value})"}
            for name, each in ports.items()
        },
        "additionalProperties": False,
    }


NODE: Schema = {"$ref": "#/definitions/node"}
NODES: Schema = {"type": "array", "items": NODE, "minItems": 1}
PAUSE = given(Kind.DURATION)
TIME: Schema = {
    "type": "object",
    "properties": {"time": TEXT},
    "required": ["time"],
    "additionalProperties": False,
}
A_KEY: Schema = {"patternProperties": {f"^{vocabulary.IDENTIFIER.pattern}$": {"$ref": "#/definitions/any"}}}
WANTED_CODES: Schema = {
    "anyOf": [
        {"$ref": "#/definitions/wanted_code"},
        {"type": "array", "items": {"$ref": "#/definitions/wanted_code"}},
    ]
}
"""Codes, or groups of codes, that a mission looks for."""
ASSIGNMENTS: Schema = {"type": "object", **A_KEY, "additionalProperties": False, "minProperties": 1}
"""A table of keys and values."""
