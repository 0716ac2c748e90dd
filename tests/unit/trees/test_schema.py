"""The JSON Schema: it lets through what the check lets through, and refuses what it can see to be wrong."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from jsonschema import Draft7Validator

from florence_bt.core.declaration import Kind
from florence_bt.core.plain_yaml import parse_yaml
from florence_bt.trees.kinds.words import ANYWHERE_TEXTS, MODIFIERS, NODE_KINDS
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.loader import BUILT_IN, MissionLibrary
from florence_bt.trees.language.quantities import UNITS, example_of
from florence_bt.trees.language.schema import make_schema
from florence_bt.trees.language.vocabulary import ANYWHERE, MISSION_KEYS, PROPERTY_KEYS
from tests.unit.trees.yaml_data import as_data

DOCS = Path(__file__).parents[3] / "docs"
LABELS = {"hotspot": ["kitchen", "tv"], "room": ["kitchen"]}
SCHEMA = make_schema(collect_declarations(), MissionLibrary.load().missions())
STRICT = make_schema(collect_declarations(), MissionLibrary.load().missions(), LABELS)
BLOCKS = re.findall(r"```yaml( node)?\n(.*?)```", (DOCS / "reference" / "missions.md").read_text(), re.DOTALL)


def problems(text: str, schema=SCHEMA) -> list[str]:
    data = as_data(parse_yaml(text.encode(), Path("m.yaml")))
    return [error.message for error in Draft7Validator(schema).iter_errors(data)]


def in_mission(tree: str) -> str:
    return f"mission: m\ndescription: A test.\ntree: {tree}\n"


def test_the_schema_is_a_schema():
    Draft7Validator.check_schema(SCHEMA)
    Draft7Validator.check_schema(STRICT)
    Draft7Validator.check_schema(make_schema({}))


@pytest.mark.parametrize("file", sorted(BUILT_IN.glob("*.yaml")), ids=lambda file: file.stem)
def test_the_missions_that_come_with_florence(file):
    assert problems(file.read_text()) == []


@pytest.mark.parametrize("block", [text for kind, text in BLOCKS if kind])
def test_every_node_in_the_document(block):
    tree = "".join(f"  {line}\n" for line in block.splitlines())
    assert problems(f"mission: example\ntree:\n{tree}") == []


@pytest.mark.parametrize("block", [text for kind, text in BLOCKS if not kind])
def test_every_mission_in_the_document(block):
    assert problems(block) == []


@pytest.mark.parametrize(
    "tree",
    [
        "{turn: {angle: 45 deg}}",
        "{turn: {angle: $step}}",
        '{turn: {angle: "${$step * 2}"}}',
        "{turn: {angle: 0}}",
        "{stop_tracker: }",
        "{look_for_user: , out: {user: $user}}",
        "{look_for_user: , out: {posture: posture, height: height}}",
        "{propose_approach_pose: {user: $u, robot: $r, trial: 4}}",
        "{retry: 3, on: no_user_seen, do: {look_for_user: {}}}",
        "{run: my_own_mission, with: {anything: 5}}",
        "{navigate_to: {goal: {x: 1 m, y: $y, yaw: 90 deg}}}",
        "{get_hotspot: {label: anywhere}}",
        "{fail: 5}",
        "{parallel: [{wait: 1 s}], policy: {succeed: 1}}",
        "{wait: 1 s, when: true}",
    ],
)
def test_what_is_right(tree):
    assert problems(in_mission(tree)) == []


@pytest.mark.parametrize(
    "tree",
    [
        "{}",
        "wait",
        "{seqence: [{wait: 1 s}]}",
        "{sequence: []}",
        "{sequence: {wait: 1 s}}",
        "{sequence: [wait]}",
        "{wait: 1 s, turn: {angle: 45 deg}}",
        "{wait: 5}",
        "{wait: 5 m}",
        "{wait: , name: x}",
        "{wait: 1 s, memory: false}",
        "{wait: 1 s, becaus: x}",
        "{turn: {angel: 45 deg}}",
        "{turn: {}}",
        "{turn: }",
        "{turn: {angle: 45}}",
        "{turn: {angle: 45 m}}",
        "{turn: 45 deg}",
        "{look_for_user: , out: {usr: user}}",
        "{look_for_user: , out: {user: User}}",
        "{stop_tracker: , out: {user: user}}",
        "{propose_approach_pose: {user: $u, robot: $r, trial: 7}}",
        "{propose_approach_pose: {user: $u, robot: $r, trial: 0}}",
        "{retry: 0, do: {wait: 1 s}}",
        "{retry: 3}",
        "{retry: 3, do: [{wait: 1 s}]}",
        "{retry: 3, do: {wait: 1 s}, on: No}",
        "{force: failure, do: {wait: 1 s}}",
        "{wait: 1 s, on_failure: {}}",
        "{wait: 1 s, on_failure: {any: [{wait: 1 s}]}}",
        "{wait: 1 s, until: [{wait: 1 s}]}",
        "{if: $x < 3}",
        "{switch: $x}",
        "{switch: $x, cases: {}}",
        "{parallel: [{wait: 1 s}], policy: some}",
        "{parallel: [{wait: 1 s}], policy: {succeeed: 1}}",
        "{parallel: [{wait: 1 s}], policy: {fail: 1}}",
        "{parallel: [{wait: 1 s}], policy: {succeed: 0}}",
        "{run: goto_room}",
        "{run: goto_room, with: {rom: kitchen}}",
        "{run: goto_room, with: {room: kitchen}, out: {pose: p}}",
        "{run: Goto}",
        "{run: my_own_mission, with: {Room: 5}}",
        "{set: {}}",
        "{set: {Key: 1}}",
        "{navigate_to: {goal: {x: 1 m, y: 2 m}}}",
        "{navigate_to: {goal: kitchen}}",
        "{fail: [a]}",
    ],
)
def test_what_is_wrong(tree):
    assert problems(in_mission(tree)) != []


@pytest.mark.parametrize(
    "text",
    [
        "description: no name\ntree: {wait: 1 s}\n",
        "mission: Big\ntree: {wait: 1 s}\n",
        "mission: m\n",
        "mission: m\ntree: {wait: 1 s}\ntre: x\n",
        "mission: m\non_restart: again\ntree: {wait: 1 s}\n",
        "mission: m\ninputs: {a: {type: len}}\ntree: {wait: 1 s}\n",
        "mission: m\ninputs: {a: {default: 5}}\ntree: {wait: 1 s}\n",
        "mission: m\ninputs: {a: {type: length, default: 5}}\ntree: {wait: 1 s}\n",
        "mission: m\ninputs: {a: {type: text, min: 5}}\ntree: {wait: 1 s}\n",
        "mission: m\ninputs: {A: {type: text}}\ntree: {wait: 1 s}\n",
        "mission: m\noutputs: {a: {type: text, default: x}}\ntree: {wait: 1 s}\n",
        "- mission: m\n",
        "mission: m\nproperties: {never: say}\ntree: {wait: 1 s}\n",
        "mission: m\nproperties: [say]\ntree: {wait: 1 s}\n",
        "mission: m\nproperties: [{never: say, at_most: {say: 3}}]\ntree: {wait: 1 s}\n",
        "mission: m\nproperties: [{because: it is loud}]\ntree: {wait: 1 s}\n",
        "mission: m\nproperties: [{after: say}]\ntree: {wait: 1 s}\n",
        "mission: m\nproperties: [{never: say, within: 3 s}]\ntree: {wait: 1 s}\n",
        "mission: m\nproperties: [{after: say, eventually: turn, within: 3 m}]\ntree: {wait: 1 s}\n",
        "mission: m\nproperties: [{at_most: {say: often}}]\ntree: {wait: 1 s}\n",
    ],
)
def test_files_that_are_wrong(text):
    assert problems(text) != []


@pytest.mark.parametrize("file", sorted(BUILT_IN.glob("*.properties.yml")), ids=lambda file: file.stem)
def test_the_properties_that_come_with_florence(file):
    assert problems(f"mission: m\n{file.read_text()}tree: {{wait: 1 s}}\n") == []


def test_labels_are_known_when_they_are_given():
    assert problems(in_mission("{get_hotspot: {label: tv}}"), STRICT) == []
    assert problems(in_mission("{get_hotspot: {label: $where}}"), STRICT) == []
    assert problems(in_mission("{get_hotspot: {label: sofa}}"), STRICT) != []
    assert problems(in_mission("{robot_in_room: {room: tv}}"), STRICT) != []


@pytest.mark.parametrize("kind", [kind for kind in Kind if kind is not Kind.POSE])
def test_a_value_of_each_kind(kind):
    def declared(value):
        return f"mission: m\ninputs: {{a: {{type: {kind.value}, default: {value}}}}}\ntree: {{wait: 1 s}}\n"

    assert problems(declared(example_of(kind))) == []
    for unit in UNITS.get(kind, ()):
        assert problems(declared(f"1.5 {unit}")) == []
        assert problems(declared(f"1.5{unit}")) == []
        assert problems(declared(f"1.5 {unit}x")) != []


def test_editors_are_told_what_everything_is():
    node = SCHEMA["definitions"]["node"]["properties"]
    assert set(node) == {*NODE_KINDS, *ANYWHERE, *MODIFIERS, *collect_declarations()}
    assert all(schema["description"] for schema in node.values())
    assert set(ANYWHERE_TEXTS) == set(ANYWHERE)
    assert list(SCHEMA["properties"]) == list(MISSION_KEYS)
    wanted = SCHEMA["properties"]["properties"]["items"]["properties"]
    assert list(wanted) == list(PROPERTY_KEYS)
    assert all(schema["description"] for schema in wanted.values())
    window = node["look_for_user"]["properties"]["window"]
    assert window["default"] == "5 s" and "at least 0.5 s, at most 15 s" in window["description"]
    assert "Fails with: no_user_seen" in node["look_for_user"]["description"]
    assert node["set_user_position"]["description"].endswith("Fails with: none of its own.")
    assert "goto_room" in node["run"]["anyOf"][0]["enum"]


def test_data_is_typed_as_yaml_1_2_types_it():
    text = "a: [no, on, yes, true, 12, 1.5, 1e3, '7', ~, null, 12:30, 0x1f, '']\nb: {on: 5}\n"
    assert as_data(parse_yaml(text.encode(), Path("m.yaml"))) == {
        "a": ["no", "on", "yes", True, 12, 1.5, 1000.0, "7", None, None, "12:30", "0x1f", ""],
        "b": {"on": 5},
    }


def schemas_in(schema):
    """Every schema in a schema, itself included."""
    if isinstance(schema, dict):
        yield schema
        for part in schema.values():
            yield from schemas_in(part)
    elif isinstance(schema, list):
        for part in schema:
            yield from schemas_in(part)


NEWER = {
    "$defs",
    "dependentRequired",
    "dependentSchemas",
    "unevaluatedProperties",
    "prefixItems",
    "minContains",
}


def test_editors_of_today_know_every_word_of_it():
    # Language servers for YAML follow draft-07; what came later they pass over in silence.
    assert SCHEMA["$schema"] == "http://json-schema.org/draft-07/schema#"
    assert not [words for words in map(set, schemas_in(SCHEMA)) if words & NEWER]
    references = {each["$ref"] for each in schemas_in(SCHEMA) if "$ref" in each}
    assert references <= {f"#/definitions/{name}" for name in SCHEMA["definitions"]}


def test_whatever_an_editor_offers_it_explains():
    node = SCHEMA["definitions"]["node"]["properties"]
    declared = SCHEMA["properties"]["inputs"]["additionalProperties"]["properties"]
    for name, schema in {**SCHEMA["properties"], **node, **declared}.items():
        assert schema.get("description"), name
    for schema in schemas_in(SCHEMA):
        named = schema.get("enumDescriptions")
        assert named is None or (len(named) == len(schema["enum"]) and all(named))


def test_conditions_are_no_proposals():
    # A schema with `properties` and `required` is offered as a whole, under the title of what is round it.
    for schema in schemas_in(SCHEMA):
        condition = schema.get("if", {})
        assert not {"properties", "required"} <= set(condition)
        then = schema.get("then", {})
        assert not isinstance(then, dict) or not {"properties", "required"} <= set(then)


@pytest.mark.parametrize(
    ("tree", "words"),
    [
        ("{wait: 5}", "a duration is a number with its unit (s, ms, min, h): 30 s"),
        ("{turn: {angle: 5 m}}", "an angle is a number with its unit (deg, °, rad): 45 deg"),
        ("{wait: 1 s, turn: {angle: 5 deg}}", "a node has one kind only"),
        ("{name: nothing}", "a node needs a kind, or the name of a skill"),
    ],
)
def test_an_editor_says_in_words_what_is_wrong(tree, words):
    def told(errors):
        for error in errors:
            if isinstance(error.schema, dict) and "errorMessage" in error.schema:
                yield error.schema["errorMessage"]
            yield from told(error.context)

    data = as_data(parse_yaml(in_mission(tree).encode(), Path("m.yaml")))
    assert any(words in message for message in told(Draft7Validator(SCHEMA).iter_errors(data)))


def test_an_unknown_word_is_all_that_is_said_about_its_node():
    assert problems(in_mission("{sequnce: [{wait: 1 s}]}")) == [
        "Additional properties are not allowed ('sequnce' was unexpected)"
    ]
