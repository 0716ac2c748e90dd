"""What an author wants to hold is followed through every way of a mission."""

from pathlib import Path

import pytest

from florence_bt.assurance.scenario import write_scenario
from florence_bt.core.errors import ConfigError

SPEAKS = """
  retry: 3
  on: [no_answer]
  do:
    sequence:
      - say: {text: Hello}
      - wait_for_answer:
"""
DRIVES = (
    "  navigate_to: {goal: {x: 1 m, y: 0 m, yaw: 0 deg}}\n"
    "  on_failure:\n    unreachable:\n      sequence:\n        - say: {text: No way}\n        - fail: no\n"
)
BESIDE = "  parallel:\n    - turn: {angle: 90 deg}\n    - look_for_user: {}\n"
HOLDS = [
    (SPEAKS, "at_most: {say: 3}"),
    (SPEAKS, "always_before: {say: wait_for_answer}"),
    (SPEAKS, "never: it ends with blocked"),
    (SPEAKS, "never: say while wait_for_answer"),
    (DRIVES, "{after: navigate_to fails with no_path, eventually: say}"),
    (DRIVES, "{after: navigate_to fails with unreachable, eventually: say, within: 5 s}"),
]
BREAKS = [
    (SPEAKS, "at_most: {say: 2}"),
    (SPEAKS, "always_before: {wait_for_answer: say}"),
    (SPEAKS, "never: it ends with no_answer"),
    (SPEAKS, "never: say fails with not_said"),
    (DRIVES, "{after: navigate_to fails, eventually: say}"),
    (DRIVES, "{after: navigate_to begins, eventually: it ends, within: 1 min}"),
    (BESIDE, "never: turn while look_for_user"),
]


def with_property(tmp_path: Path, text: str) -> None:
    (tmp_path / "tried.properties.yml").write_text(f"properties:\n  - {text}\n")


@pytest.mark.parametrize(("tree", "text"), HOLDS)
def test_what_holds(verify, tmp_path: Path, tree: str, text: str):
    with_property(tmp_path, text)
    assert verify(tree).holds


@pytest.mark.parametrize(("tree", "text"), BREAKS)
def test_what_does_not_hold_has_a_way_to_it(verify, tmp_path: Path, tree: str, text: str):
    with_property(tmp_path, text)
    [problem] = verify(tree).broken
    assert problem.path
    assert problem.kind in text


@pytest.mark.parametrize(("tree", "text"), BREAKS)
def test_what_stands_in_the_mission_itself_counts_alike(verify, tree: str, text: str):
    [problem] = verify(tree, f"properties:\n  - {text}").broken
    assert problem.kind in text
    assert (problem.file.name, problem.position.line) == ("tried.yaml", 3)


def test_the_author_says_why(verify, tmp_path: Path):
    with_property(tmp_path, "{at_most: {say: 2}, because: It gets on people's nerves.}")
    assert [each.text for each in verify(SPEAKS).broken] == ["It gets on people's nerves."]


def test_a_broken_property_becomes_a_scenario(verify, tmp_path: Path):
    with_property(tmp_path, "at_most: {say: 2}")
    verdict = verify(SPEAKS)
    assert write_scenario(verdict.explored, verdict.broken[0], tmp_path / "scenarios" / "it.yaml")


@pytest.mark.parametrize(
    "text",
    [
        "sometimes: say",
        "at_most: {sing: 3}",
        "at_most: {say: often}",
        "at_most: say",
        "never: say sings",
        "after: say",
        "never: [say]",
        "say",
    ],
)
def test_what_cannot_be_read_is_refused_with_its_line(verify, tmp_path: Path, text: str):
    with_property(tmp_path, text)
    with pytest.raises(ConfigError) as refused:
        verify(SPEAKS)
    assert refused.value.line == 2
    assert refused.value.valid
