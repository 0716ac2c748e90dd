"""Feeds a display with what is known of a run, without ever waiting for anybody."""

from __future__ import annotations

import time

from florence_interfaces.msg import RunTree as RunTreeMsg
from florence_interfaces.srv import MissionStatus

from florence_bt.app.runs.client import STATUS_SERVICE, MissionClient, OpenQuestion
from florence_bt.app.runs.live import LiveDisplay, LogDisplay
from florence_bt.app.runs.run_trees import run_tree_from_ros
from florence_bt.app.runs.whereabouts import Whereabouts
from florence_bt.runtime.viewers.run_tree import RunTree

STATUS_PERIOD_S = 1.0
"""Wall seconds between two questions for the status: while the tree stays as it is, times go on."""


class RunFeed:
    """Shows a run on a display.

    The topic of the tree says at once what has changed, and nothing while only time goes on: then the mission
    server is asked, one question at a time.

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
        self._told: RunTreeMsg | None = None
        self._shown: RunTree | None = None

    def look(self) -> None:
        """Show what is new; call it often."""
        told = self._client.told_tree
        if told is not self._told:
            self._told = told
            self._take(self._client.tree_of(self._run_id))
        if isinstance(self._display, LiveDisplay):
            self._ask()
            where = self._where.text() if self._where is not None else ""
            if self._shown is not None:
                self._display.show(self._shown, where)
        elif self._shown is not None:
            self._display.show(self._shown)

    def _take(self, tree: RunTree | None) -> None:
        """Keep the newest state of a run: an answer may be older than what the topic has told meanwhile."""
        before = self._shown
        if tree is None or (before is not None and before.run_id == tree.run_id and _is_older(tree, before)):
            return
        self._shown = tree

    def _ask(self) -> None:
        answer = self._question.take()
        if answer is not None and answer.found:
            self._take(run_tree_from_ros(answer.run_tree))
        now = time.monotonic()
        if now - self._asked_at >= STATUS_PERIOD_S:
            request = MissionStatus.Request(run_id=self._run_id)
            if self._question.ask(MissionStatus, STATUS_SERVICE, request):
                self._asked_at = now


def _is_older(one: RunTree, other: RunTree) -> bool:
    return (one.seconds or 0.0) < (other.seconds or 0.0)
