"""``code``: what a failure is called; and groups: one word for several codes."""

import pytest

from florence_bt.core.declaration import CodeGroup, SkillDeclaration
from florence_bt.core.outcome import failure
from florence_bt.trees.language.code_groups import by_code, codes_named, groups_of
from florence_bt.trees.language.declarations import own_declarations
from florence_bt.trees.language.declared_skills import read_skills_file, skills_document
from tests.unit.trees.language import ENDLESS, Play, takes

HEAD = "inputs: {n: {type: integer, default: 5}}\n"


# The node | what the mission ends with
@pytest.mark.parametrize(
    ("tree", "code"),
    [
        ("{condition: $n < 3}", "condition_false"),
        ("{condition: $n < 3, code: too_many}", "too_many"),
        ("{condition: $n == 5, code: too_many}", "success"),
        ("{invert: {work: }}", "unexpected_success"),
        ("{invert: {work: }, code: still_there}", "still_there"),
        ("{work: , while: $n < 3, code: too_many}", "too_many"),
        ("{work: , while: $n < 3, code: too_many, finally: {clean: }}", "too_many"),
        ("{sequence: [{work: }, {fail: x, code: odd}], while: $n > 3, code: too_many}", "odd"),
    ],
)
def test_a_failure_has_the_name_that_the_author_gives(tmp_path, tree, code):
    assert Play(tmp_path, f"{HEAD}tree: {tree}").run() == code


def test_a_node_that_is_stopped_by_while_fails_with_the_name(tmp_path):
    text = """\
keys: {n: {type: integer, default: 5}}
tree:
  parallel:
    - work:
      while: $n == 5
      code: changed
    - sequence: [{wait: 2 s}, {set: {n: 6}}, {wait: 1 s}]
"""
    play = Play(tmp_path, text, work=[ENDLESS])
    assert (play.run(), play.ended[0][:2]) == ("changed", (2.0, "work"))


@pytest.mark.parametrize(
    ("tree", "line"),
    [
        (
            "{wait: 1 s, code: x}",
            "'code' does not belong to 'wait' but to for_each and invert and condition and fail and a node",
        ),
        (
            "{condition: $n < 3, while: $n < 4, code: x}",
            "code: it is not clear whether that is about 'condition' or",
        ),
        ("{condition: $n < 3, code: Not So}", "code must be a name of lower-case letters"),
        (
            "{retry: 2, on: [condition_false], do: {condition: $n < 3, code: x}}",
            "cannot fail with 'condition_false'",
        ),
        ("{retry: 2, on: [not_so], do: {condition: $n < 3}}", "cannot fail with 'not_so' | condition_false"),
        (
            "{retry: 2, on: [inverted], do: {invert: {turn: {angle: 1 rad}}}}",
            "with 'inverted' | unexpected_success",
        ),
        ("{sequence: [{condition: $n < 3}, {retry: 2, on: [unreachable], do: {turn: {angle: 1 rad}}}]}", ""),
        (
            "{retry: 2, on: [unreachable], do: {condition: $n < 3}}",
            "with any code of the group 'unreachable'",
        ),
        (
            "{retry: 2, on: [unreachabel], do: {turn: {angle: 1 rad}}}",
            "cannot fail with 'unreachabel' | unreachable",
        ),
        (
            "{condition: $n < 3, because: {not_found: x}}",
            "cannot fail with any code of the group 'not_found'",
        ),
    ],
)
def test_what_the_check_says(workshop, tree, line):
    found = workshop.lines(f"{HEAD}tree: {tree}\n")
    assert any(line in each for each in found) if line else found == [], found


WORDS = """\
tree:
  retry: 3
  on: [trouble]
  because: {trouble: it does not work, broken: it broke down}
  do: {work: }
"""


@pytest.mark.parametrize(
    ("code", "started", "reason"),
    [("broken", 3, "it broke down"), ("jammed", 3, "it does not work"), ("tired", 1, "as the test wants")],
)
def test_a_group_stands_for_its_codes(tmp_path, monkeypatch, code, started, reason):
    skill = SkillDeclaration(
        "work",
        "Work",
        failures={"broken": "", "jammed": "", "tired": ""},
        groups=(CodeGroup("trouble", frozenset({"broken", "jammed"})),),
    )
    monkeypatch.setitem(Play.run.__globals__["DECLARATIONS"], "work", skill)
    play = Play(tmp_path, WORDS, work=[takes(1.0, failure(code, "as the test wants"))])
    assert (play.run(), len(play.started), play.why.reason) == (code, started, reason)


def test_a_code_counts_before_a_group_and_a_group_has_its_own_name():
    groups = {"far": CodeGroup("far", frozenset({"a", "b"}))}
    assert codes_named("far", groups) == {"far", "a", "b"}
    assert by_code([("far", 1), ("b", 2), ("c", 3)], groups) == {"far": 1, "a": 1, "b": 2, "c": 3}


def test_the_skills_declare_groups_together():
    groups = groups_of(own_declarations())
    assert set(groups) == {"unreachable", "not_found", "stopped_by_base"}
    assert {"no_path", "pose_occupied", "timed_out"} <= groups["unreachable"].codes
    assert groups["not_found"].codes == {"no_user_seen", "user_not_in_view", "user_lost"}
    declared = own_declarations()
    known = {code for skill in declared.values() for code in skill.failures} | {"timed_out"}
    assert all(group.meaning and group.codes <= known for group in groups.values())


def test_a_file_of_skills_declares_groups(tmp_path):
    file = tmp_path / "more.skills.yaml"
    file.write_text("skills:\n  lift:\n    failures: {stuck: it hangs}\n    groups: {unreachable: [stuck]}\n")
    (lift,) = read_skills_file(file).declarations.values()
    assert lift.groups == (CodeGroup("unreachable", frozenset({"stuck"})),)
    assert skills_document([lift])["skills"]["lift"]["groups"] == {"unreachable": ["stuck"]}
    file.write_text(
        "skills:\n  lift:\n    failures: {stuck: it hangs}\n    groups: {Far: [stuck], near: [Odd One]}\n"
    )
    assert len(read_skills_file(file).findings) == 2
