"""Random missions that are stopped, paused, taken over and killed are run again without a difference."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest

from florence_bt.core.errors import FlorenceError
from florence_bt.runtime.journal import JournalReader
from florence_bt.runtime.replay.replay import check
from florence_bt.runtime.run import MissionRequest, MissionRun
from tests.sweeps import sweep
from tests.unit.behaviours.ticking.random_missions import DECLARATIONS, SUB, Author
from tests.unit.runtime.test_recovery_random import process

DRIVING = {
    name: replace(each, resources=frozenset({"base"} if name in ("work", "other") else ()))
    for name, each in DECLARATIONS.items()
}
"""The skills of the random missions, two of which need the base."""


def record(folder, seed, text):
    """Record a run to its end; the executor of its last process."""
    folder.mkdir()
    (folder / "sub.yaml").write_text(SUB)
    (folder / "m.yaml").write_text(text.replace("mission: m\n", "mission: m\non_restart: resume\n"))
    chance = random.Random(seed * 7 + 3)
    clock, executor, _ = process(folder, seed, start=0.0, name="A", declarations=DRIVING)
    executor.trigger(MissionRequest("m"))
    for number in range(chance.randrange(5)):
        clock.advance(chance.choice((0.0, 0.3, 0.5, chance.uniform(0.0, 3.0))))
        act = chance.choice(("pause", "pause", "resume", "resume", "stop", "override", "kill"))
        if act == "kill":
            start, name = 5000.0 * (number + 1), f"B{number}"
            clock, executor, _ = process(
                folder, seed + number + 1, start=start, name=name, declarations=DRIVING
            )
        else:
            _do(executor, act)
    for _ in range(100):
        _do(executor, "resume")
        clock.advance(5.0)
    return executor


def _do(executor, act):
    """Do what a person does, where it can be done."""
    try:
        getattr(executor, act)(*(() if act == "resume" else ("enough",)))
    except FlorenceError:
        return


@pytest.mark.parametrize(("asks", "catches"), [(False, False), (True, False), (True, True)])
@pytest.mark.parametrize("first", sweep(range(0, 200, 25), every=8))
def test_a_random_run_is_run_again_without_a_difference(tmp_path, first, asks, catches):
    for seed in range(first, first + 25):
        text = Author(seed, asks=asks, catches=catches).file()
        executor = record(tmp_path / str(seed), seed, text)
        with JournalReader(tmp_path / str(seed) / "runs") as reader:
            row = reader.runs(100)[-1]
            events = reader.events(row.run_id)
        run = MissionRun(row.run_id, MissionRequest("m"), {})
        assert check(run, events, executor.library, DRIVING) is None, seed
