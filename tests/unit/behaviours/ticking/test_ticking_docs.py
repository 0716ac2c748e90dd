"""The examples of docs/notes/ticking.md run."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

TEXT = (Path(__file__).parents[4] / "docs" / "notes" / "ticking.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)


@pytest.mark.parametrize("number", range(len(EXAMPLES)))
def test_an_example_runs(number, capsys):
    exec(compile(EXAMPLES[number], f"docs/notes/ticking.md example {number}", "exec"), {})
    assert "b INVALID -> RUNNING" in capsys.readouterr().out
