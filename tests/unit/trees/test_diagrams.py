"""Diagrams of missions: what is in them, and that every picture can be read."""

import itertools
import random
import re
import xml.etree.ElementTree as ET

import pytest

from florence_bt.app.mission_files.draw import png_of
from florence_bt.trees.drawings._layout import PlacedBox, lay_out
from florence_bt.trees.drawings._svg import MAX_CHARS, box_lines
from florence_bt.trees.drawings.diagram import Box, diagram_of
from florence_bt.trees.drawings.draw import FORMATS, SYMBOLS, draw
from florence_bt.trees.kinds.words import NODE_KINDS
from florence_bt.trees.language.loader import MissionLibrary

EVERYTHING = """
inputs: {near: {type: length, default: 1 m}}
keys: {mode: {type: text, default: fast}, found: {type: boolean, default: false}}
tree:
  name: all of it
  finally: {stop_tracker: }
  because: {blocked: "the way is blocked"}
  sequence:
    - if: $near < 2 m
      then: {turn: {angle: 45 deg}}
      else: {fail: too far, code: far}
    - switch: $mode
      cases: {fast: {wait: 1 s}, slow: {wait: 2 s}}
      default: {condition: $found}
    - {turn: {angle: 5 deg}, when: not $found, while: $near < 3 m, name: turn a little}
    - {timeout: 30 s, do: {once: {turn: {angle: 1 deg}, until: $found, on_failure: {any: {wait: 3 s}}}}}
    - {parallel: [{stop_tracker: , name: one}, {wait: 1 s}], policy: [one]}
    - {run: goto_room, with: {room: kitchen}}
"""


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


def test_branches_guards_and_words_are_in_the_diagram(workshop):
    workshop.write(EVERYTHING)
    box = diagram_of(workshop.library().get("m"))
    assert box.because == ("blocked: the way is blocked",)
    assert [below.edge for below in box.below] == ["", "", "", "", "", "", "finally"]
    choice, switch, turn, limited, together, _, _ = box.below
    assert [below.edge for below in choice.below] == ["then", "else"]
    assert choice.below[1].details == ("too far", "code: far")
    assert [below.edge for below in switch.below] == ["fast", "slow", "default"]
    assert turn.guards == ("when not $found", "while $near < 3 m")
    assert [each.kind for each in limited.walk()] == [
        "timeout",
        "once",
        "on_failure",
        "until",
        "skill",
        "condition",
        "wait",
    ]
    assert [below.edge for below in together.below] == ["must succeed", ""]


def test_every_kind_of_node_has_a_sign():
    assert set(NODE_KINDS) | {"skill", "until", "interrupted_by", "on_failure", "ensure"} == set(SYMBOLS)


def test_text_drawing(workshop):
    library = MissionLibrary.load()
    assert draw(library.get("goto_room"), "txt") == (
        "→ goto_room\n"
        "├─ get hotspot  [label: $room; pose -> $hotspot]\n"
        "└─ drive to the hotspot  [navigate_to; goal: $hotspot]"
    )
    workshop.write(EVERYTHING)
    text = draw(workshop.library().get("m"), "txt")
    assert text.startswith(
        "→ all of it  [because blocked: the way is blocked]\n├─ ◇ if $near < 2 m\n│  ├─ (then) turn"
    )
    assert "├─ turn a little  [when not $found; while $near < 3 m; turn; angle: 5 deg]" in text


# ---- Mermaid ---------------------------------------------------------------------------------------------

LINE = re.compile(
    r'  n\d+(\("[^"]*"\)|\["[^"]*"\])|  n\d+ (-->|-\.->)(\|"[^"]*"\|)? n\d+'
    r"|  classDef k_\w+ fill:#\w+,stroke:#\w+,color:#\w+|  class n\d+(,n\d+)* k_\w+"
)


@pytest.mark.parametrize("name", MissionLibrary.load().names())
def test_mermaid_has_only_lines_that_mermaid_knows(name):
    library = MissionLibrary.load()
    first, *lines = draw(library.get(name), "mermaid", library, expand=True).splitlines()
    assert first == "flowchart LR"
    assert [line for line in lines if not LINE.fullmatch(line)] == []


def test_mermaid_escapes_texts(workshop):
    workshop.write('tree: {sequence: [{fail: "say \\"no\\" [1] `x` <b>"}, {wait: 1 s, name: 1. end}]}\n')
    text = draw(workshop.library().get("m"), "mermaid")
    assert "n0 --> n1" in text and "n0 --> n2" in text and "⏸ 1. end" in text
    assert "say #34;no#34; #91;1#93; #96;x#96; #60;b#62;" in text
    # What begins like a list would not be drawn.
    box = Box("1. end", "skill", (), (Box("- x", "skill"), Box("+ y", "skill"), Box("2.5 m", "skill")))
    shown = re.findall(r'[\[(]"([^"]*)"[\])]', FORMATS["mermaid"](box))
    assert shown == ["1#46; end", "#45; x", "#43; y", "2.5 m"]


# ---- SVG and PNG -----------------------------------------------------------------------------------------


def boxes(svg):
    root = ET.fromstring(svg)
    names = "{http://www.w3.org/2000/svg}"
    drawing, legend = root.findall(names + "g")
    assert legend.get("class") == "legend"
    shift = float(drawing.get("transform").split("(")[1].split()[0])
    found = [
        [shift * (key in "xy") + float(r.get(key)) for key in ("x", "y", "width", "height")]
        for r in drawing.iter(names + "rect")
    ]
    return root, found, [text.text for text in root.iter(names + "text")]


