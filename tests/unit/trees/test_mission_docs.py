"""The documents of the mission language are true: every example is checked, and runs."""

import re
from pathlib import Path

import pytest
from py_trees.common import Status

from florence_bt.behaviours.why import explain
from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import Kind
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Outcome, Result
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.trees.checks.lint import check
from florence_bt.trees.kinds.words import MODIFIERS, NODE_KINDS, TREE_CODES
from florence_bt.trees.language.compile import compile_mission
from florence_bt.trees.language.declarations import own_declarations
from florence_bt.trees.language.declared_skills import read_skills_file
from florence_bt.trees.language.expressions.parser import FUNCTIONS
from florence_bt.trees.language.inputs import parse_inputs
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.quantities import UNITS
from florence_bt.trees.language.vocabulary import ANYWHERE, PROPERTY_KEYS
from tests.scripted_skill import ScriptedSkill
from tests.ticking import drain, make_context, tick_until
from tools.skills_page import skills_page

DOCS = Path(__file__).parents[3] / "docs"
TEXT = (DOCS / "reference" / "missions.md").read_text()
BLOCKS = re.findall(r"```yaml( node)?\n(.*?)```", TEXT, re.DOTALL)
NODES = [text for kind, text in BLOCKS if kind]
MISSIONS = [text for kind, text in BLOCKS if not kind]
DECLARATIONS = own_declarations()

# What an example reads and does not write is an input here.
GIVEN = {
    "distance": "{type: length, default: 0.8 m}",
    "people": "{type: integer, default: 1}",
    "mode": "{type: text, default: quick}",
}
# Examples that fail by intention: a part of the text -> the code.
FAILURES = {
    'fail: "nobody was': "nobody_home",
    "invert:\n": "still_in_the_kitchen",
    "while: not $found": "somebody_is_here",
    'fail: "there is no chair': "no_chair",
}
OUTPUTS = {
    Kind.POSE: Pose2(1.0, 2.0, 0.5),
    Kind.TEXT: "kitchen",
    Kind.BOOLEAN: True,
    Kind.INTEGER: 1,
}


def as_mission(node):
    used = [name for name in GIVEN if re.search(rf"\${name}\b", node) and not re.search(rf"{name}: ", node)]
    inputs = [f"  {name}: {GIVEN[name]}" for name in used]
    tree = [f"  {line}" for line in node.splitlines()]
    return "\n".join(["mission: example", *(["inputs:"] if used else []), *inputs, "tree:", *tree, ""])


def problems(name, text, folder):
    """What the check says; that nobody reads what an example writes is no fault of the example."""
    (folder / f"{name}.yaml").write_text(text)
    library = MissionLibrary.load([folder])
    found = check(library.get(name), library, DECLARATIONS)
    return [str(finding) for finding in found if "read" not in finding.message]


def run(name, text, folder, given=None):
    """Tick a mission with skills that succeed, after a second unless they are instant; its root."""
    (folder / f"{name}.yaml").write_text(text)
    library = MissionLibrary.load([folder])
    clock = ManualClock()
    skills = {}
    for skill, declaration in DECLARATIONS.items():
        outputs = {name: OUTPUTS.get(port.kind, 1.5) for name, port in declaration.outputs.items()}
        step = Step(Result(Outcome.SUCCEEDED, outputs=outputs), after=0.0 if declaration.instant else 1.0)
        skills[skill] = ScriptedSkill(declaration, clock, [step])
    context = make_context(clock, skills, DECLARATIONS)
    mission = library.get(name)
    tree = compile_mission(mission, library, parse_inputs(mission, given or {}), context)
    tick_until(tree.root, clock, context)
    drain(clock, context)
    return tree.root


@pytest.mark.parametrize("block", NODES)
def test_every_node_in_the_document_is_right(block, tmp_path):
    assert problems("example", as_mission(block), tmp_path) == []


@pytest.mark.parametrize("block", NODES)
def test_every_node_in_the_document_runs(block, tmp_path):
    root = run("example", as_mission(block), tmp_path)
    expected = next((code for part, code in FAILURES.items() if part in block), None)
    why = explain(root)
    assert (why.code if why else None) == expected, why
    assert root.status is (Status.FAILURE if expected else Status.SUCCESS)


@pytest.mark.parametrize("block", MISSIONS)
def test_every_mission_in_the_document(block, tmp_path):
    name = re.match(r"mission: (\w+)", block)[1]
    assert problems(name, block, tmp_path) == []
    assert run(name, block, tmp_path, {"plant": "palm"}).status is Status.SUCCESS


def test_the_document_has_an_example_of_everything():
    nodes = "\n".join(NODES)
    for word in (*NODE_KINDS, *ANYWHERE, *MODIFIERS):
        assert re.search(rf"\b{word}:", nodes), word
    for word in PROPERTY_KEYS:
        assert re.search(rf"`{word}[:`]", TEXT), word
    for units in UNITS.values():
        for unit in units:
            assert re.search(rf"`-?[\d.]+ {unit}`", TEXT), unit
    for function in FUNCTIONS:
        assert f"`{function}(" in TEXT, function
    for code, meaning in TREE_CODES.items():
        assert f"| `{code}` | {meaning} |" in TEXT, code


def test_the_page_of_the_skills_is_current():
    assert (DOCS / "reference" / "skills.md").read_text() == skills_page(), (
        "write it again: python tools/skills_page.py docs/reference/skills.md"
    )


def test_the_examples_of_declared_skills_are_read(tmp_path):
    texts = [TEXT, (DOCS / "manual" / "skills_without_code.md").read_text()]
    blocks = [block for text in texts for block in re.findall(r"```yaml skills\n(.*?)```", text, re.DOTALL)]
    assert len(blocks) == 3
    for block in blocks:
        file = tmp_path / "mine.skills.yaml"
        file.write_text(block)
        declared = read_skills_file(file)
        assert declared.declarations and not declared.findings
