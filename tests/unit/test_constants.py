"""A public constant has one value by its name: what is the same has one home, all else another name."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "florence_bt"
LEFT_OUT = ("skills/people", "simulation/rig", "drivers", "trees/checks", "runtime/journal")
"""Folders that are still to be gone through."""


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


def places() -> dict[str, dict[float, list[str]]]:
    """Return where each name has which value."""
    found: dict[str, dict[float, list[str]]] = defaultdict(lambda: defaultdict(list))
    for file in sorted(PACKAGE.rglob("*.py")):
        path = str(file.relative_to(PACKAGE))
        if not path.startswith(tuple(f"{folder}/" for folder in LEFT_OUT)):
            for name, value, line in numbers(file.read_text(encoding="utf-8")):
                found[name][value].append(f"{path}:{line}")
    return found


def test_one_name_has_one_value() -> None:
    several = {name: dict(values) for name, values in places().items() if len(values) > 1}
    assert several == {}, "give what is the same one home, and what is not another name"


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
