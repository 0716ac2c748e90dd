"""Of docs/notes/promises.md each sentence stands in its page of the manual, and each test is there."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MANUAL = ROOT / "docs/manual"
LIST = (ROOT / "docs/notes/promises.md").read_text(encoding="utf-8")
PART = re.compile(r"^## [^\n]*\(\[(\w+\.md)\]\(\.\./manual/\1\)\)$(.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL)
ROW = re.compile(r"^\| (.+) \| (?:`([\w/]+\.py)::(test_\w+)`|none) \|$", re.MULTILINE)
PROMISES = [(page, *row) for page, rows in PART.findall(LIST) for row in ROW.findall(rows)]
"""Page, sentence, file and name of the test; the last two are empty where there is no test."""
HERE = "tests/unit/test_promises.py"


@cache
def words_of(page):
    return " ".join((MANUAL / page).read_text(encoding="utf-8").split())


@cache
def functions_of(file):
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def problems(page, sentence, file, test):
    if sentence not in words_of(page):
        yield f"{page} does not say: {sentence}"
    if file and not ((ROOT / file).is_file() and test in functions_of(file)):
        yield f"{page}, {sentence}: there is no {file}::{test}"


def test_every_sentence_stands_in_its_page_and_every_test_is_there():
    assert [problem for promise in PROMISES for problem in problems(*promise)] == []


def test_every_page_has_its_part_and_every_line_of_a_table_is_a_row():
    assert {page for page, *_ in PROMISES} == {page.name for page in MANUAL.glob("*.md")}
    headings = LIST.count("\n## ")
    assert len(PROMISES) + 2 * headings == LIST.count("\n|")


@pytest.mark.parametrize(
    ("sentence", "file", "test"),
    [
        ("The robot never stops.", HERE, "test_a_row_that_is_wrong_is_noticed"),
        ("The manual override", HERE, "test_that_is_not_there"),
        ("The manual override", "tests/unit/test_that_is_not_there.py", "test_one"),
    ],
)
def test_a_row_that_is_wrong_is_noticed(sentence, file, test):
    assert len(list(problems("safety.md", sentence, file, test))) == 1
