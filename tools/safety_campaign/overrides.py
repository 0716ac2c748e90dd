"""Overrides at random moments of drives: how fast the wheels obey, and whether anything moves meanwhile.

Drives by a mission, by ``goal_pose`` and by goals of a foreign client; with the mission server alive, hung
(SIGSTOP) and dead (SIGKILL, and the supervisor stopped so that it starts no new one).
"""

from __future__ import annotations

import itertools
import random
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from geometry_msgs.msg import Twist
from std_msgs.msg import Bool

from tools.safety_campaign.running_system import BringUp, CampaignFailed, RunningSystem
from tools.tables import milliseconds, table

SERVERS = ("alive", "hung", "dead")
DRIVES = ("mission", "goal_pose", "foreign goal")
BLOCK = 20
"""Trials of each state of the mission server in one bring-up."""
PLACES = ((3.3, 5.2), (7.3, 4.9), (3.6, 2.95), (6.7, 2.975))
"""Free places of the flat, metres."""
TRIES = 5
GIVEN_UP = 3
"""Bring-ups that may end early, because the robot is stuck somewhere."""
SETTLE_S = 0.15
"""A base that brakes rocks a little when it stands."""
ATTACK_S = 0.6
"""Time in which everybody tries to drive the robot while the override is on."""
QUIET_S = 0.6
"""Time in which nobody does, before the release; the velocity filter lets old commands go within that
time."""

SHIFT_M = 0.01
"""A base that moves farther than this between the stand and the end is worth a line."""


@dataclass(frozen=True)
class Trial:
    """The effects of one override.

    Attributes:
        server: The state of the mission server.
        drive: What drove the robot.
        reaction_s: From the message to the first lower wheel speed.
        standing_s: From the message to the stand.
        distance_m: How far the robot came after the message.
        commanded: Whether the wheels were given a speed before the release, or without a command after it.
        shifted_m: How far the robot came between the stand and the end, after the release.
    """

    server: str
    drive: str
    reaction_s: float
    standing_s: float
    distance_m: float
    commanded: bool
    shifted_m: float


def override_many(
    count: int,
    seed: int,
    say: Callable[[str], None] = print,
    bring_up: BringUp = RunningSystem,
) -> list[Trial]:
    """Run the trials, a bring-up for a block of each state; one whose robot is stuck is given up.

    Raises:
        CampaignFailed: Too many bring-ups were given up.
    """
    dice = random.Random(seed)
    trials: list[Trial] = []
    servers = deque(_servers(count))
    given_up = 0
    numbers = itertools.count(seed)
    while servers:
        dead = 0
        try:
            with bring_up(next(numbers)) as system:
                while servers and (servers[0] == "dead" or not dead):  # it does not come back
                    trials.append(_next_trial(system, servers[0], dead, dice, say))
                    dead += servers.popleft() == "dead"
        except CampaignFailed as error:
            given_up += 1
            if given_up > GIVEN_UP:
                raise
            say(str(error))
        say(f"{len(trials)} of {count} overrides")
    return trials


def _next_trial(
    system: RunningSystem, server: str, dead: int, dice: random.Random, say: Callable[[str], None]
) -> Trial:
    """Try once, in a bring-up whose mission server has been dead for so many trials."""
    drive = _drive_for(server, dead, dice)
    if dead == 1:
        _kill_server(system)
    trial = _try_once(system, server, drive, dice, dies=server == "dead" and not dead)
    if trial.commanded or trial.shifted_m > SHIFT_M:
        say(f"it moved: {trial}; {_speeds(system.truths)}")
    system.spin(0.2)
    return trial


