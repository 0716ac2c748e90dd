"""Texts with commas that fell apart between { and }."""

from __future__ import annotations

from pathlib import Path

import pytest

from florence_bt.core.plain_yaml import YamlMapping, parse_yaml
from florence_bt.core.unquoted_commas import unquoted_commas


def torn(text: str) -> list[tuple[str, str]]:
    table = parse_yaml(text.encode(), Path("t.yaml"))
    assert isinstance(table, YamlMapping)
    return [(found.key.text, found.whole) for found in unquoted_commas(table)]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("{a: x, b c}", [("a", "x, b c")]),
        ("{a: x, b c, d}", [("a", "x, b c, d")]),
        ("{a: (1 m, 2 m, 0 deg), b: y, c: 1, z}", [("a", "(1 m, 2 m, 0 deg)"), ("c", "1, z")]),
        ("{k: 1, a: x, ü ö}", [("a", "x, ü ö")]),
    ],
)
def test_what_fell_apart(text: str, found: list[tuple[str, str]]) -> None:
    assert torn(text) == found


@pytest.mark.parametrize(
    "text",
    [
        "{a: x, b c: }",
        "{a: x, b: y}",
        "{a: 'x', b c}",
        "{a: x, 'b c'}",
        "{a: , b c}",
        "{b c, d e}",
        "{a: [x], b c}",
        "a: x\nb c:\nd:\n",
        '{a: x, b: "y, z", c: ""}',
    ],
)
def test_what_did_not(text: str) -> None:
    assert torn(text) == []


def test_the_quotes_that_would_have_worked() -> None:
    table = parse_yaml(b'{a: he said "no", then left, b: it\'s so, yes}', Path("t.yaml"))
    assert isinstance(table, YamlMapping)
    assert [found.valid for found in unquoted_commas(table)] == [
        "a: 'he said \"no\", then left'",
        'b: "it\'s so, yes"',
    ]
