"""One run of a goal on an action server: which events lead where, and what a passed deadline means.

No ROS in here: what is sent to the server goes through :class:`GoalChannel`; what the server says comes in
through the methods ``accepted``, ``rejected``, ``finished`` and ``stop_answered``.

Two clocks: what the robot does takes the time of ``clock``, simulated or not; whether another process answers
is a matter of ``steady``, the time of this machine. A simulation that runs fast must not make a server late.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from florence_bt.core.clock import Clock, Timer
from florence_bt.core.errors import ConfigError
from florence_bt.core.outcome import Outcome, Result, cancelled, failure
from florence_bt.core.skill import Event, Phase, RunState
from florence_bt.ros._goal_stop import GoalStop, StopAnswer


@dataclass(frozen=True, slots=True)
class Deadlines:
    """How long each state of a run may last, in seconds.

    Attributes:
        accept_s: From the start to the server's answer to the goal, the search for the server included;
            steady time.
        result_s: From the acceptance to the result; time of the robot.
        cancel_s: From a cancel request to the result; passed when both clocks say so.
        lost_s: How long a server may be out of sight during a run; discovery blinks under load; steady time.
    """

    accept_s: float = 5.0
    result_s: float = 60.0
    cancel_s: float = 5.0
    lost_s: float = 1.0

    def __post_init__(self) -> None:
        """Refuse times that are not above zero."""
        for name in ("accept_s", "result_s", "cancel_s", "lost_s"):
            if not getattr(self, name) > 0.0:
                raise ConfigError(f"the deadline {name} must be above zero, not {getattr(self, name)}")


class GoalChannel(Protocol):
    """The way to the server, for one goal."""

    def server_is_there(self) -> bool:
        """Whether a server is in sight."""

    def goals_server_is_there(self) -> bool:
        """Whether a server is in sight that was there when the goal was taken, not only a newer one."""

    def servers(self) -> int:
        """How many servers of this name are in sight: each of them is sent the goal."""

    def send_goal(self) -> None:
        """Send the goal; the answer comes later."""

    def send_cancel(self) -> None:
        """Ask for the goal's end, any time after it was sent; the answer comes to ``stop_answered``."""

    def feedback(self) -> str:
        """The newest that the server told about the goal, for people; empty when there is nothing new."""


SEARCH_PERIOD_S = 0.05
"""How often to look for a server that is not there yet: discovery reports nothing by itself."""

SETTLE_S = 0.25
"""How long a server that was just found is left alone: it may not know the way back to this client yet, and
its first answer would be lost."""

WATCH_PERIOD_S = 0.25
"""How often to look whether the server is still there, and what it told last."""

STANDING_CLOCK = 4.0
"""A cancel is given up after this many times its deadline in steady time, should the robot's clock stand."""


