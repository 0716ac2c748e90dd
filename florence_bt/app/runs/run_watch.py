"""Follows one run over ROS to its end, also when messages are missed or the mission server goes away."""

from __future__ import annotations

import time
from typing import Any

from florence_bt.core.errors import DeviceTimeout
from florence_bt.app.runs.client import ACTIVE_STATES, MissionClient, SystemNotThere
from florence_bt.app.bringup.locks import bring_up_here

ASK_PERIOD_S = 2.0
"""Wall seconds between two questions to the mission server."""
RESTART_S = 60.0
"""Wall seconds without an answer after which it is gone although its bring-up runs, which starts it again."""
LIVE_STATES = ("QUEUED", "RUNNING", "PAUSED", "ENDING")
"""States that the status service tells of a run that is not over."""


class RunWatch:
    """Knows whether a run is over.

    The topic ``run_state`` tells it at once, but keeps one message only: the start of the next run may hide
    the end of this one. So the mission server is asked now and then, which shows as well that it is there.

    Args:
        client: The client that is spun meanwhile.
        run_id: The run; empty to watch nothing but the mission server.
    """

    def __init__(self, client: MissionClient, run_id: str = "") -> None:
        self._client = client
        self._run_id = run_id
        self._heard = time.monotonic()
        self._next_question = self._heard + ASK_PERIOD_S
        self._unanswered = 0

    def over(self) -> bool:
        """Whether the run has ended.

        Raises:
            SystemNotThere: The mission server went away, or does not know the run.
        """
        state = self._client.state
        if self._run_id and state.run_id == self._run_id and state.state not in ACTIVE_STATES:
            return True
        if time.monotonic() < self._next_question:
            return False
        over = self._ask()
        self._next_question = time.monotonic() + ASK_PERIOD_S
        return over

    def result(self) -> Any:
        """The status of the run once it is over.

        Raises:
            SystemNotThere: The mission server went away meanwhile; the run was stopped by its end, or before.
        """
        try:
            return self._client.status(self._run_id)
        except (SystemNotThere, DeviceTimeout) as error:
            raise self._gone() from error

    def _ask(self) -> bool:
        try:
            status = self._client.status(self._run_id)
        except (SystemNotThere, DeviceTimeout) as error:
            self._unanswered += 1
            enough = isinstance(error, SystemNotThere) or self._unanswered > 1
            if enough and not (bring_up_here() and time.monotonic() < self._heard + RESTART_S):
                raise self._gone() from error
            return False
        self._unanswered = 0
        self._heard = time.monotonic()
        if self._run_id and not status.found:
            raise SystemNotThere(
                f"the mission server was started anew and knows nothing of the run {self._run_id}"
            )
        return bool(self._run_id) and status.state not in LIVE_STATES

    def _gone(self) -> SystemNotThere:
        state = self._client.state
        last = f"; its last word was: {state.reason}" if state.run_id == self._run_id and state.reason else ""
        return SystemNotThere(f"the mission server went away, see the logs of the bring-up{last}")
