"""Pages that are transcripts: the tool that records them, and the commands of the first hour."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from florence_bt.cli.application import app
from tools.first_hour import Block, CommandWentWrong, commands_of, transcript, without_figures, written_anew

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "manual" / "first_hour.md").read_text()
ASSURANCE = (ROOT / "docs" / "manual" / "assurance.md").read_text()
FLORENCE = sorted({command for command in commands_of(PAGE + ASSURANCE) if command.startswith("florence ")})
OFFLINE = tuple(f"$ florence {verb}" for verb in ("check", "draw", "test", "verify", "mutate"))


def record(folder: Path, text: str) -> str:
    page = folder / "page.md"
    page.write_text(text)
    written_anew(page, folder, dict(os.environ))
    return page.read_text()


def test_what_commands_print_is_written_behind_them(tmp_path: Path) -> None:
    files = "Say\n\n```yaml it.yaml\nhello: 1\n```\n\n"
    page = f"{files}```console\n$ cat it.yaml\n$ pwd\nold\n```\nso.\n"
    new = page.replace("cat it.yaml\n", "cat it.yaml\nhello: 1\n").replace("old", "~/florence_bt")
    assert record(tmp_path, page) == new
    assert record(tmp_path, new) == new


def test_a_block_stays_when_only_figures_differ(tmp_path: Path) -> None:
    first = "```console\n$ echo took 3.1 s\ntook 12.9 s\n"
    page = f"{first}$ echo run 20261126T160223Z-001\nrun 20270101T000000Z-017\n```\n"
    assert record(tmp_path, page) == page
    assert without_figures("took 3 s") != without_figures("took 3 m")
    assert without_figures("starts\n   0.4 s  [>] drive -- 2 m\nends") == without_figures("starts\nends")


def test_terminals_keep_what_runs_in_them_until_a_key(tmp_path: Path) -> None:
    page = (
        "```console other until=there\n$ echo there; sleep 60 && echo killed\n```\n"
        "```console\n$ echo meanwhile\n```\n"
        "```console other\n^C\n$ echo after\n```\n"
    )
    new = record(tmp_path, page)
    assert re.findall(r"^[a-z]\w*$", new, re.MULTILINE) == ["there", "meanwhile", "after"]


def test_the_rest_of_an_output_comes_in_a_block_without_command(tmp_path: Path) -> None:
    page = "```console until=one\n$ echo one; echo two\n```\n```console\n```\n"
    assert (
        record(tmp_path, page)
        == "```console until=one\n$ echo one; echo two\none\n```\n```console\ntwo\n```\n"
    )


def test_long_output_is_shortened_where_the_page_says_so(tmp_path: Path) -> None:
    new = record(tmp_path, "```console lines=1..2\n$ seq 9\n```\n")
    assert new == "```console lines=1..2\n$ seq 9\n1\n...\n8\n9\n```\n"


@pytest.mark.parametrize("command", ["no_such_command", "echo 'Traceback (most recent call last):'"])
def test_a_command_that_is_wrong_is_not_written(tmp_path: Path, command: str) -> None:
    with pytest.raises(CommandWentWrong):
        record(tmp_path, f"```console\n$ {command}\n```\n")


def is_offline(block: Block) -> bool:
    """Whether nothing need be running for any command of the block."""
    return all(step.startswith(OFFLINE) and "--live" not in step for step in block.steps)


@pytest.mark.parametrize("command", FLORENCE)
def test_the_commands_of_the_first_hour_and_their_options_exist(command: str) -> None:
    words = command.partition(" $(")[0].split()[1:]
    options = [word for word in words if word.startswith("-")]
    subcommands = words[: 2 if words[0] in ("skills", "hotspot") else 1]
    told = CliRunner().invoke(app, [*subcommands, "--help"], env={"COLUMNS": "100"}, catch_exceptions=False)
    assert told.exit_code == 0
    assert [option for option in options if option not in told.output and option != "-v"] == []


@pytest.mark.slow
@pytest.mark.parametrize(("page", "least"), [(PAGE, 3), (ASSURANCE, 8)], ids=["first hour", "assurance"])
def test_a_page_shows_what_commands_without_a_robot_say(page: str, least: int, tmp_path: Path) -> None:
    for name in ("examples", "hotspots"):
        (tmp_path / name).symlink_to(ROOT / name)
    environment = {
        **os.environ,
        "COLUMNS": "100",
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
    }
    shown = [
        (block.text, new)
        for block, new in transcript(page, tmp_path, environment, is_offline)
        if block.kind == "console"
    ]
    assert len(shown) >= least
    for old, new in shown:
        assert new == old
