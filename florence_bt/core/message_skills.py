"""Skills that are answered by the messages of some source, such as a topic. No ROS in here."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from florence_bt.core.clock import Clock, Timer
from florence_bt.core.errors import FlorenceError
from florence_bt.core.outcome import Result, cancelled, failure
from florence_bt.core.serving import QuestionBinding, WaitBinding
from florence_bt.core.skill import BaseRun, Event, FinishedRun, Inputs, SkillRun

LOOK_S = 1.0
"""How often is looked whether a source that speaks only when something changes is still there, while somebody
watches or waits. Chosen: as fast as a killed server is noticed during a call."""
OPEN_QUESTION = "open: "
"""What the answer to somebody who asks whether a question is open begins with, if one is."""
NOBODY_ASKS = "no mission waits for an answer"


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
            Infinite for a source that speaks only when something changes.
        source_is_there: Tells whether the source could still speak: the last message of one that is gone does
            not count, however new it is allowed to be. Asked where ``max_age_s`` is infinite.
    """

    def __init__(
        self,
        clock: Clock,
        label: str,
        to_result: Callable[[Inputs, Any], Result],
        max_age_s: float,
        source_is_there: Callable[[], bool] = lambda: True,
    ) -> None:
        self._clock = clock
        self._label = label
        self._to_result = to_result
        self._max_age_s = max_age_s
        self._source_is_there = source_is_there
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
        if self._max_age_s == math.inf and not self._source_is_there():
            return failure("server_lost", f"{self._label} went away; start its node again")
        try:
            return self._to_result(inputs, self._message)
        except (FlorenceError, KeyError, TypeError, ValueError) as error:
            return failure("bad_input", f"a message from {self._label} cannot be judged: {error}")

    def _judge_again(self) -> None:
        for watch in tuple(self._watches):
            before, watch.answer = watch.answer, self._judge(watch.inputs)
            if _differ(before, watch.answer):
                watch.callback()

    def _look_again(self) -> None:
        self._judge_again()
        self._limit_silence()

    def _limit_silence(self) -> None:
        """Have a timer only while there is a watch and a message counts."""
        if self._silence is not None:
            self._silence.cancel()
            self._silence = None
        when, now = self._came + self._max_age_s, self._clock.now()
        if not self._watches or self._message is None:
            return
        if when == math.inf:
            self._silence = self._clock.call_at(now + LOOK_S, self._look_again)
        elif now < when:
            self._silence = self._clock.call_at(when, self._judge_again)


class MessageWait:
    """Waits for the next message.

    Args:
        clock: The time of the robot.
        label: Names the source for people.
        served: What a message means, and how long to wait for one.
        source_is_there: Tells whether the source could still speak.
        search_s: Seconds that the source gets to appear in; a wait without one ends with ``server_lost``.
    """

    def __init__(
        self,
        clock: Clock,
        label: str,
        served: WaitBinding,
        source_is_there: Callable[[], bool] = lambda: True,
        search_s: float = math.inf,
    ) -> None:
        self._clock = clock
        self._label = label
        self._served = served
        self._source_is_there = source_is_there
        self._search_s = search_s
        self._runs: list[_WaitRun] = []

    def start(self, inputs: Inputs) -> SkillRun:
        """Wait from now on; what came before does not count."""
        run = _WaitRun(self._feedback(), self._on_end)
        self._runs.append(run)
        end = self._clock.now() + self._served.time_limit(inputs)
        run.timer = self._clock.call_at(end, lambda: run.finish(self._served.nothing(inputs)))
        if self._search_s < math.inf:
            self._look_for_source(run, self._clock.now() + self._search_s)
        return run

    def _look_for_source(self, run: _WaitRun, when: float) -> None:
        def look() -> None:
            if self._source_is_there():
                self._look_for_source(run, self._clock.now() + LOOK_S)
            else:
                run.finish(failure("server_lost", f"nobody publishes {self._label}; start its node"))

        run.search = self._clock.call_at(when, look)

    def take(self, message: Any) -> None:
        """Take a message: it ends every run."""
        for run in tuple(self._runs):
            run.finish(self._served.result(message))

    def _feedback(self) -> str:
        return f"waiting for {self._label}"

    def _on_end(self, run: _WaitRun) -> None:
        self._runs.remove(run)


@dataclass(frozen=True, slots=True)
class Taken:
    """The fate of an answer.

    Attributes:
        accepted: Whether a mission has it, or may still get it.
        text: The same for people.
    """

    accepted: bool
    text: str


