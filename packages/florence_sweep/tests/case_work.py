"""Work for cases that takes no time; here, so that processes find it."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from florence_sweep.experiment import Case, Setup
from florence_sweep.outcome import Outcome
from florence_sweep.running import without_run


def cases(count: int, mission: str = "") -> list[Case]:
    return [Case(number, "", number + 10, Setup(mission=mission)) for number in range(count)]


def at_once(case: Case) -> Outcome:
    return replace(without_run(case, "SUCCEEDED", ""), good=True, seconds=case.seed / 3.0)


def third_dies(case: Case) -> Outcome:
    if case.number == 3:
        os._exit(9)
    return at_once(case)


def third_dies_once(case: Case) -> Outcome:
    """The mission of the case is a file that tells that it has died before."""
    before = Path(case.setup.mission)
    if case.number == 3 and not before.exists():
        before.touch()
        os._exit(9)
    return at_once(case)
