"""Measures short calls side by side, in processor time: what else the machine does is not counted."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

Size = TypeVar("Size")

_small = False


def be_small() -> None:
    """Measure as little as goes through all of the code; called before the benchmarks are imported."""
    global _small
    _small = True


def is_small() -> bool:
    """Whether as little as possible is measured."""
    return _small


def size(full: Size, small: Size) -> Size:
    """Return how much is measured: ``small`` with ``--small``."""
    return small if _small else full


ROUNDS = 5
ROUND_S = 0.005


def seconds_per_call(*calls: Callable[[], object]) -> list[float]:
    """The best time of each call: they take turns, so that a busy machine is busy for all of them."""
    rounds, round_s = size((ROUNDS, ROUND_S), (1, 0.0))
    repeats = []
    for call in calls:
        call()
        begin = time.process_time()
        call()
        took = time.process_time() - begin
        repeats.append(max(1, int(round_s / max(took, 1e-7))))
    best = [float("inf")] * len(calls)
    for _ in range(rounds):
        for index, (call, repeat) in enumerate(zip(calls, repeats, strict=True)):
            begin = time.process_time()
            for _ in range(repeat):
                call()
            best[index] = min(best[index], (time.process_time() - begin) / repeat)
    return best
