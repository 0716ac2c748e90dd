"""Runs one case in the rig."""

from __future__ import annotations

import math
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from florence_bt.app.bringup.config import load_config
from florence_bt.app.bringup.options import ABSENT
from florence_bt.app.bringup.simulated import COMPANY, LEADING
from florence_bt.app.demo.rigs import make_rig
from florence_bt.core.clock import ManualClock
from florence_bt.core.errors import ConfigError, closest_first, raise_all
from florence_bt.core.outcome import COMMON_CODES, failure
from florence_bt.core.skill import FinishedRun, Inputs, Skill, SkillRun
from florence_bt.runtime.run import MissionRun
from florence_bt.simulation.home.closeness import closeness
from florence_bt.simulation.home.flat import Flat
from florence_bt.simulation.home.generate import choose_flat
from florence_bt.simulation.home.people import place_person
from florence_bt.simulation.home.person import PersonSpec
from florence_bt.simulation.home.situations import (
    SITUATIONS,
    LedWalk,
    company_in,
    led_walk,
    person_in,
    room_with_decoy,
)
from florence_bt.simulation.rig.components import navigator_parameters
from florence_bt.simulation.rig.rig import SETTLE_S, Rig, SkillChange
from florence_bt.simulation.rig.robot import SensorQuality
from florence_bt.simulation.sensors.base_noise import BaseNoiseParameters
from florence_bt.simulation.sensors.kinect_sensor import KinectNoiseParameters
from florence_bt.simulation.sensors.laser_sensor import LaserParameters
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.inputs import parse_inputs
from florence_bt.trees.language.loader import MissionLibrary
from florence_sweep.best_case import best_case
from florence_sweep.experiment import DRAWN, FLAT, GENERATED, GIVEN, MADE, PITCH, Case, Setup, SkillFault
from florence_sweep.explored import judge_map
from florence_sweep.led import follow
from florence_sweep.outcome import (
    BROKEN,
    LOOK_S,
    NOT_RUN,
    Outcome,
    description,
    is_false,
    is_polite,
    judged,
    met,
)

NOBODY = "nobody"


def run_case(case: Case) -> Outcome:
    """Run one case and judge it; what goes wrong becomes its outcome, and takes no other run along."""
    wall = time.perf_counter()
    try:
        outcome = judge(case, stage(case))
    except ConfigError as error:
        outcome = without_run(case, NOT_RUN, str(error))
    except Exception as error:
        traceback.print_exc()
        outcome = without_run(case, BROKEN, f"{type(error).__name__}: {error}")
    return replace(outcome, wall=time.perf_counter() - wall)


@dataclass(frozen=True, slots=True)
class Staged:
    """A rig that is ready for a case.

    Attributes:
        rig: It.
        flat: The home.
        people: Who is there; the user first.
        sent_to: The room where the user was last seen.
        walk: On which somebody leads the robot; None when nobody does.
    """

    rig: Rig
    flat: Flat
    people: list[PersonSpec]
    sent_to: str
    walk: LedWalk | None


def stage(case: Case, runs_folder: Path | None = None) -> Staged:
    """Make the home and the rig of a case.

    Raises:
        ConfigError: The home has no place for such people; the case names what does not exist.
    """
    setup = case.setup
    flat = _home(setup.home, case.seed)
    rng = np.random.default_rng(case.seed)
    walk = led_walk(flat, rng) if setup.people == LEADING else None
    people = [walk.leader, walk.visitor] if walk is not None else _people(setup.people, flat, rng)
    room = flat.room_at(people[0].pose.x, people[0].pose.y) if people else None
    sent_to = room.name if room is not None else room_with_decoy(flat, rng)
    rig = make_rig(
        seed=case.seed,
        person=people[0] if people else ABSENT,
        others=people[1:],
        start=walk.start if walk is not None else None,
        mapping=setup.map == MADE,
        user_room=sent_to if setup.map == GIVEN else "",
        runs_folder=runs_folder,
        flat=flat,
        links=setup.links,
        quality=_quality(setup.sensors),
        drawn_people=setup.detections == DRAWN,
        missions=_library(setup.missions),
        change_skills=_with_faults(setup.faults),
    )
    rig.robot.base.charge_fraction = setup.battery
    return Staged(rig, flat, people, sent_to, walk)


