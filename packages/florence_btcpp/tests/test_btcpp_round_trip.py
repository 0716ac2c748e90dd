"""Own missions survive the way to BehaviorTree.CPP and back: the same XML again, and the same ticks."""

# ruff: noqa: E501  (XML and missions on one line)

import random
import re

import pytest

from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.loader import BUILT_IN, MissionLibrary
from florence_bt.trees.language.model import walk
from tests.sweeps import sweep

SKILLS = {
    skill.name: skill
    for skill in (
        SkillDeclaration(
            "go", "Drive.", {"goal": Port(Kind.POSE, "where to")}, failures={"blocked": "no way"}
        ),
        SkillDeclaration(
            "turn",
            "Turn.",
            {"angle": Port(Kind.ANGLE, "", default=0.1), "name_of": Port(Kind.TEXT, "", default="")},
        ),
        SkillDeclaration(
            "look",
            "Look.",
            {"window": Port(Kind.DURATION, "how long", default=1.0, minimum=0.5)},
            {
                "seen": Port(Kind.BOOLEAN, "whether"),
                "distance": Port(Kind.LENGTH, "how far"),
                "count": Port(Kind.INTEGER, ""),
            },
            {"nobody": "no person"},
        ),
        SkillDeclaration("room_is", "Ask.", {"room": Port(Kind.TEXT, "which")}, instant=True),
        SkillDeclaration(
            "where", "Tell.", {}, {"pose": Port(Kind.POSE, ""), "speed": Port(Kind.SPEED, "")}, instant=True
        ),
        SkillDeclaration(
            "shift",
            "Move a pose.",
            {"pose": Port(Kind.POSE, "")},
            {"pose": Port(Kind.POSE, "")},
            instant=True,
        ),
        SkillDeclaration("beep", "Beep."),
    )
}
HEAD = """\
mission: m
description: A small one.
inputs:
  room: {type: text, default: kitchen}
  limit: {type: duration, default: 3 s, min: 0 s, max: 1 h}
  near: {type: length, default: 50 cm}
  tries: {type: integer, default: 2}
keys:
  mode: {type: text, default: fast}
  number: {type: integer, default: 0}
  far: {type: length, default: 2 m, description: how far away}
  found: {type: boolean, default: false}
  goal: {type: pose}
outputs:
  far: {type: length, description: how far it was}
"""
NODES = [
    "{sequence: [{beep: }, {look: {window: 2 s}, out: {distance: far, seen: found, count: number}}]}",
    "{selector: [{room_is: {room: $room}}, {beep: }], memory: false}",
    "{sequence: [{look: , every: 2 s}, {room_is: {room: hall}, every: 500 ms}, {turn: }], memory: false}",
    "{parallel: [{beep: }, {look: {window: $limit}}]}",
    "{parallel: [{beep: }, {turn: {angle: 45 deg}}], policy: any}",
    "{parallel: [{beep: }, {turn: }, {look: }], policy: {succeed: 2, fail: 2}}",
    "{parallel: [{beep: , name: horn}, {turn: }], policy: [horn]}",
    "{if: $far < 1 m, then: {beep: }, else: {turn: {angle: -0.3 rad}}}",
    "{if: $found, then: {beep: }, memory: false}",
    '{if: {room_is: {room: "the $room"}}, then: {turn: }, else: {wait: 250 ms}}',
    "{switch: $mode, cases: {fast: {beep: }, slow: {turn: }}, default: {look: }}",
    "{switch: $number, cases: {0: {beep: }, 1: {turn: }}}",
    "{switch: '${$number + 1}', cases: {1: {beep: }, 2: {turn: }, 3: {look: }}}",
    "{retry: 3, do: {look: }}",
    "{retry: $tries, on: [nobody, rejected], attempt: number, do: {look: }, because: 'round $number'}",
    "{retry: 3, do: {look: }, between: {turn: {angle: 5 deg}}}",
    "{retry: 3, on: [nobody], do: {look: }, between: {wait: 1 s, when: $found}}",
    "{for_each: $rooms, as: mode, do: {room_is: {room: $mode}}}",
    "{for_each: [kitchen, $room], as: mode, index: number, go_on_over: [nobody], do: {look: }}",
    "{for_each: [1, 2], as: number, first_success: true, do: {condition: $number > 1}, code: no_one}",
    "{append: {mode: ' and $room', rooms: $room}}",
    "{condition: 'count($rooms) > 1 and $room in $rooms and $rooms[0] == $room'}",
    "{set: {rooms: [hall, $room]}}",
    "{repeat: 2, do: {turn: {angle: 5 deg}}}",
    "{timeout: 1.5 s, do: {look: }}",
    "{timeout: $limit, do: {go: {goal: {x: $near, y: 1 m, yaw: 90 deg}}}}",
    "{look: , until: {room_is: {room: hall}}, code: too_late}",
    "{repeat: forever, do: {look: }, until: $far < 1 m}",
    "{sequence: [{look: }, {turn: }], interrupted_by: {if: {room_is: {room: hall}}, do: {beep: }}}",
    "{for_each: [a, $room], as: mode, do: {look: }, interrupted_by: {if: {turn: }, do: {beep: }}, until: $far < 1 m, code: c}",
    "{look: , on_failure: {nobody: {beep: }, any: {turn: }}}",
    "{name: l, look: , until: {turn: }, on_failure: {nobody: {fail: '$failure_code'}}, when: $found, finally: {beep: }}",
    "{sequence: [{look: , name: l}], on_failure: {any: {beep: }}, because: {rejected: no}}",
    "{repeat: 2, do: {once: {look: }}}",
    "{succeed: {look: }}",
    "{invert: {room_is: {room: bedroom}}}",
    "{condition: '$far * 2 > 1 m + $near and not $found'}",
    "{condition: $far > 1 m, code: too_near}",
    "{invert: {room_is: {room: bedroom}}, code: still_there, because: {still_there: no}}",
    "{look: , while: $number < 3, code: enough, finally: {beep: }}",
    "{condition: 'abs($far - 1 m) < 2 m'}",
    "{fail: 'no way to $room', code: lost}",
    "{wait: 0.5 s}",
    "{wait: $limit}",
    "{parallel: [{wait_until: $number > 1, timeout: 5 s}, {sequence: [{look: , out: {count: number}}]}]}",
    "{wait_until: {room_is: {room: hall}, every: 500 ms}, name: until it is the hall, timeout: $limit}",
    "{set: {number: 3, mode: slow, far: 1.5 m}}",
    "{set: {number: '${$number + 1}'}}",
    "{set: {goal: {x: 1 m, y: $near, yaw: 10 deg}}}",
    '{set: {mode: "the $room"}}',
    "{set: {far: '${max($far, 30 cm)}', found: true}}",
    "{sequence: [{where: , out: {pose: goal}}, {shift: {pose: $goal}, out: {pose: goal}}, {go: {goal: $goal}}]}",
    "{beep: , when: $far < 5 m}",
    "{beep: , when: not $found, name: only when nobody was found}",
    "{look: , while: $number < 3, when: $far < 9 km}",
    "{sequence: [{beep: }, {look: }], finally: {turn: }, because: {nobody: 'nobody in $room', blocked: no}}",
    "{turn: {name_of: 'it''s {odd} $$5'}, finally: {beep: }, while: not $found}",
    "{turn: {name_of: '{odd}'}}",
    "{turn: {name_of: ' padded; 1 '}}",
]


