"""Requests from outside: bounded, checked, one clear sentence."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.core.errors import ConfigError
from florence_bt.runtime.requests import MAX_INPUTS, MAX_NAME, MAX_VALUE, checked_text, request_from_texts
from florence_bt.runtime.run import TriggerPolicy


def test_a_request_of_texts() -> None:
    request = request_from_texts(
        "goto_room", ["room", "text"], ["kitchen", "two\nlines"], caller="me", policy="queue", priority=3
    )
    assert (request.mission, request.inputs) == ("goto_room", {"room": "kitchen", "text": "two\nlines"})
    assert (request.caller, request.policy, request.priority) == ("me", TriggerPolicy.QUEUE, 3)
    assert request_from_texts("m", caller="me").policy is TriggerPolicy.REJECT


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"names": ["a"], "values": []}, "1 input names came with 0 values"),
        ({"names": ["a", "a"], "values": ["1", "2"]}, "'a' was given twice"),
        ({"names": ["a"] * (MAX_INPUTS + 1), "values": ["1"] * (MAX_INPUTS + 1)}, "at most 64"),
        ({"names": ["a"], "values": ["x" * (MAX_VALUE + 1)]}, "too long: 2001 characters"),
        ({"names": ["a" * (MAX_NAME + 1)], "values": ["x"]}, "the name of an input is too long"),
        ({"mission": "m" * 201}, "the name of the mission is too long"),
        ({"caller": "\x1b[2J"}, "the caller has characters that cannot be printed"),
        ({"policy": "perhaps"}, "would have worked: reject, queue, preempt"),
        ({"policy": "p" * 300}, "the policy is too long"),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(changes: dict[str, object], message: str) -> None:
    call: dict[str, object] = {"mission": "m", "caller": "me", **changes}
    with pytest.raises(ConfigError, match=message) as error:
        request_from_texts(**call)  # type: ignore[arg-type]
    assert len(str(error.value)) < 400


def test_the_longest_text_is_allowed() -> None:
    assert checked_text("it", "x" * MAX_NAME) == "x" * MAX_NAME
    with pytest.raises(ConfigError, match="it is too long: 201 characters"):
        checked_text("it", "x" * (MAX_NAME + 1))


@given(st.text(max_size=MAX_NAME))
def test_a_checked_text_is_the_text_and_tears_no_line(text: str) -> None:
    try:
        assert checked_text("it", text) == text
    except ConfigError:
        assert not text.translate({10: 32, 9: 32}).isprintable()
    else:
        assert "\x1b" not in text and "\r" not in text
