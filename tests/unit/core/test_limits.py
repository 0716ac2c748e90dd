"""Limits in the annotations of parameter dataclasses."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.limits import CheckedParameters, Finite, Limits, NotNegative, Positive, check_order


@dataclass(frozen=True, slots=True)
class Parameters(CheckedParameters):
    """One field of each kind."""

    rate: Positive = 20.0
    pause: NotNegative = 0.0
    offset: Finite = 0.0
    skip: Annotated[int, Limits(0, 9)] = 0
    share: Annotated[float, Limits(0.0, 1.0, above=True)] | None = None
    source: Literal["laser", "kinect"] = "laser"
    free: float = 0.0


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("rate", 0.0, "rate is 0.0 (would have worked: rate: 20.0 (above 0))"),
        ("rate", math.inf, "rate is inf"),
        ("pause", -1.0, "(would have worked: pause: 0.0 (0 or more))"),
        ("offset", math.nan, "offset: 0.0 (a finite number)"),
        ("offset", -math.inf, "offset is -inf"),
        ("skip", 10, "(would have worked: skip: 0 (0 to 9))"),
        ("share", 0.0, "share: None (above 0 and at most 1)"),
        ("source", "kinekt", "source cannot be 'kinekt' (would have worked: kinect"),
    ],
)
def test_a_value_outside_its_limits_is_refused(name: str, value: object, message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        Parameters(**{name: value})
    assert message in str(caught.value)


def test_values_within_the_limits() -> None:
    Parameters(rate=1e-9, pause=0.0, skip=9, share=1.0, source="kinect", free=math.nan)
    Parameters(share=None)


def test_order() -> None:
    parameters = Parameters(rate=2.0, pause=2.0)
    check_order(parameters, ("pause", "rate"), equal=True)
    with pytest.raises(ConfigError, match=r"pause \(2.0\) must be below rate \(2.0\)"):
        check_order(parameters, ("pause", "rate"))
    with pytest.raises(ConfigError, match=r"rate \(2.0\) must not be above skip \(0\)"):
        check_order(parameters, ("pause", "rate"), ("rate", "skip"), equal=True)


@dataclass(frozen=True, slots=True)
class Band(CheckedParameters):
    """Two fields that belong together."""

    lowest: Positive = 1.0
    highest: Positive = 2.0

    def _check(self) -> None:
        check_order(self, ("lowest", "highest"))


def test_each_field_is_checked_before_what_concerns_several():
    assert Band(3.0, 4.0).highest == 4.0
    with pytest.raises(ConfigError, match=r"lowest \(3\.0\) must be below highest"):
        Band(3.0)
    with pytest.raises(ConfigError, match=r"highest is -1\.0"):
        Band(3.0, -1.0)
