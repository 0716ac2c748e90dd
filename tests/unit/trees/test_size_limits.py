"""What is exactly as large as a limit is allowed, and what is larger by one is not."""

from __future__ import annotations

import pytest

from florence_bt.trees.checks.lint import check
from florence_bt.trees.language import analysis
from florence_bt.trees.language.analysis import MAX_TREE_DEPTH


@pytest.mark.parametrize(("too_many", "found"), [(0, []), (1, [f"{MAX_TREE_DEPTH + 1} nodes are nested"])])
def test_the_depth_of_a_tree_with_the_missions_that_it_calls(workshop, too_many, found):
    calls = MAX_TREE_DEPTH - 1 + too_many
    for number in range(calls):
        workshop.write(f"tree: {{run: c{number + 1}}}\n", f"c{number}")
    workshop.write("tree: {wait: 1 s}\n", f"c{calls}")
    library = workshop.library()
    findings = check(library.get("c0"), library, workshop.declarations)
    assert [each.message.partition(",")[0] for each in findings] == found


@pytest.mark.parametrize(("most", "found"), [(4, []), (3, ["the mission has 4 nodes"])])
def test_the_nodes_of_a_mission(workshop, monkeypatch, most, found):
    monkeypatch.setattr(analysis, "MAX_NODES", most)
    findings = workshop.findings("tree: {sequence: [{wait: 1 s}, {wait: 2 s}, {wait: 3 s}]}\n")
    assert [each.message.partition(" with those")[0] for each in findings] == found
