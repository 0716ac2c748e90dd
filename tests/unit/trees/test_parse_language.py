"""Branches, guards, policies, keys and expressions: from the file to the model, and what is wrong there."""

from pathlib import Path

import pytest

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.trees.kinds import (
    CallMission,
    Condition,
    If,
    Once,
    OnFailure,
    Parallel,
    PolicyKind,
    Repeat,
    RunSkill,
    Sequence,
    Switch,
    Timeout,
    Until,
)
from florence_bt.trees.language.model import Expression, Template, references, show, walk
from florence_bt.trees.language.parse import parse_mission
from florence_bt.trees.language.vocabulary import ANYWHERE


def parse(tree, head=""):
    """A mission whose tree begins in line 3."""
    return parse_mission(f"mission: m\n{head or 'description: d'}\ntree: {tree}\n", Path("m.yaml"))


def node(tree):
    mission = parse(tree)
    assert mission.findings == ()
    return mission.tree


def findings(tree, head=""):
    return [f"{f.line}:{f.column} {f.message} | {', '.join(f.valid)}" for f in parse(tree, head).findings]


def test_if_with_an_expression_and_with_a_node():
    found = node("{if: $d < 1 m, then: {work: }, else: {other: }, memory: false}")
    assert isinstance(found, If) and isinstance(found.condition, Expression)
    assert (found.condition.text, found.memory, found.title) == ("$d < 1 m", False, "if $d < 1 m")
    assert [part.title for part in found.parts] == ["work", "other"]
    asked = node("{if: {is_home: }, then: {work: }}")
    assert isinstance(asked.condition, RunSkill) and asked.otherwise is None and asked.memory
    assert [part.title for part in walk(asked)] == ["if is home", "is home", "work"]


def test_switch():
    found = node("{switch: $mode, cases: {fast: {work: }, '5': {other: }}, default: {run: called}}")
    assert isinstance(found, Switch) and isinstance(found.default, CallMission)
    assert [(literal.text, literal.quoted) for literal, _ in found.cases] == [("fast", False), ("5", True)]
    assert found.title == "switch $mode"


@pytest.mark.parametrize(
    ("tree", "kind", "title"),
    [
        ("{timeout: $pause, do: {work: }}", Timeout, "within $pause"),
        ("{once: {work: }}", Once, "once work"),
        ("{repeat: forever, do: {work: }}", Repeat, "repeat forever"),
        ("{work: , until: $a, code: late}", Until, "work until $a"),
        ("{work: , on_failure: {any: {wait: 1 s}}}", OnFailure, "work"),
        ("{work: , until: $a, on_failure: {any: {wait: 1 s}}, name: all}", OnFailure, "all"),
        ("{condition: $a and $b}", Condition, "$a and $b"),
    ],
)
def test_small_nodes(tree, kind, title):
    found = node(tree)
    assert (type(found), found.title) == (kind, title)


@pytest.mark.parametrize(
    ("policy", "kind", "text", "needed"),
    [
        ("all", PolicyKind.ALL, "all", 2),
        ("any", PolicyKind.ANY, "any", 1),
        ("[work]", PolicyKind.SELECTED, "[work]", 1),
        ("{succeed: 2, fail: 1}", PolicyKind.COUNTED, "{succeed: 2, fail: 1}", 2),
        ("{succeed: 1}", PolicyKind.COUNTED, "{succeed: 1}", 1),
    ],
)
def test_policies(policy, kind, text, needed):
    found = node(f"{{parallel: [work: , other: ], policy: {policy}}}")
    assert isinstance(found, Parallel)
    assert (found.policy.kind, str(found.policy), found.policy.successes_needed(2)) == (kind, text, needed)


def test_guards_stand_on_every_node():
    found = node("{sequence: [{work: , when: $a, while: not $c}], while: $d == 1}")
    assert isinstance(found, Sequence) and found.holds.text == "$d == 1"
    assert [guard.text for guard in found.children[0].guards] == ["$a", "not $c"]


def test_declared_keys():
    mission = parse("{work: }", "keys: {n: {type: integer, default: 3, max: 9}, p: {type: pose}}")
    assert mission.findings == ()
    assert (mission.keys["n"].default, mission.keys["n"].maximum) == (3, 9)
    assert mission.keys["p"].required and mission.keys["p"].kind is Kind.POSE


def test_a_pose_can_be_a_default():
    mission = parse("{work: }", "inputs: {p: {type: pose, default: {x: 1 m, y: 50 cm, yaw: 0}}}")
    assert mission.findings == () and mission.inputs["p"].default == Pose2(1.0, 0.5, 0.0)
    for wrong, column in (("{x: $a, y: 0, yaw: 0}", 37), ("{x: 1, y: 0, yaw: 0}", 37), ("{x: 1 m}", 33)):
        (finding,) = parse("{work: }", f"keys: {{p: {{type: pose, default: {wrong}}}}}").findings
        assert (finding.line, finding.column) == (2, column) and "the default of 'p'" in finding.message


@pytest.mark.parametrize(
    ("written", "text", "column"),
    [
        ("${$d + 0.5 m}", "$d + 0.5 m", 13),
        ("'${$d + 0.5 m}'", "$d + 0.5 m", 14),
        ('"${ min($a, $b) }"', "min($a, $b)", 15),
    ],
)
def test_expressions_as_values_know_their_place(written, text, column):
    (value,) = (value for _, value in node(f"\n  set:\n    x: {'   '}{written}").values)
    assert isinstance(value, Expression)
    assert (value.text, show(value)) == (text, f"${{{text}}}")
    assert (value.position.line, value.position.column) == (5, column)
    first = next(references(value))
    assert (first.position.line, first.position.column - text.index("$")) == (5, column)