ROOMS = '  rooms: {type: list of text, default: [kitchen, "the hall"]}\n'


def mission(tree):
    head = HEAD.replace("keys:\n", f"keys:\n{ROOMS}") if "rooms" in tree else HEAD
    return f"{head}tree: {tree}\n"


@pytest.fixture
def own(tmp_path, exchange_with):
    """Writes a mission of the small world, and takes it around."""
    exchange = exchange_with(SKILLS)

    def take(text, seeds=range(12)):
        folder = tmp_path / "own"
        folder.mkdir(exist_ok=True)
        (folder / "m.yaml").write_text(text, encoding="utf-8")
        library = MissionLibrary.load([folder], built_in=False)
        assert not library.get("m").findings
        back, xml = exchange.around("m", library)
        found = [check(each.get("m"), each, SKILLS) for each in (library, back)]
        told = [sorted(re.sub(r"line \d+", "line", f.message) for f in each) for each in found]
        assert told[0] == told[1]
        assert exchange.export("m", back).xml == xml
        assert dict(back.get("m").inputs) == dict(library.get("m").inputs)
        assert dict(back.get("m").outputs) == dict(library.get("m").outputs)
        assert dict(back.get("m").keys) == dict(library.get("m").keys)
        exchange.same_ticks("m", library, back, seeds)
        return back, xml

    return take


