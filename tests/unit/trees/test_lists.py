"""Lists: written, from a caller, in expressions; ``for_each`` and ``append``."""

# ruff: noqa: E501  (missions on one line)

import pytest
from py_trees.common import Status

from florence_bt.core.declaration import REQUIRED, Kind, Port
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.runtime.events import plain
from florence_bt.runtime.journal.rows import typed
from florence_bt.trees.language.inputs import parse_inputs
from florence_bt.trees.language.model import Mission
from florence_bt.trees.language.quantities import format_value, read_value
from tests.unit.trees.dumps import ascii_tree
from tests.unit.trees.language import BROKEN, ENDLESS, Play, takes

TEXTS, POSES = Kind.LIST_OF_TEXT, Kind.LIST_OF_POSE


def test_every_kind_has_a_list_and_no_list_has_one():
    plain_kinds = [kind for kind in Kind if kind.item is None]
    assert [kind.list.item for kind in plain_kinds] == plain_kinds
    assert len(list(Kind)) == 2 * len(plain_kinds)


@pytest.mark.parametrize(
    ("kind", "text", "value"),
    [
        (TEXTS, "[kitchen, hall]", ("kitchen", "hall")),
        (TEXTS, "kitchen, hall", ("kitchen", "hall")),
        (TEXTS, '["the hall", kitchen]', ("the hall", "kitchen")),
        (TEXTS, "kitchen", ("kitchen",)),
        (TEXTS, "[]", ()),
        (TEXTS, "", ()),
        (Kind.LIST_OF_LENGTH, "[1 m, 50 cm]", (1.0, 0.5)),
        (Kind.LIST_OF_INTEGER, "1, 2", (1, 2)),
    ],
)
def test_a_list_from_a_caller(tmp_path, kind, text, value):
    mission = Mission("m", "", tmp_path / "m.yaml", inputs={"l": Port(kind, "")})
    assert parse_inputs(mission, {"l": text}) == {"l": value}
    assert parse_inputs(mission, {"l": list(value)}) == {"l": value}
    assert read_value(format_value(value, kind), kind) == value


def test_poses_from_a_caller(tmp_path):
    mission = Mission("m", "", tmp_path / "m.yaml", inputs={"l": Port(POSES, "")})
    given = "[{x: 1 m, y: 2 m, yaw: 0}, {x: 0 m, y: 0 m, yaw: 90 deg}]"
    first, second = parse_inputs(mission, {"l": given})["l"]
    assert first == Pose2(1.0, 2.0, 0.0) and second.yaw == pytest.approx(1.5708, abs=1e-4)
    assert parse_inputs(mission, {"l": "[]"}) == {"l": ()}
    with pytest.raises(ConfigError, match="a list of pose is needed"):
        parse_inputs(mission, {"l": "kitchen"})


@pytest.mark.parametrize(
    ("text", "problem"), [("[1 m, 2]", "a length needs a unit: '2'"), ("x", "a length is needed, not 'x'")]
)
def test_a_wrong_item_from_a_caller(tmp_path, text, problem):
    mission = Mission("m", "", tmp_path / "m.yaml", inputs={"l": Port(Kind.LIST_OF_LENGTH, "", REQUIRED)})
    with pytest.raises(ConfigError, match=problem):
        parse_inputs(mission, {"l": text})


def test_the_journal_keeps_lists():
    for kind, value in ((TEXTS, ("a", "b")), (POSES, (Pose2(1.0, 2.0, 3.0),)), (TEXTS, ())):
        assert typed(plain(value), Port(kind, "")) == value


