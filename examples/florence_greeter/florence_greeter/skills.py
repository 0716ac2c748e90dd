"""The skill ``greet_user``: what missions know of it, and how it is done.

Florence imports this module with every command, so it imports nothing heavy.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from florence_bt.core.clock import Clock, Timer
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.outcome import cancelled, failure, success
from florence_bt.core.skill import BaseRun, Event, FinishedRun, Inputs, Skill, SkillRun
from florence_greeter.greeting import UnknownLanguage, greeting, speaking_time

GREET_USER = SkillDeclaration(
    name="greet_user",
    summary="Greet somebody",
    inputs={
        "name": Port(Kind.TEXT, "who is greeted; empty when nobody knows", default=""),
        "language": Port(Kind.TEXT, "en, de or es", default="en"),
        "evening": Port(Kind.BOOLEAN, "whether it is late", default=False),
    },
    outputs={"words": Port(Kind.TEXT, "what was said")},
    failures={"unknown_language": "there are no words in this language"},
    resources=frozenset({"voice"}),
    deadline_s=20.0,
)


class GreetUser:
    """Says a greeting and is done when it has been spoken.

    Args:
        say: Begins to speak a text, and returns at once; an empty text makes it stop.
        clock: Tells when the text is over.
    """

    def __init__(self, say: Callable[[str], object], clock: Clock) -> None:
        self._say = say
        self._clock = clock

    def start(self, inputs: Inputs) -> SkillRun:
        """Begin to speak."""
        try:
            text = greeting(inputs["name"], inputs["language"], evening=inputs["evening"])
        except UnknownLanguage as error:
            return FinishedRun(failure("unknown_language", str(error)))
        return _Speaking(text, self._say, self._clock)


class _Speaking(BaseRun):
    """One greeting that is being spoken."""

    def __init__(self, text: str, say: Callable[[str], object], clock: Clock) -> None:
        super().__init__("speaking")
        self._text = text
        self._say = say
        self.handle(Event.ACCEPTED)
        say(text)
        self._timer: Timer = clock.call_at(clock.now() + speaking_time(text), self._on_end)

    def cancel(self) -> None:
        if self.handle(Event.CANCEL):
            self._timer.cancel()
            self._say("")
            self.handle(Event.FINISHED, cancelled())

    def _on_end(self) -> None:
        self.handle(Event.FINISHED, success(words=self._text))


def make_skills(node: Any) -> Mapping[str, Skill]:
    """Make the skills on a robot.

    Args:
        node: The ROS node of the mission server. Publishers and clients can be made with it, and
            ``node.timebase`` is the clock that all skills go by. Here the words go to the log; a robot with a
            voice would publish them.
    """
    return {GREET_USER.name: GreetUser(node.get_logger().info, node.timebase)}
