"""The skills of the rig: the pure components behind the contract that behaviours know (core.skill)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, MutableMapping
from functools import partial
from random import Random
from types import SimpleNamespace
from typing import Any

from florence_bt.core.clock import Clock
from florence_bt.core.message_skills import AnswerWait, MessageCondition, MessageWait
from florence_bt.core.outcome import Result, cancelled, success
from florence_bt.core.serving import (
    AnswerBinding,
    ClockBinding,
    ConditionBinding,
    NodeBinding,
    PublicationBinding,
    QuestionBinding,
    SkillBinding,
    WaitBinding,
)
from florence_bt.core.skill import BaseRun, Event, FinishedRun, Inputs, InstantSkill, Skill, SkillRun
from florence_bt.skills.served import BINDINGS
from florence_bt.skills.speech.voice import SilentVoice


class ComponentRun(BaseRun):
    """A run of a component in this process: accepted at once, ended by :meth:`finish`.

    Args:
        feedback: What the component does.
        on_cancel: Asks the component to stop; it then finishes the run.
    """

    def __init__(self, feedback: str, on_cancel: Callable[[], None]) -> None:
        super().__init__(feedback)
        self._on_cancel = on_cancel
        self.handle(Event.ACCEPTED)

    def cancel(self) -> None:
        """Ask the component to stop."""
        if self.handle(Event.CANCEL):
            self._on_cancel()

    def finish(self, result: Result) -> None:
        """End the run; later results are dropped."""
        self.handle(Event.FINISHED, result)


class ExclusiveComponent:
    """A component that serves one run at a time; a newer run ends the older one, as a Nav2 server would."""

    def __init__(self) -> None:
        self._run: ComponentRun | None = None

    def begin(self, feedback: str, on_cancel: Callable[[], None]) -> ComponentRun:
        """Make the run that is served from now on."""
        self.finish(cancelled("preempted by a newer goal"))
        self._run = ComponentRun(feedback, on_cancel)
        return self._run

    def finish(self, result: Result) -> None:
        """End the run that is served, if there is one."""
        run, self._run = self._run, None
        if run is not None:
            run.finish(result)


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


class RigTopic:
    """A topic of the rig: what is published reaches every subscriber at once."""

    def __init__(self) -> None:
        self._subscribers: list[Callable[[Any], None]] = []

    def subscribe(self, callback: Callable[[Any], None]) -> None:
        """Call back with each message."""
        self._subscribers.append(callback)

    def publish(self, **values: Any) -> None:
        """Send a message with these fields."""
        message = SimpleNamespace(**values)
        for callback in tuple(self._subscribers):
            callback(message)


class RigVoice:
    """The robot's voice: sentences take their time, and the topics ``say`` and ``speaking`` have them.

    Args:
        topics: Receives the topics.
        clock: The time of the robot.
    """

    def __init__(self, topics: MutableMapping[str, RigTopic], clock: Clock) -> None:
        self._say = topics.setdefault("say", RigTopic())
        self._speaking = topics.setdefault("speaking", RigTopic())
        self._voice = SilentVoice(clock)
        self._component = ExclusiveComponent()

    def say(self, text: str) -> SkillRun:
        """Begin a sentence; it takes the place of an older one."""
        self._voice.stop()
        run = self._component.begin(f"says: {text}", self._stop)
        self._say.publish(data=text)
        self._speaking.publish(data=text)
        self._voice.begin(text, lambda problem: self._end(success()))
        return run

    def _stop(self) -> None:
        self._voice.stop()
        self._end(cancelled())

    def _end(self, result: Result) -> None:
        self._speaking.publish(data="")
        self._component.finish(result)


def rig_skills(
    components: Mapping[str, Any], topics: MutableMapping[str, RigTopic], clock: Clock, seed: int = 0
) -> dict[str, Skill]:
    """Make every shipped skill by name.

    Args:
        components: Those that the tables of the skills name.
        topics: Receives the topics that the tables name, by name.
        clock: Says how old messages are.
        seed: Where chance comes from.
    """
    chance = Random(seed)
    return {served.skill: _in_rig(served, components, topics, clock, chance) for served in BINDINGS}


def _in_rig(
    served: SkillBinding,
    components: Mapping[str, Any],
    topics: MutableMapping[str, RigTopic],
    clock: Clock,
    chance: Random,
) -> Skill:
    if isinstance(served, AnswerBinding):
        return InstantSkill(lambda inputs: served.answer(inputs, chance))
    if isinstance(served, ClockBinding):
        return served.make(clock, clock.now)
    if isinstance(served, NodeBinding):
        assert served.start_in_rig is not None, f"{served.skill} names no component of the rig"
        return ComponentSkill(partial(served.start_in_rig, components[served.component]))
    topic = topics.setdefault(served.name, RigTopic())
    if isinstance(served, PublicationBinding):
        return InstantSkill(partial(_publish, topic, served))
    label = f"topic {served.name}"
    answered: MessageCondition | MessageWait
    if isinstance(served, QuestionBinding):
        answered = wait = AnswerWait(clock, label, served, _ignore)
        said = topics.setdefault(served.said, RigTopic())
        said.subscribe(lambda message: wait.hear(message.data))
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