def overlapping(found):
    return [
        (one, other)
        for index, one in enumerate(found)
        for other in found[index + 1 :]
        if not (
            one[0] + one[2] <= other[0]
            or other[0] + other[2] <= one[0]
            or one[1] + one[3] <= other[1]
            or other[1] + other[3] <= one[1]
        )
    ]


@pytest.mark.parametrize("name", MissionLibrary.load().names())
@pytest.mark.parametrize("expand", [False, True])
def test_svg_boxes_do_not_overlap_and_lie_in_the_picture(name, expand):
    library = MissionLibrary.load()
    root, found, texts = boxes(draw(library.get(name), "svg", library, expand=expand))
    assert len(found) == len(list(diagram_of(library.get(name), library, expand=expand).walk()))
    assert name in texts or library.get(name).tree.name in texts
    assert overlapping(found) == []
    for x, y, w, h in found:
        assert min(x, y) >= 0
        assert x + w <= float(root.get("width")) and y + h <= float(root.get("height"))


def corners(way):
    """The points of a path of straight lines: M x y, then V y and H x."""
    start, *lines = re.findall(r"[MVH][^MVH]+", way)
    x, y = (float(number) for number in start[1:].split())
    found = [(x, y)]
    for line in lines:
        x, y = (x, float(line[1:])) if line[0] == "V" else (float(line[1:]), y)
        found.append((x, y))
    return found


@pytest.mark.parametrize("name", MissionLibrary.load().names())
def test_a_line_leads_to_each_box_below_and_through_none(name):
    library = MissionLibrary.load()
    root = boxes(draw(library.get(name), "svg", library, expand=True))[0]
    names = "{http://www.w3.org/2000/svg}"
    drawing = root.find(names + "g")
    found = [
        [float(r.get(key)) for key in ("x", "y", "width", "height")] for r in drawing.iter(names + "rect")
    ]
    ways = [corners(path.get("d")) for path in drawing.iter(names + "path")]
    assert len(ways) == len(found) - 1
    slack = 0.2  # numbers are written with one digit behind the point
    for way in ways:
        for (x0, y0), (x1, y1) in itertools.pairwise(way):
            for x, y, w, h in found:
                beside = max(x0, x1) <= x + slack or min(x0, x1) >= x + w - slack
                assert beside or max(y0, y1) <= y + slack or min(y0, y1) >= y + h - slack


def random_box(dice, left):
    children = []
    while left > 0 and len(children) < 7 and dice.random() < 0.8:
        part = dice.randint(1, left)
        children.append(random_box(dice, part - 1))
        left -= part
    details = tuple("x" * dice.randint(1, 60) for _ in range(dice.randint(0, 4)))
    return Box(
        "a name " * dice.randint(1, 4), "sequence", details, tuple(children), dice.choice(["", "finally"])
    )


@pytest.mark.parametrize("seed", range(30))
def test_random_trees_are_drawn_without_overlaps_and_fit_the_page(seed):
    root, found, _ = boxes(FORMATS["svg"](random_box(random.Random(seed), 90)))
    assert overlapping(found) == []
    assert float(root.get("width")) <= 1600


def test_sixty_nodes_fit_a_page(workshop):
    groups = ", ".join("{sequence: [" + ", ".join(["{wait: 1 s}"] * 10) + "]}" for _ in range(5))
    workshop.write(f"tree: {{sequence: [{groups}]}}\n")
    mission = workshop.library().get("m")
    root, found, _ = boxes(draw(mission, "svg"))
    assert len(found) == 56 and overlapping(found) == []
    assert float(root.get("width")) < 800 and float(root.get("height")) < 600
    narrow, _, _ = boxes(draw(mission, "svg", width=420))
    assert float(narrow.get("width")) <= 420 and float(narrow.get("height")) > 600


def test_ten_thousand_boxes_are_laid_out():
    root = PlacedBox(50, 20, [PlacedBox(40, 20, [PlacedBox(30, 20) for _ in range(99)]) for _ in range(100)])
    width, height = lay_out(root, 2000, 1.5)
    assert width <= 2000 and height > 0


def test_no_line_of_a_box_is_longer_than_it_may_be():
    box = Box("t" * 200, "skill", ("a " * 80, "word " * 9), because=("b" * 50,))
    lines = box_lines(box)
    assert max(len(line.text) for line in lines) <= MAX_CHARS + 2
    assert lines[-1].text.startswith("… ")


def test_svg_escapes_texts(workshop):
    workshop.write('tree: {fail: "a < b & c", name: "<x>"}\n')
    _, _, texts = boxes(draw(workshop.library().get("m"), "svg"))
    assert {"<x>", "a < b & c"} <= set(texts)


def test_png_is_the_svg_twice_as_large():
    svg = draw(MissionLibrary.load().get("goto_room"), "svg")
    png = png_of(svg)
    width, height = (int.from_bytes(png[at : at + 4], "big") for at in (16, 20))
    root = ET.fromstring(svg)
    assert png.startswith(b"\x89PNG") and len(set(png)) > 50
    assert abs(width - 2 * float(root.get("width"))) <= 2 and abs(height - 2 * float(root.get("height"))) <= 2
