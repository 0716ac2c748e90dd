"""docs/manual/checking.md is true: every example is said to be what the comment in front of it says."""

import re
from pathlib import Path

import pytest

from florence_bt.core.plain_yaml import MAX_DEPTH, MAX_PARTS, MAX_TEXT
from florence_bt.core.text_files import MAX_MISSION_BYTES
from florence_bt.skills.locator.hotspots import load_hotspots
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.analysis import MAX_NODES, MAX_TREE_DEPTH
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.findings import MAX_FINDINGS
from florence_bt.trees.language.loader import MissionLibrary

ROOT = Path(__file__).parents[3]
TEXT = (ROOT / "docs" / "manual" / "checking.md").read_text()
BLOCKS = re.findall(r"```yaml bad\n# (.*?)\n(.*?)```", TEXT, re.DOTALL)


@pytest.mark.parametrize(("says", "example"), BLOCKS, ids=[says for says, _ in BLOCKS])
def test_every_finding_in_the_document(says, example, tmp_path):
    if not example.startswith("mission:"):
        example = "mission: example\ntree:\n" + "".join(f"  {line}\n" for line in example.splitlines())
    (tmp_path / "example.yaml").write_text(example)
    library = MissionLibrary.load([tmp_path])
    labels = load_hotspots(ROOT / "hotspots" / "flat.yaml").labels()
    mission = library.find("example")
    readable = mission is not None
    findings = check(mission, library, collect_declarations(), labels) if readable else library.findings
    meant = [f for f in findings if says in f"{f.severity}: {f.message}"]
    assert len(meant) == 1, findings
    # No error but the one that the example is there for.
    assert [f for f in findings if f.severity == "error" and f not in meant] == []


def test_the_limits_in_the_document():
    for limit in (MAX_MISSION_BYTES, MAX_PARTS, MAX_DEPTH, MAX_TEXT, MAX_FINDINGS, MAX_NODES, MAX_TREE_DEPTH):
        assert re.search(rf"\b{limit:,}\b", TEXT), limit