HEAD = """\
inputs: {rooms: {type: list of text, default: [kitchen, hall]}, n: {type: integer, default: 1}}
keys: {text: {type: text, default: ""}, found: {type: list of text, default: []}}
"""


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("count($rooms)", 2),
        ("count($rooms) == 2 and count($found) == 0", True),
        ('"hall" in $rooms', True),
        ('not "attic" in $rooms', True),
        ("$rooms[0]", "kitchen"),
        ('$rooms[$n] == "hall"', True),
        ("$rooms == $found", False),
        ('$rooms[0] in ["attic", "kitchen"]', True),
        ('$rooms[0] in ["attic"] or not $n in [2, $n + 1]', True),
        ("$n in []", False),
        ("count([1, $n, 3])", 3),
        ('["a", "b"][$n]', "b"),
        ("$rooms == [$rooms[0], $rooms[1]]", True),
        ("$rooms[2]", "bad_expression"),
        ("$rooms[-1]", "bad_expression"),
    ],
)
def test_expressions(tmp_path, expression, value):
    play = Play(tmp_path, f"{HEAD}tree: {{set: {{x: '${{{expression}}}'}}}}")
    status = play.run()
    assert (play.keys.read("x") if status == "success" else status) == value


@pytest.mark.parametrize(
    ("tree", "found"),
    [
        ("{set: {found: [hall, $text]}}", ("hall", "")),
        ("{set: {found: '${$rooms}'}}", ("kitchen", "hall")),
        ("{append: {found: hall}}", ("hall",)),
        ("{sequence: [{append: {found: $rooms}}]}", None),
        ("{for_each: $rooms, as: room, do: {append: {found: 'the $room'}}}", ("the kitchen", "the hall")),
        ("{for_each: [a, b, c], as: room, index: i, do: {append: {found: '$i$room'}}}", ("0a", "1b", "2c")),
        ("{for_each: [], as: room, do: {append: {found: $room}}}", ()),
    ],
)
def test_what_a_list_holds(tmp_path, tree, found):
    play = Play(tmp_path, f"{HEAD}tree: {tree}")
    if found is not None:
        assert (play.run(), play.keys.read("found")) == ("success", found)


def test_append_to_a_text(tmp_path):
    text = f"{HEAD}tree: {{for_each: $rooms, as: room, do: {{append: {{text: '$room: nobody. '}}}}}}"
    play = Play(tmp_path, text)
    assert (play.run(), play.keys.read("text")) == ("success", "kitchen: nobody. hall: nobody. ")


def test_append_to_a_key_without_a_value(tmp_path):
    play = Play(tmp_path, "keys: {t: {type: text}}\ntree: {append: {t: x}}")
    assert play.run() == "missing_key"


MENDED = "on_failure: {none_worked: {clean: }}"
LOOP = "for_each: [a, b, c], as: x, do: {sequence: [{append: {found: $x}}, {work: }]}"


# What the loop says | how each item ends | how the loop ends | the items that were begun
@pytest.mark.parametrize(
    ("more", "ends", "status", "found"),
    [
        ("", [takes(1.0)], "success", "abc"),
        ("", [takes(1.0), takes(1.0, BROKEN)], "broken", "ab"),
        (", go_on_over: [broken]", [takes(1.0, BROKEN)], "success", "abc"),
        (", go_on_over: broken", [takes(0.0, BROKEN), takes(0.0)], "success", "abc"),
        (", go_on_over: [rejected]", [takes(1.0, BROKEN)], "broken", "a"),
        (", first_success: true", [takes(1.0, BROKEN), takes(1.0)], "success", "ab"),
        (", first_success: true", [takes(1.0, BROKEN)], "none_worked", "abc"),
        (", first_success: true, code: nowhere", [takes(1.0, BROKEN)], "nowhere", "abc"),
        (", first_success: true, go_on_over: [rejected]", [takes(1.0, BROKEN)], "broken", "a"),
        (f", first_success: true, {MENDED}", [takes(1.0, BROKEN), takes(1.0)], "success", "ab"),
        (f", first_success: true, {MENDED}", [takes(1.0, BROKEN)], "success", "abc"),
    ],
)
def test_how_a_loop_ends(tmp_path, more, ends, status, found):
    play = Play(tmp_path, f"{HEAD}tree: {{{LOOP}{more}}}", work=ends)
    assert (play.run(), "".join(play.keys.read("found"))) == (status, found)


def test_the_reason_when_no_item_succeeds(tmp_path):
    play = Play(tmp_path, f"{HEAD}tree: {{{LOOP}, first_success: true}}", work=[takes(1.0, BROKEN)])
    play.run()
    assert play.why.reason == "no item succeeded; the last one: it broke"
    play = Play(tmp_path, "tree: {for_each: [], as: x, first_success: true, do: {set: {y: $x}}}")
    assert (play.run(), play.why.reason) == ("none_worked", "the list is empty")


