"""How much faster than real time the rig is, and where its time goes (``build/rig_profile.csv``)."""

from __future__ import annotations

import cProfile
import pstats
import time
from dataclasses import dataclass

from benchmarks.measure import size
from florence_bt.app.demo.rigs import make_rig
from tools.tables import BUILD, write_rows

SEEDS = size((1, 2, 3), (1,))
LIMIT_S = size(600.0, 2.0)
"""Simulated seconds after which a mission is stopped."""


@dataclass(frozen=True, slots=True)
class Called:
    """Where the time of a mission goes.

    Attributes:
        own_percent: Of the whole time, without the functions that it calls.
        function: Its name.
        file: Where it is.
        calls: How often it was called.
    """

    own_percent: float
    function: str
    file: str
    calls: int


def run_once(seed: int) -> tuple[float, float]:
    """Simulated and wall seconds of one mission."""
    rig = make_rig(seed=seed)
    begin, wall = rig.clock.now(), time.perf_counter()
    rig.run("goto_user", limit_s=LIMIT_S)
    return rig.clock.now() - begin, time.perf_counter() - wall


def test_rig_speed(benchmark, figures):
    run_once(SEEDS[0])  # the hot loops are compiled or loaded by now
    results = []
    benchmark.pedantic(lambda: results.append(run_once(SEEDS[len(results) % len(SEEDS)])), rounds=len(SEEDS))
    simulated, wall = sum(r[0] for r in results), sum(r[1] for r in results)
    figures.add(
        "rig: simulated seconds per wall second", f"{simulated / wall:.0f}", "goto_user, one core; aim 250"
    )
    figures.limit(simulated / wall, least=250.0)


def test_rig_profile(benchmark):
    profile = cProfile.Profile()
    benchmark.pedantic(lambda: profile.runcall(run_once, SEEDS[-1]), rounds=1)
    stats = pstats.Stats(profile)
    total = stats.total_tt
    entries = sorted(stats.stats.items(), key=lambda item: item[1][2], reverse=True)
    rows = []
    for (file, _line, name), (_, calls, own, _, _) in entries:
        place = file.split("florence_bt/")[-1] if "florence_bt" in file else file.rsplit("/", 1)[-1]
        rows.append(Called(round(100 * own / total, 1), name, place, calls))
    write_rows(BUILD / "rig_profile.csv", Called, rows)
