import math
from pathlib import Path

import pytest

from florence_bt.core.declaration import Kind
from florence_bt.trees import kinds
from florence_bt.trees.language import model
from florence_bt.trees.language.model import Literal, PoseParts, Reference, Template
from florence_bt.trees.language.parse import parse_mission

FILE = Path("m.yaml")


def parse(tree, head="mission: m\n"):
    return parse_mission(head + tree, FILE)


def node(text):
    mission = parse("tree:\n" + "\n".join(f"  {line}" for line in text.strip("\n").split("\n")))
    assert mission.findings == ()
    return mission.tree


def problems(text):
    return [f"{f.line}:{f.column} {f.message} | {', '.join(f.valid)}" for f in parse(text).findings]


def test_the_head():
    mission = parse(
        """\
description: Try it.
inputs:
  far: {type: length, default: 50 cm, min: 0 m, max: 2 m, description: how far}
  who: {type: text}
outputs:
  user: {type: pose, description: where}
on_restart: resume
tree: {fail: x}
"""
    )
    assert mission.findings == ()
    assert (mission.name, mission.description, mission.on_restart) == ("m", "Try it.", "resume")
    far = mission.inputs["far"]
    assert (far.kind, far.default, far.minimum, far.maximum, far.description) == (
        Kind.LENGTH,
        0.5,
        0.0,
        2.0,
        "how far",
    )
    assert mission.required_inputs() == ("who",)
    assert mission.outputs["user"].kind is Kind.POSE
    assert (mission.positions["who"].line, mission.positions["user"].line) == (5, 7)


@pytest.mark.parametrize(
    ("head", "problem"),
    [
        ("[]", "1:1 a mission file must be a mapping"),
        ("tree: {fail: x}", "1:1 the mission has no name | mission: m"),
        ("mission: other\ntree: {fail: x}", "1:10 the mission is called 'other' but its file is m.yaml | m"),
        ("mission: Big Name\ntree: {fail: x}", "1:10 mission must be a name of lower-case letters"),
        ("mission: m", "1:1 the mission has no tree"),
        ("mission: m\ntree: {fail: x}\ntreee: 1", "3:1 unknown key of a mission 'treee' | tree"),
        (
            "mission: m\non_restart: maybe\ntree: {fail: x}",
            "2:13 on_restart cannot be 'maybe' | abort, restart",
        ),
        ("mission: m\ninputs: 5\ntree: {fail: x}", "2:9 inputs must be a mapping"),
        (
            "mission: m\ninputs: {a: }\ntree: {fail: x}",
            "2:10 an input is a mapping with its type | a: {type: text|boolean|",
        ),
        ("mission: m\ninputs: {a: {}}\ntree: {fail: x}", "2:13 'a' needs a type | text, boolean"),
        (
            "mission: m\ninputs: {a: {type: lenght}}\ntree: {fail: x}",
            "2:20 the type of 'a' cannot be 'lenght'",
        ),
        (
            "mission: m\ninputs: {a: {type: length, default: 5}}\ntree: {fail: x}",
            "2:37 the default of 'a': a length needs a unit: '5' | 5 m, 5 cm",
        ),
        (
            "mission: m\ninputs: {a: {type: length, default: 5 m, max: 3 m}}\ntree: {fail: x}",
            "2:37 the default of 'a': 5 m is above the maximum of 3 m",
        ),
        (
            "mission: m\ninputs: {a: {type: length, min: 5 m, max: 3 m}}\ntree: {fail: x}",
            "2:13 the minimum of 'a' is above its maximum",
        ),
        ("mission: m\ninputs: {a: {type: text, max: 3}}\ntree: {fail: x}", "2:31 a text has no max"),
        (
            "mission: m\noutputs: {a: {type: text, default: x}}\ntree: {fail: x}",
            "2:27 an output has no default",
        ),
        ("mission: m\ninputs: {A: {type: text}}\ntree: {fail: x}", "2:10 an input must be a name of lower"),
        (
            "mission: m\ninputs: {a: {type: pose, default: 1 m}}\ntree: {fail: x}",
            "2:35 the default of 'a': a pose is",
        ),
    ],
)
def test_what_is_wrong_with_the_head(head, problem):
    found = [
        f"{f.line}:{f.column} {f.message} | {', '.join(f.valid)}" for f in parse_mission(head, FILE).findings
    ]
    assert len(found) == 1
    assert found[0].startswith(problem)


def test_values():
    params = node(
        'go: {a: 5 m, b: $key, c: "5", d: "to $x and ${y}s", e: $$5, f: {x: 1 m, y: $y, yaw: 0}, '
        'g: "${x}-${y}"}'
    )
    values = {name.text: value for name, value in params.inputs}
    assert values["a"].text == "5 m" and not values["a"].quoted
    assert isinstance(values["b"], Reference) and values["b"].key == "key"
    assert values["c"].quoted
    assert isinstance(values["d"], Template)
    assert [p if isinstance(p, str) else p.key for p in values["d"].parts] == ["to ", "x", " and ", "y", "s"]
    assert isinstance(values["e"], Literal) and values["e"].text == "$5"
    assert isinstance(values["f"], PoseParts) and values["f"].y.key == "y"
    assert [p if isinstance(p, str) else p.key for p in values["g"].parts] == ["x", "-", "y"]
    assert [model.show(value) for value in values.values()] == [
        *["5 m", "$key", "5", "to $x and $ys", "$5"],
        "{x: 1 m, y: $y, yaw: 0}",
        "$x-$y",
    ]


