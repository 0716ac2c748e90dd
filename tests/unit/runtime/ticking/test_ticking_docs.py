"""The examples of docs/ticking.md run."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from py_trees.common import Status

from florence_bt.runtime.ticking import Ticker

TEXT = (Path(__file__).parents[4] / "docs" / "ticking.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)


@pytest.mark.parametrize("number", range(len(EXAMPLES)))
def test_an_example_runs(number, monkeypatch, capsys):
    monkeypatch.setattr("time.sleep", lambda seconds: None)
    names: dict = {}
    exec(compile(EXAMPLES[number], f"docs/ticking.md example {number}", "exec"), names)
    if "Charge" in names:
        charges(names["Charge"])
    else:
        assert "b INVALID -> RUNNING" in capsys.readouterr().out
        assert names["tree"].count == 3


def charges(charge_class: type) -> None:
    class Battery:
        full = False

        def on_change(self, callback) -> None:
            self.changed = callback

    battery, woken, visited = Battery(), [], []
    node = charge_class("charge", battery, lambda: woken.append(True))
    ticker = Ticker(node, incremental=True, visit=visited.append)
    assert [ticker.tick() for _ in range(3)] == [Status.RUNNING] * 3 and len(visited) == 1
    battery.full = True
    battery.changed()
    assert woken and ticker.tick() is Status.SUCCESS