def _servers(count: int) -> Iterator[str]:
    """Yield the state of the mission server in each trial: the states take turns, a block of each."""
    share = {server: count // 3 + (count % 3 > index) for index, server in enumerate(SERVERS)}
    while any(share.values()):
        for server in SERVERS:
            size = min(BLOCK, share[server])
            share[server] -= size
            yield from [server] * size


def _drive_for(server: str, dead: int, dice: random.Random) -> str:
    """Choose a drive; a dead server has driven at most once: in the first trial it dies during it."""
    if server == "dead":
        return dice.choice(DRIVES[1:]) if dead else DRIVES[0]
    return dice.choice(DRIVES)


def _kill_server(system: RunningSystem) -> None:
    if system.pid("missions") is not None:
        system.process.send_signal(signal.SIGSTOP)
        system.send("missions", signal.SIGKILL)
        system.wait(lambda: system.pid("missions") is None, "the death of the mission server")


def _try_once(system: RunningSystem, server: str, drive: str, dice: random.Random, *, dies: bool) -> Trial:
    _begin_drive(system, drive, dice)
    if server == "hung":
        system.send("missions", signal.SIGSTOP)
        system.spin(dice.uniform(0.0, 0.3))
    elif dies:
        _kill_server(system)
        system.spin(dice.uniform(0.0, 0.3))
    system.forget()
    begin, speed, place = time.monotonic(), _speed(system.truth), system.truth["robot"]
    system.switch.publish(Bool(data=True))
    stands = system.spin_until(lambda: _stands_for(SETTLE_S, system.truths, begin), 5.0)
    truths = [truth for truth in system.truths if truth["monotonic"] >= begin]
    moving = [number for number, truth in enumerate(truths) if _moves(truth)]
    lower = [truth["monotonic"] for truth in truths if _speed(truth) < speed or speed == 0.0]
    standing = truths[moving[-1] + 1 if moving else 0]["monotonic"] if stands else begin + 5.0
    distance = _distance(place, system.truth["robot"])
    stood = system.truth["robot"]
    _attack(system, server)
    commanded = any(_speed(truth) > 0.0 for truth in system.truths)
    shifted = max((_distance(stood, truth["robot"]) for truth in system.truths), default=0.0)
    reaction = (lower or [begin + 5.0])[0] - begin
    return Trial(server, drive, reaction, standing - begin, distance, commanded, shifted)


def _begin_drive(system: RunningSystem, drive: str, dice: random.Random) -> None:
    """Let something drive the robot, and wait for a random moment of it.

    Raises:
        CampaignFailed: It does not drive.
    """
    for _ in range(TRIES):
        here = system.truth["robot"]
        x, y = max(PLACES, key=lambda place: _distance(here, place) + dice.uniform(0.0, 2.0))
        if drive == "mission":
            system.drive_by_mission()
        elif drive == "goal_pose":
            system.drive_by_topic(x, y)
        elif dice.random() < 0.7:
            system.drive_by_action(x, y)
        else:
            system.turn_by_action(dice.choice((-6.0, 6.0)))
        if system.spin_until(lambda: system.truth["moving"], 15.0):
            system.spin(dice.uniform(0.0, 2.5))
            if system.truth["moving"] and _speed(system.truth) > 0.02:
                return
    raise CampaignFailed(f"the robot does not drive by {drive}:\n{system.output}")


def _attack(system: RunningSystem, server: str) -> None:
    """Let everybody try to drive the robot; when nothing of it is on its way any more, release it."""
    system.forget()
    twist = Twist()
    twist.linear.x = 0.2
    system.drive_by_topic(*PLACES[0])
    answers = (system.drive_by_action(*PLACES[1]), system.turn_by_action(3.0))
    end = time.monotonic() + ATTACK_S
    while time.monotonic() < end:
        for velocity in system.velocities:
            velocity.publish(twist)
        system.spin(0.05)
    if server == "hung":
        system.send("missions", signal.SIGCONT)
    system.wait(lambda: all(answer.done() for answer in answers), "navigation's answers to the goals")
    system.spin(QUIET_S)
    system.switch.publish(Bool(data=False))
    system.wait(lambda: system.overridden is False, "the release")
    system.spin(0.4)


def _speeds(truths: list[dict]) -> str:
    """Write when the wheels were given which speeds, for people; seconds from the first truth."""
    given = [(truth["monotonic"] - truths[0]["monotonic"], truth["wheels"]) for truth in truths]
    return ", ".join(f"{at:.2f} s: {wheels}" for at, wheels in given if any(wheels))[:500]


def _stands_for(seconds: float, truths: list[dict], begin: float) -> bool:
    """Tell whether nothing has moved for some time; a robot that brakes hard rocks for a moment."""
    end = truths[-1]["monotonic"] if truths else begin
    lately = [truth for truth in truths if truth["monotonic"] > end - seconds]
    return end - begin >= seconds and not any(map(_moves, lately))


def _moves(truth: dict) -> bool:
    return bool(truth["moving"]) or _speed(truth) > 0.0


def _speed(truth: dict) -> float:
    """Return the faster wheel's command, m/s."""
    return max(abs(speed) for speed in truth["wheels"])


def _distance(one: tuple, other: tuple) -> float:
    return ((one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2) ** 0.5


def overrides_table(trials: list[Trial]) -> str:
    """Write a row per state of the mission server and kind of drive, and one for all."""
    kinds = [(server, drive) for server in SERVERS for drive in DRIVES]
    rows = [
        _row(
            f"{server}, {drive}",
            [trial for trial in trials if (trial.server, trial.drive) == (server, drive)],
        )
        for server, drive in kinds
    ]
    head = (
        "mission server, drive by",
        "overrides",
        "reaction: median",
        "99 %",
        "longest",
        "standing: median",
        "longest",
        "farthest after it",
        "given a speed before, or by itself after the release",
        "farthest shift meanwhile",
    )
    return table(head, [row for row in [*rows, _row("all", trials)] if row])


def _row(name: str, trials: list[Trial]) -> tuple[str, ...]:
    if not trials:
        return ()
    reactions = sorted(trial.reaction_s for trial in trials)
    standings = sorted(trial.standing_s for trial in trials)
    return (
        name,
        str(len(trials)),
        milliseconds(reactions, 0.5),
        milliseconds(reactions, 0.99),
        milliseconds(reactions, 1.0),
        milliseconds(standings, 0.5),
        milliseconds(standings, 1.0),
        f"{max(trial.distance_m for trial in trials) * 100:.1f} cm",
        str(sum(trial.commanded for trial in trials)),
        f"{max(trial.shifted_m for trial in trials) * 1000:.1f} mm",
    )
