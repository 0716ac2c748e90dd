"""What the editor is told of a mission that is verified."""

from __future__ import annotations

import pytest
from florence_page.editor.verification import answer

from florence_bt.app.mission_files.verifying import VerifyOptions, verify_missions

HOLDS = "mission: tea\ntree:\n  wait: 1 s\n"
LEFT_ON = """\
mission: tea
tree:
  sequence:
    - start_tracker:
    - look_for_user: {}
"""
TWICE = """\
mission: tea
properties:
  - at_most: {say: 1}
    because: It gets on people's nerves.
tree:
  repeat: 2
  do: {say: {text: Hello}}
"""


@pytest.fixture
def ask(tmp_path):
    """Verify a text of the mission tea of a folder."""

    def verify(text):
        request = {"text": text, "file": str(tmp_path / "tea.yaml"), "folders": [str(tmp_path)]}
        return answer(request)

    return verify


def test_what_holds(ask):
    answer = ask(HOLDS)
    assert answer["holds"] and answer["headline"] == "holds" and not answer["problems"]
    assert any("all of them" in line for line in answer["facts"])


def test_a_problem_has_its_line_and_the_words_of_the_terminal(ask, tmp_path):
    (tmp_path / "tea.yaml").write_text(LEFT_ON)
    [problem] = ask(LEFT_ON)["problems"]
    assert (problem["line"], problem["severity"], problem["file"]) == (5, "error", "")
    report, _ = verify_missions([str(tmp_path / "tea.yaml")], VerifyOptions())
    assert [line.strip() for line in problem["way"]] == [
        line.strip() for line in report.split("It comes like this:\n")[1].splitlines()
    ]


def test_a_property_is_shown_where_it_stands(ask, tmp_path):
    [problem] = ask(TWICE)["problems"]
    assert (problem["text"], problem["line"], problem["file"]) == ("It gets on people's nerves.", 3, "")
    head, _, tree = TWICE.partition("tree:")
    (tmp_path / "tea.properties.yml").write_text(head.partition("\n")[2])
    [problem] = ask(f"mission: tea\ntree:{tree}")["problems"]
    assert (problem["line"], problem["file"]) == (4, "tea.properties.yml")  # the node that speaks


def test_a_scenario_is_about_what_is_saved(ask, tmp_path):
    assert not ask(TWICE)["problems"][0]["scenario"]
    (tmp_path / "tea.yaml").write_text(TWICE)
    assert "called: {say: 1}" in ask(TWICE)["problems"][0]["scenario"]


def test_why_a_mission_cannot_be_verified(ask):
    assert "sya" in ask("mission: tea\ntree:\n  sya: {text: Hello}\n")["problem"]
