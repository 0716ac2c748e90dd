"""The words on ``approach_user/status``: what they say, and how often."""

from __future__ import annotations

MISSIONS = ("detect_user", "approach_user", "goto_user")
"""The missions whose runs the status follows (document, tables 12 and 13)."""
ACTIVE, SUCCEEDED, ABORTED = "ACTIVE", "SUCCEEDED", "ABORTED"
FINAL_REPEATS = 5
"""REFERENCE 12.8."""

_WORDS = {"ACTIVE": ACTIVE, "SUCCEEDED": SUCCEEDED, "ABORTED": ABORTED, "PREEMPTED": ABORTED}


class ApproachStatus:
    """Follows the runs that approach a user: ACTIVE as long as one runs, then its last state a few times."""

    def __init__(self) -> None:
        self._reported_run = ""
        self._word: str | None = None
        self._left = 0
        self._received_any = False

    def take(self, run_id: str, mission: str, state: str) -> bool:
        """Take the state of a mission run.

        Returns:
            Whether there is something to publish.
        """
        first, self._received_any = not self._received_any, True
        word = _WORDS.get(state)
        if mission not in MISSIONS or word is None:
            return False
        if word != ACTIVE and (first or run_id == self._reported_run):
            # The latched end of a run from before this node, or an end that was published already.
            return False
        self._reported_run = "" if word == ACTIVE else run_id
        self._word = word
        self._left = 1 + FINAL_REPEATS
        return True

    def next_word(self) -> str | None:
        """Return the word to publish now, or None when there is nothing left to publish."""
        if self._word is None:
            return None
        if self._word != ACTIVE:
            if self._left == 0:
                self._word = None
                return None
            self._left -= 1
        return self._word