@pytest.mark.parametrize("moment", [0.5, 1.0, 1.5])
def test_a_loop_can_be_stopped_at_every_moment(tmp_path, moment):
    play = Play(tmp_path, f"{HEAD}tree: {{{LOOP}, finally: {{clean: }}}}", work=[takes(1.0), ENDLESS])
    assert play.at(moment) == "running"
    play.root.stop(Status.INVALID)
    play.clock.advance(1.0)
    assert [skill for _, skill in play.started].count("clean") == 1
    assert play.context.runs == []


def test_a_loop_begins_anew(tmp_path):
    play = Play(tmp_path, f"{HEAD}tree: {{repeat: 2, do: {{{LOOP}}}}}", work=[takes(0.0)])
    assert (play.run(), "".join(play.keys.read("found"))) == ("success", "abcabc")


def test_a_mission_hands_a_list_on(tmp_path):
    called = (
        "inputs: {l: {type: list of text}}\noutputs: {k: {type: list of text}}\ntree: {set: {k: [$l, x]}}"
    )
    called = called.replace("[$l, x]", "['${$l[0]}', x]")
    play = Play(
        tmp_path,
        f"{HEAD}tree: {{run: called, with: {{l: $rooms}}, out: {{k: found}}}}",
        others={"called": called},
    )
    assert (play.run(), play.keys.read("found")) == ("success", ("kitchen", "x"))
    assert play.tree.output_texts() == {}


def test_the_dump(tmp_path):
    play = Play(tmp_path, f"{HEAD}tree: {{sequence: [{{{LOOP}}}]}}", work=[ENDLESS])
    play.at(1.0)
    assert ascii_tree(play.root).splitlines()[:3] == [
        "[>] m (sequence)",
        "    [>] for each [a, b, c] -- a",
        "        [>] sequence",
    ]


