"""The schema of a mission file as a whole."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from florence_bt.core.declaration import Kind, SkillDeclaration
from florence_bt.trees.language.kinds import (
    INPUT_KEYS,
    KEY_KEYS,
    MISSION_KEYS,
    NODE_KINDS,
    ON_RESTART,
    OUTPUT_KEYS,
)
from florence_bt.trees.language.model import Mission
from florence_bt.trees.language.quantities import NUMERIC_KINDS, example_of
from florence_bt.trees.language.schema._nodes import NODE, NodeSchemas
from florence_bt.trees.language.schema._values import NAME, TEXT, Schema, definitions, literal, where, words

DRAFT = "http://json-schema.org/draft-07/schema#"
"""The newest draft that YAML language servers of editors understand."""

_TEXTS = {
    "mission": "the name, equal to the name of the file",
    "description": "what the mission does, for people",
    "inputs": "what a caller gives; all are keys of the tree",
    "outputs": "keys that are handed to the caller when the mission succeeds",
    "keys": "further keys with their types; a default is the value at the start",
    "on_restart": "what follows when the executor died while this mission ran",
    "tree": "the root of the behaviour tree",
}


_RESTARTS = {
    "abort": "the run is over",
    "restart": "the mission begins again",
    "resume": "the mission goes on where it stood",
}
_PORT_TEXTS: dict[str, Schema] = {
    "type": {
        **words({kind.value: f"such as {example_of(kind)}" for kind in Kind}),
        "description": "what it holds",
    },
    "description": {**TEXT, "description": "what it is, for people"},
    "default": {"description": "its value when none is given"},
    "min": {"description": "the smallest value that is allowed"},
    "max": {"description": "the largest value that is allowed"},
}


def make_schema(
    declarations: Mapping[str, SkillDeclaration],
    missions: Iterable[Mission] = (),
    labels: Mapping[str, Iterable[str]] | None = None,
) -> Schema:
    """The JSON Schema (draft-07) of a mission file.

    Args:
        declarations: The skills by name.
        missions: The missions that can be called; others can be named too, their inputs are not checked.
        labels: What a text can name (``hotspot``, ``room``) -> the names that exist; where they are not given
            any text will do.

    Returns:
        The schema, ready for ``json.dumps``.
    """
    values: dict[str, Schema] = {
        "mission": NAME,
        "description": TEXT,
        "inputs": _ports(INPUT_KEYS),
        "outputs": _ports(OUTPUT_KEYS),
        "keys": _ports(KEY_KEYS),
        "on_restart": {**words({each: _RESTARTS[each] for each in ON_RESTART}), "default": ON_RESTART[0]},
        "tree": NODE,
    }
    nodes = NodeSchemas(declarations, missions, labels or {})
    return {
        "$schema": DRAFT,
        "$id": "urn:florence-bt:mission",
        "title": "A mission of Florence BT",
        "description": f"A behaviour tree over skills. Kinds of nodes: {', '.join(NODE_KINDS)}; and skills.",
        "type": "object",
        "properties": {key: {"description": _TEXTS[key], **values[key]} for key in MISSION_KEYS},
        "required": ["mission", "tree"],
        "additionalProperties": False,
        "definitions": {**definitions(), "code": nodes.code(), "node": nodes.node()},
    }


def _ports(keys: Iterable[str]) -> Schema:
    """A table of declared inputs, outputs or keys."""
    fields = {key: _PORT_TEXTS[key] for key in keys}
    limited: list[str] = [key for key in ("min", "max") if key in fields]
    rules = [_typed(kind, limited, fields) for kind in Kind] if "default" in fields else []
    declared: Schema = {
        "title": "what is declared",
        "type": "object",
        "properties": fields,
        "required": ["type"],
        "additionalProperties": False,
        **({"allOf": rules} if rules else {}),
    }
    return {"type": ["object", "null"], "propertyNames": NAME, "additionalProperties": declared}


def _typed(kind: Kind, limited: list[str], fields: Mapping[str, Schema]) -> Schema:
    """A default and limits are of the declared type; only numbers have limits."""
    of_kind: dict[str, Schema | bool] = {"default": literal(kind)}
    of_kind |= {key: literal(kind) if kind in NUMERIC_KINDS else False for key in limited}
    return {
        "if": where({"required": ["type"]}, {"properties": {"type": {"const": kind.value}}}),
        "then": {"properties": of_kind},
    }
