"""Findings as text for people, as JSON and as annotations for a continuous-integration service.

A text shows the offending line with marks under the offending text, as good compilers do.
"""

from __future__ import annotations

import json
import re
import unicodedata
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.core.text_files import NOT_UTF8, read_bytes, readable
from florence_bt.trees.language.findings import ERROR, Finding

MAX_VALID = 8
"""Things that would have worked which are shown in a text, at most."""
MAX_MESSAGE = 400
"""Characters of a message that are shown in a text, at most."""

_RED, _YELLOW, _GREEN, _BOLD, _PLAIN = "\x1b[1;31m", "\x1b[1;33m", "\x1b[32m", "\x1b[1m", "\x1b[0m"


def report_text(findings: Iterable[Finding]) -> str:
    """Write one line per finding: ``file:line:column: severity: message (would have worked: ...)``."""
    return "\n".join(f"{f.file}:{f.line}:{f.column}: {f.severity}: {_with_valid(f)}" for f in findings)


def report_full(findings: Iterable[Finding], excerpts: Excerpts, *, colour: bool = False) -> str:
    """Write findings for people: each with its line, marks under the offending text, and what would work.

    Args:
        findings: The findings in order.
        excerpts: The lines of the files.
        colour: Whether to use the colours of a terminal.
    """
    return "\n".join(_full(finding, excerpts, colour) for finding in findings)


def report_json(findings: Iterable[Finding], excerpts: Excerpts | None = None) -> str:
    """Write a JSON list of objects with the fields of :class:`Finding` and the offending ``text``."""
    return json.dumps(
        [{**asdict(finding), "text": _offending(finding, excerpts)} for finding in findings],
        indent=1,
        ensure_ascii=False,
    )


def report_github(findings: Iterable[Finding], excerpts: Excerpts | None = None) -> str:
    """Write GitHub workflow commands, which show the findings beside the lines of a pull request."""
    return "\n".join(
        f"::{f.severity} file={_escape(f.file, property_=True)},line={f.line},col={f.column}"
        f",endColumn={f.column + max(1, len(_offending(f, excerpts))) - 1},title=florence check"
        f"::{_escape(_with_valid(f))}"
        for f in findings
    )


def summary(findings: Iterable[Finding]) -> str:
    """Count the errors and warnings, in words."""
    findings = list(findings)
    errors = sum(finding.severity == ERROR for finding in findings)
    warnings = len(findings) - errors
    if not findings:
        return "no problem found"
    return f"{errors} error{'s' * (errors != 1)}, {warnings} warning{'s' * (warnings != 1)}"


FORMATS: dict[str, Callable[[Iterable[Finding], Excerpts], str]] = {
    "text": report_full,
    "json": report_json,
    "github": report_github,
}
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
    """Shorten what somebody wrote much too long: one line, without its middle."""
    text = " ".join(text.split("\n"))
    half = MAX_MESSAGE // 2
    return text if len(text) <= MAX_MESSAGE else f"{text[:half]} … {text[-half:]}"


def _escape(text: str, *, property_: bool = False) -> str:
    text = text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")
    return text.replace(":", "%3A").replace(",", "%2C") if property_ else text


MAX_WIDTH = 100
"""Characters of a line that are shown at most."""
_BEFORE = 60
"""Characters before the offending text that are shown when the line is longer."""

_LINE_BREAK = re.compile("\r\n|\r|\n")
_OFFENDING = re.compile(
    r"""
    "(?:[^"\\]|\\.)*" | '(?:[^']|'')*'     # in quotes, as a whole
    | \$\{[^{}]*\}                         # ${...}
    | \$?[A-Za-z_][A-Za-z0-9_.]*           # a name or $key
    | [<>=!]=?                             # an operator of an expression
    | (?:[^\s,:\]\[{}#]|:(?!\s|$)|\ (?=[A-Za-z°/]))+    # a number, perhaps with its unit after a space
    """,
    re.VERBOSE,
)
_QUOTED = re.compile("'([^'\n]+)'")


@dataclass(frozen=True, slots=True)
class Excerpt:
    """A piece of a line.

    Attributes:
        line: The piece, without control characters.
        start: Where the offending text begins in it, 0-based.
        text: The offending text; empty when the place is behind the end of the line.
    """

    line: str
    start: int
    text: str


class Excerpts:
    """Knows the lines of the files that findings are about; reads each file once.

    Args:
        known: File -> its text, for those that are not on the disk (the standard input).
    """

    def __init__(self, known: Mapping[str, str] | None = None) -> None:
        self._lines = {file: _LINE_BREAK.split(text) for file, text in (known or {}).items()}

    def of(self, finding: Finding) -> Excerpt | None:
        """Return the offending line of a finding, None when the file has no such line or cannot be read."""
        lines = self._lines.get(finding.file)
        if lines is None:
            lines = self._lines[finding.file] = _lines_of(finding.file)
        if not 0 < finding.line <= len(lines) or not lines[finding.line - 1].strip():
            return None
        line, start = lines[finding.line - 1], finding.column - 1
        text = _offending_text(line, start, finding.message)
        first = max(0, start - _BEFORE) if len(line) > MAX_WIDTH else 0
        shown = line[first : first + MAX_WIDTH]
        head, tail = "…" * (first > 0), "…" * (first + MAX_WIDTH < len(line))
        printable = "".join(char if char.isprintable() else " " for char in shown)
        return Excerpt(f"{head}{printable}{tail}", start - first + len(head), text)


def marks_under(excerpt: Excerpt) -> str:
    """Return the carets under the offending text, as wide as it is in a terminal."""
    wide = width(excerpt.line[: excerpt.start])
    room = excerpt.line[excerpt.start : excerpt.start + len(excerpt.text)]
    return " " * wide + "^" * max(1, width(room))


def width(text: Iterable[str]) -> int:
    """Return how many columns of a terminal a text takes."""
    return sum(
        0 if unicodedata.combining(char) else 2 if unicodedata.east_asian_width(char) in "WF" else 1
        for char in text
    )


def _offending_text(line: str, start: int, message: str) -> str:
    """Return the part of a line that a message is about."""
    if NOT_UTF8 in message:
        return line[start : start + 1]  # one byte, whatever stands round it
    match = _OFFENDING.match(line, start)
    text = match[0].rstrip() if match else line[start : start + 1]
    # A text that the message itself quotes is taken as a whole, whatever signs are in it.
    in_message = [quoted for quoted in _QUOTED.findall(message) if line.startswith(quoted, start)]
    return max((text, *in_message), key=len)


def _lines_of(file: str) -> list[str]:
    try:
        text = readable(read_bytes(Path(file)))
    except ConfigError:
        text = None  # the finding itself says that the file cannot be read
    return _LINE_BREAK.split(text) if text is not None else []
