"""The skills of the rig: the pure components behind the contract that behaviours know (core.skill)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from random import Random
from typing import Any

from florence_bt.core.message_skills import AnswerWait, MessageCondition, MessageWait
from florence_bt.core.outcome import Result, success
from florence_bt.core.serving import (
    ActionBinding,
    AnswerBinding,
    ClockBinding,
    ConditionBinding,
    NodeBinding,
    PublicationBinding,
    QuestionBinding,
    ServiceBinding,
    SkillBinding,
    WaitBinding,
)
from florence_bt.core.skill import FinishedRun, Inputs, InstantSkill, Skill, SkillRun
from florence_bt.simulation.rig.wires import RigTopic, Wires
from florence_bt.skills.served import BINDINGS


class ComponentSkill:
    """A skill that a component performs.

    Args:
        start_in_rig: Gives the result of a skill that answers at once, else its run.
    """

    def __init__(self, start_in_rig: Callable[[Inputs], Result | SkillRun]) -> None:
        self._perform = start_in_rig

    def start(self, inputs: Inputs) -> SkillRun:
        """Ask the component."""
        answer = self._perform(inputs)
        return FinishedRun(answer) if isinstance(answer, Result) else answer


class WiredSkill:
    """A skill that a component serves over the rig's wires."""

    def __init__(self, served: NodeBinding, wires: Wires) -> None:
        self._served, self._wires = served, wires

    def start(self, inputs: Inputs) -> SkillRun:
        """Send the goal, or ask the service."""
        served = self._served
        if isinstance(served, ActionBinding):
            action = self._wires.actions[served.name]
            return action.start(served.request(inputs), served.result, served.feedback)
        assert isinstance(served, ServiceBinding)
        return FinishedRun(served.result(self._wires.services[served.name](served.request(inputs))))


def rig_skills(components: Mapping[str, Any], wires: Wires, seed: int = 0) -> dict[str, Skill]:
    """Make every shipped skill by name.

    Args:
        components: Those that the tables of the skills name.
        wires: Carry topics, actions and services.
        seed: Where chance comes from.
    """
    chance = Random(seed)
    return {served.skill: _in_rig(served, components, wires, chance) for served in BINDINGS}


def _in_rig(served: SkillBinding, components: Mapping[str, Any], wires: Wires, chance: Random) -> Skill:
    clock = wires.clock
    if isinstance(served, AnswerBinding):
        return InstantSkill(lambda inputs: served.answer(inputs, chance))
    if isinstance(served, ClockBinding):
        return served.make(clock, clock.now)
    if isinstance(served, NodeBinding):
        if served.start_in_rig is None:
            return WiredSkill(served, wires)
        return ComponentSkill(partial(served.start_in_rig, components[served.component]))
    topic = wires.topics[served.name]
    if isinstance(served, PublicationBinding):
        return InstantSkill(partial(_publish, topic, served))
    label = f"topic {served.name}"
    answered: MessageCondition | MessageWait
    if isinstance(served, QuestionBinding):
        answered = wait = AnswerWait(clock, label, served, _ignore)
        wires.topics[served.said].subscribe(lambda message: wait.hear(message.data))
    elif isinstance(served, WaitBinding):
        answered = MessageWait(clock, label, served)
    else:
        assert isinstance(served, ConditionBinding)
        answered = MessageCondition(clock, label, served.judge, served.max_age_s)
    topic.subscribe(answered.take)
    return answered


def _ignore(line: str) -> None:
    """Report nothing: nobody reads along in the rig."""


def _publish(topic: RigTopic, served: PublicationBinding, inputs: Inputs) -> Result:
    topic.publish(**served.message(inputs))
    return success()
