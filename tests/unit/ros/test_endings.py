"""What has ended goes: what came again and again by its silence, what was told once with who told it."""

from __future__ import annotations

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.ros.endings import Silence, Tellers


def test_what_ceases_to_come_ends_once_and_may_come_again():
    clock = ManualClock(100.0)
    silence = Silence(clock, 3.0)
    assert silence.take_ended() == []
    silence.heard("scan")
    clock.advance(2.0)
    silence.heard("camera")
    clock.advance(0.9)
    assert silence.take_ended() == []
    clock.advance(0.1)
    assert silence.take_ended() == ["scan"] and silence.take_ended() == []
    silence.heard("scan")
    clock.advance(2.0)
    assert silence.take_ended() == ["camera"]
    clock.advance(1.0)
    assert silence.take_ended() == ["scan"] and silence.take_ended() == []


class Bench:
    def __init__(self):
        self.there = set()
        self.ends = 0
        self.tellers = Tellers(lambda: self.there, self._on_end)

    def _on_end(self):
        self.ends += 1

    def look(self, *there, told=False):
        if told:
            self.tellers.heard()
        self.there = set(there)
        self.tellers.look()
        return self.ends


def test_what_was_told_stays_while_who_told_it_is_there():
    bench = Bench()
    assert bench.look() == 0 and bench.look("one") == 0, "nothing was told yet"
    assert bench.look("one", told=True) == 0 and bench.look("one") == 0
    assert bench.look() == 1 and bench.look() == 1


@pytest.mark.parametrize("there", [(), ("other",)])
def test_what_was_told_goes_with_who_told_it_also_when_another_comes(there):
    bench = Bench()
    bench.look("one", told=True)
    assert bench.look(*there) == 1
    assert bench.look("other", told=True) == 1 and bench.look() == 2


def test_of_several_who_may_have_told_it_one_is_enough():
    bench = Bench()
    bench.look("one", "two", told=True)
    assert bench.look("two", "three") == 0 and bench.look("three") == 1


def test_what_was_told_by_one_who_is_gone_already_goes():
    bench = Bench()
    assert bench.look(told=True) == 1