@pytest.mark.parametrize("node", NODES)
def test_every_node_comes_back(own, node):
    own(mission(node))


@pytest.fixture(scope="module")
def built_in():
    return MissionLibrary.load(), collect_declarations()


@pytest.mark.parametrize("name", sorted(path.stem for path in BUILT_IN.glob("*.yaml")))
@pytest.mark.parametrize("first", sweep(range(0, 24, 6), every=4))
def test_built_in_missions_come_back_with_the_same_ticks(exchange_with, built_in, name, first):
    library, declarations = built_in
    exchange = exchange_with(declarations)
    back, xml = exchange.around(name, library)
    assert exchange.export(name, back).xml == xml
    exchange.same_ticks(name, library, back, range(first, first + 6))


def random_tree(dice, depth):
    if depth == 0 or dice.random() < 0.25:
        return dice.choice(NODES)
    below = [random_tree(dice, depth - 1) for _ in range(dice.randint(1, 3))]
    children, memory = ", ".join(below), dice.choice(["", ", memory: false"])
    return dice.choice(
        [
            f"{{sequence: [{children}]{memory}}}",
            f"{{selector: [{children}]{memory}}}",
            f"{{parallel: [{children}], policy: {dice.choice(['all', 'any'])}}}",
            f"{{retry: 2, do: {below[0]}}}",
            f"{{timeout: 4 s, do: {below[0]}}}",
            f"{{invert: {below[0]}}}",
            f"{{if: $number < 2, then: {below[0]}, else: {below[-1]}{memory}}}",
            f"{{sequence: [{children}], finally: {{beep: }}, when: not $found}}",
            f"{{selector: [{children}], while: $number < 5, name: watched}}",
        ]
    )


@pytest.mark.parametrize("seed", sweep(range(80), every=4))
def test_random_missions_come_back_with_the_same_ticks(own, seed):
    own(mission(random_tree(random.Random(seed), 3)), seeds=range(seed, seed + 5))


def test_calls_keep_their_names_inputs_and_outputs(tmp_path, exchange_with):
    (tmp_path / "outer.yaml").write_text(
        "mission: outer\ndescription: The outer one.\noutputs: {far: {type: length}}\non_restart: resume\n"
        "tree: {sequence: [{set: {near: 1 m}}, {run: inner, with: {near: $near, room: 'a b'}, out: {far: far}}]}\n"
    )
    (tmp_path / "inner.yaml").write_text(
        "mission: inner\ninputs: {near: {type: length}, room: {type: text}, further: {type: length, default: 2 m}}\n"
        "outputs: {far: {type: length}}\ntree: {set: {far: '${$near + $further}'}}\n"
    )
    library = MissionLibrary.load([tmp_path], built_in=False)
    exchange = exchange_with(SKILLS)
    back, _ = exchange.around("outer", library)
    assert back.names() == ["inner", "outer"]
    assert back.get("outer").on_restart == "resume" and back.get("outer").description == "The outer one."
    exchange.same_ticks("outer", library, back, range(3))


def test_a_script_that_an_editor_changed_counts_more_than_our_words(own, exchange_with):
    _, xml = own(mission("{sequence: [{condition: $far < 1 m}, {beep: , when: $near < 2 m}]}"))
    assert 'code="far &lt; 1.0" _florence="$far &lt; 1 m"' in xml
    changed = xml.replace('code="far &lt; 1.0"', 'code="far &lt; 3"').replace(
        "!(near &lt; 2.0)", "!(near &lt; 0.5)"
    )
    assert changed.count("0.5)") == 1
    root = exchange_with(SKILLS).library_of(changed).get("m").tree
    assert root.children[0].condition.text == "$far < 3 m"
    assert root.children[1].when.text == "$near < 0.5 m"


def test_without_our_marks_the_units_come_from_the_keys(own, exchange_with):
    _, xml = own(mission("{sequence: [{condition: $far < 1 m}, {set: {far: 30 cm}}, {look: {window: 2 s}}]}"))
    bare = re.sub(r'\s_florence(?!_m|_keys)\w*="[^"]*"', "", xml)
    assert "_florence=" not in bare and "_florence_set" not in bare
    tree = exchange_with(SKILLS).library_of(bare).get("m").tree
    assert "$far < 1 m" in [node.condition.text for node in walk(tree) if hasattr(node, "condition")]
