"""The example of CONTRIBUTING.md, a kind of node that is made up, is added, checked, drawn and run."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import florence_bt

PACKAGE = Path(florence_bt.__file__).parent
ROOT = PACKAGE.parent
EXAMPLE = re.search(
    r"^## Adding a node kind$.*?(?=^## )", (ROOT / "CONTRIBUTING.md").read_text(), re.M | re.S
)
BLOCKS = re.findall(r"`(florence_bt/[\w/]+\.py)`[^`]*\n\n```(?:python|diff)\n(.*?)```", EXAMPLE[0], re.S)
MISSION = """\
mission: often
description: Counts every other round.
keys: {n: {type: integer, default: 0}, seen: {type: text}}
outputs: {n: {type: integer}}
tree:
  sequence:
    - repeat: 5
      do: {every_other: {sequence: [{add: {n: 1}}, {set: {seen: "yes"}}]}}
    - fail: $seen
      when: $n == 0
"""
RUN = """
import json, sys
from pathlib import Path
from florence_page.editor.words import words_of
from florence_bt.trees.language.schema import make_schema
from tests.unit.trees.language import Play
play = Play(Path(sys.argv[1]), sys.argv[2].split("\\n", 1)[1])
words = words_of([], None)
print(json.dumps({
    "end": play.run(),
    "n": play.keys.read("n"),
    "schema": make_schema({})["definitions"]["node"]["properties"]["every_other"]["description"],
    "palette": words["node_kinds"]["every_other"],
}))
"""


def added(text: str, diff: str) -> str:
    """The text with each line that begins with + behind the line before it, which is there once."""
    before = ""
    for line in diff.splitlines():
        if line.startswith("+"):
            assert text.count(f"{before}\n") == 1, before
            text = text.replace(f"{before}\n", f"{before}\n{line[1:]}\n")
        before = line[1:]
    return text


@pytest.fixture(scope="module")
def with_example(tmp_path_factory):
    """A folder with the package florence_bt and the example in it, as somebody would write it."""
    folder = tmp_path_factory.mktemp("example")
    mixed = {PACKAGE, PACKAGE / "trees", PACKAGE / "trees" / "kinds", PACKAGE / "behaviours"}
    for source in sorted(mixed):
        target = folder / source.relative_to(ROOT)
        target.mkdir()
        for entry in source.iterdir():
            if entry not in mixed and entry.name != "__pycache__":
                (target / entry.name).symlink_to(entry)
    assert [name for name, _ in BLOCKS] == [
        "florence_bt/behaviours/every_other.py",
        "florence_bt/trees/kinds/every_other.py",
        "florence_bt/trees/kinds/__init__.py",
    ]
    for name, text in BLOCKS:
        target = folder / name
        text = added(target.read_text(), text) if target.exists() else text
        target.unlink(missing_ok=True)
        target.write_text(text)
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


def python(folder: Path, *arguments: str) -> str:
    """What Python prints that has the example, with the tests of this repository behind it."""
    ended = subprocess.run(
        [sys.executable, *arguments],
        env={"PYTHONPATH": f"{folder}:{ROOT}", "PATH": ""},
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout


def test_the_example_is_checked_and_drawn(with_example):
    """Nobody has told the flow of keys of the new kind: what is written below it may be missing."""
    file = with_example / "often.yaml"
    file.write_text(MISSION)
    checked = python(with_example, "-m", "florence_bt.cli", "check", str(file))
    assert "'seen' may have no value here" in checked and "1 warning" in checked
    python(with_example, "-m", "florence_bt.cli", "draw", str(file), "-o", "often.txt")
    assert "½ every other time sequence" in (with_example / "often.txt").read_text()


def test_the_example_runs_and_is_described(with_example, tmp_path):
    told = python(with_example, "-c", RUN, str(tmp_path), MISSION)
    assert '"end": "success", "n": 3' in told
    assert '"schema": "runs a node every other time"' in told
    assert '"palette": "- every_other:\\n    wait: 1 s"' in told


def test_the_example_has_the_style_of_the_house(with_example):
    kept = ["--config", str(ROOT / "pyproject.toml"), "--no-cache"]
    files = [str(with_example / name) for name, _ in BLOCKS]
    python(with_example, "-m", "ruff", "check", *kept, *files)
    python(with_example, "-m", "ruff", "format", "--check", *kept, *files)
