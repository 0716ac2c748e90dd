"""What the check says of waiting that nothing ends, loops without end, exact comparisons and groups in vain."""

# ruff: noqa: E501  (missions on one line)

from dataclasses import replace

import pytest

from florence_bt.core.declaration import CodeGroup, Kind, Port, SkillDeclaration
from florence_bt.trees.language.declared_skills import read_skills_file

N = "keys: {n: {type: integer, default: 0}}\n"
WRITE = "sequence: [{wait: 1 s}, {add: {n: 1}}]"
NOBODY = "nothing that runs meanwhile writes $n"


@pytest.mark.parametrize(
    ("tree", "line"),
    [
        ("wait_until: $n == 2", f"wait_until: {NOBODY}"),
        ("wait_until: {selector: [{condition: $n == 7}, {condition: $n == 1}]}", f"wait_until: {NOBODY}"),
        (f"sequence: [{{wait_until: $n == 2}}, {{{WRITE}}}]", f"wait_until: {NOBODY}"),
        (
            f"parallel: [{{wait: 1 s}}, {{sequence: [{{wait_until: $n == 2}}, {{{WRITE}}}]}}]",
            f"wait_until: {NOBODY}",
        ),
        (f"parallel: [{{wait_until: $n == 2}}, {{{WRITE}}}]", ""),
        (f"parallel: [{{sequence: [{{wait_until: $n == 2}}]}}, {{invert: {{{WRITE}}}}}]", ""),
        ("parallel: [{wait_until: $n == 2}, {wait: 1 s, finally: {set: {n: 2}}}]", ""),
        (f"wait_until: $n == 2, until: {{{WRITE}}}", ""),
        ("sequence: [{is_charged: }, {wait_until: $n == 2}], memory: false", f"wait_until: {NOBODY}"),
        (
            "sequence: [{get_hotspot: {label: x}, out: {pose: p}}, {wait_until: $p.x > 1 m}], memory: false",
            "",
        ),
        ("wait_until: {sequence: [{is_charged: }, {condition: $n == 0}]}", ""),
        ("wait_until: {sequence: [{add: {n: 1}}, {condition: $n == 3}]}", ""),
        ("repeat: forever, do: {wait: 1 s}, until: $n == 3", f"until: {NOBODY}"),
        (f"repeat: forever, do: {{{WRITE}}}, until: $n == 3", ""),
        ("repeat: 3, do: {wait: 1 s}, while: $n < 3", f"while: {NOBODY} | when: $n < 3"),
        (f"repeat: 3, do: {{{WRITE}}}, while: $n < 3", ""),
        (f"parallel: [{{wait: 9 s, while: $n < 3}}, {{{WRITE}}}]", ""),
    ],
)
def test_something_must_write_what_is_waited_for(workshop, tree, line):
    found = [each for each in workshop.lines(f"{N}tree: {{{tree}}}\n") if "meanwhile" in each]
    assert (len(found) == 1 and line in found[0]) if line else found == [], found


ENDLESS = "repeat: forever, do: {wait: 1 s}"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (f"tree: {{{ENDLESS}}}", ""),
        (f"tree: {{repeat: forever, do: {{{ENDLESS}}}}}", "there is never a second round"),
        (f"tree: {{repeat: forever, do: {{succeed: {{{ENDLESS}}}}}}}", "there is never a second round"),
        (f"tree: {{repeat: 2, do: {{sequence: [{{{ENDLESS}}}, {{turn: {{angle: 1 rad}}}}]}}}}", "'turn' is never reached"),
        (f"tree: {{sequence: [{{succeed: {{{ENDLESS}}}}}, {{wait: 2 s}}]}}", "'wait 2 s' is never reached"),
        (f"tree: {{sequence: [{{for_each: [1], as: x, do: {{{ENDLESS}, until: $x == 1}}}}, {{wait: 2 s}}]}}", "until: nothing"),
        (f"tree: {{sequence: [{{for_each: [a], as: x, do: {{sequence: [{{{ENDLESS}}}], name: $x}}}}, {{wait: 2 s}}]}}", "never a second item"),
        ("tree: {retry: forever, do: {sequence: [{wait: 1 s}, {fail: no}]}}", "the retry never ends: 'sequence' never succeeds"),
        ("tree: {retry: forever, on: [no], do: {sequence: [{turn: {angle: 1 rad}}, {fail: no, code: no}]}}", ""),
        (f"tree: {{wait: 1 s, finally: {{{ENDLESS}}}}}", "finally: 'repeat forever' never ends"),
        (f"tree: {{wait: 1 s, finally: {{timeout: 5 s, do: {{{ENDLESS}}}}}}}", "how a clean-up ends changes nothing"),
        (f"outputs: {{n: {{type: integer}}}}\n{N}tree: {{repeat: forever, do: {{{WRITE}}}}}", "the output 'n' is never given"),
        (f"outputs: {{n: {{type: integer}}}}\n{N}tree: {{repeat: forever, do: {{{WRITE}}}, until: $n == 3}}", ""),
    ],
)  # fmt: skip
def test_what_never_ends(workshop, text, line):
    found = [each for each in workshop.lines(f"{text}\n") if "nothing reads" not in each]
    assert any(line in each for each in found) if line else found == [], found


