"""The manual of bring-up and teleop: the commands and options that it names exist, and what it says is so."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
import typer

from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.supervisor import PAUSES_S
from florence_bt.app.bringup.topology import companions
from florence_bt.app.robot_setup.files import RULES, UNIT
from florence_bt.app.teleop.hands import GamepadLayout, TeleopParameters
from florence_bt.app.teleop.panel import KEYS
from florence_bt.cli.application import app

MANUAL = Path(__file__).parents[3] / "docs" / "manual"
BRINGUP, TELEOP = ((MANUAL / name).read_text(encoding="utf-8") for name in ("bringup.md", "teleop.md"))
COMMANDS = re.findall(r"^\$ (florence [^#\n]*?) *(?:#.*)?$", BRINGUP + TELEOP, re.MULTILINE)


@pytest.mark.parametrize("line", COMMANDS)
def test_every_command_can_be_typed(line: str) -> None:
    verbs: Any = typer.main.get_command(app)
    _, verb, *words = shlex.split(line)
    command = verbs.commands[verb]
    # Read as when it is typed; nothing is run.
    command.make_context(verb, words, resilient_parsing=False)


def test_the_page_names_the_files_of_init() -> None:
    for name in ("florence.yaml", "robot.yaml", "hotspots.yaml", RULES, UNIT):
        assert f"`{name}`" in BRINGUP


def test_the_page_says_which_processes_start_again() -> None:
    rows = dict(re.findall(r"^\| `(\w+)`(?: with `--nav nav2`)? \| (\w+)", BRINGUP, re.MULTILINE))
    for process in ("missions", "people", "navigation", "simulator"):
        again = companions(process, BringUp(folder="x")) is not None
        assert (rows[process] == "yes") is again, process
    assert "`hardware` | yes, with `navigation`" in BRINGUP
    _, second, third = PAUSES_S
    assert f"after {second:g} s for the second, after {third:g} s for the third" in BRINGUP


def test_the_page_shows_the_keys_and_the_defaults() -> None:
    for line in KEYS:
        assert line in TELEOP
    assert f"{TeleopParameters().timeout:g} s after the last repetition" in TELEOP
    layout = GamepadLayout()
    for option in ("axis_linear", "axis_angular", "enable_button", "turbo_button"):
        assert f"| `--{option.replace('_', '-')}` | {getattr(layout, option)} |" in TELEOP
