"""Many seeded runs of ``goto_user`` in the rig, with the person anywhere in the flat, and their results.

``python tools/trials.py --runs 30 --out docs/trials.md``
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from florence_bt.app.demo.rigs import make_rig
from florence_bt.runtime.run import RunStatus
from florence_bt.simulation.home.closeness import Closeness, closeness


@dataclass(frozen=True, slots=True)
class Trial:
    """One run and what really came of it.

    Attributes:
        seed: The run's seed.
        room: Where the person was.
        posture: What the person did.
        status: How the mission ended.
        reason: Why it did not succeed.
        end: How the robot really stood to the person in the end.
        contacts: What the robot touched.
        simulated: Simulated seconds of the mission.
        wall: Wall seconds of the mission.
    """

    seed: int
    room: str
    posture: str
    status: RunStatus
    reason: str
    end: Closeness
    contacts: tuple[str, ...]
    simulated: float
    wall: float

    @property
    def good(self) -> bool:
        """Success in truth: the mission says so, the distance and the heading fit, nothing was touched."""
        return self.status is RunStatus.SUCCEEDED and self.end.polite and not self.contacts


def run_trial(seed: int, runs_folder: Path | None = None) -> Trial:
    """Run ``goto_user`` once with the person in a random place.

    Args:
        seed: Chooses the place, the posture and all noise.
        runs_folder: Where the run leaves its folder, None for nowhere.
    """
    rig = make_rig(seed=seed, runs_folder=runs_folder)
    person = rig.world.people[0]
    wall = time.perf_counter()
    run = rig.run("goto_user")
    wall = time.perf_counter() - wall
    assert run.started is not None and run.ended is not None
    rig.clock.advance(1.0)
    end = closeness(rig.world.robot_pose, rig.world.person_pose(person.name))
    return Trial(
        seed=seed,
        room=rig.locator.room_of(person.pose.x, person.pose.y),
        posture=person.posture,
        status=run.status,
        reason=run.reason,
        end=end,
        contacts=tuple(contact.name for contact in rig.world.contacts),
        simulated=run.ended - run.started,
        wall=wall,
    )


HEAD = """# Seeded runs of goto_user in the rig

Made by `make trials`. The person stands or sits in a random place of a random room; the robot starts in the
hall and is told the room. Good means: the mission succeeded, the robot really stands 0.5 m ± 0.1 m from the
person, looks at them within 15 degrees, and touched nothing on the way.
"""


def table(trials: Sequence[Trial]) -> str:
    """The results as Markdown."""
    simulated, wall = sum(trial.simulated for trial in trials), sum(trial.wall for trial in trials)
    good = sum(trial.good for trial in trials)
    lines = [
        HEAD,
        f"**{good} of {len(trials)} good, {touches(trials)} contacts**; {simulated:.0f} simulated seconds in",
        f"{wall:.0f} wall seconds ({simulated / wall:.0f} times real time on one core of the last machine).",
        "",
        "| seed | room | person | mission | distance (m) | facing (deg) | contacts | time (s) | |",
        "|---|---|---|---|---|---|---|---|---|",
        *(row(trial) for trial in trials),
    ]
    return "\n".join(lines) + "\n"


def touches(trials: Sequence[Trial]) -> int:
    """How often something was touched."""
    return sum(len(trial.contacts) for trial in trials)


def row(trial: Trial) -> str:
    """One run as a line of the table."""
    cells = (
        trial.seed,
        trial.room,
        trial.posture,
        f"{trial.status.value}: {trial.reason}" if trial.reason else trial.status.value,
        f"{trial.end.distance:.2f}",
        f"{math.degrees(trial.end.facing):.0f}",
        ", ".join(trial.contacts) or "none",
        f"{trial.simulated:.0f}",
        "good" if trial.good else "**not good**",
    )
    return f"| {' | '.join(str(cell) for cell in cells)} |"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the trials; exit code 1 when fewer than all but one are good or something was touched."""
    parser = argparse.ArgumentParser(description="Seeded runs of goto_user in the rig")
    parser.add_argument("--runs", type=int, default=30)
    parser.add_argument("--first", type=int, default=1, help="first seed")
    parser.add_argument("--out", type=Path, help="Markdown file for the table")
    parser.add_argument("--runs-folder", type=Path, help="folder for the runs' own folders")
    given = parser.parse_args(arguments)
    trials = []
    for seed in range(given.first, given.first + given.runs):
        trials.append(run_trial(seed, given.runs_folder))
        print(row(trials[-1]), f"{trials[-1].wall:.1f} s", flush=True)
    if given.out is not None:
        given.out.write_text(table(trials), encoding="utf-8")
    good = sum(trial.good for trial in trials)
    print(f"{good} of {len(trials)} good, {touches(trials)} contacts")
    return 0 if good >= len(trials) - 1 and not touches(trials) else 1


if __name__ == "__main__":
    raise SystemExit(main())
