"""A server that says no: a draft fails then, and the check warns of an answer that nothing reads."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("std_srvs")

from florence_bt.app.mission_files.skill_draft import add_to_file, draft_skill
from florence_bt.core.interfaces import load_interface
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.declared_skills import read_skills_file
from florence_bt.trees.language.loader import MissionLibrary
from tests.made_interfaces import make_interfaces

ANSWERS: dict[str, dict[str, Any]] = {
    "bool ok\nstring why\nfloat32 litres": {"ok": False, "why": "the bed is covered"},
    "bool granted\nstring remark": {"granted": False, "remark": "the bed is covered"},
    "bool refused\nstring hint": {"refused": True, "hint": "the bed is covered"},
    "Outcome outcome\nfloat32 used": {"outcome.text": "the bed is covered"},
    "uint8 OK=0\nuint8 COVERED=1\nuint8 code\nstring detail": {"code": 1, "detail": "the bed is covered"},
    "uint8 OK=0\nuint8 EMPTY=1\nuint8 code\nstring text": {"code": 77, "text": "the bed is covered"},
    "string status\nfloat32 took": {"status": "the bed is covered"},
    "int8 status\nstring hint": {"status": -1, "hint": "the bed is covered"},
    "string error": {"error": "the bed is covered"},
    "string[] errors\nbool[] limits\nstring reason": {"errors": ["7"], "reason": "the bed is covered"},
    "bool[] successes\nstring why": {"successes": [True, False], "why": "the bed is covered"},
    'string OK="ok"\nstring NO="no"\nstring status\nstring text': {
        "status": "no",
        "text": "the bed is covered",
    },
    "uint8 NACK=0\nuint8 ACK=1\nuint8 answer\nstring text": {"answer": 0, "text": "the bed is covered"},
    "uint16 error_code\nstring text": {"error_code": 5, "text": "the bed is covered"},
}


@pytest.mark.parametrize("answer", ANSWERS)
@pytest.mark.parametrize(
    ("way", "kind", "part", "text"),
    [("service", "srv", "Response", "---\n{}"), ("action", "action", "Result", "---\n{}\n---")],
)
def test_a_draft_fails_when_the_server_says_no(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, answer: str, way: str, kind: str, part: str, text: str
) -> None:
    asked = {f"{kind}_Ask": text.format(answer)}
    make_interfaces(monkeypatch, "made_msgs", msg_Outcome="bool ok\nstring text", **asked)
    interface = f"made_msgs/{kind}/Ask"
    file = tmp_path / "mine.skills.yaml"
    add_to_file(file, draft_skill(way, "cart/ask", interface))
    found = read_skills_file(file)
    assert all(finding.severity == "warning" and "draft" in finding.message for finding in found.findings)
    message = getattr(load_interface(interface), part)()
    for path, value in ANSWERS[answer].items():
        holder, _, name = path.rpartition(".")
        setattr(getattr(message, holder) if holder else message, name, value)
    refused = found.mappings["ask"].result(message)
    assert refused.outcome.name == "FAILED" and "the bed is covered" in refused.reason


@pytest.fixture
def warned(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Any:
    def warned(skill: str, node: str = "{ask: }", answer: str = "bool ok\nstring why") -> list[str]:
        make_interfaces(monkeypatch, "made_msgs", srv_Ask=f"---\n{answer}")
        (tmp_path / "mine.skills.yaml").write_text(f"skills:\n  ask:\n{skill}", encoding="utf-8")
        (tmp_path / "m.yaml").write_text(f"mission: m\ntree: {node}\n", encoding="utf-8")
        library = MissionLibrary.load([tmp_path], built_in=False)
        findings = [*library.findings, *check(library.missions(), library, collect_declarations())]
        assert all(finding.severity == "warning" for finding in findings), findings
        return [f"{Path(each.file).name}: {each.valid[0]}" for each in findings]

    return warned


ASK = "    service: cart/ask\n    type: made_msgs/srv/Ask\n"


def test_a_refusal_that_nothing_reads_is_pointed_out(warned: Any) -> None:
    assert warned(ASK) == ["mine.skills.yaml: failures: {refused: {when: not $ok}}"]
    assert len(warned(ASK + "    reason: why\n")) == 2
    assert warned(ASK + "    failures: {empty: {when: $why == 'empty'}}\n") != []
    assert warned(ASK, answer="bool left\nbool right\nstring text") != []


@pytest.mark.parametrize(
    ("answer", "remedy", "read"),
    [
        ("int32 result_code", "failures: {refused: {when: $result_code != 0}}", "$result_code == 7"),
        ("string error", 'failures: {refused: {when: $error != ""}}', "$error == 'jammed'"),
        ("bool[] successes", "failures: {refused: {when: false in $successes}}", "not $successes[0]"),
        ("int8 status", "failures: {refused: {when: $status != 0}}", "$status < 0"),
    ],
)
def test_every_form_of_a_refusal_is_pointed_out(warned: Any, answer: str, remedy: str, read: str) -> None:
    assert warned(ASK, answer=answer) == [f"mine.skills.yaml: {remedy}"]
    failures = f'    failures: {{no: {{when: "{read}"}}}}\n'
    assert warned(ASK + failures, answer=answer) == []


def test_flags_of_several_things_need_an_output(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    made = {"msg_Outcome": "bool ok\nstring text", "srv_Ask": "---\nOutcome[] results"}
    make_interfaces(monkeypatch, "made_msgs", **made)
    file = tmp_path / "mine.skills.yaml"
    file.write_text(f"skills:\n  ask:\n    summary: Ask.\n{ASK}", encoding="utf-8")
    (finding,) = read_skills_file(file).findings
    outputs, failures = finding.valid[0].split(", failures: ")
    file.write_text(f"skills:\n  ask:\n{ASK}    {outputs}\n    failures: {failures}\n", encoding="utf-8")
    found = read_skills_file(file)
    assert found.findings == ()
    message = load_interface("made_msgs/srv/Ask").Response()
    item = load_interface("made_msgs/msg/Outcome")
    message.results = [item(), item()]
    message.results[0].ok = True
    assert found.mappings["ask"].result(message).code == "refused"
    message.results[1].ok = True
    assert found.mappings["ask"].result(message).succeeded


def test_a_refusal_that_is_read_is_none(warned: Any) -> None:
    assert warned(ASK + "    failures: {no: {when: not $ok}}\n    reason: why\n") == []
    assert (
        warned(
            ASK + "    outputs: {fine: {type: boolean, from: ok}}\n    failures: {no: {when: not $fine}}\n"
        )
        == []
    )
    assert warned(ASK, answer="bool open\nfloat32 angle") != [], "nobody asks whether it is open"
    assert warned(ASK + "    outputs: {left: {type: boolean}}\n", answer="bool left\nbool right") == []


def test_a_mission_that_takes_the_answer_reads_it(warned: Any) -> None:
    fine = ASK + "    outputs: {fine: {type: boolean, from: ok}}\n"
    assert warned(fine) == ["m.yaml: failures: {refused: {when: not $fine}}, in the file of skills"]
    taken = "{sequence: [{ask: , out: {fine: fine}}, {if: $fine, then: {wait: 1 s}}]}"
    assert warned(fine, taken) == []


def test_a_condition_on_a_flag_that_nothing_asks_is_always_a_yes(warned: Any) -> None:
    door = "    condition: cart/door\n    type: std_msgs/msg/Bool\n"
    assert warned(door) == ["mine.skills.yaml: failures: {not_so: {when: not $data}}"]
    assert warned(door + "    failures: {shut: {when: not $data}}\n") == []
    assert warned("    wait_for: cart/bell\n    type: std_msgs/msg/Bool\n") == []
