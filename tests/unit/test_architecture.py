"""ARCHITECTURE.md and the walks name folders, modules and functions that exist."""

import ast
import re
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "florence_bt"
TEXT = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
WALKS = (ROOT / "docs" / "notes" / "walks.md").read_text(encoding="utf-8")
QUOTED = sorted(set(re.findall(r"`([^`\n]+)`", TEXT + WALKS)))


FUNCTIONS = ast.FunctionDef | ast.AsyncFunctionDef


def methods(classes: set[str]) -> set[str]:
    """The methods of the classes with these names, as ``Class.method``."""
    found = set()
    for file in [*PACKAGE.rglob("*.py"), *(ROOT / "packages").glob("*/florence_*/**/*.py")]:
        text = file.read_text(encoding="utf-8")
        if not classes.isdisjoint(re.findall(r"^class (\w+)", text, re.M)):
            for node in ast.parse(text).body:
                if isinstance(node, ast.ClassDef):
                    parts = (
                        part for part in node.body if isinstance(part, ast.FunctionDef | ast.AsyncFunctionDef)
                    )
                    found |= {f"{node.name}.{part.name}" for part in parts}
    return found


@pytest.mark.parametrize("name", [name for name in QUOTED if re.fullmatch(r"[a-z_]+/[a-z_/]*(/|\.py)", name)])
def test_modules_exist(name):
    assert (PACKAGE / name).exists()


def test_methods_exist():
    named = {name for name in QUOTED if re.fullmatch(r"[A-Z]\w+\.[a-z_]+", name)}
    assert len(named) >= 10
    assert named <= methods({name.partition(".")[0] for name in named})


def test_the_table_has_every_layer_and_folder():
    layers = dict.fromkeys(re.findall(r"^\| `(\w+)` \|", TEXT, re.M))
    rest = {"behaviours", "skills", "drivers"}
    assert set(layers) == {path.parent.name for path in PACKAGE.glob("*/__init__.py")} >= rest
    for folder in ("app", "simulation", "skills", "trees"):
        for part in (PACKAGE / folder).glob("*/__init__.py"):
            assert f"`{part.parent.name}`" in TEXT, part


def test_no_two_files_of_tests_have_one_name():
    """A report names the file alone."""
    names = Counter(
        path.name for folder in ("tests", "packages") for path in (ROOT / folder).rglob("test_*.py")
    )
    assert [name for name, count in names.items() if count > 1] == []


def test_the_skills_without_ports_are_those_that_are_named():
    nodes = (PACKAGE / "skills").rglob("node.py")
    without = {path.parent.name for path in nodes if "RosPorts" not in path.read_text(encoding="utf-8")}
    named = TEXT.partition("All skills are built so but")[2].partition(";")[0]
    assert set(re.findall(r"`(\w+)`", named)) == without
