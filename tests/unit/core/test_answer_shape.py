"""Whether an answer is a refusal is known by its shape, and by no one spelling."""

from __future__ import annotations

import pytest

from florence_bt.core.answer_shape import shape_of
from florence_bt.core.interfaces import load_interface
from tests.made_interfaces import make_interfaces


@pytest.mark.parametrize(
    ("answer", "refusal", "words"),
    [
        ("bool ok\nstring why", "not $ok", "why"),
        ("bool granted\nstring remark", "not $granted", "remark"),
        ("bool zq\nstring<=80 text", "not $zq", "text"),
        ("string text\nfloat64 litres\nbool zq", "not $zq", "text"),
        ("bool done", "not $done", ""),
        ("bool zq", "not $zq", ""),
        ("bool failed\nstring error_message", "$failed", "error_message"),
        ("bool is_busy\nstring hint", "$is_busy", "hint"),
        ("bool no_error\nstring hint", "not $no_error", "hint"),
        ("bool not_allowed\nstring hint", "$not_allowed", "hint"),
        ("bool cached\nbool success\nstring message", "not $success", "message"),
        ("std_msgs/Header header\nbool zq", "not $zq", ""),
        ("Outcome outcome\nfloat32 used", "not $outcome.ok", "outcome.text"),
        ("Answer answer\nfloat32 used", "not $answer.outcome.ok", "answer.outcome.text"),
        ("bool[] successes\nstring[] texts", "false in $successes", ""),
        ("bool[] rejected", "true in $rejected", ""),
        ("Outcome[] results", "false in $results[*].ok", ""),
        ("string error", '$error != ""', "error"),
        ("float32 took\nstring<=80 error_msg", '$error_msg != ""', "error_msg"),
        ("string[] problems", "count($problems) > 0", "problems[0]"),
        ("float64 error", "", ""),
        ("Thing thing", "", ""),
        ("bool open\nfloat32 angle", "", ""),
        ("bool left\nbool right\nstring text", "", ""),
        ("string text", "", ""),
        ("", "", ""),
    ],
)
def test_a_refusal_is_known_by_its_shape(
    monkeypatch: pytest.MonkeyPatch, answer: str, refusal: str, words: str
) -> None:
    pytest.importorskip("std_msgs")
    made = {
        "msg_Outcome": "bool ok\nstring text",
        "msg_Answer": "Outcome outcome",
        "msg_Thing": "uint8 KIND_NONE=0\nuint8 KIND_BIG=1\nuint8 kind\nbool locked\nstring name",
    }
    make_interfaces(monkeypatch, "made_msgs", **made, srv_Ask=f"---\n{answer}")
    shape = shape_of(load_interface("made_msgs/srv/Ask").Response)
    assert (shape.refusal, shape.words) == (refusal, words)


@pytest.mark.parametrize(
    ("answer", "mishap", "failures"),
    [
        ("uint8 OK=0\nuint8 EMPTY=1\nuint8 code\nstring detail", "$code != 0", {"EMPTY": 1}),
        ("int32 SUCCESS=1\nint32 FAILURE=-4\nint32 code", "$code != 1", {"FAILURE": -4}),
        ("uint8 RESULT_NONE=0\nuint8 RESULT_LOST=7\nuint8 result", "$result != 0", {"RESULT_LOST": 7}),
        ("uint16 error_code\nuint32 count", "$error_code != 0", {}),
        ("bool ok\nuint8 STATE_DRY=1\nuint8 state", "", {}),
        ("uint32 count", "", {}),
        ("uint8 NACK=0\nuint8 ACK=1\nuint8 answer", "$answer != 1", {"NACK": 0}),
        (
            "uint8 REJECTED=0\nuint8 QUEUED=1\nuint8 ACCEPTED=2\nuint8 result",
            "$result != 2",
            {"REJECTED": 0, "QUEUED": 1},
        ),
        ("uint8 NOT_DONE=0\nuint8 DONE=1\nuint8 status", "$status != 1", {"NOT_DONE": 0}),
        ("int32 rc\nstring text", "$rc != 0", {}),
        ("uint16 errors\nfloat32 took", "$errors != 0", {}),
        ('string OK="fine"\nstring REFUSED="no"\nstring status', '$status != "fine"', {"REFUSED": "no"}),
        ("Code code\nfloat32 took", "$code.val != 0", {"JAMMED": 11}),
        ("uint8 OK=0\nuint8 LOST=1\nuint8 MODE_FOG=2\nuint8 code\nuint8 mode", "$code != 0", {"LOST": 1}),
        ("int8 status\nstring text", "$status != 0", {}),
        ("string outcome", 'not $outcome in ["OK", "ok", "SUCCESS", "success", "DONE", "done"]', {}),
        ("string state\nfloat32 took", "", {}),
    ],
)
def test_a_code_that_names_no_success_is_a_failure(
    monkeypatch: pytest.MonkeyPatch, answer: str, mishap: str, failures: dict[str, int]
) -> None:
    code = "int32 OK=0\nint32 JAMMED=11\nint32 val\nstring text"
    make_interfaces(monkeypatch, "made_msgs", msg_Code=code, srv_Ask=f"---\n{answer}")
    shape = shape_of(load_interface("made_msgs/srv/Ask").Response)
    assert (shape.mishap, shape.failures) == (mishap, failures)
