"""The schema of a node: a table that may have every kind key and modifier, and rules what goes together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from florence_bt.core.declaration import Kind, SkillDeclaration
from florence_bt.core.outcome import COMMON_CODES
from florence_bt.trees.language.kinds import (
    FORCED,
    IDENTIFIER,
    MODIFIERS,
    NODE_KINDS,
    POLICIES,
    POLICY_KEYS,
    TREE_CODES,
)
from florence_bt.trees.language.model import Mission
from florence_bt.trees.language.schema._values import (
    EXPRESSION,
    NAME,
    REFERENCE,
    TEXT,
    Schema,
    given,
    literal,
    refused,
    table,
    targets,
    where,
    words,
)

NODE: Schema = {"$ref": "#/definitions/node"}
_NODES: Schema = {"type": "array", "items": NODE, "minItems": 1}
_COUNT: Schema = {"anyOf": [{"type": "integer", "minimum": 1}, REFERENCE]}
_PAUSE = given(Kind.DURATION)
_A_KEY: Schema = {"patternProperties": {f"^{IDENTIFIER.pattern}$": {"$ref": "#/definitions/any"}}}

KIND_VALUES: dict[str, Schema] = {
    "sequence": _NODES,
    "selector": _NODES,
    "parallel": _NODES,
    "if": {"anyOf": [EXPRESSION, NODE]},
    "switch": {"$ref": "#/definitions/any"},
    "retry": _COUNT,
    "repeat": _COUNT,
    "timeout": _PAUSE,
    "delay": _PAUSE,
    "cooldown": _PAUSE,
    "once": NODE,
    "force": {"enum": list(FORCED)},
    "invert": NODE,
    "succeed": NODE,
    "condition": EXPRESSION,
    "fail": TEXT,
    "wait": _PAUSE,
    "set": {"type": "object", **_A_KEY, "additionalProperties": False, "minProperties": 1},
}
"""Kind key -> what stands behind it; ``run`` depends on the missions."""

MODIFIER_TEXTS: dict[str, str] = {
    "name": "shown instead of the name that the kind gives",
    "when": "must hold before the node starts; the node is skipped otherwise",
    "unless": "must not hold before the node starts; the node is skipped otherwise",
    "while": "must hold all along; the node is stopped and fails otherwise",
    "because": "the reason of a failure in your own words, or one for each code",
    "finally": "a node that is done afterwards, on success, failure and cancel alike",
    "do": "the node that this one is about",
    "then": "what is done when the condition holds",
    "else": "what is done when the condition does not hold",
    "cases": "the values, each with the node that is done for it",
    "default": "what is done when no case fits",
    "on": "only failures with these codes are worth another attempt",
    "attempt": "the key that receives the number of the attempt",
    "memory": "false: conditions are watched while a later node runs",
    "policy": "when the parallel is done: all, any, the names of branches, or numbers",
    "code": "the code of the failure",
    "with": "the inputs of the mission",
    "out": "the outputs, each with the key that receives it",
    "every": "how often a composite without memory asks this condition again, 1 s if not given",
}
"""Modifier -> what it does."""

_POLICIES = {
    "all": "succeeds when all have succeeded, fails at the first failure",
    "any": "succeeds at the first success, fails when all have failed",
}
_NEEDED = {**dict.fromkeys(MODIFIERS["do"], "do"), "if": "then", "switch": "cases"}
"""Kind key -> the modifier that it cannot be without."""


class NodeSchemas:
    """Makes the schema of nodes.

    Args:
        declarations: The skills by name.
        missions: The missions that can be called.
        labels: What a text can name (a hotspot, a room) -> the names that exist, where they are known.
    """

    def __init__(
        self,
        declarations: Mapping[str, SkillDeclaration],
        missions: Iterable[Mission],
        labels: Mapping[str, Iterable[str]],
    ) -> None:
        self._declarations = declarations
        self._missions = sorted(missions, key=lambda mission: mission.name)
        self._labels = labels

    def code(self) -> Schema:
        """The schema of a code: one that is known, or one of the author's own."""
        return {"anyOf": [words(self._codes()), NAME]}

    def node(self) -> Schema:
        """The schema of a node."""
        properties = {**self._kinds(), **self._skills(), **self._modifiers()}
        # A word that is not known is said to be unknown, and nothing else is made of it.
        known: Schema = {"propertyNames": {"enum": list(properties)}}
        return {
            "title": "a node",
            "type": "object",
            "properties": properties,
            "additionalProperties": False,
            "allOf": [
                *self._one_kind(known),
                *self._rules(known),
                *self._skill_rules(),
                *self._call_rules(),
            ],
        }

    def _one_kind(self, known: Schema) -> Iterable[Schema]:
        kinds = [{"required": [kind]} for kind in (*NODE_KINDS, *self._declarations)]
        none, one = {"not": {"anyOf": kinds}}, {"oneOf": kinds}
        yield {"if": where(known, none), "then": refused("a node needs a kind, or the name of a skill")}
        several = where({"anyOf": kinds}, {"not": one})
        message = "a node has one kind only: several nodes stand in a list, each behind a dash"
        yield {"if": several, "then": refused(message)}

    def _kinds(self) -> dict[str, Schema]:
        missions = {mission.name: mission.description or "a mission" for mission in self._missions}
        run: Schema = {"anyOf": [words(missions), NAME]} if missions else NAME
        values = {**KIND_VALUES, "run": run}
        return {kind: {"description": text, **values[kind]} for kind, text in NODE_KINDS.items()}

    def _skills(self) -> dict[str, Schema]:
        schemas = {}
        for name, skill in self._declarations.items():
            schema = table(name, skill.inputs, self._labels)
            if "required" not in schema:
                schema["type"] = ["object", "null"]
            about = skill.summary.rstrip(".")
            codes = ", ".join(skill.failures) or "none of its own"
            schema["description"] = f"{about}. Fails with: {codes}."
            if skill.deprecated:
                schema["deprecated"] = True
            schemas[name] = schema
        return schemas

    def _modifiers(self) -> dict[str, Schema]:
        codes = self._codes()
        code: Schema = {"$ref": "#/definitions/code"}
        values: dict[str, Schema] = {
            "name": TEXT,
            "when": EXPRESSION,
            "unless": EXPRESSION,
            "while": EXPRESSION,
            "because": {
                "anyOf": [
                    TEXT,
                    {
                        "type": "object",
                        "properties": {name: {**TEXT, "description": about} for name, about in codes.items()},
                        "additionalProperties": TEXT,
                        "propertyNames": NAME,
                    },
                ]
            },
            "finally": NODE,
            "do": NODE,
            "then": NODE,
            "else": NODE,
            "cases": {"type": "object", "additionalProperties": NODE, "minProperties": 1},
            "default": NODE,
            "on": {"anyOf": [code, {"type": "array", "items": code}]},
            "attempt": NAME,
            "memory": {"type": "boolean", "default": True, "errorMessage": "true or false"},
            "policy": _policy(),
            "code": code,
            "with": {"type": ["object", "null"], **_A_KEY, "additionalProperties": False},
            "out": {"type": ["object", "null"], "propertyNames": NAME},
            "every": literal(Kind.DURATION),
        }
        return {name: {"description": text, **values[name]} for name, text in MODIFIER_TEXTS.items()}

    def _codes(self) -> dict[str, str]:
        """Every code with what it means."""
        declared = (skill.failures.items() for skill in self._declarations.values())
        known = {code: about for failures in declared for code, about in failures}
        return dict(sorted({**known, **COMMON_CODES, **TREE_CODES}.items()))

    # ---- what goes together ---------------------------------------------------------------------------

    def _rules(self, known: Schema) -> Iterable[Schema]:
        for modifier, owners in MODIFIERS.items():
            kinds = [
                kind for owner in owners for kind in ([owner] if owner in NODE_KINDS else self._declarations)
            ]
            elsewhere: Schema = {"not": {"anyOf": [{"required": [kind]} for kind in kinds]}} if kinds else {}
            message = f"{modifier!r} belongs to {' and '.join(owners)}"
            then: Schema = {"properties": {modifier: False}, "errorMessage": message}
            yield {"if": where({"required": [modifier]}, known, elsewhere), "then": then}
        for kind, modifier in _NEEDED.items():
            yield _rule(kind, {"required": [modifier]})

    def _skill_rules(self) -> Iterable[Schema]:
        for name, skill in self._declarations.items():
            yield _rule(name, {"properties": {"out": targets(skill.outputs)}})

    def _call_rules(self) -> Iterable[Schema]:
        for mission in self._missions:
            inputs = table(mission.name, mission.inputs, self._labels)
            then: Schema = {"properties": {"with": inputs, "out": targets(mission.outputs)}}
            if "required" in inputs:
                then = where(then, {"required": ["with"]})
            called = where({"required": ["run"]}, {"properties": {"run": {"const": mission.name}}})
            yield {"if": called, "then": then}


def _rule(key: str, then: Schema) -> Schema:
    return {"if": {"required": [key]}, "then": then}


def _policy() -> Schema:
    numbers = {key: {"type": "integer", "minimum": 1} for key in POLICY_KEYS}
    counted: Schema = {
        "type": "object",
        "properties": numbers,
        "required": [POLICY_KEYS[0]],
        "additionalProperties": False,
    }
    named = words({each: _POLICIES[each] for each in POLICIES})
    return {"anyOf": [named, {"type": "array", "items": TEXT, "minItems": 1}, counted]}
