"""Findings as text for people, as JSON and as annotations for a continuous-integration service."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict

from florence_bt.trees.findings import ERROR, Finding

MAX_VALID = 8
"""How many of the things that would have worked are shown in a text."""


def report_text(findings: Iterable[Finding]) -> str:
    """One line per finding: ``file:line:column: severity: message (would have worked: ...)``."""
    return "\n".join(f"{f.file}:{f.line}:{f.column}: {f.severity}: {_with_valid(f)}" for f in findings)


def report_json(findings: Iterable[Finding]) -> str:
    """A JSON list of objects with the fields of :class:`Finding`."""
    return json.dumps([asdict(finding) for finding in findings], indent=1, ensure_ascii=False)


def report_github(findings: Iterable[Finding]) -> str:
    """GitHub workflow commands, which show the findings beside the lines of a pull request."""
    return "\n".join(
        f"::{f.severity} file={_escape(f.file, property_=True)},line={f.line},col={f.column}"
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


FORMATS = {"text": report_text, "json": report_json, "github": report_github}
"""The formats by name."""


def _with_valid(finding: Finding) -> str:
    if not finding.valid:
        return finding.message
    shown = ", ".join(finding.valid[:MAX_VALID])
    more = len(finding.valid) - MAX_VALID
    return f"{finding.message} (would have worked: {shown}{f' and {more} more' if more > 0 else ''})"


def _escape(text: str, *, property_: bool = False) -> str:
    text = text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")
    return text.replace(":", "%3A").replace(",", "%2C") if property_ else text
