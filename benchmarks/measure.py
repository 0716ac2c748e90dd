"""Measures short calls side by side, in processor time: what else the machine does is not counted."""

from __future__ import annotations

import time
from collections.abc import Callable

ROUNDS = 5
ROUND_S = 0.005


def seconds_per_call(*calls: Callable[[], object]) -> list[float]:
    """The best time of each call: they take turns, so that a busy machine is busy for all of them."""
    repeats = []
    for call in calls:
        call()
        begin = time.process_time()
        call()
        took = time.process_time() - begin
        repeats.append(max(1, int(ROUND_S / max(took, 1e-7))))
    best = [float("inf")] * len(calls)
    for _ in range(ROUNDS):
        for index, (call, repeat) in enumerate(zip(calls, repeats, strict=True)):
            begin = time.process_time()
            for _ in range(repeat):
                call()
            best[index] = min(best[index], (time.process_time() - begin) / repeat)
    return best
