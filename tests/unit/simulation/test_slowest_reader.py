"""The simulated time waits for a reader that is behind, but not for one that is gone."""

from __future__ import annotations

import pytest

from florence_bt.simulation.hardware.slowest_reader import SlowestReader


def test_nobody_is_waited_for_before_the_first_word():
    assert not SlowestReader(0.4, 2.0).is_behind(100.0, 5.0)


@pytest.mark.parametrize(
    ("time", "wall", "behind"),
    [
        (10.35, 50.0, False),
        (10.5, 50.0, True),
        (10.5, 51.9, True),
        (10.5, 52.1, False),
        (9.0, 50.0, False),
    ],
)
def test_behind(time, wall, behind):
    reader = SlowestReader(0.4, 2.0)
    reader.received(10.0, 50.0)
    assert reader.is_behind(time, wall) is behind


def test_it_is_waited_for_again_when_it_comes_back():
    reader = SlowestReader(0.4, 2.0)
    reader.received(10.0, 50.0)
    assert not reader.is_behind(20.0, 60.0)
    reader.received(19.9, 61.0)
    assert not reader.is_behind(20.0, 61.0)
    assert reader.is_behind(20.6, 61.0)
    reader.received(20.5, 61.5)
    assert not reader.is_behind(20.6, 61.5)


def test_stamps_that_are_always_late_do_not_make_time_crawl():
    reader = SlowestReader(0.4, 1.0)
    time = wall = waited = 0.0
    while time < 60.0:
        if round(time * 100) % 10 == 0:
            reader.received(time - 0.7, wall)
        if reader.is_behind(time, wall):
            waited += 0.01
        else:
            time += 0.01
        wall += 0.01
    assert waited < 2.0


def test_a_reader_that_is_gone_holds_up_once():
    reader = SlowestReader(0.4, 1.0)
    reader.received(0.0, 0.0)
    time = wall = 0.0
    while time < 60.0:
        if not reader.is_behind(time, wall):
            time += 0.01
        wall += 0.01
    assert wall == pytest.approx(60.6, abs=0.1)
