"""docs/manual/places.md is true: its files are read, and its commands answer what the page says."""

from __future__ import annotations

import os
import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from florence_bt.cli.application import app

PAGE = Path(__file__).parents[3] / "docs" / "manual" / "places.md"
FILE = re.compile(r"`(\w+\.yaml)`[^`]*```yaml\n(.*?)```", re.DOTALL)
SESSION = re.compile(r"```text\n(\$ .*?)```", re.DOTALL)


def answers(page: str) -> str:
    """The page with the answers of the commands typed in its order."""

    def typed(session: re.Match[str]) -> str:
        lines = [line for line in session[1].splitlines() if line.startswith("$ ")]
        answered = [f"{line}\n{answer(line.removeprefix('$ florence '))}" for line in lines]
        return f"```text\n{''.join(answered)}```"

    return SESSION.sub(typed, page)


def answer(command: str) -> str:
    return CliRunner().invoke(app, shlex.split(command), catch_exceptions=False).output


def test_the_page_says_what_the_commands_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = PAGE.read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    files = FILE.findall(page)
    assert [name for name, _ in files] == ["home.yaml", "wrong.yaml"]
    for name, text in files:
        (tmp_path / name).write_text(text, encoding="utf-8")
    true = answers(page)
    if os.environ.get("WRITE_DOCS"):
        PAGE.write_text(true, encoding="utf-8")
    assert page == true
