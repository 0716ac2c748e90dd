"""Findings as text for people, as JSON and as annotations for a continuous-integration service."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import asdict

from florence_bt.trees.checks._excerpt import Excerpts, marks_under
from florence_bt.trees.language.findings import ERROR, Finding

MAX_VALID = 8
"""How many of the things that would have worked are shown in a text."""
MAX_MESSAGE = 400
"""How many characters of a message are shown in a text."""

_RED, _YELLOW, _GREEN, _BOLD, _PLAIN = "\x1b[1;31m", "\x1b[1;33m", "\x1b[32m", "\x1b[1m", "\x1b[0m"

__all__ = [
    "FORMATS",
    "Excerpts",
    "report_full",
    "report_github",
    "report_json",
    "report_text",
    "summary",
]

Report = Callable[[Iterable[Finding], Excerpts], str]
"""Findings and the lines that they are about to a text."""


def report_text(findings: Iterable[Finding]) -> str:
    """One line per finding: ``file:line:column: severity: message (would have worked: ...)``."""
    return "\n".join(f"{f.file}:{f.line}:{f.column}: {f.severity}: {_with_valid(f)}" for f in findings)


def report_full(findings: Iterable[Finding], excerpts: Excerpts, *, colour: bool = False) -> str:
    """Findings for people: each with the offending line, marks under the offending text, and what would work.

    Args:
        findings: The findings in order.
        excerpts: The lines of the files.
        colour: Whether to use the colours of a terminal.
    """
    return "\n".join(_full(finding, excerpts, colour) for finding in findings)


def report_json(findings: Iterable[Finding], excerpts: Excerpts | None = None) -> str:
    """A JSON list of objects with the fields of :class:`Finding` and the offending ``text``."""
    return json.dumps(
        [{**asdict(finding), "text": _offending(finding, excerpts)} for finding in findings],
        indent=1,
        ensure_ascii=False,
    )


def report_github(findings: Iterable[Finding], excerpts: Excerpts | None = None) -> str:
    """GitHub workflow commands, which show the findings beside the lines of a pull request."""
    return "\n".join(
        f"::{f.severity} file={_escape(f.file, property_=True)},line={f.line},col={f.column}"
        f",endColumn={f.column + max(1, len(_offending(f, excerpts))) - 1},title=florence check"
        f"::{_escape(_with_valid(f))}"
        for f in findings
    )


def summary(findings: Iterable[Finding]) -> str:
    """How many errors and warnings there are, in words."""
    findings = list(findings)
    errors = sum(finding.severity == ERROR for finding in findings)
    warnings = len(findings) - errors
    if not findings:
        return "no problem found"
    return f"{errors} error{'s' * (errors != 1)}, {warnings} warning{'s' * (warnings != 1)}"


FORMATS: dict[str, Report] = {"text": report_full, "json": report_json, "github": report_github}
"""The formats by name."""


def _full(finding: Finding, excerpts: Excerpts, colour: bool) -> str:
    def painted(text: str, paint: str) -> str:
        return f"{paint}{text}{_PLAIN}" if colour else text

    paint = _RED if finding.severity == ERROR else _YELLOW
    place = painted(f"{finding.file}:{finding.line}:{finding.column}:", _BOLD)
    severity = painted(f"{finding.severity}:", paint)
    lines = [f"{place} {severity} {_shortened(finding.message)}"]
    excerpt = excerpts.of(finding)
    if excerpt is not None:
        number = f"{finding.line:>5}"
        lines += [f"{number} | {excerpt.line}", f"{'':>5} | {painted(marks_under(excerpt), paint)}"]
    if finding.valid:
        lines.append(f"{'':>5} = {painted('would have worked:', _GREEN)} {_valid(finding)}")
    return "\n".join(lines)


def _offending(finding: Finding, excerpts: Excerpts | None) -> str:
    excerpt = excerpts.of(finding) if excerpts is not None else None
    return excerpt.text if excerpt is not None else ""


def _with_valid(finding: Finding) -> str:
    message = _shortened(finding.message)
    return f"{message} (would have worked: {_valid(finding)})" if finding.valid else message


def _valid(finding: Finding) -> str:
    shown = ", ".join(_shortened(each) for each in finding.valid[:MAX_VALID])
    more = len(finding.valid) - MAX_VALID
    return f"{shown} and {more} more" if more > 0 else shown


def _shortened(text: str) -> str:
    """A text on one line, without the middle of what somebody wrote much too long."""
    text = " ".join(text.split("\n"))
    half = MAX_MESSAGE // 2
    return text if len(text) <= MAX_MESSAGE else f"{text[:half]} … {text[-half:]}"


def _escape(text: str, *, property_: bool = False) -> str:
    text = text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")
    return text.replace(":", "%3A").replace(",", "%2C") if property_ else text
