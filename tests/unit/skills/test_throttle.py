"""The throttle before the fake laser."""

from __future__ import annotations

import math

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.skills.filters.depth_to_laser.fake_laser import Throttle, ThrottleParameters


def admitted(rate: float, count: int, max_rate: float) -> int:
    throttle = Throttle(ThrottleParameters(max_rate))
    return sum(throttle.admits(100.0 + index / rate) for index in range(count))


@pytest.mark.parametrize(("rate", "expected"), [(10.0, 30), (20.0, 30), (30.0, 15), (60.0, 10), (1000.0, 1)])
def test_never_more_than_the_rate(rate, expected):
    assert admitted(rate, 30, 20.0) == expected


def test_a_little_early_is_no_loss():
    throttle = Throttle(ThrottleParameters(20.0))
    assert [throttle.admits(stamp) for stamp in (0.0, 0.047, 0.1, 0.148)] == [True] * 4


def test_a_clock_that_was_set_back_starts_anew():
    throttle = Throttle()
    assert throttle.admits(1000.0)
    assert throttle.admits(1.0)
    assert not throttle.admits(1.01)


@pytest.mark.parametrize("wrong", [0.0, -1.0, math.nan, math.inf])
def test_wrong_rates_are_refused(wrong):
    with pytest.raises(ConfigError, match=r"max_rate: 20\.0"):
        ThrottleParameters(wrong)
