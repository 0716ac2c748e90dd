"""Findings of the checks of a mission file."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.plain_yaml import Position

ERROR = "error"
"""The mission cannot run."""
WARNING = "warning"
"""The mission can run but probably does not do what the author wants."""
MAX_FINDINGS = 200
"""Findings of one file that are kept; a file of another kind could have tens of thousands."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One problem in a mission file.

    Attributes:
        file: The file.
        line: 1-based.
        column: 1-based.
        severity: ``error`` or ``warning``.
        message: What is wrong, one sentence.
        valid: What would have worked, most likely first.
    """

    file: str
    line: int
    column: int
    severity: str
    message: str
    valid: tuple[str, ...] = ()

    def as_error(self) -> ConfigError:
        """Convert the finding to an exception."""
        return ConfigError(self.message, file=self.file, line=self.line, column=self.column, valid=self.valid)


class FindingList:
    """Collects the findings of one file; those beyond what is ever shown are dropped.

    Args:
        file: The file, named in the findings.
        imported: Whether another project's tree became the mission; what it does in vain is only a warning.

    Attributes:
        findings: What was added, as far as it is shown.
        count: How many were added.
    """

    def __init__(self, file: Path, *, imported: bool = False) -> None:
        self.findings: list[Finding] = []
        self.count = 0
        self._imported = imported
        self._file = str(file)

    @property
    def full(self) -> bool:
        """Tell whether more was added than is ever shown."""
        return len(self.findings) > MAX_FINDINGS

    def error(self, position: Position, message: str, valid: Iterable[str] = ()) -> None:
        """Add an error."""
        self._add(position, ERROR, message, valid)

    def add_error(self, error: ConfigError) -> None:
        """Add what was raised about a part of the file."""
        self.error(Position(error.line or 1, error.column or 1), error.problem, error.valid)

    def warning(self, position: Position, message: str, valid: Iterable[str] = ()) -> None:
        """Add a warning."""
        self._add(position, WARNING, message, valid)

    def in_vain(self, position: Position, message: str, valid: Iterable[str] = ()) -> None:
        """Add what can never work, is never reached or has no effect: an error where we are the authors."""
        self._add(position, WARNING if self._imported else ERROR, message, valid)

    def unknown(
        self,
        position: Position,
        message: str,
        name: str,
        names: Iterable[str],
        *,
        severity: str = ERROR,
        suggestions: Iterable[str] = (),
    ) -> None:
        """Add a name that does not exist, with suggestions and the names that look like it."""
        valid = () if self.full else (*suggestions, *closest_first(name, names))
        self._add(position, severity, message, valid)

    def _add(self, position: Position, severity: str, message: str, valid: Iterable[str]) -> None:
        self.count += 1
        if not self.full:
            place = position.line, position.column
            self.findings.append(Finding(self._file, *place, severity, message, tuple(valid)))


def finding_from_error(error: ConfigError) -> Finding:
    """Convert a configuration error to a finding."""
    return Finding(error.file or "", error.line or 1, error.column or 1, ERROR, error.problem, error.valid)


def sort_findings(findings: Iterable[Finding]) -> list[Finding]:
    """Order findings by file and place, each once."""
    return sorted(set(findings), key=lambda f: (f.file, f.line, f.column, f.severity, f.message))


def limit_findings(findings: Iterable[Finding]) -> list[Finding]:
    """Order findings and leave out what exceeds :data:`MAX_FINDINGS` in one file; a last finding says so."""
    kept: list[Finding] = []
    counts: dict[str, int] = {}
    for finding in sort_findings(findings):
        counts[finding.file] = counts.get(finding.file, 0) + 1
        if counts[finding.file] <= MAX_FINDINGS:
            kept.append(finding)
        elif counts[finding.file] == MAX_FINDINGS + 1:
            message = f"more than {MAX_FINDINGS} problems in this file; the rest is not shown"
            kept.append(Finding(finding.file, finding.line, finding.column, ERROR, message))
    return kept


def has_errors(findings: Iterable[Finding]) -> bool:
    """Tell whether any finding keeps a mission from running."""
    return any(finding.severity == ERROR for finding in findings)


def raise_first_error(findings: Iterable[Finding]) -> None:
    """Refuse what has errors.

    Raises:
        ConfigError: The first of the findings that is an error.
    """
    for finding in findings:
        if finding.severity == ERROR:
            raise finding.as_error()