class ActionRun:
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
        self._clock = clock
        self._steady = steady or clock
        self._channel = channel
        self._deadlines = deadlines
        self._label = label
        self.goal_id = goal_id
        self._older = older
        self._state = RunState(f"waiting for {label}")
        self._stop = GoalStop(self._steady, channel.send_cancel)
        self._sent = False
        self._accepted = False
        self._over = False
        self._refused = False
        self._promised = False
        self._cancel_asked = 0.0
        now = self._steady.now()
        self._deadline: Timer = self._steady.call_at(now + deadlines.accept_s, self._not_accepted)
        self._look: Timer | None = None
        self._seen = now
        self._came_late = False
        for run in older:
            run.stop_again()
        self._search()

    @property
    def feedback(self) -> str:
        """What the run does now."""
        return self._state.feedback

    @property
    def phase(self) -> Phase:
        """Where the run stands."""
        return self._state.phase

    @property
    def goal_open(self) -> bool:
        """Whether a goal may be running on the server that nobody has ended: to be waited for at the end."""
        if not self._sent or self._over:
            return False
        return self._stop.asking or self._state.phase is not Phase.DONE

    @property
    def goal_left(self) -> bool:
        """Whether the run has ended while its goal is not known to be over."""
        return self._accepted and not self._over and self._state.phase is Phase.DONE

    @property
    def open_goal(self) -> str:
        """The goal with its action, for people."""
        return f"goal {self.goal_id} of {self._label}"

    def stop_again(self) -> None:
        """Ask once more for the end of a goal that was left: somebody wants to send the next one."""
        if self.goal_left:
            self._stop.ask_now()

    def poll(self) -> Result | None:
        """The result, or None while the run goes on."""
        return self._state.result

    def on_change(self, callback: Callable[[], None]) -> None:
        """Call back whenever there is something new."""
        self._state.on_change(callback)

    def cancel(self) -> None:
        """Ask for the end; before the acceptance the request waits for it."""
        if not self._sent:
            self._finish(cancelled("cancelled before the goal was sent"))
            return
        if self._state.phase is Phase.ACTIVE:
            self._expect_end()
        self._handle(Event.CANCEL)

    def shut_down(self) -> None:
        """Ask for the end although nobody will be there for the acceptance: the node goes away."""
        self.cancel()
        if self._sent and not self._over:
            self._stop.begin()

    def set_feedback(self, text: str) -> None:
        """The server told what it does."""
        self._state.set_feedback(text)

    def accepted(self) -> None:
        """The server took the goal."""
        self._accepted = True
        self._over = False
        if self._state.phase in (Phase.PENDING, Phase.PENDING_CANCEL):
            if self._state.phase is Phase.PENDING:
                when = self._clock.now() + self._deadlines.result_s
                self._set_deadline(self._clock.call_at(when, self._no_result))
            else:
                self._expect_end()
            self._seen = self._steady.now()
            self._look = self._steady.call_at(self._seen + WATCH_PERIOD_S, self._watch)
        self._handle(Event.ACCEPTED)
        self.set_feedback(f"running {self._label}")

    def rejected(self) -> None:
        """The server refused the goal."""
        self._stop_twins()
        self._goal_is_over()
        if self._state.phase is Phase.PENDING_CANCEL:
            self._finish(cancelled("cancelled; the server had refused the goal"))
        else:
            self._finish(failure("rejected", f"{self._label} refused the goal; its log says why"))

    def stop_answered(self, answer: StopAnswer) -> None:
        """The server answered the request to stop."""
        self._refused = answer is StopAnswer.REFUSED
        if answer is StopAnswer.PROMISED or (answer is StopAnswer.OVER and self._promised):
            # rcl calls a goal that is just being cancelled terminated too: its result tells the end.
            self._promised = True
            self._stop.end()
        elif answer is StopAnswer.OVER:
            self._goal_is_over()
        elif answer is StopAnswer.UNKNOWN and self._accepted:
            self._goal_is_over()
            self._finish(self._without_server("knows nothing of the goal any more; was it started anew?"))

    def finished(self, result: Result) -> None:
        """The goal came to its end."""
        self._stop_twins()
        self._goal_is_over()
        self._finish(result)

    def _stop_twins(self) -> None:
        """A second server of the same name was sent the goal too; only the first answer of any comes here."""
        if not self._over and self._channel.servers() > 1:
            self._channel.send_cancel()

    def _search(self) -> None:
        if self._state.phase is Phase.DONE:
            return
        if not self._channel.server_is_there():
            self._came_late = True
            self._look = self._steady.call_at(self._steady.now() + SEARCH_PERIOD_S, self._search)
        elif self._left_open():
            self._look = self._steady.call_at(self._steady.now() + SEARCH_PERIOD_S, self._search)
        elif self._came_late:
            self._came_late = False
            self._look = self._steady.call_at(self._steady.now() + SETTLE_S, self._search)
        else:
            self._sent = True
            self._look = None
            self._channel.send_goal()

    def _left_open(self) -> str:
        """The goal of an older run that goes on, for people; empty when there is none."""
        return next((run.open_goal for run in self._older if run.goal_left), "")

    def _watch(self) -> None:
        now = self._steady.now()
        told = self._channel.feedback()
        if told:
            self.set_feedback(told)
        if self._channel.goals_server_is_there():
            self._seen = now
        elif now - self._seen >= self._deadlines.lost_s:
            # Perhaps it is only out of sight, and still working: it is asked until it answers.
            self._stop.begin()
            self._finish(self._without_server("went away during the run; start its node again"))
            return
        if self._state.phase is Phase.CANCELLING and self._cancel_age() > STANDING_CLOCK:
            self._give_up_cancel()
            return
        self._look = self._steady.call_at(now + WATCH_PERIOD_S, self._watch)

    def _without_server(self, what: str) -> Result:
        reason = f"{self._label} {what}"
        return cancelled(f"cancelled; {reason}") if self._cancelling() else failure("server_lost", reason)

    def _not_accepted(self) -> None:
        limit = f"within {self._deadlines.accept_s:g} s"
        if not self._sent and self._channel.server_is_there() and (left := self._left_open()):
            reason = (
                f"the {left} is still open although its end was asked for; no second goal was sent {limit}"
            )
            self._finish(failure("timed_out", reason))
            return
        if not self._sent:
            self._finish(
                failure(
                    "server_lost", f"nobody serves {self._label}, looked {limit}; start the node that does"
                )
            )
            return
        # Its answer may have got lost: whoever works on the goal all the same is told to stop.
        self._stop.begin()
        if self._cancelling():
            self._finish(cancelled(f"cancelled; {self._no_answer(limit)}"))
        else:
            self._finish(failure("timed_out", self._no_answer(limit)))

    def _no_answer(self, limit: str) -> str:
        return f"{self._label} did not answer the goal {limit}; the goal {self.goal_id} may be open"

    def _no_result(self) -> None:
        # The phase is ACTIVE here: the server still works, and nobody will look at the goal any more.
        self._stop.begin()
        self._finish(
            failure("timed_out", f"{self._label} had no result within {self._deadlines.result_s:g} s")
        )

    def _expect_end(self) -> None:
        self._cancel_asked = self._steady.now()
        when = self._clock.now() + self._deadlines.cancel_s
        self._set_deadline(self._clock.call_at(when, self._not_cancelled))

    def _cancel_age(self) -> float:
        """Steady time since the end was asked for, in deadlines."""
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
        return self._state.phase in (Phase.PENDING_CANCEL, Phase.CANCELLING)

    def _goal_is_over(self) -> None:
        self._over = True
        self._stop.end()

    def _finish(self, result: Result) -> None:
        self._deadline.cancel()
        if self._look is not None:
            self._look.cancel()
        if result.outcome is Outcome.FAILED and not result.reason:
            result = Result(
                result.outcome, result.code, f"{self._label} failed", result.outputs, result.server_code
            )
        self._handle(Event.FINISHED, result)

    def _set_deadline(self, timer: Timer) -> None:
        self._deadline.cancel()
        self._deadline = timer

    def _handle(self, event: Event, result: Result | None = None) -> None:
        if self._state.handle(event, result):
            self._stop.ask_now()
