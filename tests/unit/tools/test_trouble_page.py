"""docs/manual/trouble.md knows every code that a mission can fail with, and quotes what the code says."""

import ast
import re
from pathlib import Path

import pytest

from florence_bt.core.outcome import COMMON_CODES
from florence_bt.runtime.recovery.recovery import CRASHED
from florence_bt.trees.kinds.words import TREE_CODES
from florence_bt.trees.language.code_groups import groups_of
from florence_bt.trees.language.declarations import own_declarations
from florence_bt.trees.language.declared_skills import STOCK, read_skills_file
from florence_bt.trees.language.outcomes import OWN_CODES

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "manual" / "trouble.md").read_text(encoding="utf-8")
SKILLS = {**read_skills_file(STOCK).declarations, **own_declarations()}
CODES = {
    *COMMON_CODES,
    *OWN_CODES,
    *TREE_CODES,
    *(code for skill in SKILLS.values() for code in skill.failures),
}
MISSIONS = (ROOT / "florence_bt" / "trees" / "missions").glob("*.yaml")
OF_MISSIONS = {code for file in MISSIONS for code in re.findall(r"\bcode: (\w+)", file.read_text())}
OF_RUNS = {"stopped", "spinning", "internal_error", CRASHED, *groups_of(SKILLS)}


def sentences() -> list[str]:
    """What the code can say, with … for each value that is put in."""
    found = []
    for file in (ROOT / "florence_bt").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.JoinedStr):
                parts = (part.value if isinstance(part, ast.Constant) else "…" for part in node.values)
                found.append("".join(map(str, parts)))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                found.append(node.value)
    return found


def headings() -> set[str]:
    return {
        code for line in re.findall(r"^###? .*$", PAGE, re.MULTILINE) for code in re.findall(r"`(\w+)`", line)
    }


def test_every_code_has_its_place():
    assert CODES - set(re.findall(r"`(\w+)`", PAGE)) == set()


def test_there_are_no_other_codes():
    assert headings() - CODES - OF_MISSIONS - OF_RUNS == set()


@pytest.mark.slow
def test_what_it_quotes_is_what_the_code_says():
    said = "\n".join(sentences())
    quoted = re.findall(r"^> (.*)$", PAGE, re.MULTILINE)
    assert len(quoted) > 30
    assert [quote for quote in quoted if quote not in said] == []


@pytest.mark.parametrize("command", sorted(set(re.findall(r"`florence (\w+)", PAGE))))
def test_the_commands_exist(command):
    from typer.main import get_command

    from florence_bt.cli.application import app

    assert command in get_command(app).commands
