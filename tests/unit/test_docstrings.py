"""A docstring says what a function does or what a thing is, and not which question it answers."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
QUESTIONS = frozenset(("What", "How", "Where", "Who", "Whose", "Whether", "Which", "When", "Why"))
FOLDERS = ("florence_bt", "packages", "tools")
LEFT_OUT = ("florence_bt/assurance", "packages/florence_page", "packages/florence_sweep", "tools/trials")
"""Where texts of modules and constants may still be so; a place that has none any more goes from here."""


def questions(text: str) -> Iterator[tuple[int, str]]:
    """Yield the line and the first words of each docstring that begins with a question."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef) and is_question(
            ast.get_docstring(node)
        ):
            yield node.lineno, first_words(ast.get_docstring(node))


def questions_of_things(text: str) -> Iterator[tuple[int, str]]:
    """Yield the same of the text of the module, and of those below constants and attributes."""
    tree = ast.parse(text)
    if is_question(ast.get_docstring(tree)):
        yield 1, first_words(ast.get_docstring(tree))
    for node in ast.walk(tree):
        statements = getattr(node, "body", None)
        for before, after in pairwise(statements if isinstance(statements, list) else ()):
            if isinstance(before, ast.Assign | ast.AnnAssign) and isinstance(after, ast.Expr):
                words = after.value.value if isinstance(after.value, ast.Constant) else None
                if isinstance(words, str) and is_question(words):
                    yield after.lineno, first_words(words)


def is_question(text: str | None) -> bool:
    return first_words(text).split(" ")[0].rstrip(",:") in QUESTIONS


def first_words(text: str | None) -> str:
    return " ".join((text or "").split()[:4])


def found_in(folder: Path, found: Callable[[str], Iterator[tuple[int, str]]]) -> list[str]:
    return [
        f"{file.relative_to(ROOT)}:{line} {words} ..."
        for file in sorted(folder.rglob("*.py"))
        if "tests" not in file.relative_to(ROOT).parts
        for line, words in found(file.read_text(encoding="utf-8"))
    ]


def test_docstrings_of_functions_and_classes_answer_no_question() -> None:
    assert [each for folder in FOLDERS for each in found_in(ROOT / folder, questions)] == []


def test_texts_of_modules_and_constants_answer_no_question() -> None:
    found = [each for folder in FOLDERS for each in found_in(ROOT / folder, questions_of_things)]
    assert [each for each in found if not each.startswith(LEFT_OUT)] == []


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ('def f():\n    """Whether it runs."""', [1]),
        ('class A:\n    """What it is."""\n    def f(self):\n        """Tell whether it runs."""', [1]),
        ('async def f():\n    """Whenever it runs, it stops."""\ndef g(): ...', []),
    ],
)
def test_a_question_is_found(text: str, lines: list[int]) -> None:
    assert [line for line, _ in questions(text)] == lines


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ('"""Where things are."""', [1]),
        ('"""Places."""\nA = 1\n"""How many there are."""\nB: int = 2\n"""Number of others."""', [3]),
        ('class A:\n    """A thing."""\n    b: int = 1\n    """What it is."""', [4]),
        ('def f():\n    """What it does."""', []),
    ],
)
def test_a_question_of_a_module_or_constant_is_found(text: str, lines: list[int]) -> None:
    assert [line for line, _ in questions_of_things(text)] == lines
