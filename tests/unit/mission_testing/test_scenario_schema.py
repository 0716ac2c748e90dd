"""The JSON Schema of scenario files: good files fit it, broken ones do not."""

from pathlib import Path

import jsonschema
import pytest

from florence_bt.core.plain_yaml import parse_yaml, read_yaml
from florence_bt.mission_testing.paths import all_declarations
from florence_bt.mission_testing.scenarios.scenario_schema import scenario_schema
from florence_bt.trees.language.loader import MissionLibrary
from tests.unit.trees.yaml_data import as_data

FILES = sorted((Path(__file__).parents[3] / "scenarios").glob("*.yaml"))


@pytest.fixture(scope="module")
def validator():
    schema = scenario_schema(MissionLibrary.load(), all_declarations())
    jsonschema.Draft7Validator.check_schema(schema)
    return jsonschema.Draft7Validator(schema)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_our_own_scenarios_fit(validator, file):
    assert list(validator.iter_errors(as_data(read_yaml(file)))) == []


@pytest.mark.parametrize(
    "scenario",
    [
        "{name: x, then: {statsu: FAILED}}",
        "{name: x, then: {status: DONE}}",
        "{name: x, then: {}}",
        "{name: x}",
        "{then: {status: FAILED}}",
        "{name: x, whne: [], then: {code: ok}}",
        "{name: x, when: [stopp: ], then: {code: ok}}",
        "{name: x, when: [{stop: x, advance: 3 s}], then: {code: ok}}",
        "{name: x, when: [{advance: 3}], then: {code: ok}}",
        "{name: x, when: [{until: y, is: DONE}], then: {code: ok}}",
        "{name: x, given: {skill: {}}, then: {code: ok}}",
        "{name: x, given: {skills: {turn: {sucess: }}}, then: {code: ok}}",
        "{name: x, when: [stop], then: {code: ok}}",
        "{name: x, given: {skills: {turn: []}}, then: {code: ok}}",
        "{name: x, then: {duration: 3 apples}}",
        "{name: x, then: {called: {turn: -1}}}",
        "{name: x, given: {policy: maybe}, then: {code: ok}}",
    ],
)
def test_broken_scenarios_do_not(validator, scenario):
    text = f"mission: goto_room\nscenarios:\n  - {scenario}\n"
    assert list(validator.iter_errors(as_data(parse_yaml(text.encode(), Path("x")))))


def test_the_schema_knows_skills_and_missions(validator):
    schema = validator.schema["definitions"]
    assert "no_user_seen" in schema["skills"]["properties"]["look_for_user"]["description"]
    assert "goto_user" in [item.get("const") for item in schema["mission"]["anyOf"]]


def test_editors_of_today_know_every_word_of_it(validator):
    # Language servers for YAML follow draft-07; what came later they pass over in silence.
    schema = validator.schema
    assert schema["$schema"] == "http://json-schema.org/draft-07/schema#"
    parts, references = [schema], set()
    for part in parts:
        parts += [
            each
            for each in (part.values() if isinstance(part, dict) else part)
            if isinstance(each, dict | list)
        ]
        if isinstance(part, dict):
            assert not {"$defs", "dependentRequired", "unevaluatedProperties", "prefixItems"} & set(part)
            references |= {part["$ref"]} if "$ref" in part else set()
    assert references == {f"#/definitions/{name}" for name in schema["definitions"]}
