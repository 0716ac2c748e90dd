"""Feeds a display with what is known of a run, without ever waiting for anybody."""

from __future__ import annotations

import time

from florence_interfaces.srv import MissionStatus

from florence_bt.app.runs.client import MissionClient, OpenQuestion, status_service
from florence_bt.app.runs.live import LiveDisplay, LogDisplay
from florence_bt.app.runs.whereabouts import Whereabouts

PERIOD_S = 1.0
"""Wall seconds between two questions for the status while the tree stays as it is: times go on."""
SOONEST_S = 0.25
"""The same when the tree has changed: the mission server has better things to do than to draw for viewers."""


class RunFeed:
    """Shows a run on a display.

    The topic of the tree says at once what has changed. A screen shows more than it says, the times and every
    node, so for a screen the mission server is asked; one question at a time.

    Args:
        client: The client that is spun meanwhile.
        display: Where to show the run.
        run_id: The run; empty for whatever runs.
    """

    def __init__(self, client: MissionClient, display: LiveDisplay | LogDisplay, run_id: str = "") -> None:
        self._client = client
        self._display = display
        self._run_id = run_id
        self._where = Whereabouts(client) if isinstance(display, LiveDisplay) else None
        self._question = OpenQuestion(client)
        self._asked_at = float("-inf")
        self._asked_with: tuple[str, bool] = ("", False)
        self._status = ""

    def look(self) -> None:
        """Show what is new; call it often."""
        tree = self._client.tree_of(self._run_id)
        if isinstance(self._display, LogDisplay):
            self._display.show(tree)
            return
        self._ask(tree)
        where = self._where.text() if self._where is not None else ""
        self._display.show(self._status or tree, where, latest=tree)

    def _ask(self, tree: str) -> None:
        answer = self._question.take()
        if answer is not None and answer.found:
            self._status = answer.tree
        now, wanted = time.monotonic(), (tree, self._display.wants_all)
        passed = now - self._asked_at
        if passed >= PERIOD_S or (wanted != self._asked_with and passed >= SOONEST_S):
            request = MissionStatus.Request(run_id=self._run_id, durations=True)
            if self._question.ask(MissionStatus, status_service(self._display.wants_all), request):
                self._asked_at, self._asked_with = now, wanted
