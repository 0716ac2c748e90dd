"""docs/manual/maps.md is true: its commands answer what it says. WRITE_DOCS=1 writes it and its pictures."""

from __future__ import annotations

import os
import re
import shlex
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from florence_bt.cli.application import app

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs" / "manual" / "maps.md"
SESSION = re.compile(r"```text\n(\$ .*?)```", re.DOTALL)
PICTURES = {"clean.png": "map_clean.png", "edit.png": "map_edit.png", "my_home/places.png": "map_rooms.png"}


def answers(page: str) -> str:
    def typed(session: re.Match[str]) -> str:
        lines = [line for line in session[1].splitlines() if line.startswith("$ ")]
        answered = [f"{line}\n{answer(line)}" for line in lines]
        return f"```text\n{''.join(answered)}```"

    return SESSION.sub(typed, page)


def answer(line: str) -> str:
    command = shlex.split(line.removeprefix("$ florence "))
    return CliRunner().invoke(app, command, catch_exceptions=False).output


def test_the_page_says_what_the_commands_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = PAGE.read_text(encoding="utf-8")
    for folder in ("maps", "hotspots"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    monkeypatch.chdir(tmp_path)
    true = answers(page)
    if os.environ.get("WRITE_DOCS"):
        PAGE.write_text(true, encoding="utf-8")
        for made, shown in PICTURES.items():
            shutil.copy(made, ROOT / "docs" / "img" / shown)
    assert page == true
    for made, shown in PICTURES.items():
        assert Path(made).exists() and (ROOT / "docs" / "img" / shown).exists()
