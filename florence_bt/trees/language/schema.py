"""JSON Schema of mission files, so that editors complete and check them while they are written.

Made from the vocabulary of the language, the declarations of the skills and the known missions. What a schema
cannot say (whether a key has a value, whether a branch is ever reached) is left to ``florence check``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from florence_bt.core.declaration import Kind, SkillDeclaration
from florence_bt.core.outcome import COMMON_CODES
from florence_bt.trees import kinds
from florence_bt.trees.kinds.words import ANYWHERE_TEXTS, MODIFIERS, NODE_KINDS, OWNERS, TREE_CODES
from florence_bt.trees.language import vocabulary
from florence_bt.trees.language.code_groups import ANY, groups_of
from florence_bt.trees.language.model import Mission
from florence_bt.trees.language.quantities import (
    NUMERIC_KINDS,
    example_of,
)
from florence_bt.trees.language.value_schemas import (
    EXPRESSION,
    NAME,
    NODE,
    TEXT,
    Schema,
    definitions,
    literal,
    refused,
    table,
    targets,
    where,
    words,
)


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
        """Make the schema of a code: one that is known, or one of the author's own."""
        return {"anyOf": [words(self._codes()), NAME]}

    def node(self) -> Schema:
        """Make the schema of a node."""
        properties = {**self._kinds(), **self._skills(), **self._modifiers()}
        # An unknown word is reported as unknown, and as nothing else.
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
        each = [_is_kind(kind) for kind in (*NODE_KINDS, *self._declarations)]
        none, one = {"not": {"anyOf": each}}, {"oneOf": each}
        yield {"if": where(known, none), "then": refused("a node needs a kind, or the name of a skill")}
        several = where({"anyOf": each}, {"not": one})
        message = "a node has one kind only: several nodes stand in a list, each after a dash"
        yield {"if": several, "then": refused(message)}

    def _kinds(self) -> dict[str, Schema]:
        missions = {mission.name: mission.description or "a mission" for mission in self._missions}
        run: Schema = {"anyOf": [words(missions), NAME]} if missions else NAME
        known = {
            word: {"description": node.kind.about, **node.kind.value} for word, node in kinds.BY_WORD.items()
        }
        return {**known, "run": {"description": known["run"]["description"], **run}}

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
        codes = {**self._groups(), **self._codes()}
        values: dict[str, Schema] = {
            "name": TEXT,
            "when": EXPRESSION,
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
            **{word: dict(node.kind.value) for word, node in kinds.OF_MODIFIERS.items()},
        }
        values["on_failure"] |= {
            "properties": {
                name: {**NODE, "description": about}
                for name, about in {ANY: "every other failure", **codes}.items()
            },
        }
        anywhere = {
            word: {"description": ANYWHERE_TEXTS[word], **values[word]} for word in vocabulary.ANYWHERE
        }
        of_kinds = {word: {"description": each.about, **each.value} for word, each in MODIFIERS.items()}
        return {**anywhere, **of_kinds}

    def codes_and_groups(self) -> Schema:
        """Make the schema of a code or a group of codes that a mission looks for."""
        return {"anyOf": [words({**self._groups(), **self._codes()}), NAME]}

    def _groups(self) -> dict[str, str]:
        """Return every group of codes with what it means."""
        groups = groups_of(self._declarations).values()
        return {group.name: f"{group.meaning} ({', '.join(sorted(group.codes))})" for group in groups}

    def _codes(self) -> dict[str, str]:
        """Return every code with what it means."""
        declared = (skill.failures.items() for skill in self._declarations.values())
        known = {code: about for failures in declared for code, about in failures}
        return dict(sorted({**known, **COMMON_CODES, **TREE_CODES}.items()))

    # ---- what goes together ---------------------------------------------------------------------------

    def _rules(self, known: Schema) -> Iterable[Schema]:
        for modifier, owners in OWNERS.items():
            own = [
                kind for owner in owners for kind in ([owner] if owner in NODE_KINDS else self._declarations)
            ]
            beside = [{"required": [word]} for word in vocabulary.BESIDE.get(modifier, ())]
            elsewhere: Schema = (
                {"not": {"anyOf": [*({"required": [kind]} for kind in own), *beside]}} if own else {}
            )
            message = (
                f"{modifier!r} belongs to {' and '.join((*owners, *vocabulary.BESIDE.get(modifier, ())))}"
            )
            then: Schema = {"properties": {modifier: False}, "errorMessage": message}
            yield {"if": where({"required": [modifier]}, known, elsewhere), "then": then}
        for word, node in kinds.BY_WORD.items():
            yield from (_rule(word, {"required": [modifier]}) for modifier in node.kind.needed)

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


