"""Runs that another process performs, as an action or a service, or hears on a topic. No ROS in here.

What is sent goes through a channel; what comes back is passed to the methods of the run.

Two clocks: what the robot does takes the time of ``clock``, simulated or not. Whether another process answers
is measured in ``steady``, the time of this machine: a simulation that runs fast must not make a server late.
"""

from __future__ import annotations

import enum
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

from florence_bt.core.clock import Clock, Timer
from florence_bt.core.errors import FlorenceError
from florence_bt.core.limits import CheckedParameters, Positive
from florence_bt.core.outcome import Outcome, Result, cancelled, failure, success
from florence_bt.core.server_comparison import Lack
from florence_bt.core.skill import BaseRun, Event, FinishedRun, Inputs, Phase, SkillRun

SEARCH_PERIOD_S = 0.05
"""Period of looking for a server that is not there yet: discovery reports nothing by itself."""

SERVER_SETTLE_S = 0.25
"""Wait after a server was found: it may not know the way back to this client yet, and its first answer would
be lost."""

SEARCH_S = 5.0
"""Limit of the search for a server."""
SEARCH_SHARE = 0.8
"""The share of a skill's deadline that the search may take at most: whoever watches the deadline must not be
first, or a server that is not there would read ``timed_out``."""

LOST_S = 1.0
"""Time for which a server may be out of sight: discovery blinks under load."""
WATCH_PERIOD_S = 0.25
"""Period of looking whether the server is still there, and of reading its feedback."""

STANDING_CLOCK = 4.0
"""A cancel is given up after this many times its deadline in steady time, should the robot's clock stand."""

REPEAT_S = 1.0
"""Wait for the answer to a request to stop before the next one, in steady time."""
GIVE_UP_S = 60.0
"""Limit of repeating the request: a server that is gone for this long comes back without its goals."""


@dataclass(frozen=True, slots=True)
class Deadlines(CheckedParameters):
    """The time limits of the states of a run, in seconds.

    Attributes:
        accept_s: From the start to the server's answer to the goal, the search for the server included;
            steady time.
        result_s: From the acceptance to the result; time of the robot.
        cancel_s: From a cancel request to the result; passed when both clocks say so.
        lost_s: How long a server may be out of sight during a run; steady time.
    """

    accept_s: Positive = SEARCH_S
    result_s: Positive = 60.0
    cancel_s: Positive = 5.0
    lost_s: Positive = LOST_S

    @staticmethod
    def within(deadline_s: float) -> Deadlines:
        """Return the usual ones for a skill that declares a deadline."""
        return Deadlines(accept_s=search_limit(deadline_s), result_s=deadline_s)


def search_limit(deadline_s: float) -> float:
    """Return for how long a skill looks for its server, seconds, given the deadline that it declares."""
    return min(SEARCH_S, SEARCH_SHARE * deadline_s)


class Channel(Protocol):
    """The way to the other process, for one run."""

    def server_is_there(self) -> bool:
        """Tell whether the other process has been discovered."""

    def lack(self) -> Lack:
        """Return why the other process cannot be reached, as far as that is known."""

    def send(self) -> None:
        """Send the goal, request or message; an answer comes later."""

    def stop(self) -> None:
        """Ask for the end of what was sent, or forget it where nothing can be taken back."""


class GoalChannel(Channel, Protocol):
    """The way to an action server, for one goal; the answers to ``stop`` come to ``stop_answered``."""

    def goals_server_is_there(self) -> bool:
        """Tell whether a server is there that was there when the goal was accepted, not only a newer one."""

    def servers(self) -> int:
        """Return how many servers of this name have been discovered: each of them receives the goal."""

    def feedback(self) -> str:
        """Return the newest feedback on the goal, for people; empty when there is nothing new."""