@pytest.mark.parametrize(
    ("tree", "threshold"),
    [
        ("if: {full: {charge: 0.3}}, then: {wait: 1 s}, memory: false", "full"),
        ("if: {full: {charge: 0.3}}, then: {wait: 1 s}, else: {wait: 2 s}", ""),
        (
            "if: {sequence: [{is_charged: }, {invert: {full: {charge: 0.3}}}]}, then: {wait: 1 s}, memory: false",
            "full",
        ),
        ("if: $d < 1 m, then: {wait: 1 s}, memory: false", "$d < 1 m"),
        ("if: not ($n > 3 or $p.x >= 2 m), then: {wait: 1 s}, memory: false", "not ($n > 3 or $p.x >= 2 m)"),
        ("if: $n > 3, then: {wait: 1 s}, memory: false", ""),
        ("if: {is_charged: }, then: {wait: 1 s}, memory: false", ""),
        ("selector: [{full: {charge: 0.3}}, {wait: 1 s}], memory: false", "full"),
        ("selector: [{condition: $d < 1 m}, {wait: 1 s}], memory: false", "$d < 1 m"),
        ("selector: [{is_charged: }, {full: {charge: 0.3}}], memory: false", ""),
        ("sequence: [{full: {charge: 0.3}}, {wait: 1 s}], memory: false", ""),
        ("repeat: forever, do: {wait: 1 s}, until: {full: {charge: 0.3}}", ""),
    ],
)
def test_a_threshold_by_which_branches_take_over_from_each_other(workshop, tree, threshold):
    full = SkillDeclaration("full", "Ask", {"charge": Port(Kind.NUMBER, "")}, {}, {"low": "no"}, instant=True)
    workshop.declarations = {**workshop.declarations, "full": full}
    head = f"{N}tree: {{sequence: [{{look_for_user: , out: {{user: p, distance: d}}}}, "
    found = workshop.lines(f"{head}{{{tree}}}]}}\n")
    found = [each for each in found if "is a threshold" in each]
    assert (len(found) == 1 and f"'{threshold}' is a threshold" in found[0]) if threshold else found == [], (
        found
    )


LOOK = "{look_for_user: , out: {user: p, distance: d}}, {get_hotspot: {label: x}, out: {pose: q}}"


@pytest.mark.parametrize(
    ("condition", "remedy"),
    [
        ("$p == $q", "distance($p, $q) < 0.1 m"),
        ("$n == 0 and $p != $q", "distance($p, $q) >= 0.1 m"),
        ("$d == 1 m", "abs($d - 1 m) < 0.1 m"),
        ("$p.x == 0", "abs($p.x) < 0.1 m"),
        ("$p.yaw != 90 deg", "abs($p.yaw - 90 deg) >= 5 deg"),
        ("distance($p, $q) == 2 m", "abs(distance($p, $q) - 2 m) < 0.1 m"),
        ("$p in $places", ""),
        ("$far == 1 m", None),
        ("$n == 2", None),
        ("$d <= 1 m", None),
    ],
)
def test_measured_values_are_hardly_ever_the_same(workshop, condition, remedy):
    head = "inputs: {far: {type: length}, places: {type: list of pose}, n: {type: integer}}\n"
    found = workshop.lines(f"{head}tree: {{sequence: [{LOOK}, {{condition: '{condition}'}}]}}\n")
    found = [each for each in found if "the last digit" in each]
    assert found == [] if remedy is None else len(found) == 1 and found[0].endswith(f" | {remedy}"), found


@pytest.mark.parametrize(
    ("node", "line"),
    [
        ("turn: {angle: 1 rad}, on_failure: {far_off: {wait: 1 s}}", ""),
        (
            "is_charged: , on_failure: {far_off: {wait: 1 s}}",
            "on_failure: 'is charged' has of the group 'far_off' only timed_out",
        ),
        (
            "retry: 2, on: [far_off], do: {is_charged: }",
            "what is retried has of the group 'far_off' only timed_out",
        ),
        (
            "for_each: [1], as: x, go_on_over: [far_off], do: {is_charged: , name: $x}",
            "go_on_over: '$x' has of the group",
        ),
        (
            "is_charged: , because: {far_off: no}",
            "because: 'is charged' has of the group 'far_off' only timed_out",
        ),
        ("is_charged: , on_failure: {timed_out: {wait: 1 s}}", ""),
    ],
)
def test_a_group_of_which_a_node_has_no_code_of_its_own(workshop, node, line):
    far_off = CodeGroup("far_off", frozenset({"blocked", "timed_out"}), "not there")
    turn = workshop.declarations["turn"]
    workshop.declarations = {**workshop.declarations, "turn": replace(turn, groups=(far_off,))}
    found = [each for each in workshop.lines(f"tree: {{{node}}}\n") if "nothing reads" not in each]
    assert any(line in each for each in found) if line else found == [], found


GROUPED = """\
groups:
  hard: [stuck, jammed]
skills:
  close:
    failures: {stuck: it does not move}
    groups: {broken: [stuck]}
  open: {failures: {stuck: it does not move}, groups: [hard]}
  shut: {failures: {jammed: something is in it}, groups: [hard]}
"""


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ("", "", ""),
        ("{broken: [stuck]}", "{broken: [stuk]}", "6:23 no skill of this file can fail with 'stuk', a code of the group 'broken' | stuck"),
        ("{broken: [stuck]}", "{broken: {codes: [stuck, lost]}}", "6:38 no skill of this file can fail with 'lost'"),
        ("{broken: [stuck]}", "{broken: [stuck, timed_out]}", ""),
        ("hard: [stuck, jammed]", "hard: [stuck, jamed]", "2:17 no skill of this file can fail with 'jamed'"),
    ],
)  # fmt: skip
def test_a_group_has_only_codes_that_its_skills_have(tmp_path, before, after, says):
    file = tmp_path / "my.skills.yaml"
    file.write_text(GROUPED.replace(before, after))
    found = [
        f"{each.line}:{each.column} {each.message} | {', '.join(each.valid)}"
        for each in read_skills_file(file).findings
    ]
    assert len(found) == 1 and found[0].startswith(says) if says else found == [], found