def judge(case: Case, staged: Staged) -> Outcome:
    """Run the mission of a case, and tell what really came of it."""
    rig, way = staged.rig, _Way(staged.rig)
    run, found = _kind_of(case.setup)(case, staged)
    outcome = replace(
        without_run(case, run.status.value, run.reason),
        home=staged.flat.name,
        room=staged.sent_to,
        code=run.code,
        seconds=_seconds(run),
        driven=way.metres,
        false_find=any(is_false(each, staged.people) for each in rig.found),
        contacts=_contacts(rig),
    )
    return judged(replace(outcome, **found), case.setup.good)


Found = tuple[MissionRun, dict[str, Any]]
"""A finished run, and what there is to tell of runs of its kind: attributes of its outcome."""


def _kind_of(setup: Setup) -> Callable[[Case, Staged], Found]:
    """Return what runs and judges runs of a kind."""
    if setup.map == MADE:
        return _make_the_map
    return _be_led if setup.people == LEADING else _come_to_people


def _contacts(rig: Rig) -> tuple[str, ...]:
    return tuple(contact.name for contact in rig.world.contacts)


def _make_the_map(case: Case, staged: Staged) -> Found:
    """Run a mission in which the robot makes the map; return the run, and how good the map is."""
    rig = staged.rig
    run = rig.run(case.setup.mission, case.setup.inputs, limit_s=case.setup.limit)
    measures, contacts = judge_map(staged.flat, rig.grid, case.seed)
    return run, {"measures": measures, "contacts": (*_contacts(rig), *contacts)}


def _come_to_people(case: Case, staged: Staged) -> Found:
    """Run a mission to its end; return the run, and how the robot stands to people then."""
    rig, people = staged.rig, staged.people
    best_cases = {spec.name: best_case(staged.flat, rig.world, spec, staged.flat.start) for spec in people}
    run = rig.run(case.setup.mission, case.setup.inputs, limit_s=case.setup.limit)
    if all(spec.posture != "walking" for spec in people):
        rig.clock.advance(1.0)  # until it stands
    ends = {spec.name: closeness(rig.world.robot_pose, rig.world.person_pose(spec.name)) for spec in people}
    if not people:
        return run, {"people": NOBODY}
    who = met(ends, best_cases)
    end, best = ends[who], best_cases[who]
    nearest_first = sorted(people, key=lambda spec: (spec.name != who, ends[spec.name].distance))
    return run, {
        "people": "; ".join(map(description, nearest_first)),
        "distance": end.distance,
        "facing": end.facing,
        "polite": is_polite(end, best),
        "visible": best.visible,
        "ideal": best.way / _speed() + LOOK_S if best.way is not None else None,
    }


def _be_led(case: Case, staged: Staged) -> Found:
    """Run a mission while somebody leads the robot; return the run, and how it kept with them."""
    assert staged.walk is not None
    run, measures = follow(staged.rig, staged.walk, case.setup)
    world, leader = staged.rig.world, staged.walk.leader
    end = closeness(world.robot_pose, world.person_pose(leader.name))
    people = description(leader)
    return run, {"people": people, "distance": end.distance, "facing": end.facing, "measures": measures}


def _seconds(run: MissionRun) -> float:
    assert run.started is not None and run.ended is not None
    return run.ended - run.started


def _speed() -> float:
    return navigator_parameters(load_config()).controller.max_vel_x


class _Way:
    """The way that the robot really drove, from its odometry's ticks."""

    def __init__(self, rig: Rig) -> None:
        self.metres = 0.0
        self._rig, self._last = rig, rig.world.robot_pose
        self._note()

    def _note(self) -> None:
        pose = self._rig.world.robot_pose
        self.metres += pose.distance_to(self._last)
        self._last = pose
        self._rig.clock.call_at(self._rig.clock.now() + 0.1, self._note)


