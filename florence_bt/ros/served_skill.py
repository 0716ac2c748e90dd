"""Common base of the skills that another node serves."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from florence_bt.core.server_comparison import Lack


@runtime_checkable
class ServedSkill(Protocol):
    """A skill that needs a server."""

    @property
    def label(self) -> str:
        """Names the server for people."""

    def server_is_there(self) -> bool:
        """Tell whether the server has been discovered."""

    def lack(self) -> Lack:
        """Return why the server cannot be reached, as far as the graph tells it."""


def server_text(skill: ServedSkill) -> str:
    """Name the server of a skill for people, and why it cannot be reached, where that is known."""
    why = str(skill.lack())
    return f"{skill.label}: {why}" if why else skill.label
