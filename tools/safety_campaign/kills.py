"""Processes that are killed during a drive: when the wheels stand, and what becomes of the rest."""

from __future__ import annotations

import random
import signal
from collections.abc import Callable
from dataclasses import dataclass

from tools.safety_campaign.running_system import CampaignFailed, RunningSystem
from tools.tables import milliseconds, table

OTHERS = ("hardware", "navigation", "people", "simulator")
IN_A_ROW = 3
"""How often one bring-up starts its mission server again within ten minutes."""


@dataclass(frozen=True)
class Kill:
    """The outcome of one kill.

    Attributes:
        group: The process that was killed.
        standing_s: From the kill to the stand; infinite when it never stood. Not known of the simulator.
        well: The mission server came back and its mission drove again; or the others ended with code 3.
        left: Processes that were left.
    """

    group: str
    standing_s: float
    well: bool
    left: int


def kill_many(missions: int, others: int, seed: int, say: Callable[[str], None] = print) -> list[Kill]:
    """Kill the mission server, and each other process, so many times."""
    dice = random.Random(seed)
    kills: list[Kill] = []
    while len(kills) < missions:
        with RunningSystem(seed + len(kills)) as system:
            system.drive_by_mission()
            for _ in range(min(IN_A_ROW, missions - len(kills))):
                kills.append(_kill_missions(system, dice))
        say(f"{len(kills)} of {missions} kills of the mission server")
    for group in OTHERS:
        for number in range(others):
            kills.append(_kill_other(group, seed + number, dice))
        say(f"{others} kills of {group}")
    return kills


def _kill_missions(system: RunningSystem, dice: random.Random) -> Kill:
    if not system.wait_for_drive(dice):
        raise CampaignFailed(f"the robot does not drive:\n{system.output}")
    before = system.pid("missions")
    system.send("missions", signal.SIGKILL)
    standing = system.seconds_to_stand()
    system.wait(lambda: system.pid("missions") not in (None, before), "the new mission server", 60.0)
    return Kill("missions", standing, system.wait_for_drive(dice), 0)


def _kill_other(group: str, seed: int, dice: random.Random) -> Kill:
    with RunningSystem(seed) as system:
        system.drive_by_mission()
        if not system.wait_for_drive(dice):
            raise CampaignFailed(f"the robot does not drive:\n{system.output}")
        system.send(group, signal.SIGKILL)
        standing = float("nan") if group == "simulator" else system.seconds_to_stand()
        ended = system.spin_until(lambda: system.process.poll() is not None, 60.0)
        left = [name for name in (*OTHERS, "missions") if system.pid(name) is not None]
        well = ended and system.process.returncode == 3 and f"'{group}'" in system.output
    return Kill(group, standing, well, len(left))


def kills_table(kills: list[Kill]) -> str:
    """Write a row per process."""
    rows = []
    for group in ("missions", *OTHERS):
        mine = [kill for kill in kills if kill.group == group]
        if not mine:
            continue
        times = sorted(kill.standing_s for kill in mine)
        known = group != "simulator"
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