class AnswerWait(MessageWait):
    """Waits for the answer to what the robot says.

    An answer counts while somebody waits for it. One that comes while the robot still speaks, or within
    ``keep_s`` after the sentence, or after a wait that ended without an answer, is kept for the next wait for
    an answer to the same sentence. What nobody takes is reported. One that sounds like a
    choice of the mission is that choice.

    Args:
        clock: The time of the robot.
        label: Names the source for people.
        served: What an answer means, and how long to wait for one.
        report: Told a line about an answer that nobody takes.
    """

    def __init__(
        self, clock: Clock, label: str, served: QuestionBinding, report: Callable[[str], None]
    ) -> None:
        super().__init__(clock, label, served)
        self._keep_s = served.keep_s
        self._choices_of = served.choices
        self._choices: Sequence[str] = ()
        self._report = report
        self._sentence = ""
        self._open_until = -math.inf
        self._kept: Any = None
        self._expiry: Timer | None = None

    @property
    def question(self) -> str:
        """The question for which an answer would count now; empty when there is none."""
        if self._runs or self._clock.now() <= self._open_until:
            return f"{self._sentence!r}" if self._sentence else "a question without words"
        return ""

    @property
    def question_with_choices(self) -> str:
        """The question, with a line for each answer that the mission names; empty when there is none."""
        choices = [" ".join(each.split()) for each in self._choices] if self._runs else []
        return "\n  ".join([self.question, *filter(None, choices)])

    def hear(self, sentence: str) -> None:
        """Take what the robot says now; empty when it is silent."""
        if not sentence:
            if self._open_until == math.inf:
                self._close_later()
            return
        if sentence != self._sentence:
            self._drop()
        self._sentence, self._open_until = sentence, math.inf
        self._stop_expiry()

    def start(self, inputs: Inputs) -> SkillRun:
        """Wait from now on; an answer that was kept ends the wait at once."""
        run = super().start(inputs)
        self._choices = self._choices_of(inputs)
        kept, self._kept = self._kept, None
        if kept is not None:
            self._give(kept)
        return run

    def take(self, message: Any) -> None:
        """Take an answer: it ends every run, or is kept."""
        self.offer(message)

    def offer(self, message: Any) -> Taken:
        """Take an answer and tell what became of it."""
        question = self.question
        if self._runs:
            self._give(message)
            return Taken(True, f"answered: {question}")
        if not question:
            self._report(f"an answer came that nobody waits for: {_shown(message)}")
            return Taken(False, NOBODY_ASKS)
        self._drop()
        self._kept = message
        return Taken(True, f"kept in case that the mission waits for it: {question}")

    def _give(self, message: Any) -> None:
        meant = _spoken(message.data)
        message.data = next((each for each in self._choices if _spoken(each) == meant), message.data)
        super().take(message)
        self._open_until = -math.inf
        self._stop_expiry()

    def _feedback(self) -> str:
        return f"waits for an answer to {self._sentence!r}" if self._sentence else "waits for an answer"

    def _on_end(self, run: _WaitRun) -> None:
        super()._on_end(run)
        if not self._runs and self._open_until < math.inf:
            self._close_later()

    def _close_later(self) -> None:
        """Let answers count for a while yet, which is then over."""
        self._stop_expiry()
        self._open_until = self._clock.now() + self._keep_s
        self._expiry = self._clock.call_at(self._open_until, self._drop)

    def _stop_expiry(self) -> None:
        if self._expiry is not None:
            self._expiry.cancel()
            self._expiry = None

    def _drop(self) -> None:
        """Report the answer that is kept: no wait will take it."""
        kept, self._kept = self._kept, None
        if kept is not None:
            self._report(f"an answer to {self._sentence!r} came too late: {_shown(kept)}")


def _spoken(text: str) -> str:
    """Strip an answer of what nobody hears: capitals, further spaces, the full stop."""
    return " ".join(text.split()).rstrip(".!?").casefold()


def _shown(message: Any) -> str:
    return repr(message.data[:60])


class _WaitRun(BaseRun):
    """One wait."""

    def __init__(self, feedback: str, on_end: Callable[[_WaitRun], None]) -> None:
        super().__init__(feedback)
        self.handle(Event.ACCEPTED)
        self._on_end = on_end
        self.timer: Timer | None = None
        self.search: Timer | None = None

    def cancel(self) -> None:
        self.finish(cancelled())

    def finish(self, result: Result) -> None:
        if self.result is not None:
            return
        for timer in (self.timer, self.search):
            if timer is not None:
                timer.cancel()
        self._on_end(self)
        self.handle(Event.FINISHED, result)


def _differ(one: Result, other: Result) -> bool:
    """Tell whether two answers differ in more than their words."""
    return (one.code, one.outputs) != (other.code, other.outputs)
