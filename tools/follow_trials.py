"""Many seeded runs of ``follow_me``: in the rig somebody leads the robot through a home.

``python tools/follow_trials.py --runs 10 --write docs/notes/follow.md``.
"""

from __future__ import annotations

import argparse
import itertools
import math
import statistics
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from florence_bt.app.demo.rigs import make_rig
from florence_bt.core.errors import ConfigError, FlorenceError
from florence_bt.runtime.run import MissionRequest, MissionRun
from florence_bt.simulation.home.flat import Flat
from florence_bt.simulation.home.generate import choose_flat
from florence_bt.simulation.home.person import PersonSpec
from florence_bt.simulation.home.situations import LedWalk, led_walk
from florence_bt.simulation.rig.rig import Rig
from tools.processes import processes
from tools.tables import RowTable, command_of, table

HOMES = {"flat": "the hand-made flat", "generated": "generated homes"}
"""Name -> what it is."""

FOLLOW_M = 1.0
"""The distance that the mission is to keep, between the middles."""

_TRIES = 5
"""Generated homes for a run, 1000 seeds from each other: in some nobody can lead a robot so far."""

LOST_M, KEPT_M = 2.0, 1.5
"""Further away the person is lost for the moment; whoever is nearer in the end has been followed."""

SAMPLE_S, AFTER_S = 0.1, 10.0
"""Period of looking at the truth; time for the robot to come near when the walk is over."""

SPARE_S = 60.0
"""A walk that takes twice the time that it would take alone, its pauses, and this much more, is blocked."""


@dataclass(frozen=True, slots=True)
class Sample:
    """The truth at one moment.

    Attributes:
        leader: From the middle of the robot to that of the person to follow, metres.
        visitor: To that of the other person, metres.
        walking: Whether the walk goes on.
        running: Whether the mission does.
    """

    leader: float
    visitor: float
    walking: bool
    running: bool


@dataclass(frozen=True, slots=True)
class Verdict:
    """The verdict on the samples of a run.

    Attributes:
        over: The person came to the end of the walk; a robot in a door can block it.
        kept: Then the robot came near the person in time, and the mission still ran.
        error: Mean of how far the distance was from the wanted one during the walk, metres.
        nearest: The smallest distance to the person, metres.
        nearest_visitor: The smallest distance to the other person, metres.
        losses: How often the person was lost.
        lost: For how many seconds in all.
        followed: Who was near in the end: ``leader``, ``visitor`` or ``nobody``.
    """

    over: bool
    kept: bool
    error: float
    nearest: float
    nearest_visitor: float
    losses: int
    lost: float
    followed: str


def judge(samples: Sequence[Sample]) -> Verdict:
    """Judge a run by the truth.

    Args:
        samples: From when the person sets off, every ``SAMPLE_S``, to ``AFTER_S`` after the walk.
    """
    walk = [sample for sample in samples if sample.walking]
    after = [sample for sample in samples if not sample.walking]
    far = [sample.leader > LOST_M for sample in walk]
    end = samples[-1]
    distance, followed = min((end.leader, "leader"), (end.visitor, "visitor"))
    return Verdict(
        over=bool(after),
        kept=any(sample.running and sample.leader < KEPT_M for sample in after),
        error=statistics.fmean(abs(sample.leader - FOLLOW_M) for sample in walk),
        nearest=min(sample.leader for sample in samples),
        nearest_visitor=min(sample.visitor for sample in samples),
        losses=sum(now and not before for before, now in itertools.pairwise([False, *far])),
        lost=SAMPLE_S * sum(far),
        followed=followed if distance < KEPT_M else "nobody",
    )


@dataclass(frozen=True, slots=True)
class Trial:
    """One run and what really came of it.

    Attributes:
        home: A key of ``HOMES``.
        seed: The run's seed; chooses a generated home too.
        length: Of the leader's route, metres.
        speed: Of the leader, m/s.
        mission: How the mission ended by itself, and why; empty when it ran until it was stopped.
        verdict: What the truth says.
        contacts: What the robot touched.
        simulated: Simulated seconds from the start of the mission.
        wall: Wall seconds of the same.
    """

    home: str
    seed: int
    length: float
    speed: float
    mission: str
    verdict: Verdict
    contacts: tuple[str, ...]
    simulated: float
    wall: float


def _home_and_walk(
    home: str, seed: int, world: Path | None, world_seed: int | None, length_m: float
) -> tuple[Flat, LedWalk]:
    """Choose where and how somebody leads the robot; a generated home without room is replaced."""
    generated = home == "generated"
    own = generated and world_seed is None
    home_seeds = [seed + 1000 * number for number in range(_TRIES)] if own else [world_seed]
    for home_seed in home_seeds:
        flat = choose_flat(None, home_seed) if generated else choose_flat(world)
        try:
            return flat, led_walk(flat, np.random.default_rng(seed), length_m)
        except ConfigError:
            if home_seed == home_seeds[-1]:
                raise
    raise AssertionError("there is at least one seed")


def run_trial(
    home: str,
    seed: int,
    *,
    world: Path | None = None,
    world_seed: int | None = None,
    length_m: float = 60.0,
    runs: Path | None = None,
) -> Trial:
    """Let somebody lead the robot once.

    Args:
        home: A key of ``HOMES``.
        seed: Chooses the home, the people and all noise.
        world: A home's file in place of the hand-made flat.
        world_seed: The seed of a generated home when it is not the run's.
        length_m: The least length of the walk, metres.
        runs: Where the run leaves its folder, None for nowhere.

    Raises:
        ConfigError: The home has no room for such a walk, or there is no such mission.
    """
    flat, walk = _home_and_walk(home, seed, world, world_seed, length_m)
    rig = make_rig(
        seed=seed, person=walk.leader, others=[walk.visitor], start=walk.start, flat=flat, runs_folder=runs
    )
    wall, begin = time.perf_counter(), rig.clock.now()
    run = trigger(rig, walk)
    samples = watch(rig, walk, run)
    mission = f"{run.status.value}: {run.reason}" if run.status.final else ""
    rig.executor.stop("the walk is over")
    return Trial(
        home=home,
        seed=seed,
        length=route_length(walk.leader),
        speed=walk.leader.speed,
        mission=mission,
        verdict=judge(samples),
        contacts=tuple(contact.name for contact in rig.world.contacts),
        simulated=rig.clock.now() - begin,
        wall=time.perf_counter() - wall,
    )


