"""Hints for a text that is not YAML, in the words of people who do not know YAML's own."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass

from florence_bt.core._flow_hints import quoted

_KEY = re.compile(r"\s*(?:- +)*(?P<key>[^\s:#'\"{\[][^:#]*): +(?P<value>\S.*)$")
_WORD_AND_COLON = re.compile(r"[\s,]+(?P<word>[a-z_]+):(?=\s|$)")
_TABLE = re.compile(r"[a-z_][a-z0-9_]*:(?: +(?P<rest>[{\[].*|\S+))?")
"""A table in one line: ``room: kitchen``; what has several words is more likely a text."""
_SIGNS = "&*|>?,]}"
"""Signs that at the beginning of a value begin something else than a text; a library never says so."""
_NO_COLON = "could not find expected ':'"
_WORDS = {
    "mapping values are not allowed in this context": "a colon cannot stand here",
    "did not find expected key": "this line does not fit those above it",
    "did not find expected '-' indicator": "this line does not fit the list above it",
    "did not find expected ',' or '}'": "the { before is not closed, or a comma is missing",
    "did not find expected ',' or ']'": "the [ before is not closed, or a comma is missing",
    "did not find expected node content": "a value is missing here",
    "found unexpected end of stream": "a quote is not closed",
    "found character that cannot start any token": "this character cannot begin a value",
    _NO_COLON: "a colon is missing",
    "block sequence entries are not allowed in this context": "a list cannot begin here",
}


@dataclass(frozen=True, slots=True)
class Hint:
    """A problem in plain words.

    Attributes:
        problem: What is wrong.
        valid: What would have worked.
        of_line: Whether it is about this line alone, wherever the thing around it began.
    """

    problem: str
    valid: tuple[str, ...] = ()
    of_line: bool = False


def explain(lines: list[str], line: int, column: int, problem: str, beside: Collection[str] = ()) -> Hint:
    """Say what is wrong where the YAML library gave up.

    Args:
        lines: The lines of the file.
        line: Where it gave up, 1-based.
        column: Likewise.
        problem: What the library says.
        beside: Keys that stand beside others, on lines of their own.

    Returns:
        The problem in plain words (the library's own when there are none), and what to write instead.
    """
    words = _WORDS.get(problem, problem)
    if line > len(lines):
        return Hint(words, _closing(problem))
    before, after = lines[line - 1][: column - 1], lines[line - 1][column - 1 :]
    if (found := _on_its_own_line(lines[line - 1], column, beside)) is not None:
        return found
    if before.endswith("$") and after.startswith("{"):
        return Hint("${...} needs quotes between { and }", ('quotes round it: "${...}"',))
    if _begins_with_quote(before):
        valid = _whole_in_quotes(before, after)
        return Hint("the text goes on after its closing quote", valid, of_line=True)
    if problem.startswith("did not find expected") and _begins_with_bracket(before) and after.strip():
        return _after_a_bracket(lines[line - 1], before.rstrip()[-1], after.strip())
    if (found := _begins_with_sign(lines[line - 1], column)) is not None:
        return found
    if problem == _NO_COLON and _content(before):
        above = next((number for number in range(line - 1, 0, -1) if _content(lines[number - 1])), None)
        if above is not None and " " in _content(before) and _KEY.match(lines[above - 1]):
            problem = f"a colon is missing, or this is the rest of the text of line {above}"
            return Hint(
                problem, (f"{_content(before)}:", f"{_indent(lines[above - 1]) + 2} spaces before it")
            )
        return Hint(words, (f"{_content(before)}:",))
    if "\t" in (after[:1], before[-1:]):
        return Hint("a tab", ("spaces",))
    if problem.startswith("mapping values"):
        return _colon(lines, line, column, words)
    if problem.startswith("did not find expected") and not before.strip(" -"):
        return Hint(words, _indentations(lines, line))
    if problem.startswith("found character"):
        match = _KEY.match(lines[line - 1])
        return Hint(words, (_quoted(match["key"], match["value"]),) if match else ("quotes round the text",))
    return Hint(words, _closing(problem))


def _on_its_own_line(line: str, column: int, beside: Collection[str]) -> Hint | None:
    """Find a key that stands in the line of another one, as in ``run: goto_room with: {...}``."""
    match = _KEY.match(line)
    for found in _WORD_AND_COLON.finditer(line, match.start("value")) if match else ():
        if match and found["word"] in beside and found.start() < column <= found.end() + 1:
            first = line[match.start("key") : found.start()].rstrip(" ,")
            second = line[found.start("word") :].rstrip()
            problem = f"{found['word']!r} goes on a line of its own below {match['key']!r}"
            valid = (f"{first} on this line", f"{second} on the next, indented like {match['key']}")
            return Hint(problem, valid, of_line=True)
    return None


def _begins_with_quote(before: str) -> bool:
    _, colon, value = before.partition(": ")
    value = value.strip()
    return bool(colon) and len(value) > 1 and value[0] in "'\"" and value.endswith(value[0])


def _begins_with_sign(line: str, column: int) -> Hint | None:
    """Find a text such as ``> all the rest`` or ``- a dash``, whose first sign means something in YAML."""
    match = _KEY.match(line)
    if match is None or match["value"][0] not in _SIGNS or column > match.start("value") + 4:
        return None
    valid = _quoted(match["key"], match["value"])
    return Hint(f"text that begins with {match['value'][0]} needs quotes", (valid,), of_line=True)


def _begins_with_bracket(before: str) -> bool:
    """Tell whether a list or a table between brackets ended just before, as in ``name: [draft] a round``."""
    value = before.partition(": ")[2].strip()
    brackets = [char for char in value if char in "[]{}"]
    closed: list[str] = []
    for number, char in enumerate(brackets):
        if char in "[{":
            closed.append("]" if char == "[" else "}")
        elif not closed or closed.pop() != char or (not closed and number < len(brackets) - 1):
            return False
    return not closed and value[:1] in ("[", "{") and value[-1] in "]}"


def _after_a_bracket(line: str, bracket: str, after: str) -> Hint:
    if after[0] in "]}":
        return Hint(f"a {after[0]} too many", ("the line without it",), of_line=True)
    match = _KEY.match(line)
    quoted = (f"if it is text: {_quoted(match['key'], match['value'])}",) if match else ()
    problem = f"the line goes on after the closing {bracket}"
    return Hint(problem, ("nothing after it", *quoted), of_line=True)


def _whole_in_quotes(before: str, after: str) -> tuple[str, ...]:
    """Put a text whose quotes end too soon, such as ``'it's over'``, in the other quotes."""
    value = (before.partition(": ")[2] + after).strip()
    quote = "'" if value[0] == '"' else '"'
    inside = value[1:-1] if value.endswith(value[0]) else value
    return (f"quotes round the whole value: {quote}{inside}{quote}",) if quote not in inside else ()


def _colon(lines: list[str], line: int, column: int, words: str) -> Hint:
    """Explain a colon too many in a text, or one too few in the line above."""
    match = _KEY.match(lines[line - 1])
    if match and column - 1 >= match.start("value"):
        problem, in_quotes = "text with a colon needs quotes", _quoted(match["key"], match["value"])
        table = _TABLE.fullmatch(match["value"].rstrip())
        if table is None:
            return Hint(problem, (in_quotes,))
        if table["rest"] is None:
            below = f"{match['value'].strip()} on the next, indented further"
            return Hint("one colon on a line", (f"{match['key']}: on this line", below), of_line=True)
        in_braces = f"{match['key']}: {{{match['value'].strip()}}}"
        return Hint(f"{problem}, and a table braces", (in_braces, in_quotes))
    above = next((number for number in range(line - 1, 0, -1) if _content(lines[number - 1])), None)
    if above is None:
        return Hint(words)
    content = _content(lines[above - 1])
    if ":" not in content:
        return Hint(f"a colon is missing in line {above}", (f"{content}:",))
    if _indent(lines[line - 1]) > _indent(lines[above - 1]):
        problem = f"this line is indented deeper than line {above}, which has a value already"
        return Hint(problem, _indentations(lines, line))
    return Hint(words)


def _indentations(lines: list[str], line: int) -> tuple[str, ...]:
    """Return how many spaces the lines above have, those with nearly as many first."""
    wrong, dashed = _indent(lines[line - 1]), lines[line - 1].lstrip(" ").startswith("- ")
    seen: dict[int, int] = {}
    for number in range(line - 1, max(0, line - 50), -1):
        above = lines[number - 1]
        if _content(above):
            key = len(above) - len(above.lstrip("- "))
            seen.setdefault(_indent(above) if dashed else key, number)
    near = sorted((abs(spaces - wrong), spaces) for spaces in seen if spaces != wrong)[:2]
    return tuple(f"{n} space{'s' * (n != 1)} before it, as in line {seen[n]}" for _, n in near)


def _quoted(key: str, value: str) -> str:
    return f"{key}: {quoted(value)}"


def _content(line: str) -> str:
    return line.split(" #", 1)[0].strip().removeprefix("- ").strip() if line.lstrip()[:1] != "#" else ""


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip(" "))


def _closing(problem: str) -> tuple[str, ...]:
    for mark in ("}", "]"):
        if problem == f"did not find expected ',' or '{mark}'":
            return (f"a {mark} where it ends", "a comma between two entries")
    if problem.startswith("block sequence entries"):
        return ("each dash on a line of its own", "quotes round it, if it is text")
    return ("a closing quote",) if problem == "found unexpected end of stream" else ()
