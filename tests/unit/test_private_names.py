"""Tests look at what a user relies on: the private attributes that they still touch become fewer.

Counted are attributes with one underscore of anything but ``self``, ``cls`` and ``super()``.
"""

from __future__ import annotations

import ast
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TOUCHED = {
    "packages/florence_btcpp": 1,
    "packages/florence_page": 6,
    "packages/florence_sweep": 2,
    "tests": 2,
    "tests/emulators": 10,
    "tests/hardware": 1,
    "tests/ros": 55,
    "tests/unit/app": 10,
    "tests/unit/behaviours": 1,
    "tests/unit/drivers": 1,
    "tests/unit/ros": 1,
    "tests/unit/runtime": 9,
    "tests/unit/simulation": 3,
    "tests/unit/skills": 10,
    "tests/unit/tools": 2,
}
"""So many places there are in each folder of tests. Whoever mends one lowers the number."""


def private_attributes(text: str) -> list[int]:
    """Return the line of each private attribute of something else."""
    return [
        node.lineno
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Attribute) and node.attr.startswith("_") and not node.attr.startswith("__")
        if not _is_own(node.value)
    ]


def _is_own(node: ast.expr) -> bool:
    if isinstance(node, ast.Call):
        return isinstance(node.func, ast.Name) and node.func.id == "super"
    return isinstance(node, ast.Name) and node.id in ("self", "cls")


def folder_of(file: Path) -> str:
    parts = file.relative_to(ROOT).parent.parts
    return "/".join(parts[:3] if parts[0] == "tests" else parts[:2])


def test_no_folder_of_tests_touches_more_private_attributes_than_before() -> None:
    touched: Counter[str] = Counter()
    for file in [*ROOT.glob("tests/**/*.py"), *ROOT.glob("packages/*/tests/**/*.py")]:
        touched[folder_of(file)] += len(private_attributes(file.read_text(encoding="utf-8")))
    more = {folder: count for folder, count in touched.items() if count > TOUCHED.get(folder, 0)}
    assert more == {}, "assert on what a user relies on"


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("a._b\na.b._c()\na.__dict__", [1, 2]),
        ("class A(B):\n    def f(self):\n        self._a = super()._a + cls._a", []),
    ],
)
def test_a_private_attribute_of_something_else_is_found(text: str, lines: list[int]) -> None:
    assert private_attributes(text) == lines
