"""Whatever a run of a random mission with random skills reaches is among what the verifier says."""

from pathlib import Path

import pytest

from florence_bt.assurance.explorer import Limits
from tests.sweeps import sweep
from tests.unit.assurance.random_runs import outcome_of_run, verified_outcomes, write_mission

RUNS = 60
BLOCK = 15


@pytest.mark.parametrize("first", sweep(range(0, 300, BLOCK), every=10))
def test_every_outcome_of_random_runs_was_foreseen(tmp_path: Path, first: int):
    proved = 0
    for seed in range(first, first + BLOCK):
        library = write_mission(tmp_path, seed)
        foreseen = verified_outcomes(library, Limits(seconds=60.0, steps=15_000))
        if foreseen is not None:
            reached = {outcome_of_run(library, run) for run in range(RUNS)} - {"goes on"}
            assert reached <= foreseen, seed
            proved += 1
    assert proved >= BLOCK - 2
