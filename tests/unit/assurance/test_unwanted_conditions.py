"""Properties over the values of keys: whatever a value may be counts, and nothing is taken for granted."""

from pathlib import Path

import pytest

from florence_bt.assurance.report import text_of
from florence_bt.assurance.scenario import write_scenario
from florence_bt.core.errors import ConfigError

COMES_NEAR = """
  sequence:
    - look_for_user: {}
      out: {distance: far, user: user}
    - turn: {angle: 90 deg}
      when: $far >= 1 m
    - wait: 1 s
"""
COUNTS = """
  sequence:
    - set: {tries: 0}
    - retry: 3
      do:
        sequence:
          - add: {tries: 1}
          - turn: {angle: 90 deg}
    - drive_straight: {distance: 1 m}
"""
LIT = """
  sequence:
    - set: {lit: true}
    - turn: {angle: 90 deg}
    - set: {lit: false}
"""
CLEANS_UP = f"{LIT}  finally:\n    set: {{lit: false}}\n"
LIT_HEAD = "keys:\n  lit: {type: boolean, default: false}"
HOLDS = [
    (COMES_NEAR, "", "never: turn while $far < 1 m"),
    (COMES_NEAR, "", "never: $far < 50 cm while turn"),
    (COMES_NEAR, "", "never: turn begins while $far < 1 m"),
    (COMES_NEAR, "", "never: turn while $far < 1 m and $far > 0.5 m"),
    (COMES_NEAR, "", "never: $far != $far"),
    (COUNTS, "", "never: $tries > 3"),
    (COUNTS, "", "never: drive_straight while $tries == 0"),
    (COUNTS, "", "never: it succeeds while $tries < 1"),
    (CLEANS_UP, LIT_HEAD, "never: it ends while $lit"),
    (LIT, LIT_HEAD, "never: it succeeds while $lit"),
]
BREAKS = [
    (COMES_NEAR, "", "never: turn while $far < 2 m"),
    (COMES_NEAR, "", "never: $far > 3 m"),
    (COMES_NEAR, "", "never: $user.x > 3 m"),
    (COMES_NEAR, "", "never: turn fails while $far > 3 m"),
    (COMES_NEAR, "", "never: it succeeds while $far < 1 m"),
    (COMES_NEAR, "", "never: it is stopped while $far < 1 m"),
    (COUNTS, "", "never: $tries > 2"),
    (COUNTS, "", "never: drive_straight while $tries == 3"),
    (COUNTS, "", "never: turn fails with collision_ahead while $tries == 3"),
    (LIT, LIT_HEAD, "never: it ends while $lit"),
    (LIT, LIT_HEAD, "never: turn while $lit"),
    ("  turn: {angle: $angle}\n", "inputs:\n  angle: {type: angle}", "never: turn while $angle > 90 deg"),
]


def with_property(tmp_path: Path, text: str) -> None:
    (tmp_path / "tried.properties.yml").write_text(f"properties:\n  - {text}\n")


@pytest.mark.parametrize(("tree", "head", "text"), HOLDS)
def test_what_holds_whatever_the_values_are(verify, tmp_path: Path, tree: str, head: str, text: str):
    with_property(tmp_path, text)
    verdict = verify(tree, head)
    assert verdict.holds, text_of(verdict)


@pytest.mark.parametrize(("tree", "head", "text"), BREAKS)
def test_what_some_value_breaks(verify, tmp_path: Path, tree: str, head: str, text: str):
    with_property(tmp_path, text)
    [problem] = verify(tree, head).broken
    assert any(each.what == "unwanted" for each in problem.path[-1].happened)


def test_the_way_says_where_the_condition_holds(verify, tmp_path: Path):
    with_property(tmp_path, "{never: it ends while $lit, because: The light is left on.}")
    report = text_of(verify(LIT, LIT_HEAD))
    assert "broken: The light is left on." in report
    assert "here it holds: it ends while $lit" in report
    assert "tried.properties.yml:2" in report


def test_a_condition_without_a_value_does_not_hold(verify, tmp_path: Path):
    """Before the user was seen nobody knows how far they are; nor is 1 divided by 0 anything."""
    with_property(tmp_path, "never: look_for_user while $far < 1 m")
    assert verify(COMES_NEAR).holds
    with_property(tmp_path, "never: 1 / $tries > 2")
    assert verify(COUNTS).holds


def test_the_lengths_of_lists_are_said(verify, tmp_path: Path):
    with_property(tmp_path, "never: turn while count($rooms) > 2")
    tree = "  sequence:\n    - get_rooms: {}\n      out: {rooms: rooms}\n    - turn: {angle: 90 deg}\n"
    assert verify(tree).assumed == ("lists have up to 2 items",)


def test_what_is_taken_as_it_stands_is_said(verify, tmp_path: Path):
    with_property(tmp_path, "never: $tries > 3")
    head = "inputs:\n  tries: {type: integer, default: 3}"
    assert verify("  retry: $tries\n  do: {turn: {angle: 90 deg}}\n", head).assumed == ("tries is 3",)


def test_a_text_that_is_put_together_is_said(verify, tmp_path: Path):
    look = "  sequence:\n    - look_for_user: {}\n      out: {posture: posture}\n"
    tree = f"{look}    - set: {{line: it is $posture}}\n"
    with_property(tmp_path, 'never: $line == "it is lying"')
    assert verify(tree).assumed == ("the text line is made of values that stand for others",)
    with_property(tmp_path, 'never: $posture == "lying"')
    assert not verify(tree).assumed


def test_the_scenario_has_the_values_that_break_it(verify, tmp_path: Path):
    with_property(tmp_path, "never: turn while $far < 2 m")
    verdict = verify(COMES_NEAR)
    file = tmp_path / "scenarios" / "it.yaml"
    assert write_scenario(verdict.explored, verdict.broken[0], file), text_of(verdict)
    assert "not_called: turn" in file.read_text()


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("never: $far < 1 m while $far > 2 m", "two conditions are one"),
        ("never: turn begins while wait ends", "one must last"),
        ("never: it ends while turn", "one must last"),
        ("never: turn while $nothing", "no key 'nothing'"),
        ("never: turn while $far < 3", "needs two of one kind"),
        ("never: turn while $far", "is a length"),
        ("never: turn while $far <", "a value is missing"),
        ("never: it fails with unheard_of", "nothing fails with"),
        ("{never: turn, within: 3 s}", "'within' does not belong to 'never'"),
    ],
)
def test_what_cannot_be_meant_is_refused_with_its_line(verify, tmp_path: Path, text: str, problem: str):
    with_property(tmp_path, text)
    with pytest.raises(ConfigError, match=problem) as refused:
        verify(COMES_NEAR)
    assert refused.value.line == 2
    assert refused.value.valid
