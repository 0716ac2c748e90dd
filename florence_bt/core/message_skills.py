"""Skills that are answered by the messages of some source, such as a topic. No ROS in here."""

from __future__ import annotations

import math
import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from florence_bt.core.clock import Clock, Timer
from florence_bt.core.errors import FlorenceError
from florence_bt.core.outcome import Result, cancelled, failure
from florence_bt.core.serving import QuestionBinding, WaitBinding
from florence_bt.core.skill import BaseRun, Event, FinishedRun, Inputs, SkillRun

SOURCE_LOOK_S = 1.0
"""Period of looking whether a source that speaks only when something changes is still there, while somebody
watches or waits. Chosen: as fast as a killed server is noticed during a call."""
SAID_WITH_S = 0.5
"""Delay with which the sentence of a node beside a wait may begin and still be the words of the question.
Chosen: the way of a sentence to the voice and back takes some hundredths of a second."""
NOBODY_ASKS = "no mission waits for an answer"
NOT_ASKED = "the robot does not ask this any more"


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
        why_silent: Gives why nothing can come, as far as that is known.
    """

    def __init__(
        self,
        clock: Clock,
        label: str,
        to_result: Callable[[Inputs, Any], Result],
        max_age_s: float,
        source_is_there: Callable[[], bool] = lambda: True,
        why_silent: Callable[[], str] = lambda: "",
    ) -> None:
        self._clock = clock
        self._label = label
        self._why_silent = why_silent
        self._refused = ""
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
        self._refused = ""
        self._limit_silence()
        self._judge_again()

    def refuse(self, problem: str) -> None:
        """Note that a message came that cannot be used, and why."""
        self._refused = problem
        self._judge_again()

    def _judge(self, inputs: Inputs) -> Result:
        old = self._clock.now() - self._came >= self._max_age_s
        if self._refused and (self._message is None or old):
            return failure("bad_output", f"what comes from {self._label} cannot be used: {self._refused}")
        if self._message is None:
            why = self._why_silent()
            return failure(
                "server_lost", f"nothing has come from {self._label} yet{f'; {why}' if why else ''}"
            )
        if old:
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
            self._silence = self._clock.call_at(now + SOURCE_LOOK_S, self._look_again)
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
        why_silent: Gives why nothing can come, as far as that is known.
    """

    def __init__(
        self,
        clock: Clock,
        label: str,
        served: WaitBinding,
        source_is_there: Callable[[], bool] = lambda: True,
        search_s: float = math.inf,
        why_silent: Callable[[], str] = lambda: "",
    ) -> None:
        self._clock = clock
        self._label = label
        self._why_silent = why_silent
        self._refused = ""
        self._served = served
        self._source_is_there = source_is_there
        self._search_s = search_s
        self._runs: list[_WaitRun] = []

    def start(self, inputs: Inputs) -> SkillRun:
        """Wait from now on; what came before does not count."""
        run = self._new_run(inputs)
        self._runs.append(run)
        self._refused = ""
        end = self._clock.now() + self._served.time_limit(inputs)
        run.timer = self._clock.call_at(end, lambda: run.finish(self._nothing(inputs)))
        if self._search_s < math.inf:
            if not self._source_is_there():
                self._why_silent()  # what has to be asked for is known when the search is over
            self._look_for_source(run, self._clock.now() + self._search_s)
        return run

    def _look_for_source(self, run: _WaitRun, when: float) -> None:
        def look() -> None:
            if self._source_is_there():
                self._look_for_source(run, self._clock.now() + SOURCE_LOOK_S)
            else:
                why = self._why_silent() or "start its node"
                run.finish(failure("server_lost", f"nobody publishes {self._label}; {why}"))

        run.search = self._clock.call_at(when, look)

    def _nothing(self, inputs: Inputs) -> Result:
        """Return the end of a wait in which no message came that can be used."""
        result = self._served.nothing(inputs)
        if not self._refused:
            return result
        return replace(result, reason=f"what came from {self._label} cannot be used: {self._refused}")

    def refuse(self, problem: str) -> None:
        """Note that a message came that cannot be used, and why; the wait goes on."""
        self._refused = problem

    def take(self, message: Any) -> None:
        """Take a message: it ends every run."""
        for run in tuple(self._runs):
            run.finish(self._served.result(message))

    def _new_run(self, inputs: Inputs) -> _WaitRun:
        return _WaitRun(f"waiting for {self._label}", self._on_end)

    def _on_end(self, run: _WaitRun) -> None:
        self._runs.remove(run)


@dataclass(frozen=True, slots=True)
class Taken:
    """The fate of an answer.

    Attributes:
        accepted: Whether a mission has it.
        text: The same for people.
    """

    accepted: bool
    text: str


@dataclass(frozen=True, slots=True)
class AskedQuestion:
    """The question that a node of a mission waits to be answered.

    Attributes:
        id: Names this wait alone, also among those of other processes.
        text: What the robot has said; empty when it waits without words.
        choices: The answers that the mission names, without further spaces.
    """

    id: str
    text: str
    choices: tuple[str, ...]

    def __str__(self) -> str:
        return repr(self.text) if self.text else "a question without words"


