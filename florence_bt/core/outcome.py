"""Outcomes of skills, with the reason."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


class Outcome(enum.Enum):
    """The ways in which a run of a skill can end."""

    SUCCEEDED = "succeeded"
    FAILED = "failed"
    """The skill tried and could not, or refused the goal."""
    CANCELLED = "cancelled"
    """Somebody asked for the end."""


@dataclass(frozen=True, slots=True)
class Result:
    """The end of one run of a skill.

    Attributes:
        outcome: Which way it ended.
        code: A short name for programs, e.g. ``no_path``; one of the codes that the skill declares, or one
            of the codes that every skill may end with (:data:`COMMON_CODES`). ``ok`` on success.
        reason: A sentence for people. Never empty on failure.
        outputs: The declared outputs of the skill.
    """

    outcome: Outcome
    code: str = "ok"
    reason: str = ""
    outputs: Mapping[str, Any] = field(default_factory=dict)

    @property
    def succeeded(self) -> bool:
        """Tell whether the skill did what was asked."""
        return self.outcome is Outcome.SUCCEEDED


COMMON_CODES: dict[str, str] = {
    "rejected": "the server refused the goal",
    "timed_out": "a deadline of the run passed",
    "server_lost": "the server is not there or went away",
    "cancelled": "the run was cancelled",
    "bad_input": "an input is outside what the skill accepts",
}
"""Codes that any skill may end with, beside those it declares."""


LASTING_CODES = frozenset({"no_skill", "bad_input", "bad_output", "bad_expression"})
"""Codes of mistakes in a mission or a robot: who asks again gets the same answer."""


def success(**outputs: Any) -> Result:
    """Make a successful end with the given outputs."""
    return Result(Outcome.SUCCEEDED, outputs=outputs)


def failure(code: str, reason: str, **outputs: Any) -> Result:
    """Make a failed end.

    Args:
        code: The name that the skill declares for this failure.
        reason: A sentence for people.
        **outputs: What is known in spite of the failure.
    """
    return Result(Outcome.FAILED, code, reason, outputs)


def cancelled(reason: str = "cancelled on request") -> Result:
    """Make the end of a run that was cancelled."""
    return Result(Outcome.CANCELLED, "cancelled", reason)