class RemoteRun(BaseRun):
    """A run in another process: the search for the other process, the state, and the end.

    Attributes:
        sent: Whether the goal, request or message is out.
    """

    def __init__(self, channel: Channel, steady: Clock, label: str, feedback: str) -> None:
        super().__init__(feedback)
        self._channel = channel
        self._steady = steady
        self._label = label
        self._deadline: Timer | None = None
        self._look: Timer | None = None
        self._came_late = False
        self.sent = False

    def cancel(self) -> None:
        """End the run at once; what was sent is stopped as far as that is possible."""
        self._stop_with(cancelled())

    def finished(self, result: Result) -> None:
        """Take the end that the other process reported; the first result stays."""
        for timer in (self._deadline, self._look):
            if timer is not None:
                timer.cancel()
        self.handle(Event.FINISHED, result)

    def _search(self) -> None:
        """Look for the other process until it is there, then send."""
        if self.phase is Phase.DONE:
            return
        pause = SEARCH_PERIOD_S
        if not self._channel.server_is_there():
            if not self._came_late:
                self._channel.lack()  # what has to be asked for is known when the search is over
            self._came_late = True
        elif self._may_send():
            if not self._came_late:
                self._look = None
                self.sent = True
                self._channel.send()
                return
            self._came_late = False
            pause = SERVER_SETTLE_S
        self._look = self._steady.call_at(self._steady.now() + pause, self._search)

    def _may_send(self) -> bool:
        return True

    def _not_found(self, within_s: float, what: str = "server") -> Result:
        why = str(self._channel.lack()) or "start its node"
        reason = f"no {what} of {self._label} was found within {within_s:g} s; {why}"
        return failure("server_lost", reason)

    def _stop_with(self, result: Result) -> None:
        if self.phase is Phase.DONE:
            return
        if self.sent:
            self._channel.stop()
        self.finished(result)

    def _set_deadline(self, timer: Timer) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
        self._deadline = timer


class RemoteSkill(ABC):
    """A skill whose runs another process performs.

    Attributes:
        label: Names the action, service or topic, for people.
    """

    def __init__(self, label: str, what: str, to_message: Callable[[Inputs], Any]) -> None:
        self.label = label
        self._what = what
        self._to_message = to_message

    def start(self, inputs: Inputs) -> SkillRun:
        """Send what begins the run as soon as the other process is there."""
        try:
            message = self._to_message(inputs)
        except (FlorenceError, KeyError, TypeError, ValueError) as error:
            return FinishedRun(failure("bad_input", f"no {self._what} for {self.label}: {error}"))
        return self._begin(message, inputs)

    @abstractmethod
    def _begin(self, message: Any, inputs: Inputs) -> SkillRun:
        """Send a message."""


class ServiceRun(RemoteRun):
    """A run of a skill that is one call of a service. A cancel ends it at once; a call cannot be undone."""

    def __init__(self, clock: Clock, channel: Channel, deadline_s: float, label: str) -> None:
        """Begin the run.

        Args:
            clock: Drives the deadline; the steady time.
            channel: The way to the server.
            deadline_s: Seconds from the start to the answer, the search for the server included.
            label: Names the service in reasons.
        """
        super().__init__(channel, clock, label, f"calling {label}")
        self._too_late_at = clock.now() + deadline_s
        within_s = search_limit(deadline_s)
        self._no_answer = failure("timed_out", f"{label} did not answer within {deadline_s:g} s")
        self._set_deadline(
            clock.call_at(clock.now() + within_s, lambda: self._stop_with(self._not_found(within_s)))
        )
        self._search()

    def _search(self) -> None:
        super()._search()
        if self.sent and self.phase is not Phase.DONE:
            self._set_deadline(
                self._steady.call_at(self._too_late_at, lambda: self._stop_with(self._no_answer))
            )
            self._seen = self._steady.now()
            self._watch()

    def _watch(self) -> None:
        now = self._steady.now()
        if self._channel.server_is_there():
            self._seen = now
        elif now - self._seen >= LOST_S:
            self._stop_with(failure("server_lost", f"{self._label} went away during the call"))
            return
        self._look = self._steady.call_at(now + WATCH_PERIOD_S, self._watch)


class PublicationRun(RemoteRun):
    """A run that publishes one message as soon as somebody listens, and has succeeded with that."""

    def __init__(self, clock: Clock, channel: Channel, deadline_s: float, label: str) -> None:
        """Begin the run.

        Args:
            clock: Drives the deadline; the steady time.
            channel: The way to the topic.
            deadline_s: Seconds in which a subscriber must be found.
            label: Names the topic in reasons.
        """
        super().__init__(channel, clock, label, f"publishing on {label}")
        self._set_deadline(
            clock.call_at(
                clock.now() + deadline_s, lambda: self._stop_with(self._not_found(deadline_s, "subscriber"))
            )
        )
        self._search()

    def _search(self) -> None:
        super()._search()
        if self.sent:
            self.finished(success())


class StopAnswer(enum.Enum):
    """The answers of a server to the request to stop a goal (REFERENCE 10, cancel message)."""

    PROMISED = "it will end"
    REFUSED = "it goes on"
    UNKNOWN = "no such goal here"
    OVER = "it has ended already"