class AnswerWait(MessageWait):
    """Waits for the answer to what the robot says.

    Only a wait asks, and each is a question of its own. Its words are the sentence that was said last. When
    that is over for ``keep_s``, one that begins within :data:`SAID_WITH_S`, beside the wait, is it instead.

    An answer that names a question counts for that one, while it is open. One that names none counts for the
    open questions that have it as a choice, else for all of them. What sounds like a choice is that choice.

    What is heard (:meth:`take`) while the robot speaks, or within ``keep_s`` after the sentence, and before a
    node waits, is kept for the first that does, unless that has choices and this is none of them. What nobody
    takes is reported.

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
        self._open: list[_QuestionRun] = []
        self._report = report
        self._sentence = ""
        self._asked = False
        self._early_until = -math.inf
        self._kept: Any = None
        self._expiry: Timer | None = None

    @property
    def questions(self) -> tuple[AskedQuestion, ...]:
        """The questions that are open, the oldest first."""
        return tuple(run.question for run in self._open)

    def hear(self, sentence: str) -> None:
        """Take what the robot says now; empty when it is silent."""
        if not sentence:
            if self._early_until == math.inf:
                self._keep_until(self._clock.now() + self._keep_s)
            return
        self._drop()
        self._sentence, self._asked = sentence, False
        self._keep_until(math.inf)
        for run in self._open:
            if self._clock.now() <= run.words_until:
                run.say(sentence)
                self._asked = True

    def forget(self) -> None:
        """Forget what was said and heard: another mission follows, or none."""
        self._drop()
        self._sentence = ""
        self._keep_until(-math.inf)

    def start(self, inputs: Inputs) -> SkillRun:
        """Wait from now on; an answer that was kept ends the wait at once."""
        run = super().start(inputs)
        self._asked = True
        kept = self._kept
        if kept is not None:
            choices = self._open[-1].choices
            if choices and _choice(kept.data, choices) is None:
                self._drop()
            else:
                self._kept = None
                self._give(self._open[-1], kept)
        return run

    def take(self, message: Any) -> None:
        """Take an answer that was heard: it ends a wait, is kept, or is reported."""
        early = not self._open and not self._asked and self._clock.now() <= self._early_until
        if early:
            self._drop()
            self._kept = message
        else:
            self.offer(message)

    def offer(self, message: Any, question: str = "") -> Taken:
        """Give an answer to a question that is open, and tell what became of it.

        Args:
            message: The answer.
            question: The id of the question that it was given to; empty for what is open.
        """
        if question:
            meant = [run for run in self._open if run.question.id == question]
        else:
            named = [run for run in self._open if _choice(message.data, run.choices) is not None]
            meant = named or list(self._open)
        if not meant:
            self._report(f"an answer came that nobody waits for: {_shown(message)}")
            return Taken(False, NOT_ASKED if question else NOBODY_ASKS)
        for run in meant:
            self._give(run, message)
        return Taken(True, "answered: " + "; ".join(str(run.question) for run in meant))

    def _give(self, run: _QuestionRun, message: Any) -> None:
        if run.question.text == self._sentence:
            self.forget()
        choice = _choice(message.data, run.choices)
        run.finish(self._served.result(message if choice is None else type(message)(data=choice)))

    def _new_run(self, inputs: Inputs) -> _WaitRun:
        now = self._clock.now()
        words_until = -math.inf if now <= self._early_until else now + SAID_WITH_S
        run = _QuestionRun(self._sentence, tuple(self._choices_of(inputs)), words_until, self._on_end)
        self._open.append(run)
        return run

    def _on_end(self, run: _WaitRun) -> None:
        super()._on_end(run)
        self._open = [each for each in self._open if each is not run]

    def _keep_until(self, when: float) -> None:
        """Let what is heard count for the next question until then."""
        if self._expiry is not None:
            self._expiry.cancel()
        self._early_until = when
        self._expiry = self._clock.call_at(when, self._drop) if abs(when) < math.inf else None

    def _drop(self) -> None:
        """Report the answer that is kept: no wait will take it."""
        kept, self._kept = self._kept, None
        if kept is not None:
            self._report(f"no question took the answer to {self._sentence!r}: {_shown(kept)}")


def _choice(text: str, choices: Sequence[str]) -> str | None:
    """Return the choice that an answer sounds like; None when it is no choice."""
    meant = _spoken(text)
    return next((each for each in choices if _spoken(each) == meant), None)


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


class _QuestionRun(_WaitRun):
    """One wait for an answer.

    Args:
        text: What the robot has said.
        choices: The answers that the mission names.
        words_until: Until when a sentence that begins is what the robot asks.
        on_end: Called in the end.

    Attributes:
        question: The same for people.
    """

    def __init__(
        self, text: str, choices: tuple[str, ...], words_until: float, on_end: Callable[[_WaitRun], None]
    ) -> None:
        shown = tuple(filter(None, (" ".join(each.split()) for each in choices)))
        self.question = AskedQuestion(uuid.uuid4().hex, text, shown)
        self.choices = choices
        self.words_until = words_until
        super().__init__(self._words(), on_end)

    def say(self, sentence: str) -> None:
        """Take what the robot asks."""
        self.question = replace(self.question, text=sentence)
        self.set_feedback(self._words())

    def _words(self) -> str:
        text = self.question.text
        return f"waits for an answer to {text!r}" if text else "waits for an answer"


def _differ(one: Result, other: Result) -> bool:
    """Tell whether two answers differ in more than their words."""
    return (one.code, one.outputs) != (other.code, other.outputs)
