"""Missions that were paused or overridden when their mission server died: whether the robot drives off."""

from __future__ import annotations

import itertools
import random
import signal
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from std_msgs.msg import Bool

from tools.safety_campaign.kills import IN_A_ROW
from tools.safety_campaign.running_system import BringUp, CampaignFailed, RunningSystem
from tools.tables import table

DEATHS = ("killed", "hung until the supervisor killed it")
STANDS_BY = ("pause", "override")
WATCH_S = 8.0
"""Time after the mission server is back in which nothing may move; a run that comes back drives within 3
s."""
DRIVES_S = 30.0
UP_AGAIN = "'missions' is up again"


@dataclass(frozen=True)
class Stand:
    """The robot after its mission server died while somebody had made it stand.

    Attributes:
        by: ``pause`` or ``override``.
        death: How the mission server died, one of :data:`DEATHS`.
        moved: Whether anything moved that nobody had asked for.
        state: The state of the run afterwards.
        well: Whether the robot drove when it was asked to: by ``resume``, or by a new run.
    """

    by: str
    death: str
    moved: bool
    state: str
    well: bool


def stand_many(
    count: int,
    seed: int,
    say: Callable[[str], None] = print,
    bring_up: BringUp = RunningSystem,
) -> list[Stand]:
    """Let the mission server die so many times, a bring-up for each block of deaths that it survives."""
    dice = random.Random(seed)
    cases = itertools.cycle([(by, death) for by in STANDS_BY for death in DEATHS])
    stands: list[Stand] = []
    while len(stands) < count:
        with bring_up(seed + len(stands)) as system:
            for _ in range(min(IN_A_ROW, count - len(stands))):
                stands.append(_stand(system, *next(cases), dice))
        say(f"{len(stands)} of {count} deaths")
    return stands


def _stand(system: RunningSystem, by: str, death: str, dice: random.Random) -> Stand:
    system.drive_by_mission()
    if not system.wait_for_drive(dice):
        raise CampaignFailed(f"the robot does not drive:\n{system.output}")
    if by == "pause":
        system.pause("a visitor")
    else:
        system.switch.publish(Bool(data=True))
        system.wait(lambda: system.overridden, "the override")
    system.wait(lambda: not system.truth["moving"], "the stand")
    system.spin(dice.uniform(0.0, 1.0))
    system.forget()
    restarts = system.output.count(UP_AGAIN)
    system.send("missions", signal.SIGKILL if death == DEATHS[0] else signal.SIGSTOP)
    system.wait(lambda: system.output.count(UP_AGAIN) > restarts, "the new mission server", 60.0)
    if by == "override":
        system.switch.publish(Bool(data=False))
        system.wait(lambda: system.overridden is False, "the release")
    system.spin(WATCH_S)
    moved = any(any(truth["wheels"]) for truth in system.truths)
    state = system.status().state
    if state == "PAUSED":
        system.resume()
    else:
        system.drive_by_mission()
    return Stand(by, death, moved, state, system.spin_until(lambda: system.truth["moving"], DRIVES_S))


def stands_table(stands: list[Stand]) -> str:
    """Write a row per kind of stand and death."""
    head = (
        "robot stood by",
        "mission server",
        "times",
        "moved by itself",
        "run afterwards",
        "drove when asked",
    )
    return table(head, list(_rows(stands)))


def _rows(stands: list[Stand]) -> Iterator[tuple[str, ...]]:
    for by, death in itertools.product(STANDS_BY, DEATHS):
        mine = [stand for stand in stands if (stand.by, stand.death) == (by, death)]
        if mine:
            states = ", ".join(sorted({stand.state for stand in mine}))
            moved, well = sum(stand.moved for stand in mine), sum(stand.well for stand in mine)
            yield by, death, str(len(mine)), str(moved), states, str(well)
