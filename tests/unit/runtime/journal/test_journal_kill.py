"""The journal of a process that is killed at any moment has everything that the process acknowledged."""

from __future__ import annotations

import signal
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest

from florence_bt.runtime.journal import JournalReader
from tests.sweeps import sweep

CHILD = Path(__file__).with_name("journal_child.py")
MOMENTS = (166, 78, 203, 334, 25, 38, 275, 49, 188, 299, 30, 260)
"""After how many lines of the child it is killed."""
TOIL = """
mission: toil
description: Works.
tree:
  repeat: 3
  do:
    sequence:
      - work:
      - wait: 1 s
"""


def killed_after(lines: int, folder: Path, mode: str) -> list[tuple[str, str]]:
    """Start a child, kill it after this many lines; gives what it said."""
    command = [sys.executable, str(CHILD), str(folder), mode]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        try:
            said = [child.stdout.readline() for _ in range(lines)]
        finally:
            child.send_signal(signal.SIGKILL)
        said += child.stdout.readlines()
    whole = [line for line in said if line.endswith("\n")]
    return [(line.split()[0], line.split()[1]) for line in whole]


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["background", "at once"])
@pytest.mark.parametrize("lines", sweep(MOMENTS, every=4))
def test_nothing_that_was_acknowledged_is_lost(tmp_path, lines, mode):
    (tmp_path / "toil.yaml").write_text(TOIL)
    said = killed_after(lines, tmp_path, mode)
    assert said and not [word for word, _ in said if word == "trouble"]
    with sqlite3.connect(tmp_path / "runs" / "journal.sqlite") as connection:
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    connection.close()
    with JournalReader(tmp_path / "runs") as reader:
        for word, run_id in said:
            row = reader.run(run_id)
            assert row is not None, (word, run_id)
            assert word != "ended" or row.state == "SUCCEEDED"
            kinds = [event.kind for event in reader.events(run_id)]
            assert word in kinds or word == "accepted"
        # What is there is whole: no event is missing before another.
        for row in reader.runs(limit=10_000):
            numbers = [event.seq for event in reader.events(row.run_id)]
            assert numbers == list(range(1, len(numbers) + 1))
