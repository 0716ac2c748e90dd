"""The manual clock, and what is called again and again."""

from __future__ import annotations

import pytest

from florence_bt.core.clock import ManualClock, call_every


def test_callbacks_run_in_order_each_at_its_own_moment():
    clock, seen = ManualClock(5.0), []

    def note(name):
        return lambda: seen.append((name, clock.now()))

    clock.call_at(7.0, note("late"))
    clock.call_at(6.0, note("first"))
    clock.call_at(6.0, note("second"))
    clock.call_at(1.0, note("overdue"))
    clock.call_at(6.5, note("cancelled")).cancel()
    assert clock.next_time() == 5.0
    clock.advance(1.5)
    assert seen == [("overdue", 5.0), ("first", 6.0), ("second", 6.0)]
    assert (clock.now(), clock.next_time()) == (6.5, 7.0)
    assert clock.run_next() and seen[-1] == ("late", 7.0)
    assert not clock.run_next() and clock.next_time() is None and clock.now() == 7.0
    clock.advance_to(3.0)
    assert clock.now() == 7.0


def test_a_period():
    clock, seen = ManualClock(), []
    timer = call_every(clock, 0.5, lambda: seen.append(clock.now()))
    early = call_every(clock, 0.5, lambda: seen.append(-clock.now()), start=0.25)
    clock.advance(1.1)
    assert seen == [-0.25, 0.5, -0.75, 1.0]
    early.cancel()
    timer.cancel()
    clock.advance(5.0)
    assert len(seen) == 4 and clock.next_time() is None
    for wrong in (0.0, -1.0, float("nan")):
        with pytest.raises(ValueError, match="above zero"):
            call_every(clock, wrong, timer.cancel)


class Rough:
    """A clock that calls late, jumps, and has called already when a call is taken back."""

    def __init__(self):
        self.time, self.calls = 0.0, []

    def now(self):
        return self.time

    def call_at(self, when, callback):
        self.calls.append((when, callback))
        return self

    def cancel(self):
        pass

    def fire(self, time):
        self.time = time
        self.calls.pop()[1]()


def test_a_late_clock_skips():
    clock, seen = Rough(), []
    timer = call_every(clock, 1.0, lambda: seen.append(clock.now()))
    clock.fire(1.2)
    assert clock.calls[-1][0] == 2.0
    clock.fire(5.5)
    assert clock.calls[-1][0] == 6.0
    timer.cancel()
    clock.fire(6.0)
    assert seen == [1.2, 5.5] and clock.calls == []