def trigger(rig: Rig, walk: LedWalk) -> MissionRun:
    """Start ``follow_me`` with where the leader truly is."""
    leader = rig.world.robot_pose.inverse() @ rig.world.person_pose(walk.leader.name)
    inputs = {"x": leader.x, "y": leader.y}
    return rig.executor.trigger(MissionRequest("follow_me", inputs, caller="trials"))


def watch(rig: Rig, walk: LedWalk, run: MissionRun) -> list[Sample]:
    """Record the truth from the leader's start to ``AFTER_S`` after the walk, or until it is blocked."""
    rig.clock.advance_to(walk.leader.wait)
    alone = route_length(walk.leader) / walk.leader.speed
    limit = rig.clock.now() + 2.0 * alone + sum(walk.leader.pauses) + SPARE_S
    samples: list[Sample] = []
    end = limit
    while rig.clock.now() < end:
        rig.clock.advance(SAMPLE_S)
        robot = rig.world.robot_pose
        leader, visitor = (
            robot.distance_to(rig.world.person_pose(each.name)) for each in (walk.leader, walk.visitor)
        )
        walking = rig.world.walks(walk.leader.name)
        if not walking and end == limit:
            end = rig.clock.now() + AFTER_S
        samples.append(Sample(leader, visitor, walking, not run.status.final))
    return samples


def route_length(spec: PersonSpec) -> float:
    """Return how long the way of somebody who walks is, metres."""
    points = [(spec.pose.x, spec.pose.y), *spec.route]
    return sum(math.dist(a, b) for a, b in itertools.pairwise(points))


SUMMARY = ["home", "runs", "walk over", "kept", "mean error (m)", "smallest distance (m)"]
SUMMARY += ["to the other person (m)", "never lost", "lost (s)", "contacts"]


def table_of(trials: Sequence[Trial]) -> str:
    """Write the totals as Markdown."""
    by_home = {home: [trial for trial in trials if trial.home == home] for home in HOMES}
    return table(SUMMARY, [summary(home, of) for home, of in by_home.items() if of])


TABLE = RowTable("follow", Trial, table_of)


def summary(home: str, trials: Sequence[Trial]) -> list[str]:
    """Write the runs of one home as a line of the table."""
    verdicts = [trial.verdict for trial in trials]
    return [
        HOMES[home],
        str(len(trials)),
        str(sum(verdict.over for verdict in verdicts)),
        f"**{sum(verdict.kept for verdict in verdicts)}**",
        f"{statistics.fmean(verdict.error for verdict in verdicts):.2f}",
        f"{min(verdict.nearest for verdict in verdicts):.2f}",
        f"{min(verdict.nearest_visitor for verdict in verdicts):.2f}",
        str(sum(not verdict.losses for verdict in verdicts)),
        f"{sum(verdict.lost for verdict in verdicts):.0f}",
        str(sum(len(trial.contacts) for trial in trials)),
    ]


def told(trial: Trial) -> str:
    """Write one walk for people."""
    verdict = trial.verdict
    touched = f", touched {', '.join(trial.contacts)}" if trial.contacts else ""
    return (
        f"{trial.home}, seed {trial.seed}, {trial.length:.0f} m at {trial.speed:.2f} m/s: "
        f"{'kept' if verdict.kept else 'not kept'}, {verdict.error:.2f} m off, "
        f"lost for {verdict.lost:.0f} s, followed {verdict.followed}{touched}. {trial.mission}"
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the trials; exit code 2 when one cannot begin."""
    parser = argparse.ArgumentParser(description="Seeded runs of follow_me in the rig")
    parser.add_argument("--runs", type=int, default=10, help="runs in each kind of home")
    parser.add_argument("--first", type=int, default=1, help="first seed")
    parser.add_argument("--homes", nargs="+", choices=HOMES, default=list(HOMES), help="kinds of homes")
    parser.add_argument(
        "--world", type=Path, help="source file in place of the hand-made flat (docs/notes/homes.md)"
    )
    parser.add_argument(
        "--world-seed", type=int, metavar="SEED", help="one generated home for all runs in such"
    )
    parser.add_argument("--length", type=float, default=60.0, metavar="M", help="least length of a walk")
    parser.add_argument("--jobs", type=int, default=2, help="runs at a time, each on a core")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="a page with the marks of the table")
    parser.add_argument("--runs-folder", type=Path, help="folder for the runs' own folders")
    given = parser.parse_args(arguments)
    run = partial(
        run_trial,
        world=given.world,
        world_seed=given.world_seed,
        length_m=given.length,
        runs=given.runs_folder,
    )
    todo = [(home, seed) for home in given.homes for seed in range(given.first, given.first + given.runs)]
    trials = []
    try:
        with processes(given.jobs) as pool:
            for trial in pool.map(run, *zip(*todo, strict=True)):
                trials.append(trial)
                print(told(trial), flush=True)
    except FlorenceError as error:
        print(error, file=sys.stderr)
        return 2
    TABLE.publish(trials, given.write, command_of("tools/follow_trials.py", arguments))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
