"""One run of a goal on an action server: which events lead where, and what a passed deadline means.

No ROS in here: what is sent to the server goes through :class:`GoalChannel`; what the server says comes in
through the methods ``accepted``, ``rejected``, ``finished`` and ``cancel_refused``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from florence_bt.core.clock import Clock, Timer
from florence_bt.core.errors import ConfigError
from florence_bt.core.outcome import Outcome, Result, cancelled, failure
from florence_bt.core.skill import Event, Phase, RunState


@dataclass(frozen=True, slots=True)
class Deadlines:
    """How long each state of a run may last, in seconds.

    Attributes:
        accept_s: From the start to the server's answer to the goal, the search for the server included.
        result_s: From the acceptance to the result.
        cancel_s: From a cancel request to the result.
        lost_s: How long a server may be out of sight during a run; discovery blinks under load.
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

    def send_goal(self) -> None:
        """Send the goal; the answer comes later."""

    def send_cancel(self) -> None:
        """Ask for the goal's end; called only after the acceptance."""


SEARCH_PERIOD_S = 0.05
"""How often to look for a server that is not there yet: discovery reports nothing by itself."""

WATCH_PERIOD_S = 0.25
"""How often to look whether the server is still there."""


class ActionRun:
    """A run of a skill that an action server performs."""

    def __init__(self, clock: Clock, channel: GoalChannel, deadlines: Deadlines, label: str) -> None:
        """Begin the run.

        Args:
            clock: Drives the deadlines.
            channel: The way to the server.
            deadlines: How long each state may last.
            label: Names the action in reasons, e.g. ``navigate_to_pose (nav2_msgs/action/NavigateToPose)``.
        """
        self._clock = clock
        self._channel = channel
        self._deadlines = deadlines
        self._label = label
        self._state = RunState(f"waiting for {label}")
        self._sent = False
        self._refused = False
        self._stop_reason = ""
        self._deadline: Timer = clock.call_at(clock.now() + deadlines.accept_s, self._not_accepted)
        self._look: Timer | None = None
        self._seen = clock.now()
        self._search()

    @property
    def feedback(self) -> str:
        """What the run does now."""
        return self._state.feedback

    @property
    def phase(self) -> Phase:
        """Where the run stands."""
        return self._state.phase

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
            self._restart_deadline(self._deadlines.cancel_s, self._not_cancelled)
        self._handle(Event.CANCEL)

    def set_feedback(self, text: str) -> None:
        """The server told what it does."""
        self._state.set_feedback(text)

    def accepted(self) -> None:
        """The server took the goal."""
        if self._state.phase in (Phase.PENDING, Phase.PENDING_CANCEL):
            if self._state.phase is Phase.PENDING:
                self._restart_deadline(self._deadlines.result_s, self._no_result)
            else:
                self._restart_deadline(self._deadlines.cancel_s, self._not_cancelled)
            self._seen = self._clock.now()
            self._look = self._clock.call_at(self._seen + WATCH_PERIOD_S, self._watch)
        self._handle(Event.ACCEPTED)
        self.set_feedback(f"running {self._label}")

    def rejected(self) -> None:
        """The server refused the goal."""
        if self._state.phase is Phase.PENDING_CANCEL:
            self._finish(cancelled("cancelled; the server had refused the goal"))
        else:
            self._finish(failure("rejected", f"{self._label} refused the goal; its log says why"))

    def cancel_refused(self) -> None:
        """The server will not stop the goal."""
        self._refused = True

    def finished(self, result: Result) -> None:
        """The goal came to its end."""
        self._finish(result)

    def _search(self) -> None:
        if self._state.phase is Phase.DONE:
            return
        if self._channel.server_is_there():
            self._sent = True
            self._look = None
            self._channel.send_goal()
        else:
            self._look = self._clock.call_at(self._clock.now() + SEARCH_PERIOD_S, self._search)

    def _watch(self) -> None:
        now = self._clock.now()
        if self._channel.server_is_there():
            self._seen = now
        elif now - self._seen >= self._deadlines.lost_s:
            reason = f"{self._label} went away during the run; start its node again"
            self._finish(
                cancelled(f"cancelled; {reason}") if self._cancelling() else failure("server_lost", reason)
            )
            return
        self._look = self._clock.call_at(now + WATCH_PERIOD_S, self._watch)

    def _not_accepted(self) -> None:
        limit = f"within {self._deadlines.accept_s:g} s"
        if not self._sent:
            self._finish(
                failure(
                    "server_lost", f"nobody serves {self._label}, looked {limit}; start the node that does"
                )
            )
        elif self._cancelling():
            self._finish(cancelled(f"cancelled; {self._label} did not answer the goal {limit}"))
        else:
            self._finish(failure("timed_out", f"{self._label} did not answer the goal {limit}"))

    def _no_result(self) -> None:
        # The phase is ACTIVE here: the server still works, and nobody will look at the goal any more.
        self._channel.send_cancel()
        self._finish(
            failure("timed_out", f"{self._label} had no result within {self._deadlines.result_s:g} s")
        )

    def _not_cancelled(self) -> None:
        answer = "refused to stop" if self._refused else "did not confirm the stop"
        self._finish(
            cancelled(f"cancelled, but {self._label} {answer} within {self._deadlines.cancel_s:g} s")
        )

    def _cancelling(self) -> bool:
        return self._state.phase in (Phase.PENDING_CANCEL, Phase.CANCELLING)

    def _finish(self, result: Result) -> None:
        self._deadline.cancel()
        if self._look is not None:
            self._look.cancel()
        if result.outcome is Outcome.FAILED and not result.reason:
            result = Result(
                result.outcome, result.code, f"{self._label} failed", result.outputs, result.server_code
            )
        self._handle(Event.FINISHED, result)

    def _restart_deadline(self, seconds: float, callback: Callable[[], None]) -> None:
        self._deadline.cancel()
        self._deadline = self._clock.call_at(self._clock.now() + seconds, callback)

    def _handle(self, event: Event, result: Result | None = None) -> None:
        if self._state.handle(event, result):
            self._channel.send_cancel()