class GoalStop:
    """Asks for the end of one goal, again and again until the goal is known to be over.

    One request is not enough: it is lost when the server is out of sight for a moment, and a server may
    refuse it once and accept it later. The requests go on after the run has ended, so that a run which ends
    with its deadline leaves no goal behind.

    Args:
        steady: Times the repetitions; the time of this machine, because the server is a process on it.
        ask: Sends the request.
    """

    def __init__(self, steady: Clock, ask: Callable[[], None]) -> None:
        self._steady = steady
        self._ask = ask
        self._give_up_at = 0.0
        self._timer: Timer | None = None

    @property
    def asking(self) -> bool:
        """Tell whether requests are being repeated."""
        return self._timer is not None

    def begin(self) -> None:
        """Ask now, and again until :meth:`end`; harmless while it is asking already."""
        if self._timer is None:
            self.ask_now()

    def ask_now(self) -> None:
        """Ask at once, also between two repetitions."""
        self.end()
        self._give_up_at = self._steady.now() + GIVE_UP_S
        self._once_more()

    def end(self) -> None:
        """Ask no more: the goal is over, or the server has promised to end it."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _once_more(self) -> None:
        now = self._steady.now()
        if now >= self._give_up_at:
            self._timer = None
            return
        self._timer = self._steady.call_at(now + REPEAT_S, self._once_more)
        self._ask()


class ActionRun(RemoteRun):
    """A run of a skill that an action server performs.

    Attributes:
        goal_id: The id of its goal, in hexadecimal.
    """

    def __init__(
        self,
        clock: Clock,
        channel: GoalChannel,
        deadlines: Deadlines,
        label: str,
        steady: Clock | None = None,
        goal_id: str = "",
        older: Sequence[ActionRun] = (),
    ) -> None:
        """Begin the run.

        Args:
            clock: The time of the robot.
            channel: The way to the server.
            deadlines: How long each state may last.
            label: Names the action in reasons, e.g. ``navigate_to_pose (nav2_msgs/action/NavigateToPose)``.
            steady: The time of this machine; ``clock`` when not given.
            goal_id: The id of the goal, for reasons.
            older: Runs of the same action that ended while their goals went on: no goal is sent beside those.
        """
        super().__init__(channel, steady or clock, label, f"waiting for {label}")
        self._clock = clock
        self._goal = channel
        self._deadlines = deadlines
        self.goal_id = goal_id
        self._older = older
        self._stop = GoalStop(self._steady, channel.stop)
        self._accepted = False
        self._over = False
        self._refused = False
        self._promised = False
        self._cancel_asked = 0.0
        self._seen = self._steady.now()
        self._set_deadline(self._steady.call_at(self._seen + deadlines.accept_s, self._not_accepted))
        for run in older:
            run.stop_again()
        self._search()

    @property
    def goal_open(self) -> bool:
        """Tell whether a goal may still be running on the server; a node that leaves waits for its end."""
        if not self.sent or self._over:
            return False
        return self._stop.asking or self.phase is not Phase.DONE

    @property
    def goal_left(self) -> bool:
        """Tell whether the run has ended while its goal is not known to be over."""
        return self._accepted and not self._over and self.phase is Phase.DONE

    @property
    def open_goal(self) -> str:
        """The goal with its action, for people."""
        return f"goal {self.goal_id} of {self._label}"

    def stop_again(self) -> None:
        """Ask once more for the end of a goal that was left: the next goal is to be sent."""
        if self.goal_left:
            self._stop.ask_now()

    def cancel(self) -> None:
        """Ask for the end; before the acceptance the request waits for it."""
        if not self.sent:
            self._finish(cancelled("cancelled before the goal was sent"))
            return
        if self.phase is Phase.ACTIVE:
            self._expect_end()
        self._handle(Event.CANCEL)

    def shut_down(self) -> None:
        """Ask for the end also before the acceptance: the node goes away."""
        self.cancel()
        if self.sent and not self._over:
            self._stop.begin()

    def accepted(self) -> None:
        """Note that the server accepted the goal."""
        self._accepted = True
        self._over = False
        if self.phase in (Phase.PENDING, Phase.PENDING_CANCEL):
            if self.phase is Phase.PENDING:
                when = self._clock.now() + self._deadlines.result_s
                self._set_deadline(self._clock.call_at(when, self._no_result))
            else:
                self._expect_end()
            self._seen = self._steady.now()
            self._look = self._steady.call_at(self._seen + WATCH_PERIOD_S, self._watch)
        self._handle(Event.ACCEPTED)
        self.set_feedback(f"running {self._label}")

    def rejected(self) -> None:
        """Note that the server refused the goal."""
        self._stop_duplicates()
        self._goal_is_over()
        if self.phase is Phase.PENDING_CANCEL:
            self._finish(cancelled("cancelled; the server had refused the goal"))
        else:
            self._finish(failure("rejected", f"{self._label} refused the goal; its log says why"))

    def stop_answered(self, answer: StopAnswer) -> None:
        """Take the server's answer to the request to stop."""
        self._refused = answer is StopAnswer.REFUSED
        if answer is StopAnswer.PROMISED or (answer is StopAnswer.OVER and self._promised):
            # rcl calls a goal that is just being cancelled terminated too: its result is the end.
            self._promised = True
            self._stop.end()
        elif answer is StopAnswer.OVER:
            self._goal_is_over()
        elif answer is StopAnswer.UNKNOWN and self._accepted:
            self._goal_is_over()
            self._finish(self._without_server("does not know the goal any more; was it restarted?"))

    def finished(self, result: Result) -> None:
        """Take the end of the goal."""
        self._stop_duplicates()
        self._goal_is_over()
        self._finish(result)

    def _stop_duplicates(self) -> None:
        """Stop the goal on further servers of the same name; only the first answer of any comes here."""
        if not self._over and self._goal.servers() > 1:
            self._channel.stop()

    def _may_send(self) -> bool:
        return not self._left_open()

    def _left_open(self) -> str:
        """Return the goal of an older run that goes on, for people; empty when there is none."""
        return next((run.open_goal for run in self._older if run.goal_left), "")

    def _watch(self) -> None:
        now = self._steady.now()
        news = self._goal.feedback()
        if news:
            self.set_feedback(news)
        if self._goal.goals_server_is_there():
            self._seen = now
        elif now - self._seen >= self._deadlines.lost_s:
            # Perhaps it is only out of sight, and still working: the request is repeated until it answers.
            self._stop.begin()
            self._finish(self._without_server("went away during the run; start its node again"))
            return
        if self.phase is Phase.CANCELLING and self._cancel_age() > STANDING_CLOCK:
            self._give_up_cancel()
            return
        self._look = self._steady.call_at(now + WATCH_PERIOD_S, self._watch)

    def _without_server(self, what: str) -> Result:
        reason = f"{self._label} {what}"
        return cancelled(f"cancelled; {reason}") if self._cancelling() else failure("server_lost", reason)

    def _not_accepted(self) -> None:
        limit = f"within {self._deadlines.accept_s:g} s"
        if not self.sent and self._channel.server_is_there() and (left := self._left_open()):
            reason = (
                f"the {left} is still open although its end was asked for; no second goal was sent {limit}"
            )
            self._finish(failure("timed_out", reason))
            return
        if not self.sent:
            self._finish(self._not_found(self._deadlines.accept_s))
            return
        # Its answer may be lost: a server that works on the goal anyway is asked to stop.
        self._stop.begin()
        if not self._channel.server_is_there():
            self._finish(self._without_server("went away before it answered the goal; start its node again"))
        elif self._cancelling():
            self._finish(cancelled(f"cancelled; {self._no_answer(limit)}"))
        else:
            self._finish(failure("timed_out", self._no_answer(limit)))

    def _no_answer(self, limit: str) -> str:
        return f"{self._label} did not answer the goal {limit}; the goal {self.goal_id} may be open"

    def _no_result(self) -> None:
        # The phase is ACTIVE here: the server still works on a goal that has no run any more.
        self._stop.begin()
        self._finish(
            failure("timed_out", f"{self._label} had no result within {self._deadlines.result_s:g} s")
        )

    def _expect_end(self) -> None:
        self._cancel_asked = self._steady.now()
        when = self._clock.now() + self._deadlines.cancel_s
        self._set_deadline(self._clock.call_at(when, self._not_cancelled))

    def _cancel_age(self) -> float:
        """Return the steady time since the end was asked for, in deadlines."""
        return (self._steady.now() - self._cancel_asked) / self._deadlines.cancel_s

    def _not_cancelled(self) -> None:
        if self._cancel_age() < 1.0:
            # A simulation faster than the other processes.
            when = self._cancel_asked + self._deadlines.cancel_s
            self._set_deadline(self._steady.call_at(when, self._give_up_cancel))
        else:
            self._give_up_cancel()

    def _give_up_cancel(self) -> None:
        answer = "refused to stop" if self._refused else "did not confirm the stop"
        limit = f"within {self._deadlines.cancel_s:g} s"
        self._finish(
            cancelled(f"cancelled, but {self._label} {answer} {limit}; its goal {self.goal_id} is still open")
        )

    def _cancelling(self) -> bool:
        return self.phase in (Phase.PENDING_CANCEL, Phase.CANCELLING)

    def _goal_is_over(self) -> None:
        self._over = True
        self._stop.end()

    def _finish(self, result: Result) -> None:
        if result.outcome is Outcome.FAILED and not result.reason:
            result = replace(result, reason=f"{self._label} failed")
        super().finished(result)

    def _handle(self, event: Event) -> None:
        if self.handle(event):
            self._stop.ask_now()