def test_every_kind():
    tree = node(
        """
sequence:
  - selector: [{fail: no, code: nope}]
    memory: false
  - parallel: [{wait: 1 s}, {wait: 2 s}]
    policy: any
  - retry: 3
    on: [a, b]
    attempt: n
    do: {wait: 1 s}
  - repeat: $n
    do: {wait: 1 s}
  - timeout: 1 s
    do: {wait: 1 s}
  - invert: {succeed: {wait: 1 s}}
  - set: {a: 1, b: $a}
  - run: other
    with: {x: 1}
    out: {y: $z}
  - go:
    out: {pose: p}
"""
    )
    selector, parallel, retry, repeat, timeout, invert, set_, run, go = tree.children
    assert (selector.memory, selector.children[0].code.text) == (False, "nope")
    assert parallel.policy.kind is kinds.PolicyKind.ANY
    assert ([code.text for code in retry.on], retry.attempt_key.text) == (["a", "b"], "n")
    assert repeat.rounds.key == "n"
    assert isinstance(timeout, kinds.Timeout)
    assert isinstance(invert.child, kinds.Succeed)
    assert [key.text for key, _ in set_.values] == ["a", "b"]
    assert [(output.text, key.text) for output, key in run.outputs] == [("y", "z")]
    assert (go.skill, go.inputs, go.mapping_given) == ("go", (), True)
    assert [part.title for part in tree.children] == [
        *["selector", "parallel", "retry up to 3 times", "repeat $n times", "within 1 s"],
        *["not try wait 1 s", "set a, b", "run other", "go"],
    ]


def test_modifiers_of_every_node():
    tree = node('wait: 1 s\nname: rest\nbecause: "no $x"\nfinally: {stop: }')
    assert (tree.title, tree.cleanup.skill, model.show(tree.reasons.always)) == ("rest", "stop", "no $x")
    tree = node("wait: 1 s\nbecause: {timed_out: too late}")
    assert (tree.reasons.always, tree.reasons.by_code["timed_out"].text) == (None, "too late")


@pytest.mark.parametrize(
    ("tree", "problem"),
    [
        ("tree: stop", "2:7 'stop' is not a node: a node is a name, a colon and a space | stop:"),
        ("tree: []", "2:7 one node is needed here, not a list | sequence: with the list below it"),
        ("tree: wait 1 s", "2:7 'wait 1 s' is not a node: a node is a name, a colon and a space | wait: 1 s"),
        (
            "tree: {sequence: [wait:1 s]}",
            "2:19 'wait:1 s' is not a node: a node is a name, a colon and a space | wait: 1 s",
        ),
        ("tree: {name: x}", "2:7 this node has no kind | sequence, selector"),
        ("tree: {go: {}, stop: {}}", "2:16 a node has exactly one kind, not 'go' and 'stop'"),
        ("tree: {go: {}, becuase: x}", "2:16 unknown modifier 'becuase' | because"),
        ("tree: {sequence: }", "2:18 sequence needs a list of nodes"),
        ("tree: {sequence: []}", "2:18 sequence needs a list of nodes"),
        ("tree: {sequence: {go: }}", "2:18 sequence needs a list of nodes"),
        ("tree: {sequence: [{go: }], memory: maybe}", "2:36 memory cannot be 'maybe' | true, false"),
        (
            "tree: {sequence: [{go: }], policy: any}",
            "2:28 'policy' does not belong to 'sequence' but to parallel",
        ),
        ("tree: {parallel: [{go: }], policy: some}", "2:36 policy cannot be 'some' | all, any"),
        (
            "tree: {go: {}, do: {stop: }}",
            "2:16 'do' does not belong to 'go' but to for_each and retry and repeat and timeout",
        ),
        ("tree: {retry: 3}", "2:8 retry needs a node under `do`"),
        ("tree: {retry: , do: {go: }}", "2:15 retry has no value"),
        ("tree: {wait: [{x: 1 m}]}", "2:15 an item of wait: the pose lacks y, yaw"),
        ("tree: {wait: $}", "2:14 a lone $ in '$' | $key, $$ for a dollar sign"),
        ("tree: {go: {a: $Key}}", "2:16 keys have lower-case letters, not $Key in '$Key' | $key, $$"),
        ("tree: {go: {A: 1}}", "2:13 a name in go must be a name"),
        ("tree: {go: {a: {x: 1 m, y: 1 m}}}", "2:16 'a': the pose lacks yaw"),
        ("tree: {go: {a: {x: 1 m, y: 1 m, yaw: 0, z: 1}}}", "2:41 unknown part of a pose 'z'"),
        ("tree: {set: {}}", "2:13 set needs keys and values"),
        ("tree: {set: 5}", "2:13 set must be a mapping"),
        ("tree: {run: Other}", "2:13 run must be a name of lower-case"),
        ("tree: {go: {}, out: [a]}", "2:21 out must be a mapping"),
        ("tree: {go: {}, name: }", "2:22 name must be text"),
        ("tree: {fail: {a: b}}", "2:14 fail must be text"),
        ("tree: {go: {}, because: [a]}", "2:25 because must be text, not a list"),
        ("tree: {go: {out: {a: b}}}", "2:13 'out' stands among the inputs of go | out indented like go"),
        ("tree: {invert: }", "2:16 a node is missing here"),
    ],
)
def test_what_is_wrong_with_nodes(tree, problem):
    found = problems(tree)
    assert found[0].startswith(problem), found


def test_all_problems_at_once_and_what_can_be_read_is_kept():
    mission = parse(
        """\
tree:
  sequence:
    - stop
    - wait:
    - go: {a: 1}
"""
    )
    assert [finding.line for finding in mission.findings] == [4, 5]
    assert [child.title for child in mission.tree.children] == ["go"]


def test_default_is_in_si_units():
    mission = parse("inputs: {phi: {type: angle, default: 90 deg}}\ntree: {fail: x}\n")
    assert mission.inputs["phi"].default == pytest.approx(math.pi / 2)
