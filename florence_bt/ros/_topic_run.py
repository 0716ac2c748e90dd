"""One run of a skill that is commanded on one topic and tells its end on another: no ROS in here."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from florence_bt.core.clock import Clock, Timer
from florence_bt.core.outcome import Result, cancelled, failure
from florence_bt.core.skill import Event, Phase, RunState
from florence_bt.ros._action_run import SEARCH_PERIOD_S, Deadlines


class CommandChannel(Protocol):
    """The way to whoever obeys the commands."""

    def listener_is_there(self) -> bool:
        """Whether somebody listens to the commands."""

    def send_command(self) -> None:
        """Publish the command."""

    def send_stop(self) -> None:
        """Publish the command that takes the other one back, if there is one."""


class TopicRun:
    """A run that ends with the first message that says so, a deadline or a cancel.

    A cancel ends it at once, with the stop command on its way: on a topic nobody can confirm it.

    Attributes:
        sent: Whether the command is out, so that messages of the other side may be about this run.
    """

    def __init__(
        self,
        clock: Clock,
        channel: CommandChannel,
        deadlines: Deadlines,
        label: str,
        steady: Clock | None = None,
    ) -> None:
        """Begin the run.

        Args:
            clock: The time of the robot.
            channel: The way to the other side.
            deadlines: ``accept_s`` limits the search for a listener, ``result_s`` the time from the command
                to the end.
            label: Names the topics in reasons.
            steady: The time of this machine; ``clock`` when not given.
        """
        self._clock = clock
        self._steady = steady or clock
        self._channel = channel
        self._deadlines = deadlines
        self._label = label
        self._state = RunState(f"commanding {label}")
        self._deadline: Timer | None = None
        self._give_up_at = 0.0
        self.sent = channel.listener_is_there()
        if self.sent:
            channel.send_command()
            self._limit()
        else:
            self._give_up_at = self._steady.now() + deadlines.accept_s
            self._search()

    @property
    def feedback(self) -> str:
        """What the run does now."""
        return self._state.feedback

    def poll(self) -> Result | None:
        """The result, or None while the run goes on."""
        return self._state.result

    def on_change(self, callback: Callable[[], None]) -> None:
        """Call back whenever there is something new."""
        self._state.on_change(callback)

    def set_feedback(self, text: str) -> None:
        """The other side told what it does."""
        self._state.set_feedback(text)

    def cancel(self) -> None:
        """Take the command back and end the run."""
        self._stop_with(cancelled())

    def finished(self, result: Result) -> None:
        """The other side told the end."""
        self._state.handle(Event.FINISHED, result)
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None

    def _search(self) -> None:
        if self._state.phase is Phase.DONE:
            return
        if self._channel.listener_is_there():
            self.sent = True
            self._channel.send_command()
            self._limit()
        elif self._steady.now() >= self._give_up_at:
            limit = f"within {self._deadlines.accept_s:g} s"
            reason = f"nobody listens to {self._label}, looked {limit}; start the node that does"
            self.finished(failure("server_lost", reason))
        else:
            self._steady.call_at(self._steady.now() + SEARCH_PERIOD_S, self._search)

    def _limit(self) -> None:
        """After the command: nothing stands between the end of one run and the command of the next."""
        when = self._clock.now() + self._deadlines.result_s
        self._deadline = self._clock.call_at(when, self._too_late)

    def _too_late(self) -> None:
        limit = f"within {self._deadlines.result_s:g} s"
        self._stop_with(failure("timed_out", f"{self._label} told no end {limit}"))

    def _stop_with(self, result: Result) -> None:
        if self._state.phase is Phase.DONE:
            return
        if self.sent:
            self._channel.send_stop()
        self.finished(result)
