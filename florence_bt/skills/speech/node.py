"""The robot's voice on ROS (``speech``): serves ``speak``, and publishes what is being said."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from florence_interfaces.action import Speak
from std_msgs.msg import String

from florence_bt.core.limits import CheckedParameters
from florence_bt.core.outcome import Outcome
from florence_bt.ros.action_server import SingleGoalServer
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE
from florence_bt.ros.topics import SAY, SPEAKING
from florence_bt.skills.speech.bindings import PROGRAM_FAILED
from florence_bt.skills.speech.voice import (
    LONGEST_TEXT,
    PRINT,
    ProgramVoice,
    SilentVoice,
    Voice,
    command_of,
    spoken_text,
)


@dataclass(frozen=True, slots=True)
class SpeechParameters(CheckedParameters):
    """Parameters of the robot's voice.

    Attributes:
        program: A command that reads a sentence from its standard input and ends when it is said, such as
            ``espeak-ng -v de``; ``print`` when sentences are only shown; ``none`` when another node serves
            the action ``speak``.
    """

    program: str = PRINT

    def _check(self) -> None:
        command_of(self.program)


class SpeechNode(FlorenceNode):
    """Serves the action ``speak``, one sentence at a time; a newer one takes the place of an older one.

    Each sentence is published on ``say`` when it begins; ``speaking`` has the sentence while it is said.

    Args:
        parameters: Overrides of the node's parameters.
    """

    parameter_classes = (SpeechParameters,)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None) -> None:
        super().__init__("speech", parameters=parameters)
        command = command_of(self.read_parameters(SpeechParameters).program)
        self._voice: Voice = ProgramVoice(self.steady, command) if command else SilentVoice(self.timebase)
        self._say = self.create_publisher(String, SAY, RELIABLE)
        self._speaking = self.create_publisher(String, SPEAKING, LATCHED)
        self._speaking.publish(String())  # one that died may have left a sentence
        self._server = SingleGoalServer(
            self, Speak, "speak", on_goal=self._on_goal, on_cancel=self._on_cancel
        )
        self.on_close(self._voice.stop)

    def _on_goal(self, request: Speak.Goal) -> str | None:
        text = spoken_text(request.text)
        if not text:
            return "there is nothing to say"
        if len(text) > LONGEST_TEXT:
            return f"the text has {len(text)} characters; at most {LONGEST_TEXT} are said"
        self._voice.stop()
        self.get_logger().info(f"says: {text}")
        self._say.publish(String(data=text))
        self._speaking.publish(String(data=text))
        self._voice.begin(text, self._on_end)
        self.call_soon(lambda: self._server.publish_feedback(Speak.Feedback(text=text)))
        return None

    def _on_cancel(self) -> None:
        self._voice.stop()
        self._finish(Speak.Result(error_msg="the sentence was stopped"), Outcome.CANCELLED)

    def _on_end(self, problem: str) -> None:
        if problem:
            self.get_logger().error(problem)
            self._finish(Speak.Result(error_code=PROGRAM_FAILED, error_msg=problem), Outcome.FAILED)
        else:
            self._finish(Speak.Result(), Outcome.SUCCEEDED)

    def _finish(self, result: Speak.Result, outcome: Outcome) -> None:
        self._speaking.publish(String())
        self._server.finish(result, outcome)
