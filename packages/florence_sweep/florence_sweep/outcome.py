"""What came of a run: judged on the truth of the simulated home, not on what the robot believes."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace

from florence_bt.core.geometry import Pose2
from florence_bt.runtime.run import RunStatus
from florence_bt.simulation.home.closeness import POLITE_DISTANCE_M, Closeness
from florence_bt.simulation.home.person import PersonSpec
from florence_sweep.best_case import BestCase

NEAR_M = 0.8
"""Whoever is found further than this from every place where a person was is not a person."""
LOOK_S = 2.0
"""The shortest look: the pause before it and five pictures (``detect_user``, ``LookParameters``)."""
KEPT = "kept"
"""Measure: whether the robot was with the person who led it when their walk was over."""
ALL_SEEN = "all rooms seen"
"""Measure: whether the map that the robot has made shows every room."""
Measures = dict[str, bool | float]
"""What is measured in runs of a kind alone, by the words of the table: it holds or not, or how much it is."""
NOT_RUN, BROKEN = "NOT_RUN", "BROKEN"
"""States of what is no run: the home has no place for such people; the program broke down."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of one case.

    Attributes:
        number: Of the case.
        variation: What was varied.
        seed: Of the case.
        home: The name of the home.
        room: Where the person was, or where the robot was sent to when nobody was there.
        people: What the people did; the one that the rest is about first.
        status: How the mission ended, :data:`NOT_RUN` or :data:`BROKEN`.
        code: The code of a failure.
        reason: Why it did not succeed.
        seconds: Simulated seconds of the mission.
        driven: Metres that the robot drove.
        contacts: What the robot touched.
        false_find: Whether somebody was found where nobody was.
        distance: From the robot to the person in the end, metres; None without people. Of several people this
            and what follows are about the one before whom the robot stood politely, or else the nearest.
        facing: How far the robot looked past the person in the end, radians.
        polite: Whether it stood at the polite distance, or as near as can be, and looked at them.
        visible: Whether they could be seen from somewhere the robot gets to.
        ideal: Seconds that the way to them takes at best; None when that cannot be done.
        good: Whether the run was as the experiment wants it.
        wall: Wall seconds of the run; the only part that is not the same each time.
        measures: What runs of its kind have besides, where somebody leads the robot or it makes the map.
    """

    number: int
    variation: str
    seed: int
    home: str
    room: str
    people: str
    status: str
    code: str
    reason: str
    seconds: float
    driven: float
    contacts: tuple[str, ...]
    false_find: bool
    distance: float | None
    facing: float | None
    polite: bool | None
    visible: bool | None
    ideal: float | None
    good: bool
    wall: float
    measures: Measures = field(default_factory=dict)

    @property
    def was_run(self) -> bool:
        """Tell whether there was a run."""
        return self.status not in (NOT_RUN, BROKEN)

    def without_wall(self) -> str:
        """Write what is the same each time, bit for bit."""
        values = asdict(self)
        del values["wall"]
        return json.dumps(values)


def is_polite(end: Closeness, best: BestCase | None) -> bool:
    """Tell whether the robot stands before a person as it should, as near as can be."""
    nearest = best.distance if best is not None else None
    # Where the truth knows no way, the robot may have found one: it needs less room than a disc.
    return end.polite_at(POLITE_DISTANCE_M if nearest is None else nearest)


def met(ends: Mapping[str, Closeness], best_cases: Mapping[str, BestCase]) -> str:
    """Tell before whom the robot stands, empty without people: others may have come nearer meanwhile."""
    return min(
        ends,
        key=lambda name: (not is_polite(ends[name], best_cases[name]), ends[name].distance),
        default="",
    )


CRITERIA: Mapping[str, Callable[[Outcome], bool]] = {
    "succeeded": lambda outcome: outcome.status == RunStatus.SUCCEEDED.value,
    "failed": lambda outcome: outcome.status == RunStatus.FAILED.value,
    "polite": lambda outcome: bool(outcome.polite),
    "kept": lambda outcome: bool(outcome.measures.get(KEPT)),
    "all_rooms_seen": lambda outcome: bool(outcome.measures.get(ALL_SEEN)),
    "untouched": lambda outcome: not outcome.contacts,
    "no_false_find": lambda outcome: not outcome.false_find,
}
"""What a run can be asked to be: the mission has succeeded; it has failed, as it should; the robot stands
politely before a person in the end; it has kept with the person who leads it; the map that it has made shows
every room; it has touched nothing and nobody; nobody was found where nobody is."""


def judged(outcome: Outcome, criteria: Iterable[str]) -> Outcome:
    """Return an outcome that is good when there was a run that is all that is asked for."""
    return replace(outcome, good=outcome.was_run and all(CRITERIA[each](outcome) for each in criteria))


def is_false(found: Pose2, people: Sequence[PersonSpec]) -> bool:
    """Tell whether somebody was found where nobody has ever been."""
    return all(_distance_to_places((found.x, found.y), spec) > NEAR_M for spec in people)


def description(spec: PersonSpec) -> str:
    """Describe a person in some words."""
    where = {"seated": " on furniture", "lying": " in bed" if spec.surface else " on the floor"}
    things = "".join(f", with a {value}" for value in (spec.aid, spec.load) if value != "none")
    return f"{spec.posture}{where.get(spec.posture, '')}, {spec.height:.2f} m{things}"


def _distance_to_places(point: tuple[float, float], spec: PersonSpec) -> float:
    """Return how far a point is from where a person is, or from the way that they walk; metres."""
    points = [(spec.pose.x, spec.pose.y), *spec.route]
    return min(_distance_to_leg(point, a, b) for a, b in zip(points, points[1:] or points, strict=False))


def _distance_to_leg(
    point: tuple[float, float], start: tuple[float, float], end: tuple[float, float]
) -> float:
    along = (end[0] - start[0], end[1] - start[1])
    length = along[0] ** 2 + along[1] ** 2
    part = ((point[0] - start[0]) * along[0] + (point[1] - start[1]) * along[1]) / length if length else 0.0
    part = min(1.0, max(0.0, part))
    return math.dist(point, (start[0] + part * along[0], start[1] + part * along[1]))
