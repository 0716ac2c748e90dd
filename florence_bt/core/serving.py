"""Bindings: a skill is served by an action, a service or a topic, of ROS or of the rig.

Each ``bindings.py`` has a table ``BINDINGS`` for the skills that the ``NAME.skills.yaml`` beside it declares;
a file of skills that says how one is served gives such a binding too (``trees.language.message_mappings``).
The types of ROS are named, not imported, and messages are read by their fields, so that the rig needs no ROS.
What is sent is given by the paths of its fields (:func:`florence_bt.core.interfaces.fill`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from random import Random
from typing import Any

from florence_bt.core.clock import Clock
from florence_bt.core.outcome import Outcome, Result
from florence_bt.core.skill import Inputs, Skill


@dataclass(frozen=True, slots=True, kw_only=True)
class SkillBinding:
    """A served skill.

    Attributes:
        skill: The name of the skill.
        interface: The ROS type, such as ``nav2_msgs/action/Spin``; empty without one.
        name: The name of the action, service or topic; empty without one.
    """

    skill: str
    interface: str = ""
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class AnswerBinding(SkillBinding):
    """A skill that needs chance and no other node.

    Attributes:
        answer: The result from the inputs and from where chance comes, at once.
    """

    answer: Callable[[Inputs, Random], Result]


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockBinding(SkillBinding):
    """A skill that needs the time and no other node.

    Attributes:
        make: Makes it from a clock, and from what gives the date in seconds since 1970.
    """

    make: Callable[[Clock, Callable[[], float]], Skill]


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeBinding(SkillBinding):
    """A skill that a node serves as an action or service.

    Attributes:
        request: The fields of the goal or request from the inputs; ``dict`` where both have the same names.
    """

    request: Callable[[Inputs], Mapping[str, Any]] = lambda inputs: {}


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionBinding(NodeBinding):
    """A skill that is an action.

    Attributes:
        error_codes: Error number of the server -> failure code of the skill.
        result: The skill's result from the result message and the way the goal ended.
        feedback: A text for people from a feedback message; steady while nothing new happens.
    """

    error_codes: Mapping[int, str] = field(default_factory=dict)
    result: Callable[[Any, Outcome], Result]
    feedback: Callable[[Any], str]


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceBinding(NodeBinding):
    """A skill that is a service.

    Attributes:
        result: The skill's result from the response.
        judge: The result from the inputs and a success of the service; the success itself when None.
    """

    result: Callable[[Any], Result]
    judge: Callable[[Inputs, Result], Result] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TopicBinding(SkillBinding):
    """A skill that reads or writes a topic.

    Attributes:
        latched: Whether the topic gives its last message to who comes later.
        foreign: Whether its messages are those of another robot, whose values have other limits than ours:
            the skill judges each field that it reads.
    """

    latched: bool = False
    foreign: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ConditionBinding(TopicBinding):
    """A condition that is judged from the last message of a topic.

    Attributes:
        judge: The result from the inputs and a message; raises ValueError when a message says nothing.
        max_age_s: Seconds after which a message does not count any more.
    """

    judge: Callable[[Inputs, Any], Result]
    max_age_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PublicationBinding(TopicBinding):
    """A skill that publishes one message on a topic.

    Attributes:
        message: The fields of the message from the inputs.
    """

    message: Callable[[Inputs], Mapping[str, Any]]


@dataclass(frozen=True, slots=True, kw_only=True)
class WaitBinding(TopicBinding):
    """A skill that waits for the next message of a topic.

    Attributes:
        result: The result from the message.
        time_limit: How long to wait, seconds, from the inputs.
        nothing: The result from the inputs when no message came in time.
    """

    result: Callable[[Any], Result]
    time_limit: Callable[[Inputs], float]
    nothing: Callable[[Inputs], Result]


@dataclass(frozen=True, slots=True, kw_only=True)
class QuestionBinding(WaitBinding):
    """A skill that waits for the answer to what the robot says.

    Attributes:
        said: The topic with the sentence that is being said, empty when there is none.
        keep_s: Seconds after a question in which an answer is kept for the next wait.
        choices: The answers that the mission names, by the inputs of the wait; any other counts as well.
    """

    said: str
    keep_s: float
    choices: Callable[[Inputs], Sequence[str]]
