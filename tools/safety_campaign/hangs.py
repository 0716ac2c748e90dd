"""Processes that hang during a drive, and Ctrl-C beside a hung driver: when the wheels stand."""

from __future__ import annotations

import random
import signal
from collections.abc import Callable
from dataclasses import dataclass

from tools.safety_campaign.running_system import CampaignFailed, RunningSystem
from tools.safety_campaign.tables import milliseconds, table

PROCESSES = ("missions", "navigation", "people", "hardware")
CTRL_C = "hardware, and Ctrl-C at once"
ENDED_S = 60.0


@dataclass(frozen=True)
class Hang:
    """What became of one process under SIGSTOP.

    Attributes:
        what: The process, and what else was done.
        standing_s: From the signal to the stand; infinite when it never stood.
        well: The drive went on when the process did; or everything ended.
    """

    what: str
    standing_s: float
    well: bool


def hang_many(count: int, ends: int, seed: int, say: Callable[[str], None] = print) -> list[Hang]:
    """Let each process hang so many times, and end so many systems whose driver hangs."""
    dice = random.Random(seed)
    hangs = []
    for number, group in enumerate(PROCESSES):
        with RunningSystem(seed + number) as system:
            system.drive_by_mission()
            hangs += [_hang(system, group, dice) for _ in range(count)]
        say(f"{count} hangs of {group}")
    for number in range(ends):
        hangs.append(_end_beside_a_hung_driver(seed + len(PROCESSES) + number, dice))
    say(f"{ends} ends beside a hung driver")
    return hangs


def _hang(system: RunningSystem, group: str, dice: random.Random) -> Hang:
    _begin(system, group, dice)
    standing_s = system.seconds_to_stand()
    system.send(group, signal.SIGCONT)
    return Hang(group, standing_s, system.wait_for_drive(dice))


def _end_beside_a_hung_driver(seed: int, dice: random.Random) -> Hang:
    with RunningSystem(seed) as system:
        system.drive_by_mission()
        _begin(system, "hardware", dice)
        system.process.send_signal(signal.SIGINT)
        standing_s = system.seconds_to_stand()
        ended = system.spin_until(lambda: system.process.poll() is not None, ENDED_S)
        return Hang(CTRL_C, standing_s, ended and system.process.returncode == 130 and not system.pids())


def _begin(system: RunningSystem, group: str, dice: random.Random) -> None:
    if not system.wait_for_drive(dice):
        raise CampaignFailed(f"the robot does not drive:\n{system.output}")
    system.send(group, signal.SIGSTOP)


def hangs_table(hangs: list[Hang]) -> str:
    """A row per process."""
    rows = []
    for what in (*PROCESSES, CTRL_C):
        mine = [hang for hang in hangs if hang.what == what]
        times = sorted(hang.standing_s for hang in mine)
        well = str(sum(hang.well for hang in mine))
        rows.append((what, str(len(mine)), milliseconds(times, 0.5), milliseconds(times, 1.0), well))
    return table(("hung", "times", "standing: median", "longest", "went on, or ended, as it should"), rows)