@pytest.mark.parametrize(
    ("tree", "line"),
    [
        ("{for_each: $rooms, do: {wait: 1 s}}", "for_each needs a key for the item under `as` | as: room"),
        ("{for_each: $n, as: x, do: {fail: $x}}", "for_each needs a list, but '$n' is an integer"),
        (
            "{for_each: kitchen, as: x, do: {fail: $x}}",
            "for_each needs a list, but 'kitchen' is a text | [kitchen]",
        ),
        ("{for_each: $rooms, as: x, do: {wait: $x}}", "wait: a duration is needed, but $x is a text"),
        (
            "{for_each: [1 s, 2], as: x, do: {wait: $x}}",
            "the items of a list are of one kind, not a duration and an integer",
        ),
        ("{for_each: [1 s, 2 s], as: x, do: {wait: $x}}", ""),
        (
            "{for_each: $rooms, as: n, do: {wait: 1 s}}",
            "the key 'n' is an input of the mission and cannot be written",
        ),
        ("{for_each: $rooms, as: x, do: {wait: 1 s}}", "nothing reads the key 'x'"),
        (
            "{sequence: [{for_each: $rooms, as: x, do: {append: {found: $x}}}, {fail: $x}]}",
            "the key 'x' may have no value here",
        ),
        (
            "{for_each: $rooms, as: x, go_on_over: [odd], do: {fail: $x}}",
            "go_on_over: 'fail' cannot fail with 'odd' | failed",
        ),
        (
            "{for_each: $rooms, as: x, code: odd, do: {fail: $x}}",
            "a for_each has a failure of its own only with `first_success: true`",
        ),
        ("{for_each: $rooms, as: x, first_success: true, code: odd, do: {fail: $x}}", ""),
        ("{for_each: $rooms, as: x, until: $n == 1, do: {fail: $x}}", "until: nothing that runs meanwhile"),
        (
            "{foreach: $rooms, as: x, do: {fail: $x}}",
            "there is no skill and no kind of node 'foreach' | for_each",
        ),
        ("{append: {n: 1}}", "append: $n is an integer, and only a text or a list can be added to"),
        ("{append: {found: 1 s}}", ""),
        ("{append: {lengths: 1 s}}", "lengths: 's' is not a unit of a length"),
        ("{append: {lengths: 1 m}}", ""),
        ("{append: }", "append needs keys and values"),
        ("{set: {lengths: [1 m, 2 s]}}", "an item of lengths: 's' is not a unit of a length"),
        ("{set: {lengths: 3 m}}", ""),
        ("{set: {lengths: {x: 1 m, y: 1 m, yaw: 0}}}", "lengths: a list of length is needed, not a pose"),
        (
            "{navigate_to: {goal: [1 m, 2 m, 90 deg]}}",
            "goal: a pose is needed, not a list | {x: 1 m, y: 2 m, yaw: 90 deg}",
        ),
        ("{wait: [1 s]}", "a duration is needed, not a list | 1 s"),
        ("{condition: count($n) > 1}", "'count' needs a list, but '$n' is an integer"),
        ("{condition: $n in $rooms}", "'$n' is an integer, but the items of '$rooms' are of the kind text"),
        ("{condition: '$rooms[$rooms] == 1'}", "'[ ]' needs an integer, but '$rooms' is a list of text"),
        ("{condition: '$rooms[0 == 1'}", "this [ is not closed | ]"),
        ("{condition: '$n in [1, 2.5]'}", ""),
        (
            "{condition: '$n in [\"a\"]'}",
            "'$n' is an integer, but the items of '[\"a\"]' are of the kind text",
        ),
        (
            "{condition: '$n in [1, \"a\"]'}",
            "'1' is an integer and '\"a\"' is a text: '[ ]' needs two of one kind",
        ),
        ("{condition: '$n in [[1]]'}", "a list has no lists in it, but '[1]' is a list of integer"),
        ("{condition: $rooms < $rooms}", "'<' needs numbers or quantities, but '$rooms' is a list of text"),
        ("{set: {found: ['${$rooms[0]}', $text]}}", ""),
        ("{set: {found: ['${$rooms[0} + 1}', $text]}}", "error"),
    ],
)
def test_what_the_check_says(workshop, tree, line):
    head = HEAD.replace("keys: {", "keys: {lengths: {type: list of length, default: []}, ")
    unread = (
        "nothing reads the input",
        "nothing reads or writes",
        "nothing reads the key 'found'",
        "nothing reads the key 'lengths'",
    )
    found = [
        each for each in workshop.lines(f"{head}tree: {tree}\n") if not any(word in each for word in unread)
    ]
    assert any(line in each for each in found) if line else found == [], found


@pytest.mark.parametrize(
    ("declared", "line"),
    [
        ("{type: list of txt}", "the type of 'l' cannot be 'list of txt' | list of text"),
        ("{type: list}", "the type of 'l' cannot be 'list' | list of text"),
        ("{type: list of text, default: [a, b], min: 1}", "a list of text has no min"),
        (
            "{type: list of length, default: [1 m, 2]}",
            "2:51 error the default of 'l': a length needs a unit: '2'",
        ),
        ("{type: list of pose, default: [{x: 1 m, y: 1 m, yaw: 0}]}", ""),
        ("{type: list of text, default: }", "the default of 'l': it has no value | [], [kitchen, hall]"),
    ],
)
def test_declared_lists(workshop, declared, line):
    found = workshop.lines(f"inputs: {{l: {declared}}}\ntree: {{condition: count($l) > 1}}\n")
    assert any(line in each for each in found) if line else found == [], found


def test_rooms_of_a_list_are_held_against_the_map(workshop):
    tree = "tree: {for_each: [kichen, hall], as: r, do: {get_hotspot: {label: $r}, out: {pose: p}}}\noutputs: {p: {type: pose}}\n"
    found = [
        f.message for f in workshop.findings(tree, hotspots=["kitchen", "hall"]) if "hotspot" in f.message
    ]
    assert found == ["there is no hotspot 'kichen'"]
    tree = "inputs: {rooms: {type: list of text, default: [atic]}}\n" + tree.replace(
        "[kichen, hall]", "$rooms"
    )
    found = [f.message for f in workshop.findings(tree, hotspots=["attic", "hall"]) if "hotspot" in f.message]
    assert found == ["there is no hotspot 'atic'"]
