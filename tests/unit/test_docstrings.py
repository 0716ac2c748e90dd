"""A docstring says what a function does or what a thing is, and not which question it answers."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
QUESTIONS = frozenset(("What", "How", "Where", "Who", "Whose", "Whether", "Which", "When", "Why"))
LEFT_OUT = ("florence_bt/assurance/", "packages/florence_page/", "packages/florence_sweep/")
"""Folders of which modules still have such docstrings; one that has none any more goes from here."""


def questions(text: str) -> Iterator[tuple[int, str]]:
    """Yield the line and the first words of each docstring that begins with a question."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            words = (ast.get_docstring(node) or "").split()
            if words and words[0].rstrip(",:") in QUESTIONS:
                yield getattr(node, "lineno", 1), " ".join(words[:4])


def found_in(folder: Path) -> list[str]:
    return [
        f"{file.relative_to(ROOT)}:{line} {words} ..."
        for file in sorted(folder.rglob("*.py"))
        if "tests" not in file.relative_to(ROOT).parts
        for line, words in questions(file.read_text(encoding="utf-8"))
    ]


def test_docstrings_answer_no_question() -> None:
    found = [each for name in ("florence_bt", "packages", "tools") for each in found_in(ROOT / name)]
    assert [each for each in found if not (each.startswith(LEFT_OUT) and ".py:1 " in each)] == []


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ('def f():\n    """Whether it runs."""', [1]),
        ('class A:\n    """What it is."""\n    def f(self):\n        """Tell whether it runs."""', [1]),
        ('"""Where things are."""', [1]),
        ('async def f():\n    """Whenever it runs, it stops."""\ndef g(): ...', []),
    ],
)
def test_a_question_is_found(text: str, lines: list[int]) -> None:
    assert [line for line, _ in questions(text)] == lines
