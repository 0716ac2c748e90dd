"""Where the checks put down what they find in one mission."""

from __future__ import annotations

from collections.abc import Iterable

from florence_bt.core.errors import closest_first
from florence_bt.trees.language.findings import ERROR, MAX_FINDINGS, WARNING, Finding
from florence_bt.trees.language.model import Mission
from florence_bt.trees.language.source import Position


class Notes:
    """The findings of one mission.

    Args:
        mission: The mission.
    """

    def __init__(self, mission: Mission) -> None:
        self.findings: list[Finding] = []
        self._file = str(mission.file)

    @property
    def full(self) -> bool:
        """Whether more findings than are ever shown were noted; later ones are dropped."""
        return len(self.findings) > MAX_FINDINGS

    def error(self, position: Position, message: str, valid: Iterable[str] = ()) -> None:
        """Note an error."""
        self._add(position, ERROR, message, valid)

    def warning(self, position: Position, message: str, valid: Iterable[str] = ()) -> None:
        """Note a warning."""
        self._add(position, WARNING, message, valid)

    def unknown(
        self,
        position: Position,
        message: str,
        name: str,
        names: Iterable[str],
        *,
        severity: str = ERROR,
        meant: Iterable[str] = (),
    ) -> None:
        """Note a name that does not exist, with what is probably meant, and the names that look like it."""
        if not self.full:
            self._add(position, severity, message, (*meant, *closest_first(name, names)))

    def _add(self, position: Position, severity: str, message: str, valid: Iterable[str]) -> None:
        if not self.full:
            self.findings.append(
                Finding(self._file, position.line, position.column, severity, message, tuple(valid))
            )
