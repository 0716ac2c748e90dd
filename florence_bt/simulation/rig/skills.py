"""The skills of the rig: the pure components behind the contract that behaviours know (core.skill)."""

from __future__ import annotations

from functools import partial
from random import Random

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
        result = served.result(self._wires.services[served.name](served.request(inputs)))
        if served.judge is not None and result.succeeded:
            result = served.judge(inputs, result)
        return FinishedRun(result)


def rig_skills(wires: Wires, seed: int = 0) -> dict[str, Skill]:
    """Make every shipped skill by name.

    Args:
        wires: Carry topics, actions and services.
        seed: Where chance comes from.
    """
    chance = Random(seed)
    return {served.skill: _in_rig(served, wires, chance) for served in BINDINGS}


def _in_rig(served: SkillBinding, wires: Wires, chance: Random) -> Skill:
    clock = wires.clock
    if isinstance(served, AnswerBinding):
        return InstantSkill(lambda inputs: served.answer(inputs, chance))
    if isinstance(served, ClockBinding):
        return served.make(clock, clock.now)
    if isinstance(served, NodeBinding):
        return WiredSkill(served, wires)
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