@pytest.mark.parametrize("written", ["$d", "${d}", "the ${d}", "$d + 1 m", "$${$d}"])
def test_what_is_no_expression(written):
    (value,) = (value for _, value in node(f"{{set: {{x: '{written}'}}}}").values)
    assert not isinstance(value, Expression)


def test_an_expression_over_several_lines():
    tree = """
  sequence:
    - work:
      when: |
        $a and
        $b
    - work:
      when: $a
        or $b"""
    first, second = node(tree).children
    assert (first.when.text, second.when.text) == ("$a and $b", "$a or $b")
    assert {key.position.line for key in references(first.when)} == {6}


def test_a_text_with_an_expression_in_it_is_refused():
    assert findings("{fail: 'it took ${$n + 1} looks'}") == [
        "3:14 the expression ${$n + 1} must stand alone, not inside text | "
        "set: {key: '${$n + 1}'} first, and $key in the text"
    ]
    (value,) = (value for _, value in node("{set: {x: 'a ${n} b'}}").values)
    assert isinstance(value, Template)


# What is written, and the findings below.
WRONG = """
{if: $a}
    3:8 if needs a node under `then` | then: {a node}

{if: , then: {work: }}
    3:12 if needs an expression | $distance < 1 m, $found and not $done

{if: [work], then: {work: }}
    3:12 if needs an expression | $distance < 1 m, $found and not $done

{if: $a <, then: {work: }}
    3:16 a value is missing after '<' | $key, 1.5 m

{if: $a, then: {work: }, memory: yes}
    3:40 memory cannot be 'yes' | true

{work: , else: {other: }}
    3:16 'else' does not belong to 'work' but to if | {INDENTED}, out, every, {ANYWHERE}

{switch: $m}
    3:8 switch needs cases | cases: {value: node, value: node}

{switch: $m, cases: [work: ]}
    3:27 switch needs cases | cases: {value: node, value: node}

{switch: , cases: {a: {work: }}}
    3:16 switch has no value | a value, quotes round it: "..."

{force: failure, do: {work: }}
    3:8 there is no skill and no kind of node 'force' | succeed: the node, or a sequence that ends with fail

{delay: 2 s, do: {work: }}
    3:8 there is no skill and no kind of node 'delay' | sequence: [{wait: 2 s}, the node]

{cooldown: 2 s, do: {work: }}
    3:8 there is no skill and no kind of node 'cooldown' | sequence: [the node, {wait: 30 s}], in a repeat

{timeout: 2 s}
    3:8 timeout needs a node under `do` | do: {a node}

{timeout: , do: {work: }}
    3:17 timeout has no value | a value, quotes round it: "..."

{once: work}
    3:14 'work' is not a node: a node is a name, a colon and a space | work:

{condition: }
    3:19 condition needs an expression | $distance < 1 m, $found and not $done

{work: , when: room == 3}
    3:22 'room' is neither a key nor text | $room, "room"

{work: {when: $a}}
    3:15 'when' stands among the inputs of work | when indented like work

{work: , whn: $a}
    3:16 unknown modifier 'whn' | when

{parallel: [work: ], policy: some}
    3:36 policy cannot be 'some' | all, any, [the name of a branch], {succeed: 2, fail: 1}

{parallel: [work: ], policy: []}
    3:36 no branch is named | [work]

{parallel: [work: ], policy: {fail: 1}}
    3:36 the policy lacks succeed | {succeed: 2, fail: 1}

{parallel: [work: ], policy: {succeed: 0}}
    3:46 succeed must be a number of branches | succeed: 1

{parallel: [work: ], policy: {succeed: [1]}}
    3:46 succeed must be a number of branches | succeed: 1

{parallel: [work: ], policy: {succeed: 1, fails: 1}}
    3:49 unknown key of a policy 'fails' | fail

{set: {x: '${$a ! 3}'}}
    3:23 '!' is not known here | not
"""


INDENTED = "else indented like the if that it belongs to"


@pytest.mark.parametrize(
    "written",
    WRONG.replace("{ANYWHERE}", ", ".join(ANYWHERE)).replace("{INDENTED}", INDENTED).strip().split("\n\n"),
)
def test_what_is_wrong(written):
    tree, *expected = (line.strip() for line in written.splitlines())
    assert [finding.strip() for finding in findings(tree)] == expected


KEYS = """
keys: {n: {default: 3}}
    2:11 'n' needs a type | text, boolean, integer, number, length, angle, duration, speed, pose, list of text

keys: {n: {type: integer, default: x}}
    2:36 the default of 'n': a whole number is needed, not 'x' | 3

keys: {n: integer}
    2:8 a key is a mapping with its type | n: {type: integer}

inputs: {n: {type: text}} // keys: {n: {type: text}}
    3:8 'n' is an input, which is a key already |

outputs: {n: {type: text}} // keys: {n: {type: pose}}
    3:8 'n' is a pose here and a text as output | type: text
"""


@pytest.mark.parametrize("written", KEYS.strip().split("\n\n"))
def test_wrong_declarations_of_keys(written):
    head, *expected = (line.strip() for line in written.splitlines())
    assert [finding.strip() for finding in findings("{work: }", head.replace(" // ", "\n"))] == expected


@pytest.mark.parametrize(
    ("tree", "valid"),
    [
        ("{set: {x: ${$a + 1 m}}}", 'quotes round it: "${...}"'),
        ('\n  condition: "hall" == $room', "quotes round the whole value: '\"hall\" == $room'"),
        ("\n  condition: 'hall' == $room", "quotes round the whole value: \"'hall' == $room\""),
    ],
)
def test_what_only_lacks_quotes_for_yaml(tree, valid):
    with pytest.raises(ConfigError, match="not YAML") as caught:
        parse(tree)
    assert caught.value.valid == (valid,)
