"""What is said of a text that is not YAML: what is wrong, in plain words, and what would have worked."""

from pathlib import Path

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.plain_yaml import parse_yaml

MISTAKES = {
    "say: 'it's over'": (
        (1, 10),
        "the text goes on after its closing quote",
        """quotes round the whole value: "it's over\"""",
    ),
    "a: [x] y": ((1, 8), "the line goes on after the closing ]", 'if it is text: a: "[x] y"'),
    "a: {b: 1}}": ((1, 10), "a } too many", "the line without it"),
    "a: > b": ((1, 6), "text that begins with > needs quotes", 'a: "> b"'),
    "a: b: c": ((1, 5), "text with a colon needs quotes, and a table braces", "a: {b: c}"),
    "a: b:\n  - c": ((1, 5), "one colon on a line", "b: on the next, indented further"),
    "a: @b": ((1, 4), "this character cannot begin a value", 'a: "@b"'),
    "a: {b: c": ((1, 9), "the { before is not closed, or a comma is missing", "a } where it ends"),
    "a: 'b": ((1, 6), "a quote is not closed", "a closing quote"),
    "a\nb: 1": ((2, 2), "a colon is missing in line 1", "a:"),
    "a:\n  b: 1\n c: 2": (
        (3, 2),
        "this line does not fit those above it (begun in line 1)",
        "2 spaces before it, as in line 2",
    ),
    "a: b\n  c: d": (
        (2, 4),
        "this line is indented deeper than line 1, which has a value already",
        "0 spaces before it, as in line 1",
    ),
    "x: {a: ${b}}": ((1, 9), "${...} needs quotes between { and }", 'quotes round it: "${...}"'),
    "a:\n\tb: 1": ((2, 1), "a tab in the indentation", "spaces"),
}


@pytest.mark.parametrize("text", MISTAKES)
def test_a_mistake_is_explained_with_its_place(text):
    place, problem, would_work = MISTAKES[text]
    with pytest.raises(ConfigError) as raised:
        parse_yaml(f"{text}\n".encode(), Path("m.yaml"))
    error = raised.value
    assert ((error.line, error.column), error.problem.removeprefix("not YAML: ")) == (place, problem)
    assert would_work in error.valid
