"""Whatever a run of a random mission with random skills reaches is among what the verifier says."""

from pathlib import Path

import pytest

from tests.sweeps import sweep
from tests.unit.assurance.random_runs import compared

RUNS = 60
BLOCK = 15


@pytest.mark.parametrize("first", sweep(range(0, 300, BLOCK), every=10))
def test_every_outcome_of_random_runs_was_foreseen(tmp_path: Path, first: int):
    done = list(compared(tmp_path, range(first, first + BLOCK), RUNS))
    assert {each.seed: each.missed for each in done if each.missed} == {}
    assert sum(each.foreseen is not None for each in done) >= BLOCK - 2
