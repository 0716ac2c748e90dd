"""What missions may say to people and wait for from them, and how it is served."""

from __future__ import annotations

from typing import Any

from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.outcome import Outcome, Result, cancelled, failure, success
from florence_bt.core.serving import ActionBinding, PublicationBinding, QuestionBinding

LONGEST_ANSWER = 200
"""Characters: it becomes an output of missions and stands in the journal."""

PROGRAM_FAILED = 1
"""Error code of the action ``speak``."""

ANSWERS_KEPT_S = 3.0
"""Chosen: people are up to a second late, and a program that listens needs one or two more."""

SAY = SkillDeclaration(
    name="say",
    summary="Say a text, and go on when it has been said",
    inputs={"text": Port(Kind.TEXT, "what to say, up to 1000 characters")},
    failures={"not_said": "the program that speaks failed"},
    resources=frozenset({"voice"}),
    deadline_s=120.0,
)

CALL_FOR_HELP = SkillDeclaration(
    name="call_for_help",
    summary="Tell that a person needs help; a program that calls somebody listens on the topic `help`",
    inputs={"text": Port(Kind.TEXT, "what has happened, and where")},
    deadline_s=10.0,
)

WAIT_FOR_ANSWER = SkillDeclaration(
    name="wait_for_answer",
    summary="Wait for an answer: a button of the home sensors, `florence answer`, the topic `answer`",
    inputs={
        "time_limit": Port(Kind.DURATION, "how long to wait", default=30.0, minimum=1.0, maximum=600.0),
        "choices": Port(
            Kind.LIST_OF_TEXT,
            "the answers that the mission understands: `florence answer` lists them, the page has a button "
            "for each; any other is taken, too",
            default=(),
        ),
    },
    outputs={"answer": Port(Kind.TEXT, "the name of the button, or the first 200 characters of what came")},
    failures={"no_answer": "nobody answered in time"},
    deadline_s=610.0,
)


def _said(message: Any, outcome: Outcome) -> Result:
    if outcome is Outcome.CANCELLED:
        return cancelled()
    if outcome is Outcome.FAILED:
        return failure("not_said", message.error_msg)
    return success()


BINDINGS = (
    ActionBinding(
        skill=SAY,
        interface="florence_interfaces/action/Speak",
        name="speak",
        request=lambda inputs: {"text": inputs["text"]},
        result=_said,
        feedback=lambda message: f"says: {message.text}",
        component="voice",
        start_in_rig=lambda voice, inputs: voice.say(inputs["text"]),
    ),
    PublicationBinding(
        skill=CALL_FOR_HELP,
        interface="std_msgs/msg/String",
        name="help",
        message=lambda inputs: {"data": inputs["text"]},
    ),
    QuestionBinding(
        skill=WAIT_FOR_ANSWER,
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
