"""The texts and pictures of trees: dumps, diagrams, reports."""

import json
import xml.etree.ElementTree as ET

import pytest
from py_trees.composites import Sequence

from florence_bt.behaviours.composites import Selector
from florence_bt.behaviours.leaves import Fail, Succeed
from florence_bt.behaviours.pacing import Retry, Wait
from florence_bt.core.clock import ManualClock
from florence_bt.testing.ticking import make_context, tick_until
from florence_bt.trees.ascii import ascii_tree
from florence_bt.trees.diagram import Box, diagram_of
from florence_bt.trees.draw import FORMATS, draw
from florence_bt.trees.findings import Finding
from florence_bt.trees.loader import MissionLibrary
from florence_bt.trees.report import report_github, report_json, report_text, summary

FINDINGS = [
    Finding("a.yaml", 3, 5, "error", "unknown skill 'trun', 100%", ("turn",)),
    Finding("b.yaml", 1, 1, "warning", "odd"),
]


def ticked():
    clock = ManualClock()
    context = make_context(clock)
    root = Sequence(
        "root",
        True,
        [
            Succeed("first"),
            Selector("choose", True, [Fail("no", context, "it is\nnot"), Wait("pause", context, 1.0)]),
            Succeed("last"),
        ],
    )
    root.tick_once()
    return root, clock, context


def test_dump_of_a_running_tree():
    root, _, _ = ticked()
    assert ascii_tree(root) == (
        "[>] root (sequence)\n"
        "    [+] first\n"
        "    [>] choose (selector)\n"
        "        [x] no -- it is not\n"
        "        [>] pause\n"
        "    [ ] last"
    )
    assert "last" not in ascii_tree(root, visited_only=True)
    assert ascii_tree(root) == ascii_tree(root)


def test_dump_in_colour_differs_only_in_colour():
    root, _, _ = ticked()
    coloured = ascii_tree(root, colour=True)
    for code in ("\x1b[32m", "\x1b[31m", "\x1b[33m", "\x1b[2m", "\x1b[0m"):
        assert code in coloured
        coloured = coloured.replace(code, "")
    assert coloured == ascii_tree(root)


def test_a_reason_is_told_where_it_begins_and_where_it_changes():
    clock = ManualClock()
    context = make_context(clock)
    retry = Retry("retry", Sequence("try", True, [Fail("no", context, "not so")]), context, 2)
    root = Sequence("root", True, [retry])
    tick_until(root, clock, context)
    assert ascii_tree(root) == (
        "[x] root (sequence)\n"
        "    [x] retry -- 2 of 2 attempts failed; last: not so\n"
        "        [x] try (sequence)\n"
        "            [x] no -- not so"
    )


def test_diagram():
    library = MissionLibrary.load()
    box = diagram_of(library.get("goto_room"))
    assert box == Box(
        "goto_room",
        "sequence",
        (),
        (
            Box("get hotspot", "skill", ("label: $room", "pose -> $hotspot")),
            Box("drive to the hotspot", "skill", ("navigate_to", "goal: $hotspot")),
        ),
    )
    short, full = (diagram_of(library.get("goto_user"), library, expand=expand) for expand in (False, True))
    assert len(list(full.walk())) > len(list(short.walk()))
    assert "finally" in [box.edge for box in full.walk()]


def test_text_drawing():
    library = MissionLibrary.load()
    assert draw(library.get("goto_room"), "txt") == (
        "→ goto_room\n"
        "├─ get hotspot  [label: $room; pose -> $hotspot]\n"
        "└─ drive to the hotspot  [navigate_to; goal: $hotspot]"
    )


def test_mermaid_has_every_node_and_escapes_texts(workshop):
    workshop.write('tree: {sequence: [{fail: "say \\"no\\" [1]"}, {wait: 1 s}]}\n')
    text = draw(workshop.library().get("m"), "mermaid")
    assert text.startswith("flowchart LR\n")
    assert "n0 --> n1" in text and "n0 --> n2" in text
    assert "say #34;no#34; #91;1#93;" in text


def boxes(svg):
    root = ET.fromstring(svg)
    names = "{http://www.w3.org/2000/svg}"
    found = [
        [float(r.get(key)) for key in ("x", "y", "width", "height")]
        for r in root.iter(names + "rect")
        if r.get("x")
    ]
    return root, found, [text.text for text in root.iter(names + "text")]


@pytest.mark.parametrize("name", MissionLibrary.load().names())
@pytest.mark.parametrize("expand", [False, True])
def test_svg_boxes_do_not_overlap_and_lie_in_the_picture(name, expand):
    library = MissionLibrary.load()
    root, found, texts = boxes(draw(library.get(name), "svg", library, expand=expand))
    assert len(found) == len(list(diagram_of(library.get(name), library, expand=expand).walk()))
    assert name in texts or library.get(name).tree.name in texts
    for index, (x, y, w, h) in enumerate(found):
        assert min(x, y) >= 0
        assert x + w <= float(root.get("width")) and y + h <= float(root.get("height"))
        for x2, y2, w2, h2 in found[index + 1 :]:
            assert x + w <= x2 or x2 + w2 <= x or y + h <= y2 or y2 + h2 <= y


def test_svg_of_sixty_nodes_is_no_wider_than_its_depth(workshop):
    groups = ", ".join("{sequence: [" + ", ".join(["{wait: 1 s}"] * 10) + "]}" for _ in range(5))
    workshop.write(f"tree: {{sequence: [{groups}]}}\n")
    root, found, _ = boxes(draw(workshop.library().get("m"), "svg"))
    assert len(found) == 56
    assert float(root.get("width")) < 600 and float(root.get("height")) < 3500


def test_svg_of_a_box_taller_than_its_children():
    tall = Box("tall", "retry", tuple(f"line {n}" for n in range(20)), (Box("small", "skill"),))
    _, found, _ = boxes(FORMATS["svg"](Box("root", "sequence", (), (tall, Box("next", "skill")))))
    (_, y, _, h), (_, y_child, _, h_child) = found[1], found[2]
    assert y + h / 2 == pytest.approx(y_child + h_child / 2, abs=0.2)
    assert found[3][1] > y + h


def test_svg_escapes_texts(workshop):
    workshop.write('tree: {fail: "a < b & c", name: "<x>"}\n')
    _, _, texts = boxes(draw(workshop.library().get("m"), "svg"))
    assert {"<x>", "a < b & c"} <= set(texts)


def test_reports():
    assert report_text(FINDINGS) == (
        "a.yaml:3:5: error: unknown skill 'trun', 100% (would have worked: turn)\nb.yaml:1:1: warning: odd"
    )
    assert json.loads(report_json(FINDINGS))[0] == {
        "file": "a.yaml",
        "line": 3,
        "column": 5,
        "severity": "error",
        "message": "unknown skill 'trun', 100%",
        "valid": ["turn"],
    }
    assert report_github(FINDINGS).splitlines() == [
        "::error file=a.yaml,line=3,col=5::unknown skill 'trun', 100%25 (would have worked: turn)",
        "::warning file=b.yaml,line=1,col=1::odd",
    ]
    assert [summary(FINDINGS), summary(FINDINGS[:1] * 2), summary([])] == [
        *["1 error, 1 warning", "2 errors, 0 warnings", "no problem found"],
    ]


def test_long_lists_of_what_would_have_worked_are_cut():
    finding = Finding("a.yaml", 1, 1, "error", "no", tuple(f"n{i}" for i in range(10)))
    assert report_text([finding]).endswith("n7 and 2 more)")
