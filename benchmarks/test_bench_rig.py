"""How much faster than real time the rig is, and where its time goes (``build/rig_profile.csv``)."""

from __future__ import annotations

import cProfile
import pstats
import time

from florence_bt.app.demo.rigs import make_rig
from tools.tables import write_runs

SEEDS = (1, 2, 3)


def run_once(seed: int) -> tuple[float, float]:
    """Simulated and wall seconds of one mission."""
    rig = make_rig(seed=seed)
    begin, wall = rig.clock.now(), time.perf_counter()
    rig.run("goto_user")
    return rig.clock.now() - begin, time.perf_counter() - wall


def test_rig_speed(benchmark, figures):
    run_once(SEEDS[0])  # the hot loops are compiled or loaded by now
    results = []
    benchmark.pedantic(lambda: results.append(run_once(SEEDS[len(results) % len(SEEDS)])), rounds=len(SEEDS))
    simulated, wall = sum(r[0] for r in results), sum(r[1] for r in results)
    figures.add(
        "rig: simulated seconds per wall second", f"{simulated / wall:.0f}", "goto_user, one core; aim 250"
    )
    assert simulated / wall >= 250


def test_rig_profile(benchmark):
    profile = cProfile.Profile()
    benchmark.pedantic(lambda: profile.runcall(run_once, SEEDS[1]), rounds=1)
    stats = pstats.Stats(profile)
    total = stats.total_tt
    entries = sorted(stats.stats.items(), key=lambda item: item[1][2], reverse=True)
    rows = []
    for (file, _line, name), (_, calls, own, _, _) in entries:
        place = file.split("florence_bt/")[-1] if "florence_bt" in file else file.rsplit("/", 1)[-1]
        rows.append((f"{100 * own / total:.1f}", name, place, str(calls)))
    write_runs("rig_profile", ("own time (%)", "function", "file", "calls"), rows)
