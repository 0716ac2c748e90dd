"""What skills have in common that another node serves."""

from __future__ import annotations

from typing import Protocol, runtime_checkable


@runtime_checkable
class ServedSkill(Protocol):
    """A skill that needs a server."""

    @property
    def label(self) -> str:
        """Names the server for people."""

    def server_is_there(self) -> bool:
        """Tell whether the server has been discovered."""
