"""The node ``speech``: :class:`Speaking` on ROS, with the program that speaks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from florence_bt.core.limits import CheckedParameters
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.ports import RosPorts
from florence_bt.skills.speech.speaking import Speaking
from florence_bt.skills.speech.voice import PRINT, ProgramVoice, SilentVoice, Voice, command_of


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
    """Serves the action ``speak`` and publishes what is being said.

    Args:
        parameters: Overrides of the node's parameters.
    """

    parameter_classes = (SpeechParameters,)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None) -> None:
        super().__init__("speech", parameters=parameters)
        command = command_of(self.read_parameters(SpeechParameters).program)
        voice: Voice = ProgramVoice(self.steady, command) if command else SilentVoice(self.timebase)
        self.on_close(Speaking(RosPorts(self), voice).close)
