"""One call of a service as a run: no ROS in here."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from florence_bt.core.clock import Clock
from florence_bt.core.outcome import Result, cancelled, failure
from florence_bt.core.skill import Event, Phase, RunState
from florence_bt.ros._action_run import SEARCH_PERIOD_S, SETTLE_S


class CallChannel(Protocol):
    """The way to the server, for one call."""

    def server_is_there(self) -> bool:
        """Whether a server is in sight."""

    def send_request(self) -> None:
        """Send the request; the answer comes later."""

    def drop_request(self) -> None:
        """Nobody waits for the answer any more."""


class ServiceRun:
    """A run of a skill that is one call of a service. A cancel ends it at once; a call cannot be undone."""

    def __init__(self, clock: Clock, channel: CallChannel, deadline_s: float, label: str) -> None:
        """Begin the run.

        Args:
            clock: Drives the deadline; the steady time, because whether another process answers is no matter
                of the simulated time.
            channel: The way to the server.
            deadline_s: Seconds from the start to the answer, the search for the server included.
            label: Names the service in reasons.
        """
        self._clock = clock
        self._channel = channel
        self._deadline_s = deadline_s
        self._label = label
        self._state = RunState(f"calling {label}")
        self._sent = False
        self._deadline = clock.call_at(clock.now() + deadline_s, self._too_late)
        self._came_late = False
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

    def cancel(self) -> None:
        """End the run."""
        self._end_early(cancelled())

    def answered(self, result: Result) -> None:
        """The server answered."""
        self._deadline.cancel()
        self._state.handle(Event.FINISHED, result)

    def _search(self) -> None:
        if self._state.phase is Phase.DONE:
            return
        if not self._channel.server_is_there():
            self._came_late = True
            self._clock.call_at(self._clock.now() + SEARCH_PERIOD_S, self._search)
        elif self._came_late:
            self._came_late = False
            self._clock.call_at(self._clock.now() + SETTLE_S, self._search)
        else:
            self._sent = True
            self._channel.send_request()

    def _too_late(self) -> None:
        limit = f"within {self._deadline_s:g} s"
        if self._sent:
            self._end_early(failure("timed_out", f"{self._label} did not answer {limit}"))
        else:
            self._end_early(
                failure(
                    "server_lost", f"nobody serves {self._label}, looked {limit}; start the node that does"
                )
            )

    def _end_early(self, result: Result) -> None:
        if self._state.phase is Phase.DONE:
            return
        if self._sent:
            self._channel.drop_request()
        self.answered(result)
