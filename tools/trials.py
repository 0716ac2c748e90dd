"""Many seeded runs of ``goto_user`` in the rig, with people where people are, and what really came of them.

``python tools/trials.py --runs 10 --write docs/notes/trials.md``.
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from florence_sweep.best_case import BestCase, best_case
from florence_sweep.outcome import LOOK_S, description, is_false, is_polite, met

from florence_bt.app.bringup.config import load_config
from florence_bt.app.bringup.options import ABSENT
from florence_bt.app.demo.rigs import make_rig
from florence_bt.core.errors import FlorenceError, closest_first
from florence_bt.runtime.run import RunStatus
from florence_bt.simulation.home.closeness import Closeness, closeness
from florence_bt.simulation.home.flat import Flat
from florence_bt.simulation.home.generate import choose_flat
from florence_bt.simulation.home.person import PersonSpec
from florence_bt.simulation.home.situations import company_in, person_in, room_with_decoy
from florence_bt.simulation.rig.components import navigator_parameters
from florence_bt.simulation.rig.wires import EVERY, Link
from tools.processes import processes
from tools.tables import RowTable, command_of, table

CLASSES = {
    "easy": "easy: the hand-made flat, in view of the room's hotspot, standing or on a stool",
    "standing": "standing or leaning anywhere free",
    "sitting": "sitting on the furniture",
    "lying": "lying in bed or on the floor",
    "walking": "walking between rooms",
    "aided": "carrying something, with a rollator or in a wheelchair",
    "company": "two or three people at home",
    "nobody": "nobody at home, with plants and coats",
}
"""Name -> what it is. All but the first are in generated homes."""

LONGEST_S = 600.0
"""Simulated seconds that a run may take."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One run and what really came of it.

    Attributes:
        situation: Its class.
        seed: The run's seed; chooses the home too.
        room: Where the person was, or where the robot was sent to when nobody was there.
        person: What the people did, the one that the rest is about first.
        best_case: What a perfect robot could do; None without a person. Of several people this and ``end``
            are about the one before whom the robot stood politely in the end, or else the nearest one.
        status: How the mission ended.
        reason: Why it did not succeed.
        end: How the robot really stood to the person in the end; None without a person.
        false_find: Whether a look found somebody where nobody was.
        contacts: What the robot touched.
        simulated: Simulated seconds of the mission.
        ideal: Seconds that it takes at best; None when that cannot be done.
        wall: Wall seconds of the mission.
        drawn: Whether what the network for people says was drawn.
    """

    situation: str
    seed: int
    room: str
    person: str
    best_case: BestCase | None
    status: RunStatus
    reason: str
    end: Closeness | None
    false_find: bool
    contacts: tuple[str, ...]
    simulated: float
    ideal: float | None
    wall: float
    drawn: bool = False

    @property
    def polite(self) -> bool:
        """The mission succeeded, and the robot stands at the polite distance and looks at the person."""
        if self.status is not RunStatus.SUCCEEDED or self.end is None:
            return False
        return is_polite(self.end, self.best_case)

    @property
    def good(self) -> bool:
        """A polite approach, or nobody found where nobody is; and nothing touched."""
        right = self.polite if self.end is not None else self.status is RunStatus.FAILED
        return right and not self.contacts and not self.false_find


def _late_link(text: str) -> tuple[str, Link]:
    """Read ``S`` or ``TOPIC=S``: the name of a link, and how late it is."""
    name, _, seconds = text.rpartition("=")
    delay = float(seconds)
    if not 0.0 <= delay < math.inf:
        raise argparse.ArgumentTypeError(f"{seconds} s is no delay (would have worked: /tf=0.15)")
    return name or EVERY, Link(delay=delay)


def run_trial(
    situation: str,
    seed: int,
    *,
    world: Path | None = None,
    world_seed: int | None = None,
    homes: int | None = None,
    runs: Path | None = None,
    limit_s: float = LONGEST_S,
    links: Mapping[str, Link] | None = None,
    drawn: bool = False,
) -> Trial:
    """Run ``goto_user`` once.

    Args:
        situation: A key of ``CLASSES``.
        seed: Chooses the home, the person and all noise.
        world: A home's file in place of a generated home.
        world_seed: The seed of the home when it is not the run's.
        homes: How many homes there are for all runs; each run has a home of its own when not given.
        runs: Where the run leaves its folder, None for nowhere.
        limit_s: Simulated seconds after which it is stopped.
        links: How well topics are carried, by name; perfectly when not given.
        drawn: Whether what the network for people says is drawn in place of running it.

    Raises:
        ConfigError: The home has no place for such a person.
    """
    if situation == "easy" or world is not None:
        flat = choose_flat(world)
    else:
        home = world_seed if world_seed is not None else seed % homes if homes is not None else seed
        flat = choose_flat(None, home)
    rng = np.random.default_rng(seed)
    people = _people_in(situation, flat, rng)
    room = flat.room_at(people[0].pose.x, people[0].pose.y) if people else None
    sent_to = room.name if room is not None else room_with_decoy(flat, rng)
    rig = make_rig(
        seed=seed,
        person=people[0] if people else ABSENT,
        others=people[1:],
        user_room=sent_to,
        runs_folder=runs,
        flat=flat,
        links=links,
        drawn_people=drawn,
    )
    best_cases = {spec.name: best_case(flat, rig.world, spec, flat.start) for spec in people}
    wall = time.perf_counter()
    run = rig.run("goto_user", limit_s=limit_s)
    wall = time.perf_counter() - wall
    assert run.started is not None and run.ended is not None
    if all(spec.posture != "walking" for spec in people):
        rig.clock.advance(1.0)
    ends = {spec.name: closeness(rig.world.robot_pose, rig.world.person_pose(spec.name)) for spec in people}
    who = met(ends, best_cases)
    people.sort(key=lambda spec: (spec.name != who, ends[spec.name].distance))
    best = best_cases.get(who)
    speed = navigator_parameters(load_config()).controller.max_vel_x
    return Trial(
        situation=situation,
        seed=seed,
        room=sent_to,
        person="; ".join(map(description, people)) or "nobody",
        best_case=best,
        status=run.status,
        reason=run.reason,
        end=ends.get(who),
        false_find=any(is_false(found, people) for found in rig.found),
        contacts=tuple(contact.name for contact in rig.world.contacts),
        simulated=run.ended - run.started,
        ideal=best.way / speed + LOOK_S if best is not None and best.way is not None else None,
        wall=wall,
        drawn=drawn,
    )


def _people_in(situation: str, flat: Flat, rng: np.random.Generator) -> list[PersonSpec]:
    """Choose who is at home; the first is the user."""
    if situation == "nobody":
        return []
    return company_in(flat, rng) if situation == "company" else [person_in(situation, flat, rng)]


SUMMARY = ["class", "runs", "could be seen", "approached politely", "wrong success", "contacts"]
SUMMARY += ["false finds", "median time (s)", "to ideal"]


def table_of(trials: Sequence[Trial]) -> str:
    """Write the totals as Markdown."""
    simulated, wall = sum(trial.simulated for trial in trials), sum(trial.wall for trial in trials)
    by_class = {name: [trial for trial in trials if trial.situation == name] for name in CLASSES}
    rows = [summary(CLASSES[name], of) for name, of in by_class.items() if of]
    rows.append(summary("all with people", [trial for trial in trials if trial.end is not None]))
    return (
        f"{table(SUMMARY, rows)}\n\n"
        f"{len(trials)} runs, {simulated:.0f} simulated seconds in {wall:.0f} seconds of one core "
        f"({simulated / wall:.0f} times real time on the last machine).{_drawn_text(trials)}"
    )


def _drawn_text(trials: Sequence[Trial]) -> str:
    """Say so where no network has looked for people."""
    if not any(trial.drawn for trial in trials):
        return ""
    return (
        " No network has looked for people: what it would say was drawn from the shares of "
        "[people.md](people.md#how-well)."
    )


TABLE = RowTable("trials", Trial, table_of)
DRAWN_TABLE = RowTable("drawn trials", Trial, table_of)
LATE_TABLE = RowTable("late trials", Trial, table_of)
NEW_TABLE = RowTable("new trials", Trial, table_of)
EARLIER_TABLE = RowTable("new trials before", Trial, table_of)
TABLES = {each.name: each for each in (TABLE, DRAWN_TABLE, LATE_TABLE, NEW_TABLE, EARLIER_TABLE)}
"""The last two are of one set of seeds, with the code that is and with that before a success was measured."""


def summary(title: str, trials: Sequence[Trial]) -> list[str]:
    """Write the runs of one class as a line of the table."""
    people = [trial for trial in trials if trial.end is not None]
    polite = [trial for trial in trials if trial.polite]
    ratios = [trial.simulated / trial.ideal for trial in polite if trial.ideal]
    seen = sum(trial.best_case is not None and trial.best_case.visible for trial in people)
    succeeded = sum(trial.status is RunStatus.SUCCEEDED for trial in trials)
    return [
        title,
        str(len(trials)),
        str(seen) if people else "",
        f"**{len(polite)}**" if people else "",
        str(succeeded - len(polite)),
        str(sum(len(trial.contacts) for trial in trials)),
        str(sum(trial.false_find for trial in trials)),
        f"{statistics.median(trial.simulated for trial in polite):.0f}" if polite else "",
        f"{statistics.median(ratios):.1f}" if ratios else "",
    ]


def told(trial: Trial) -> str:
    """Write one run for people."""
    end = "" if trial.end is None else f", {trial.end.distance:.2f} m away"
    why = f": {trial.reason}" if trial.reason else ""
    touched = f", touched {', '.join(trial.contacts)}" if trial.contacts else ""
    return (
        f"{trial.situation}, seed {trial.seed}, {trial.person}: {'good' if trial.good else 'bad'}, "
        f"{trial.status.value}{why}{end}{touched}, {trial.simulated:.0f} s"
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the trials; exit code 1 when fewer than all but one of the easy ones are good."""
    parser = argparse.ArgumentParser(description="Seeded runs of goto_user in the rig")
    parser.add_argument("--runs", type=int, default=10, help="runs of each class")
    parser.add_argument("--first", type=int, default=1, help="first seed")
    parser.add_argument("--classes", nargs="+", metavar="CLASS", help=f"some of: {', '.join(CLASSES)}")
    parser.add_argument(
        "--world", type=Path, help="source file of the home for all runs (docs/notes/homes.md)"
    )
    parser.add_argument(
        "--world-seed", type=int, metavar="SEED", help="generate one home for all runs but the easy"
    )
    parser.add_argument("--homes", type=int, help="generate so many homes; without it, one for each run")
    parser.add_argument("--jobs", type=int, default=2, help="runs at a time, each on a core")
    parser.add_argument(
        "--limit",
        type=float,
        default=LONGEST_S,
        metavar="S",
        help="simulated seconds after which a run stops",
    )
    parser.add_argument(
        "--late",
        type=_late_link,
        nargs="+",
        default=[],
        metavar="[TOPIC=]S",
        help="so late each message of a topic comes, seconds; of /tf each frame, without a topic everything",
    )
    parser.add_argument(
        "--drawn",
        action="store_true",
        help="draw what the network for people says, as often as it was right (docs/notes/people.md)",
    )
    parser.add_argument("--table", choices=TABLES, help="the table to write, when it is not told by the rest")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="a page with the marks of the table")
    parser.add_argument("--runs-folder", type=Path, help="folder for the runs' own folders")
    given = parser.parse_args(arguments)
    classes = given.classes or list(CLASSES)
    for name in classes:
        if name not in CLASSES:
            parser.error(f"there is no class {name!r}; there are {', '.join(closest_first(name, CLASSES))}")
    run = partial(
        run_trial,
        world=given.world,
        world_seed=given.world_seed,
        homes=given.homes,
        runs=given.runs_folder,
        limit_s=given.limit,
        links=dict(given.late),
        drawn=given.drawn,
    )
    todo = [(name, seed) for name in classes for seed in range(given.first, given.first + given.runs)]
    trials = []
    try:
        choose_flat(given.world, given.world_seed)
        with processes(given.jobs) as pool:
            for trial in pool.map(run, *zip(*todo, strict=True)):
                trials.append(trial)
                print(told(trial), flush=True)
    except FlorenceError as error:
        print(error, file=sys.stderr)
        return 2
    usual = DRAWN_TABLE if given.drawn else LATE_TABLE if given.late else TABLE
    table = TABLES.get(given.table, usual)
    table.publish(trials, given.write, command_of("tools/trials.py", arguments))
    easy = [trial for trial in trials if trial.situation == "easy"]
    return 0 if sum(trial.good for trial in easy) >= len(easy) - 1 else 1


if __name__ == "__main__":
    raise SystemExit(main())
