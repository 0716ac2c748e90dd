"""Where commands write to: a folder in place of a file, the home folder, what is no path."""

from __future__ import annotations

from pathlib import Path

import click
import pytest
import typer
from typer.testing import CliRunner

from florence_bt.cli.application import app
from florence_bt.cli.exit_codes import OK, USAGE
from florence_bt.cli.output_paths import OutputPath

ROOT = Path(__file__).parents[2]
MAP = str(ROOT / "maps" / "flat.yaml")
READS = {
    "--base-frame",
    "--beside",
    "--config",
    "--continue",
    "--folder",
    "--home",
    "--hotspots",
    "--log",
    "--map",
    "--missions",
    "--model",
    "--params-file",
    "--pose",
    "--robot",
    "--sim-params",
    "--stdin-name",
    "--urdf",
    "--world",
    "file",
    "files",
    "folder",
    "robot",
    "source",
}
"""Options of paths that are only read, or, like ``--hotspots``, name what is there."""


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    (tmp_path / "home").mkdir()
    (tmp_path / "here" / "folder").mkdir(parents=True)
    (tmp_path / "here" / "file").touch()
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path


def florence(*arguments):
    return CliRunner().invoke(app, arguments)


FILES = [
    ("map", "clean", MAP, "--out={}"),
    ("map", "clean", MAP, "--out=x.yaml", "--picture={}"),
    ("map", "rooms", MAP, "--out={}"),
    ("map", "save", "{}"),
    ("map", "build", "--log=none.mcap", "--out={}"),
    ("map", "explore", "{}"),
    ("hotspot", "draw", "--hotspots", str(ROOT / "hotspots" / "flat.yaml"), "--map", MAP, "--out={}"),
    ("draw", "goto_user", "--out={}"),
    ("schema", "--out={}"),
    ("export", "goto_user", "--out={}"),
    ("report", "--out={}"),
    ("calibrate", "--write={}"),
    ("test", "none.yaml", "--junit={}"),
]
FOLDERS = [
    ("import", "none.xml", "--out={}"),
    ("init", "{}"),
    ("record", "{}"),
    ("demo", "--out={}"),
    ("kinect", "record", "--folder={}"),
    ("kinect", "convert", "none", "{}"),
]


@pytest.mark.parametrize("command", FILES, ids=" ".join)
@pytest.mark.parametrize(
    "path", ["./", "", ".", "..", "folder", "folder/", "new/", "/", "file/x", "~none/x", "x" * 300]
)
def test_what_is_no_name_of_a_file_is_refused_before_anything_is_done(command, path, here):
    there = set(here.rglob("*"))
    done = florence(*(word.format(path) for word in command))
    assert done.exit_code == USAGE and f"{path!r} cannot be written to" in done.stderr
    assert set(here.rglob("*")) == there


@pytest.mark.parametrize("command", FOLDERS, ids=" ".join)
@pytest.mark.parametrize("path", ["file", "", "file/x", "~none/x", "x" * 300])
def test_what_is_no_name_of_a_folder_is_refused_before_anything_is_done(command, path, here):
    there = set(here.rglob("*"))
    done = florence(*(word.format(path) for word in command))
    assert done.exit_code == USAGE and f"{path!r} cannot be written to" in done.stderr
    assert set(here.rglob("*")) == there


@pytest.mark.parametrize(
    ("command", "written"),
    [
        (("map", "clean", MAP, "--out=~/maps/x"), "maps/x.yaml"),
        (("map", "rooms", MAP, "--out", "~/rooms.yaml"), "rooms.png"),
        (("draw", "goto_user", "--out=~/tree.txt"), "tree.txt"),
        (("export", "goto_user", "-o", "~/tree.xml"), "tree.xml"),
    ],
    ids=["clean", "rooms", "draw", "export"],
)
def test_the_tilde_is_the_home_folder(command, written, here):
    done = florence(*command)
    assert done.exit_code == OK, done.output
    assert (here / "home" / written).is_file()
    assert not list((here / "here").glob("~*"))


def commands(group, words=()):
    """Every command with its words."""
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if hasattr(command, "commands"):
            yield from commands(command, (*words, name))
        else:
            yield " ".join((*words, name)), command


def test_every_option_of_a_path_is_written_to_by_that_function_or_only_read():
    left = set()
    for name, command in commands(typer.main.get_group(app)):
        for each in command.params:
            is_path = "path" in type(each.type).__name__.lower()
            if is_path and not isinstance(each.type, OutputPath) and each.opts[-1] not in READS:
                left.add((name, each.opts[-1]))
    assert left == {("logs", "--out")}, "which is where they were written to"


def test_help_says_whether_a_file_or_a_folder_is_written():
    helped = {verb: CliRunner().invoke(app, [verb, "--help"]).output for verb in ("report", "init")}
    assert not [verb for verb, text in helped.items() if "function" in text]
    assert "<file>" in CliRunner().invoke(app, ["test", "--help"]).output
