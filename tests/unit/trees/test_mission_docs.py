"""The documents of the mission language are true: every example is checked, the generated page is current."""

import re
from pathlib import Path

import pytest

from florence_bt.trees.declarations import collect_declarations
from florence_bt.trees.kinds import ANYWHERE, MODIFIERS, NODE_KINDS
from florence_bt.trees.lint import check
from florence_bt.trees.loader import MissionLibrary
from florence_bt.trees.quantities import UNITS
from florence_bt.trees.report import report_text
from florence_bt.trees.skills_page import skills_page

DOCS = Path(__file__).parents[3] / "docs"
TEXT = (DOCS / "missions.md").read_text()
BLOCKS = re.findall(r"```yaml( node)?\n(.*?)```", TEXT, re.DOTALL)


def problems(name, text, folder):
    (folder / f"{name}.yaml").write_text(text)
    library = MissionLibrary.load([folder])
    return report_text(check(library.get(name), library, collect_declarations()))


@pytest.mark.parametrize("block", [text for kind, text in BLOCKS if kind])
def test_every_node_in_the_document(block, tmp_path):
    tree = "".join(f"  {line}\n" for line in block.splitlines())
    assert problems("example", f"mission: example\ntree:\n{tree}", tmp_path) == ""


@pytest.mark.parametrize("block", [text for kind, text in BLOCKS if not kind])
def test_every_mission_in_the_document(block, tmp_path):
    name = re.match(r"mission: (\w+)", block)[1]
    assert problems(name, block, tmp_path) == ""


def test_the_document_has_an_example_of_everything():
    nodes = "\n".join(text for kind, text in BLOCKS if kind)
    for word in (*NODE_KINDS, *ANYWHERE, *MODIFIERS):
        assert re.search(rf"\b{word}:", nodes), word
    for units in UNITS.values():
        for unit in units:
            assert re.search(rf"`-?[\d.]+ {unit}`", TEXT), unit


def test_the_page_of_the_skills_is_current():
    assert (DOCS / "skills.md").read_text() == skills_page(collect_declarations()), (
        "write it anew: python -m florence_bt.trees.skills_page docs/skills.md"
    )
