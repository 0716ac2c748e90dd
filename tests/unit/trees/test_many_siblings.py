"""Siblings with equal names get numbers; ten thousand take no longer than ten times a thousand."""

from __future__ import annotations

import sys
from types import FrameType
from typing import Any

from py_trees.behaviours import Success

from florence_bt.behaviours.annotations import numbered


def names(*given: str) -> list[str]:
    return [node.name for node in numbered([Success(name) for name in given])]


def test_the_numbers():
    assert names("a", "a", "b", "a") == ["a", "a (2)", "b", "a (3)"]
    # Somebody else may have such a name already, before or after.
    assert names("a (2)", "a", "a", "a") == ["a (2)", "a", "a (3)", "a (4)"]
    assert names("a", "a", "a (2)") == ["a", "a (2)", "a (2) (2)"]


def lines_for(count: int) -> int:
    """How many lines of code are run for this many siblings."""
    siblings = [Success("same") for _ in range(count)]
    lines = 0

    def trace(frame: FrameType, event: str, argument: Any) -> Any:
        nonlocal lines
        lines += event == "line"
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        numbered(siblings)
    finally:
        sys.settrace(before)
    return lines


def test_the_work_grows_with_the_number_and_no_faster():
    assert lines_for(400) < 5 * lines_for(100)
