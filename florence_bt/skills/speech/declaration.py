"""What missions may say to people and wait for from them, and how it is served."""

from __future__ import annotations

from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.outcome import failure, success
from florence_bt.core.serving import PublicationBinding, WaitBinding

LONGEST_ANSWER = 200
"""Characters: it becomes an output of missions and stands in the journal."""

SAY = SkillDeclaration(
    name="say",
    summary="Say a text; a program that speaks listens on the topic `say`",
    inputs={"text": Port(Kind.TEXT, "what to say")},
    deadline_s=10.0,
)

CALL_FOR_HELP = SkillDeclaration(
    name="call_for_help",
    summary="Tell that a person needs help; a program that calls somebody listens on the topic `help`",
    inputs={"text": Port(Kind.TEXT, "what has happened, and where")},
    deadline_s=10.0,
)

WAIT_FOR_ANSWER = SkillDeclaration(
    name="wait_for_answer",
    summary="Wait for a button of the home sensors, or anything else that comes on the topic `answer`",
    inputs={
        "time_limit": Port(Kind.DURATION, "how long to wait", default=30.0, minimum=1.0, maximum=600.0),
    },
    outputs={"answer": Port(Kind.TEXT, "the name of the button, or the first 200 characters of what came")},
    failures={"no_answer": "nobody answered in time"},
    deadline_s=610.0,
)


BINDINGS = (
    PublicationBinding(
        skill=SAY,
        interface="std_msgs/msg/String",
        name="say",
        message=lambda inputs: {"data": inputs["text"]},
    ),
    PublicationBinding(
        skill=CALL_FOR_HELP,
        interface="std_msgs/msg/String",
        name="help",
        message=lambda inputs: {"data": inputs["text"]},
    ),
    WaitBinding(
        skill=WAIT_FOR_ANSWER,
        interface="std_msgs/msg/String",
        name="answer",
        result=lambda message: success(answer=message.data[:LONGEST_ANSWER]),
        time_limit=lambda inputs: inputs["time_limit"],
        nothing=lambda inputs: failure("no_answer", f"nobody answered within {inputs['time_limit']:g} s"),
    ),
)