def without_run(case: Case, status: str, reason: str) -> Outcome:
    """Return the outcome of a case that was not run to its end."""
    return Outcome(
        number=case.number,
        variation=case.variation,
        seed=case.seed,
        home=case.setup.home,
        room="",
        people=case.setup.people,
        status=status,
        code="",
        reason=reason,
        seconds=0.0,
        driven=0.0,
        contacts=(),
        false_find=False,
        distance=None,
        facing=None,
        polite=None,
        visible=None,
        ideal=None,
        good=False,
        wall=0.0,
    )


def refuse_what_does_not_exist(setup: Setup) -> None:
    """Check what can be checked before any run.

    Raises:
        ConfigError: All that is wrong, with what would have worked.
    """
    wrong = []
    for check in (_check_mission, _check_faults, lambda each: _quality(each.sensors)):
        try:
            check(setup)
        except ConfigError as error:
            wrong.append(error)
    raise_all(wrong)


def _check_mission(setup: Setup) -> None:
    parse_inputs(_library(setup.missions).get(setup.mission), setup.inputs)


def _check_faults(setup: Setup) -> None:
    declared = collect_declarations()
    for fault in setup.faults:
        if fault.skill not in declared:
            known = closest_first(fault.skill, declared)
            raise ConfigError(f"there is no skill {fault.skill!r} that could fail", valid=known)
        codes = {*declared[fault.skill].failures, *COMMON_CODES}
        if fault.code not in codes:
            known = closest_first(fault.code, codes)
            raise ConfigError(f"{fault.skill} does not fail with {fault.code!r}", valid=known)


@cache
def _library(folders: tuple[str, ...]) -> MissionLibrary:
    return MissionLibrary.load([Path(folder) for folder in folders])


def _home(home: str, seed: int) -> Flat:
    if home == GENERATED:
        return choose_flat(None, seed)
    return choose_flat(None if home == FLAT else Path(home))


def _people(asked: str, flat: Flat, rng: np.random.Generator) -> list[PersonSpec]:
    """Choose who is at home; the first is the user.

    Raises:
        ConfigError: There is no such class or room, or the home has no place for it.
    """
    if asked == NOBODY:
        return []
    if asked == COMPANY:
        return company_in(flat, rng)
    if asked in SITUATIONS:
        return [person_in(asked, flat, rng)]
    rooms = [room.name for room in flat.rooms]
    if asked in rooms:
        return [place_person(flat, asked, rng)]
    known = [*SITUATIONS, COMPANY, LEADING, NOBODY, *rooms]
    raise ConfigError(
        f"no class of people and no room is called {asked!r}", valid=closest_first(asked, known)
    )


def _quality(sensors: Mapping[str, Mapping[str, float]]) -> SensorQuality:
    def of(sensor: str) -> dict[str, Any]:
        return {name: value for name, value in sensors.get(sensor, {}).items() if name != PITCH}

    return SensorQuality(
        base=BaseNoiseParameters(**of("base")),
        laser=LaserParameters(**of("laser")),
        kinect=KinectNoiseParameters(**of("kinect")),
        camera_pitch=math.radians(sensors.get("kinect", {}).get(PITCH, 0.0)),
    )


def _with_faults(faults: tuple[SkillFault, ...]) -> SkillChange:
    def changed(skills: dict[str, Skill], clock: ManualClock) -> dict[str, Skill]:
        for fault in faults:
            skills[fault.skill] = _Failing(skills[fault.skill], fault, clock)
        return skills

    return changed


class _Failing:
    """A skill that fails for a while, whatever it is asked."""

    def __init__(self, skill: Skill, fault: SkillFault, clock: ManualClock) -> None:
        self._skill, self._fault, self._clock = skill, fault, clock
        self._begin = clock.now() + SETTLE_S + fault.begin

    def start(self, inputs: Inputs) -> SkillRun:
        """Start it, or fail."""
        if self._begin <= self._clock.now() < self._begin + self._fault.lasts:
            return FinishedRun(failure(self._fault.code, f"{self._fault.skill} fails in this experiment"))
        return self._skill.start(inputs)
