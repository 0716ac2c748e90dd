"""Skills that are answered by the messages of some source, such as a topic. No ROS in here."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from florence_bt.core.clock import Clock, Timer
from florence_bt.core.errors import FlorenceError
from florence_bt.core.outcome import Result, cancelled, failure
from florence_bt.core.serving import WaitBinding
from florence_bt.core.skill import BaseRun, Event, FinishedRun, Inputs, SkillRun


@dataclass(eq=False, slots=True)
class _Watch:
    inputs: Inputs
    callback: Callable[[], None]
    answer: Result


class MessageCondition:
    """Judges the last message, and reports when the judgement changes (``WakingSkill``).

    Args:
        clock: The time of the robot.
        label: Names the source in reasons.
        to_result: Judges a message by the inputs; raises FlorenceError, KeyError, TypeError or ValueError
            when it cannot.
        max_age_s: Seconds after which a message does not count any more: the answer is ``server_lost`` then.
    """

    def __init__(
        self, clock: Clock, label: str, to_result: Callable[[Inputs, Any], Result], max_age_s: float
    ) -> None:
        self._clock = clock
        self._label = label
        self._to_result = to_result
        self._max_age_s = max_age_s
        self._message: Any = None
        self._came = float("-inf")
        self._watches: list[_Watch] = []
        self._silence: Timer | None = None

    def start(self, inputs: Inputs) -> FinishedRun:
        """Judge the last message."""
        return FinishedRun(self._judge(inputs))

    def watch(self, inputs: Inputs, callback: Callable[[], None]) -> Callable[[], None]:
        """Call back when the judgement changes: by a message, or because none comes."""
        watch = _Watch(inputs, callback, self._judge(inputs))
        self._watches.append(watch)
        self._limit_silence()

        def end() -> None:
            if watch in self._watches:
                self._watches.remove(watch)
                self._limit_silence()

        return end

    def take(self, message: Any) -> None:
        """Take a message."""
        self._message, self._came = message, self._clock.now()
        self._limit_silence()
        self._judge_again()

    def _judge(self, inputs: Inputs) -> Result:
        if self._message is None:
            return failure("server_lost", f"nothing has come from {self._label} yet")
        if self._clock.now() - self._came >= self._max_age_s:
            return failure("server_lost", f"nothing has come from {self._label} for {self._max_age_s:g} s")
        try:
            return self._to_result(inputs, self._message)
        except (FlorenceError, KeyError, TypeError, ValueError) as error:
            return failure("bad_input", f"a message from {self._label} cannot be judged: {error}")

    def _judge_again(self) -> None:
        for watch in tuple(self._watches):
            before, watch.answer = watch.answer, self._judge(watch.inputs)
            if _differ(before, watch.answer):
                watch.callback()

    def _limit_silence(self) -> None:
        """Have a timer only while there is a watch and a message counts."""
        if self._silence is not None:
            self._silence.cancel()
            self._silence = None
        when = self._came + self._max_age_s
        if self._watches and self._clock.now() < when < math.inf:
            self._silence = self._clock.call_at(when, self._judge_again)


class MessageWait:
    """Waits for the next message.

    Args:
        clock: The time of the robot.
        label: Names the source for people.
        served: What a message means, and how long to wait for one.
    """

    def __init__(self, clock: Clock, label: str, served: WaitBinding) -> None:
        self._clock = clock
        self._label = label
        self._served = served
        self._runs: list[_WaitRun] = []

    def start(self, inputs: Inputs) -> SkillRun:
        """Wait from now on; what came before does not count."""
        run = _WaitRun(f"waiting for {self._label}", self._runs.remove)
        self._runs.append(run)
        end = self._clock.now() + self._served.time_limit(inputs)
        run.timer = self._clock.call_at(end, lambda: run.finish(self._served.nothing(inputs)))
        return run

    def take(self, message: Any) -> None:
        """Take a message: it ends every run."""
        for run in tuple(self._runs):
            run.finish(self._served.result(message))


class _WaitRun(BaseRun):
    """One wait."""

    def __init__(self, feedback: str, on_end: Callable[[_WaitRun], None]) -> None:
        super().__init__(feedback)
        self.handle(Event.ACCEPTED)
        self._on_end = on_end
        self.timer: Timer | None = None

    def cancel(self) -> None:
        self.finish(cancelled())

    def finish(self, result: Result) -> None:
        if self.result is not None:
            return
        if self.timer is not None:
            self.timer.cancel()
        self._on_end(self)
        self.handle(Event.FINISHED, result)


def _differ(one: Result, other: Result) -> bool:
    """Tell whether two answers differ in more than their words."""
    return (one.code, one.outputs) != (other.code, other.outputs)
