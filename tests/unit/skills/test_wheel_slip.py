"""How wrong the wheels are, learnt from fits."""

from __future__ import annotations

import numpy as np
import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.skills.navigation.localisation.wheel_slip import WheelSlip

SURE, STEP = np.diag([1e-6, 1e-6, 1e-6]), Pose2(0.2, 0.0, 0.1)


def learnt(step: Pose2, error: Pose2, covariance: np.ndarray, steps: int = 60) -> WheelSlip:
    slip = WheelSlip()
    for _ in range(steps):
        slip.learn(step, error, covariance)
    return slip


def test_what_the_fits_find_is_what_the_wheels_may_be_wrong_by() -> None:
    slip = learnt(STEP, Pose2(-0.06, 0.0, 0.04), SURE)
    metres, radians = slip.deviations(STEP, 0.0)
    assert metres == pytest.approx(0.06, abs=0.015)
    assert radians == pytest.approx(0.04, abs=0.01)
    # Further is wrong by more.
    assert slip.deviations(Pose2(1.0), 0.0)[0] == pytest.approx(0.3, abs=0.05)


def test_good_wheels_are_believed_but_never_more_than_they_may_slip() -> None:
    slip = learnt(STEP, Pose2(0.001, 0.0, 0.001), SURE)
    assert slip.deviations(Pose2(1.0), 0.0)[0] < 0.03
    assert slip.deviations(Pose2(1.0), 0.1)[0] > 0.1


def test_a_fit_that_says_nothing_of_the_way_teaches_nothing_of_it() -> None:
    """Along a bare corridor it keeps the wheels' way, and as much doubt as before."""
    slip = learnt(STEP, Pose2(-0.06), SURE)
    before = slip.deviations(STEP, 0.0)[0]
    for _ in range(60):
        slip.learn(STEP, Pose2(), np.diag([slip.deviations(STEP, 0.0)[0] ** 2, 1e-6, 1e-6]))
    assert slip.deviations(STEP, 0.0)[0] >= before


def test_wheels_that_begin_to_slip_are_noticed_within_metres() -> None:
    slip = learnt(STEP, Pose2(0.001), SURE)
    for _ in range(5):
        slip.learn(STEP, Pose2(-0.2), SURE)
    assert slip.deviations(STEP, 0.0)[0] > 0.08
