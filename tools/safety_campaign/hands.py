"""A person who drives by hand under the manual override while a process hangs: whether the wheels obey."""

from __future__ import annotations

import random
import signal
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from geometry_msgs.msg import Twist
from std_msgs.msg import Bool

from tools.safety_campaign.running_system import BringUp, CampaignFailed, RunningSystem
from tools.tables import table

HANGS = {"missions": 10.0, "navigation": 4.0, "people": 4.0}
"""Time that each process hangs, seconds: of the mission server long enough to be killed and started again."""
TURN_RAD_PER_S = 0.5
"""The person turns on the spot, where there is always room."""
PERIOD_S = 0.05
START_S = 1.0
"""The wheels turn at the full speed before the process hangs."""
QUIET_S = 1.5


@dataclass(frozen=True)
class HandDrive:
    """A drive by hand while a process hung.

    Attributes:
        group: The process under SIGSTOP.
        obeyed: Share of the time in which the wheels turned, 0 to 1.
        moved: Whether anything moved after the hand had let go.
    """

    group: str
    obeyed: float
    moved: bool


def drive_by_hand_many(
    count: int,
    seed: int,
    say: Callable[[str], None] = print,
    bring_up: BringUp = RunningSystem,
    processes: Sequence[str] = tuple(HANGS),
) -> list[HandDrive]:
    """Drive by hand so many times beside each of some processes that hang."""
    dice = random.Random(seed)
    drives = []
    for number, group in enumerate(processes):
        for index in range(count):
            with bring_up(seed + 100 * number + index) as system:
                drives.append(_drive(system, group, dice))
        say(f"{count} drives by hand while {group} hung")
    return drives


def _drive(system: RunningSystem, group: str, dice: random.Random) -> HandDrive:
    system.drive_by_mission()
    if not system.wait_for_drive(dice):
        raise CampaignFailed(f"the robot does not drive:\n{system.output}")
    system.switch.publish(Bool(data=True))
    system.wait(lambda: system.overridden, "the override")
    _turn(system, START_S)
    stopped = system.pid(group)
    system.send(group, signal.SIGSTOP)
    system.forget()
    _turn(system, HANGS[group])
    turned = [any(truth["wheels"]) for truth in system.truths]
    if system.pid(group) == stopped:
        system.send(group, signal.SIGCONT)
    system.spin(QUIET_S)  # the hand's last command grows old
    system.forget()
    system.spin(QUIET_S)
    system.switch.publish(Bool(data=False))
    system.wait(lambda: system.overridden is False, "the release")
    system.spin(QUIET_S)
    moved = any(any(truth["wheels"]) for truth in system.truths)
    return HandDrive(group, sum(turned) / max(1, len(turned)), moved)


def _turn(system: RunningSystem, seconds: float) -> None:
    command = Twist()
    command.angular.z = TURN_RAD_PER_S
    for _ in range(round(seconds / PERIOD_S)):
        system.by_hand.publish(command)
        system.spin(PERIOD_S)


def hands_table(drives: list[HandDrive]) -> str:
    """Write a row per process."""
    rows = []
    for group, seconds in HANGS.items():
        mine = [drive for drive in drives if drive.group == group]
        shares = [drive.obeyed for drive in mine]
        if mine:
            moved = str(sum(drive.moved for drive in mine))
            rows.append((group, f"{seconds:g} s", str(len(mine)), f"{100.0 * min(shares):.0f} %", moved))
    head = ("hung", "for", "times", "wheels obeyed the hand (worst drive)", "moved after the hand let go")
    return table(head, rows)
