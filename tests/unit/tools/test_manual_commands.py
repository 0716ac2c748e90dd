"""The commands of the manual exist, with their options; those run that need no robot and no system.

What pages show as a session is typed in other tests: ``test_first_hour.py``, ``test_places_docs.py``,
``test_authors_missions.py`` and ``tests/ros/test_first_fifteen_minutes.py``.
"""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command
from typer.testing import CliRunner

from florence_bt.cli.application import app
from tools.first_hour import blocks_of

ROOT = Path(__file__).parents[3]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs" / "manual").glob("*.md")])
BLOCK = re.compile(r"^( *)```(\w*)[^\n]*\n(.*?)^\1```", re.DOTALL | re.MULTILINE)
TYPED = ("sh", "console", "text", "")
PROMPTED = re.compile(r"^ *(?:\$ )?((?:\w+=\S+ )*florence .*)$", re.MULTILINE)
INLINE = re.compile(r"`(florence [^`]+)`")
EXAMPLES = {"COMMAND", "..."}
"""What stands for any command."""
FLORENCE: Any = get_command(app)
CONTEXT = FLORENCE.make_context("florence", [], resilient_parsing=True)


def commands_of(page: Path) -> list[str]:
    text = page.read_text(encoding="utf-8")
    typed = [block[3].replace("\\\n", " ") for block in BLOCK.finditer(text) if block[2] in TYPED]
    inline = (" ".join(command.split()) for command in INLINE.findall(BLOCK.sub("", text)))
    return sorted({*(command for block in typed for command in PROMPTED.findall(block)), *inline})


def wrong_in(typed: str) -> str | None:
    """The first word of a command that ``florence`` does not know."""
    words = shlex.split(re.split(r" [|>&#]|;", typed)[0].replace("[", "").replace("]", ""), comments=True)
    group: Any = FLORENCE
    rest = words[words.index("florence") + 1 :]
    while hasattr(group, "commands") and rest and not rest[0].startswith("-"):
        name = rest.pop(0)
        if name in EXAMPLES:
            return None
        if (command := group.get_command(CONTEXT, name.rstrip(":"))) is None:
            return name
        group = command
    if group.context_settings.get("ignore_unknown_options"):
        return None
    known = {option for parameter in group.params for option in (*parameter.opts, *parameter.secondary_opts)}
    if "--ros-args" in rest:
        rest = rest[: rest.index("--ros-args")]
    options = [word.split("=")[0].rstrip(",") for word in rest if re.match(r"--?[a-zA-Z]", word)]
    return next((option for option in options if option not in {*known, "--help"}), None)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_commands_of_a_page_exist(page):
    assert {command: wrong for command in commands_of(page) if (wrong := wrong_in(command))} == {}


def test_there_are_many_and_wrong_ones_are_found():
    assert sum(len(commands_of(page)) for page in PAGES) > 150
    assert wrong_in("florence hotspot dance --map x") == "dance"
    assert wrong_in("florence run --detached goto_user") == "--detached"
    assert wrong_in("florence hotspot draw --map maps/flat.yaml | cat --number") is None


OFFLINE = re.compile(r"florence (?:check|draw|schema|missions|hotspot (?:check|list|draw)) ")
ELSEWHERE = re.compile(
    r"[A-Z]{3,}|--live|home\.yaml|wrong\.yaml|my_robot|hand_missions|sure/| - |--map$|draw$|list$"
)
"""Placeholders, systems that must run, and files of pages that have tests of their own."""
RUN = sorted(
    {
        command.split("#")[0].strip()
        for page in PAGES
        for command in commands_of(page)
        if OFFLINE.match(command) and not ELSEWHERE.search(command.split("#")[0].strip())
    }
)


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with what the commands name: parts of the repository, and the missions of the first hour."""
    for name in ("examples", "hotspots", "maps"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "missions").symlink_to(ROOT / "florence_bt" / "trees" / "missions")
    (tmp_path / "docs" / "img").mkdir(parents=True)
    for block in blocks_of((ROOT / "docs" / "manual" / "first_hour.md").read_text(encoding="utf-8")):
        if block.kind == "yaml" and block.words[0].startswith("my_missions"):
            (tmp_path / "my_missions").mkdir(exist_ok=True)
            (tmp_path / block.words[0]).write_text(block.text, encoding="utf-8")
    own = (tmp_path / "my_missions" / "evening_round.yaml").read_text(encoding="utf-8")
    (tmp_path / "my_mission.yaml").write_text(own.replace("evening_round", "my_mission"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("command", RUN)
def test_a_command_that_needs_nothing_runs(command: str, checkout: Path) -> None:
    done = CliRunner().invoke(app, shlex.split(command)[1:], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    written = re.search(r"(?:-o|--out) (\S+)", command)
    assert written is None or (checkout / written[1]).stat().st_size > 0
