"""Notes on what an import or export could not carry over, with the line of each."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.core.plain_yaml import Position
from florence_bt.trees.language.findings import ERROR, WARNING, Finding, sort_findings

NOTICE = "notice"
"""Worth knowing, but nothing is lost: a name that changed, a picture's layout left out."""


class LossNotes:
    """Collects findings: errors, losses (warnings) and notices."""

    def __init__(self) -> None:
        self._findings: list[Finding] = []

    def error(self, file: Path, place: Position, message: str, valid: Iterable[str] = ()) -> None:
        """Note what makes the import impossible."""
        self._add(file, place, ERROR, message, valid)

    def failed(self, file: Path, error: ConfigError) -> None:
        """Note that a file cannot be used."""
        self.error(file, Position(error.line or 1, error.column or 1), error.problem, error.valid)

    def lost(self, file: Path, place: Position, message: str, valid: Iterable[str] = ()) -> None:
        """Note what has no equivalent, or behaves differently."""
        self._add(file, place, WARNING, message, valid)

    def notice(self, file: Path, place: Position, message: str) -> None:
        """Note what is worth knowing."""
        self._add(file, place, NOTICE, message, ())

    @property
    def findings(self) -> list[Finding]:
        """Everything noted, by file and place."""
        return sort_findings(self._findings)

    def _add(self, file: Path, place: Position, severity: str, message: str, valid: Iterable[str]) -> None:
        self._findings.append(Finding(str(file), place.line, place.column, severity, message, tuple(valid)))


def losses(findings: Iterable[Finding]) -> int:
    """Count the findings that are losses."""
    return sum(finding.severity == WARNING for finding in findings)
