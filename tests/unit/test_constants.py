"""Constants: a public one has one value by its name, and every number of a module has its words.

What is the same has one home, all else another name. The words below one number, or below several that follow
each other, say where it comes from: a source, a measurement, or that it was chosen.
"""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "florence_bt"
LEFT_OUT = ("assurance",)
"""Folders with numbers that have no words yet."""


def numbers(text: str) -> Iterator[tuple[str, float, int]]:
    """Yield name, value and line of each number that a module names in capitals, without underscore."""
    for node in ast.parse(text).body:
        if isinstance(node, ast.Assign):
            target, value = node.targets[0], node.value
        elif isinstance(node, ast.AnnAssign) and node.value is not None:
            target, value = node.target, node.value
        else:
            continue
        names = target.elts if isinstance(target, ast.Tuple) else [target]
        values = value.elts if isinstance(value, ast.Tuple) and len(names) > 1 else [value]
        for name, each in zip(names, values, strict=False):
            if isinstance(name, ast.Name) and name.id[0].isalpha() and name.id.isupper():
                number = _number(each)
                if number is not None:
                    yield name.id, number, node.lineno


def _number(node: ast.expr) -> float | None:
    try:
        value = ast.literal_eval(node)
    except ValueError:
        return None
    return value if isinstance(value, int | float) and not isinstance(value, bool) else None


def undescribed(text: str) -> Iterator[int]:
    """Yield the line of each number of a module that has no words below it, or below those that follow it."""
    waiting: list[int] = []
    for node in ast.parse(text).body:
        value = node.value if isinstance(node, ast.Assign | ast.AnnAssign) else None
        if value is not None and _is_number(value):
            waiting.append(node.lineno)
        elif value is None or _has_text(value):
            if not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
                yield from waiting
            waiting.clear()
    yield from waiting


def _is_number(node: ast.expr) -> bool:
    """Tell whether it is a number, or some numbers in brackets."""
    parts = node.elts if isinstance(node, ast.Tuple) else [node]
    return bool(parts) and all(_number(part) is not None for part in parts)


def _has_text(node: ast.expr) -> bool:
    return any(isinstance(each, ast.Constant) and isinstance(each.value, str) for each in ast.walk(node))


def places() -> dict[str, dict[float, list[str]]]:
    """Return where each name has which value."""
    found: dict[str, dict[float, list[str]]] = defaultdict(lambda: defaultdict(list))
    for file in sorted(PACKAGE.rglob("*.py")):
        for name, value, line in numbers(file.read_text(encoding="utf-8")):
            found[name][value].append(f"{file.relative_to(PACKAGE)}:{line}")
    return found


def test_one_name_has_one_value() -> None:
    several = {name: dict(values) for name, values in places().items() if len(values) > 1}
    assert several == {}, "give what is the same one home, and what is not another name"


def test_every_number_has_its_words() -> None:
    bare = [
        f"{file.relative_to(PACKAGE)}:{line}"
        for file in sorted(PACKAGE.rglob("*.py"))
        if file.relative_to(PACKAGE).parts[0] not in LEFT_OUT
        for line in undescribed(file.read_text(encoding="utf-8"))
    ]
    assert bare == []


def test_there_is_something_to_find() -> None:
    assert len(places()) > 300


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("A_S = 1.5\n_B_S = 2.0\nC = 'x'\nD = True", [("A_S", 1.5, 1)]),
        ("A_S, B_S = 0.1, -2\nE: int = 3", [("A_S", 0.1, 1), ("B_S", -2, 1), ("E", 3, 2)]),
        ("def f():\n    A = 1", []),
    ],
)
def test_the_numbers_of_a_module(text: str, found: list[tuple[str, float, int]]) -> None:
    assert list(numbers(text)) == found


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ('A = 1\n"""Chosen."""\nB = 2', [3]),
        ('A = 1\nB = 2, -3\n"""Chosen."""', []),
        ('_A = 1.5\nC = "x"\nB = 2\n"""Chosen."""', [1]),
        ('A = 1\nB = 2 * A\n"""Chosen."""', []),
        ("def f():\n    A = 1", []),
    ],
)
def test_a_number_without_words_is_found(text: str, lines: list[int]) -> None:
    assert list(undescribed(text)) == lines
