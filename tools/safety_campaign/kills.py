"""Processes that are killed during a drive: when the wheels stand, and what becomes of the rest."""

from __future__ import annotations

import random
import signal
from collections.abc import Callable
from dataclasses import dataclass

from tools.safety_campaign.running_system import BringUp, CampaignFailed, RunningSystem
from tools.tables import milliseconds, table

OTHERS = ("hardware", "navigation", "people", "simulator")
ENDS_ALL = "simulator"
"""The one that is not started again."""
IN_A_ROW = 3
"""Times that one bring-up starts a process again within ten minutes."""
AGAIN_S = 120.0


@dataclass(frozen=True)
class Kill:
    """The outcome of one kill.

    Attributes:
        group: The process that was killed.
        standing_s: From the kill to the stand; infinite when it never stood. Not known of the simulator.
        well: The process came back and the robot drove again; of the simulator: all ended with code 3.
        left: Processes that were left.
    """

    group: str
    standing_s: float
    well: bool
    left: int


def kill_many(
    missions: int,
    others: int,
    seed: int,
    say: Callable[[str], None] = print,
    bring_up: BringUp = RunningSystem,
) -> list[Kill]:
    """Kill the mission server, and each other process, so many times."""
    dice = random.Random(seed)
    kills: list[Kill] = []
    for group, count in (("missions", missions), *((other, others) for other in OTHERS)):
        done = 0
        while done < count:
            in_a_row = 1 if group == ENDS_ALL else min(IN_A_ROW, count - done)
            kills += _kill_in_a_row(group, in_a_row, seed + len(kills), dice, bring_up)
            done += in_a_row
        say(f"{count} kills of {group}")
    return kills


def _kill_in_a_row(group: str, count: int, seed: int, dice: random.Random, bring_up: BringUp) -> list[Kill]:
    with bring_up(seed) as system:
        system.drive_by_mission()
        if group == ENDS_ALL:
            return [_kill_the_world(system, dice)]
        return [_kill_and_see_it_back(system, group, dice) for _ in range(count)]


def _kill_and_see_it_back(system: RunningSystem, group: str, dice: random.Random) -> Kill:
    if not system.wait_for_drive(dice):
        raise CampaignFailed(f"the robot does not drive:\n{system.output}")
    before, told = system.pid(group), len(system.output)
    system.send(group, signal.SIGKILL)
    standing = system.seconds_to_stand()
    system.wait(
        lambda: "the robot may drive again" in system.output[told:], "the robot to be let go", AGAIN_S
    )
    if group != "missions":  # whose journal has what it was doing
        system.drive_by_mission()
    return Kill(group, standing, system.wait_for_drive(dice) and system.pid(group) not in (None, before), 0)


def _kill_the_world(system: RunningSystem, dice: random.Random) -> Kill:
    if not system.wait_for_drive(dice):
        raise CampaignFailed(f"the robot does not drive:\n{system.output}")
    system.send(ENDS_ALL, signal.SIGKILL)
    ended = system.spin_until(lambda: system.process.poll() is not None, 60.0)
    left = [name for name in (*OTHERS, "missions") if system.pid(name) is not None]
    well = ended and system.process.returncode == 3 and f"'{ENDS_ALL}'" in system.output
    return Kill(ENDS_ALL, float("nan"), well, len(left))


def kills_table(kills: list[Kill]) -> str:
    """Write a row per process."""
    rows = []
    for group in ("missions", *OTHERS):
        mine = [kill for kill in kills if kill.group == group]
        if not mine:
            continue
        times = sorted(kill.standing_s for kill in mine)
        known = group != ENDS_ALL
        rows.append(
            (
                group,
                str(len(mine)),
                milliseconds(times, 0.5) if known else "",
                milliseconds(times, 1.0) if known else "",
                str(sum(kill.well for kill in mine)),
                str(sum(kill.left for kill in mine)),
            )
        )
    head = ("killed", "times", "standing: median", "longest", "ended as it should", "processes left")
    return table(head, rows)
