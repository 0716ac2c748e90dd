"""Bindings of the skills that say something to people, and wait for their answer."""

from __future__ import annotations

from typing import Any

from florence_bt.core.outcome import Outcome, Result, cancelled, failure, success
from florence_bt.core.serving import ActionBinding, PublicationBinding, QuestionBinding

LONGEST_ANSWER = 200
"""Characters: it becomes an output of missions and stands in the journal."""

PROGRAM_FAILED = 1
"""Error code of the action ``speak``."""

ANSWERS_KEPT_S = 3.0
"""Chosen: people are up to a second late, and a program that listens needs one or two more."""


def _said(message: Any, outcome: Outcome) -> Result:
    if outcome is Outcome.CANCELLED:
        return cancelled()
    if outcome is Outcome.FAILED:
        return failure("not_said", message.error_msg)
    return success()


BINDINGS = (
    ActionBinding(
        skill="say",
        interface="florence_interfaces/action/Speak",
        name="speak",
        request=dict,
        result=_said,
        feedback=lambda message: f"says: {message.text}",
    ),
    PublicationBinding(
        skill="call_for_help",
        interface="std_msgs/msg/String",
        name="help",
        message=lambda inputs: {"data": inputs["text"]},
    ),
    QuestionBinding(
        skill="wait_for_answer",
        interface="std_msgs/msg/String",
        name="answer",
        said="speaking",
        keep_s=ANSWERS_KEPT_S,
        choices=lambda inputs: inputs["choices"],
        result=lambda message: success(answer=message.data[:LONGEST_ANSWER]),
        time_limit=lambda inputs: inputs["time_limit"],
        nothing=lambda inputs: failure("no_answer", f"nobody answered within {inputs['time_limit']:g} s"),
    ),
)
