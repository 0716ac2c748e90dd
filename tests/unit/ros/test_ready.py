"""When the nodes of a process count as ready."""

from __future__ import annotations

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.ros.process import when_ready


class Seeking:
    """A node that has found what it needs from a moment on.

    Args:
        found: That moment, seconds.
    """

    def __init__(self, found: float) -> None:
        self.steady = ManualClock()
        self.looks = 0
        self._found = found

    def missing(self) -> list[str]:
        self.looks += 1
        return [] if self.steady.now() >= self._found else ["the service locate"]


@pytest.mark.parametrize("found", [0.0, 0.3, 4.0, 60.0])
def test_that_nothing_is_missing_any_more_is_noticed_soon_and_once(found: float) -> None:
    node, ready = Seeking(found), []
    when_ready([node], lambda: ready.append(node.steady.now()), lambda: False)
    node.steady.advance_to(100.0)
    (noticed,) = ready
    assert found <= noticed <= found + max(0.051, 0.051 * found)


def test_a_process_that_waits_for_long_hardly_looks() -> None:
    node = Seeking(1e6)
    when_ready([node], lambda: None, lambda: False)
    node.steady.advance_to(600.0)
    before = node.looks
    node.steady.advance(60.0)
    assert node.looks - before == 60


def test_a_process_that_is_to_end_does_not_look_any_more() -> None:
    node, ready = Seeking(1.0), []
    when_ready([node], lambda: ready.append(1), lambda: node.steady.now() > 0.5)
    node.steady.advance_to(10.0)
    assert not ready
