"""Processes that hang during a drive: when the wheels stand.

Not the hardware: the time of a simulation waits for it, so that the world stands still with it.
"""

from __future__ import annotations

import random
import signal
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from tools.safety_campaign.running_system import BringUp, CampaignFailed, RunningSystem
from tools.tables import milliseconds, table

PROCESSES = ("missions", "navigation", "people")


@dataclass(frozen=True)
class Hang:
    """The outcome of one process under SIGSTOP.

    Attributes:
        group: The process.
        standing_s: From the signal to the stand; infinite when it never stood.
        well: Whether the drive went on when the process did.
    """

    group: str
    standing_s: float
    well: bool


def hang_many(
    count: int,
    seed: int,
    say: Callable[[str], None] = print,
    bring_up: BringUp = RunningSystem,
    processes: Sequence[str] = PROCESSES,
) -> list[Hang]:
    """Let each of some processes hang so many times."""
    dice = random.Random(seed)
    hangs = []
    for number, group in enumerate(processes):
        with bring_up(seed + number) as system:
            system.drive_by_mission()
            hangs += [_hang(system, group, dice) for _ in range(count)]
        say(f"{count} hangs of {group}")
    return hangs


def _hang(system: RunningSystem, group: str, dice: random.Random) -> Hang:
    if not system.wait_for_drive(dice):
        raise CampaignFailed(f"the robot does not drive:\n{system.output}")
    system.send(group, signal.SIGSTOP)
    standing_s = system.seconds_to_stand()
    system.send(group, signal.SIGCONT)
    return Hang(group, standing_s, system.wait_for_drive(dice))


def hangs_table(hangs: list[Hang]) -> str:
    """Write a row per process."""
    rows = []
    for group in PROCESSES:
        mine = [hang for hang in hangs if hang.group == group]
        if not mine:
            continue
        times = sorted(hang.standing_s for hang in mine)
        well = str(sum(hang.well for hang in mine))
        rows.append((group, str(len(mine)), milliseconds(times, 0.5), milliseconds(times, 1.0), well))
    return table(("hung", "times", "standing: median", "longest", "drive went on"), rows)