def _is_kind(key: str) -> Schema:
    """Require that a node is of a kind; beside ``wait_until``, ``timeout`` is none."""
    if key == "timeout":
        return where({"required": [key]}, {"not": {"required": ["wait_until"]}})
    return {"required": [key]}


def _rule(key: str, then: Schema) -> Schema:
    return {"if": _is_kind(key), "then": then}


DRAFT = "http://json-schema.org/draft-07/schema#"
"""The newest draft that YAML language servers of editors understand."""

_ONE: Schema = {"minProperties": 1, "maxProperties": 1}
_TEXTS = {
    "mission": "the name, equal to the name of the file",
    "description": "what the mission does, for people",
    "imported_from": "the file of another project whose tree it is",
    "inputs": "what a caller gives; all are keys of the tree",
    "outputs": "keys that are returned to the caller when the mission succeeds",
    "keys": "further keys with their types; a default is the value at the start",
    "properties": "what must hold of the mission, whatever happens: florence verify proves it",
    "on_restart": "what follows when the executor died while this mission ran",
    "tree": "the root of the behaviour tree",
}


_RESTARTS = {
    "abort": "the run is over",
    "restart": "the mission begins again",
    "resume": "the mission goes on where it stood",
}
_PROPERTY_TEXTS = {
    "never": "what must not happen, such as say while $distance > 2 m, or it ends with battery_low",
    "after": "what must be followed by what stands under eventually",
    "at_most": "how often a skill may begin, such as {say: 3}",
    "always_before": "what must come before what, such as {start_tracker: look_for_user}",
    "eventually": "what must follow before the mission ends",
    "within": "in which time it must follow",
    "because": "the sentence that is said when it does not hold",
}
_PROPERTY_VALUES: dict[str, Schema] = {
    "at_most": {"type": "object", "additionalProperties": {"type": "integer", "minimum": 0}, **_ONE},
    "always_before": {"type": "object", "additionalProperties": TEXT, **_ONE},
    "within": literal(Kind.DURATION),
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
    """Make the JSON Schema (draft-07) of a mission file.

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
        "imported_from": TEXT,
        "inputs": _ports(vocabulary.INPUT_KEYS),
        "outputs": _ports(vocabulary.OUTPUT_KEYS),
        "keys": _ports(vocabulary.KEY_KEYS),
        "properties": {"type": "array", "items": _property()},
        "on_restart": {
            **words({each: _RESTARTS[each] for each in vocabulary.ON_RESTART}),
            "default": vocabulary.ON_RESTART[0],
        },
        "tree": NODE,
    }
    words_of_kinds = ", ".join(NODE_KINDS)
    nodes = NodeSchemas(declarations, missions, labels or {})
    return {
        "$schema": DRAFT,
        "$id": "urn:florence-bt:mission",
        "title": "A mission of Florence BT",
        "description": f"A behaviour tree over skills. Kinds of nodes: {words_of_kinds}; and skills.",
        "type": "object",
        "properties": {key: {"description": _TEXTS[key], **values[key]} for key in vocabulary.MISSION_KEYS},
        "required": ["mission", "tree"],
        "additionalProperties": False,
        "definitions": {
            **definitions(),
            "code": nodes.code(),
            "wanted_code": nodes.codes_and_groups(),
            "node": nodes.node(),
        },
    }


def _property() -> Schema:
    """Make the schema of a property: one of its words, and what belongs to that."""
    properties = {
        word: {"description": _PROPERTY_TEXTS[word], **_PROPERTY_VALUES.get(word, TEXT)}
        for word in vocabulary.PROPERTY_KEYS
    }
    beside = vocabulary.BESIDE_PROPERTY.items()
    return {
        "title": "a property",
        "type": "object",
        "properties": properties,
        "additionalProperties": False,
        "oneOf": [{"required": [word]} for word in vocabulary.PROPERTY_WORDS],
        "dependencies": {other: [word] for word, others in beside for other in others}
        | {word: [others[0]] for word, others in beside},
    }


def _ports(keys: Iterable[str]) -> Schema:
    """Make the schema of a table of declared inputs, outputs or keys."""
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
    """Require that a default and limits are of the declared type; only numbers have limits."""
    of_kind: dict[str, Schema | bool] = {"default": literal(kind)}
    of_kind |= {key: literal(kind) if kind in NUMERIC_KINDS else False for key in limited}
    return {
        "if": where({"required": ["type"]}, {"properties": {"type": {"const": kind.value}}}),
        "then": {"properties": of_kind},
    }
