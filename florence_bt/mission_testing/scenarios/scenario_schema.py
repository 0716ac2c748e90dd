"""JSON Schema of scenario files, so that editors complete and check them while they are written.

What a schema cannot say (whether a pattern matches a node, whether a code belongs to a skill) is left to
``florence test``, which reports it with its place before anything is played.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.mission_testing.record import STATUSES
from florence_bt.mission_testing.scenarios.scenario_file import RUN_STATUSES, THEN_KEYS, WHEN_KEYS
from florence_bt.runtime.run import TriggerPolicy
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.schema import DRAFT

Schema = dict[str, Any]

_TEXT: Schema = {"type": ["string", "number", "boolean"]}
_DURATION: Schema = {
    "description": "Such as 3 s, 500 ms or 2 min.",
    "anyOf": [{"type": "string", "pattern": r"^\s*[\d.]+\s*(s|ms|min|h)\s*$|<"}, {"const": 0}],
}
_COUNT: Schema = {"anyOf": [{"type": "integer", "minimum": 0}, {"type": "string", "pattern": "<"}]}
_ANYTHING_OR_NOTHING: Schema = {"type": ["string", "number", "boolean", "null"]}
_SCRIPT_EXAMPLE = "running 3 s, then FAILURE no_path twice, then SUCCESS"


def scenario_schema(library: MissionLibrary, declarations: Mapping[str, SkillDeclaration]) -> Schema:
    """Make the schema (draft-07).

    Args:
        library: The missions that scenarios may use.
        declarations: The skills by name.
    """
    return {
        "$schema": DRAFT,
        "title": "Scenarios of Florence BT missions",
        "type": "object",
        "required": ["scenarios"],
        "additionalProperties": False,
        "properties": {
            "mission": {"$ref": "#/definitions/mission"},
            "missions": {"description": "Further folders of missions.", **_one_or_more({"type": "string"})},
            "given": {"$ref": "#/definitions/given"},
            "scenarios": {"type": "array", "items": {"$ref": "#/definitions/scenario"}},
        },
        "definitions": {
            "mission": _mission(library),
            "given": _given(),
            "skills": _skills(declarations),
            "script": _script(),
            "inputs": {"type": "object", "description": "Inputs by name, as in a mission file."},
            "scenario": _scenario(),
            "happening": _happening(),
            "expect": _expect(declarations),
            "then": _then(declarations),
        },
    }


def _mission(library: MissionLibrary) -> Schema:
    known = [
        {"const": mission.name, "description": mission.description or mission.name}
        for mission in library.missions()
    ]
    file = {"type": "string", "pattern": r"\.ya?ml$|<", "description": "The file of a mission."}
    return {"description": "The mission that is tested.", "anyOf": [*known, file, {"type": "string"}]}


def _given() -> Schema:
    return _table(
        "What holds before: inputs, what each skill does, how the mission is triggered.",
        {
            "inputs": {"$ref": "#/definitions/inputs"},
            "skills": {"$ref": "#/definitions/skills"},
            "policy": {"enum": [policy.value for policy in TriggerPolicy]},
            "priority": _COUNT,
            "caller": _TEXT,
        },
    )


def _skills(declarations: Mapping[str, SkillDeclaration]) -> Schema:
    return {
        "type": "object",
        "description": "What each skill does; by its name or by a pattern of paths.",
        "properties": {
            name: {"description": _about(declaration), "$ref": "#/definitions/script"}
            for name, declaration in declarations.items()
        },
        "additionalProperties": {"$ref": "#/definitions/script"},
    }


def _about(declaration: SkillDeclaration) -> str:
    outputs = f" Outputs: {', '.join(declaration.outputs)}." if declaration.outputs else ""
    codes = f" Failure codes: {', '.join(declaration.failures)}." if declaration.failures else ""
    return f"{declaration.summary.rstrip('.')}.{outputs}{codes}"


def _script() -> Schema:
    switch = _table(
        "An answer that depends on an input.",
        {
            "switch": {"type": "string", "description": "The input."},
            "cases": {"type": "object", "additionalProperties": {"$ref": "#/definitions/script"}},
            "default": {"$ref": "#/definitions/script"},
        },
        required=["switch"],
    )
    text = {"type": "string", "examples": ["SUCCESS", "FAILURE no_path", _SCRIPT_EXAMPLE]}
    return {"anyOf": [text, switch]}


def _scenario() -> Schema:
    return _table(
        "One case.",
        {
            "name": {"type": "string", "minLength": 1},
            "mission": {"$ref": "#/definitions/mission"},
            "examples": {
                "description": "Once for each; <name> stands for a value.",
                "anyOf": [
                    {"type": "array", "items": {"type": "object"}, "minItems": 1},
                    {"type": "object", "additionalProperties": {"type": "array"}},
                ],
            },
            "given": {"$ref": "#/definitions/given"},
            "when": {
                "description": "What happens while the mission runs, in order.",
                **_one_or_more({"$ref": "#/definitions/happening"}),
            },
            "then": {"$ref": "#/definitions/then"},
        },
        required=["name", "then"],
    )


def _happening() -> Schema:
    keys: Schema = {
        "at": _DURATION,
        "advance": _DURATION,
        "until": {"type": "string", "description": "A pattern of nodes."},
        "is": {"enum": list(STATUSES)},
        **dict.fromkeys(("stop", "pause", "resume", "override", "release"), _ANYTHING_OR_NOTHING),
        "start": {"$ref": "#/definitions/mission"},
        "inputs": {"$ref": "#/definitions/inputs"},
        "policy": {"enum": [policy.value for policy in TriggerPolicy]},
        "priority": _COUNT,
        "caller": _TEXT,
        "refused": _TEXT,
        "as": _TEXT,
        "expect": {"$ref": "#/definitions/expect"},
    }
    tables = [
        _table(f"{kind}.", {key: keys[key] for key in (kind, *more, "at")}, required=[kind])
        for kind, more in WHEN_KEYS.items()
    ]
    wait = _table("Wait until this long after the start.", {"at": _DURATION}, required=["at"])
    return {"anyOf": [*tables, wait]}


def _expect(declarations: Mapping[str, SkillDeclaration]) -> Schema:
    patterns = {"type": "string", "description": "A skill or a pattern of paths."}
    call = {
        "anyOf": [
            {"enum": list(declarations)},
            patterns,
            {"type": "object", "minProperties": 1, "maxProperties": 1},
        ]
    }
    counted = {"anyOf": [_COUNT, {"type": "object"}]}
    keys: Schema = {
        "status": {"anyOf": [{"enum": list(RUN_STATUSES)}, {"type": "string", "pattern": "<"}]},
        "code": _TEXT,
        "reason": {**_TEXT, "description": "The reason contains this."},
        "leaf": {**patterns, "description": "The node that caused it."},
        "outputs": {"type": "object"},
        "keys": {"type": "object"},
        "duration": _DURATION,
        "within": _DURATION,
        "calls": _one_or_more(call),
        "only_calls": _one_or_more(call),
        "called": {
            "anyOf": [
                {"type": "object", "properties": dict.fromkeys(declarations, counted)},
                _one_or_more(patterns),
            ]
        },
        "not_called": _one_or_more(patterns),
        "nodes": {"type": "object"},
        "trace": {"anyOf": [_one_or_more({"type": "string"}), {"type": "object", "required": ["lines"]}]},
        "tree": {"type": "string"},
    }
    return _table("What must hold at this moment.", {name: keys[name] for name in THEN_KEYS})


def _then(declarations: Mapping[str, SkillDeclaration]) -> Schema:
    schema = _expect(declarations)
    more = {
        "refused": {**_TEXT, "description": "The trigger is refused with a reason that contains this."},
        "runs": {"type": "object", "additionalProperties": {"$ref": "#/definitions/expect"}},
    }
    return {
        **schema,
        "description": "What must hold in the end.",
        "properties": {**schema["properties"], **more},
        "minProperties": 1,
    }


def _one_or_more(item: Schema) -> Schema:
    return {"anyOf": [item, {"type": "array", "items": item}]}


def _table(description: str, properties: Schema, required: list[str] | None = None) -> Schema:
    schema: Schema = {
        "type": "object",
        "description": description,
        "properties": properties,
        "additionalProperties": False,
    }
    return {**schema, "required": required} if required else schema
