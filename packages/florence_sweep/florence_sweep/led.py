"""Judges a run in which somebody leads the robot through a home: was the person kept, and how well."""

from __future__ import annotations

import itertools
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from florence_bt.runtime.run import MissionRequest, MissionRun
from florence_bt.simulation.home.situations import LedWalk
from florence_bt.simulation.rig.rig import Rig
from florence_sweep.experiment import Setup
from florence_sweep.outcome import KEPT, Measures

FOLLOW_M = 1.0
"""The distance that a robot is to keep, between the middles, metres: that of ``follow_me``."""

LOST_M, KEPT_M = 2.0, 1.5
"""Further away the person is lost for the moment; whoever is nearer in the end has been followed. Metres."""

SAMPLE_S, AFTER_S = 0.1, 10.0
"""How often the truth is looked at; how long the robot has to come near when the walk is over. Seconds."""


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


def follow(rig: Rig, walk: LedWalk, setup: Setup) -> tuple[MissionRun, Measures]:
    """Run a mission while somebody leads the robot, and stop it :data:`AFTER_S` after the walk.

    Returns:
        The finished run, and the verdict of :func:`measures`.
    """
    run = rig.executor.trigger(MissionRequest(setup.mission, setup.inputs, caller="sweep"))
    samples = watch(rig, walk, run, setup.limit)
    rig.executor.stop("the walk is over")
    while not run.status.final:
        rig.clock.run_next()
    return run, measures(samples)


def watch(rig: Rig, walk: LedWalk, run: MissionRun, limit: float) -> list[Sample]:
    """Record the truth from the leader's start to :data:`AFTER_S` after the walk, for ``limit`` s at most."""
    rig.clock.advance_to(walk.leader.wait)
    end = over = rig.clock.now() + limit
    samples: list[Sample] = []
    while rig.clock.now() < end:
        rig.clock.advance(SAMPLE_S)
        robot = rig.world.robot_pose
        leader, visitor = (
            robot.distance_to(rig.world.person_pose(each.name)) for each in (walk.leader, walk.visitor)
        )
        walking = rig.world.walks(walk.leader.name)
        if not walking and end == over:
            end = rig.clock.now() + AFTER_S
        samples.append(Sample(leader, visitor, walking, not run.status.final))
    return samples


def measures(samples: Sequence[Sample]) -> Measures:
    """Judge a run by the truth.

    Args:
        samples: From when the person sets off, every :data:`SAMPLE_S`, to :data:`AFTER_S` after the walk.

    Returns:
        Whether the walk was over (a robot in a door can block it), and whether the robot then came near in
        time, while the mission still ran; metres of the mean error during the walk, and of the smallest
        distances; how often the person was lost and for how many seconds; whether the other person was nearer
        in the end.
    """
    walk = [sample for sample in samples if sample.walking]
    after = [sample for sample in samples if not sample.walking]
    far = [sample.leader > LOST_M for sample in walk]
    return {
        "walk over": bool(after),
        KEPT: any(sample.running and sample.leader < KEPT_M for sample in after),
        "mean error (m)": statistics.fmean(abs(sample.leader - FOLLOW_M) for sample in walk),
        "smallest distance (m)": min(sample.leader for sample in samples),
        "to the other person (m)": min(sample.visitor for sample in samples),
        "times lost": sum(now and not before for before, now in itertools.pairwise([False, *far])),
        "lost (s)": SAMPLE_S * sum(far),
        "followed the other": samples[-1].visitor < min(KEPT_M, samples[-1].leader),
    }
