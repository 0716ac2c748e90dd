"""People drawn from how well the network does, in place of running it."""

from __future__ import annotations

import numpy as np
import pytest

from florence_bt.app.demo.rigs import make_rig
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import DepthImage
from florence_bt.simulation.home.flat import load_flat
from florence_bt.simulation.home.person import PersonSpec
from florence_bt.simulation.rig.drawn_people import FILE, DrawnPeople, shares
from florence_bt.simulation.rig.rig import Rig
from florence_bt.simulation.rig.robot import BASE_FRAME, CAMERA_FRAME
from florence_bt.skills.people.user_tracker.detector import Detection, detect_people
from tools.detection import TABLE, Line
from tools.drawn_people import PAGE, text_of
from tools.tables import read_rows


def rig_with(*people: PersonSpec) -> Rig:
    return make_rig(seed=3, person=people[0] if people else "absent", others=people[1:])


def before_robot(name: str, ahead: float, left: float = 0.0, **changes: object) -> PersonSpec:
    return PersonSpec(name, load_flat().start @ Pose2(ahead, left, np.pi), **changes)  # type: ignore[arg-type]


def looks(rig: Rig, drawn: DrawnPeople) -> list[Detection]:
    """Take a picture and let the detector make people of what is drawn for it."""

    depth = rig.robot.kinect.true_depth()
    picture = DepthImage(
        rig.clock.now(), CAMERA_FRAME, rig.robot.kinect.camera, np.where(depth < 4.8, depth, np.nan)
    )
    optical = rig.robot.frames.lookup(BASE_FRAME, CAMERA_FRAME)
    return detect_people(picture, optical, network=drawn.answer)


def test_the_shares_are_those_of_the_page() -> None:
    assert FILE.read_text(encoding="utf-8") == text_of(read_rows(TABLE.file_beside(PAGE), Line))


def test_whoever_is_hidden_or_far_is_found_less_often() -> None:
    chance = shares().chance
    assert chance("standing", 1.0, 2.0) > 0.9 > chance("standing", 0.5, 2.0) > chance("standing", 0.1, 2.0)
    assert chance("sitting", 0.7, 1.5) > chance("sitting", 0.7, 3.5)
    assert chance("bent over", 1.0, 1.5) == pytest.approx(0.93, abs=0.05)


def test_somebody_is_found_about_where_they_are_in_most_of_many_runs() -> None:
    person = before_robot("user", 2.0)
    rig = rig_with(person)
    found = [looks(rig, DrawnPeople(rig.world, rig.robot.kinect, seed)) for seed in range(40)]
    at = [
        (each.x, each.y, each.posture)
        for detections in found
        for each in detections
        if np.hypot(each.x - 2.0, each.y) < 0.5
    ]
    assert 34 <= len(at) <= 40
    assert np.median([np.hypot(x - 2.0, y) for x, y, _ in at]) < 0.1
    assert [posture for _, _, posture in at].count("standing") >= len(at) - 3


def test_a_view_stays_as_it_was_drawn_and_another_view_is_drawn_anew() -> None:
    person = before_robot("user", 3.5)
    rig = rig_with(person)
    stays, changes = 0, 0
    for seed in range(30):
        rig.world.carry_robot(load_flat().start)
        drawn = DrawnPeople(rig.world, rig.robot.kinect, seed)
        first, again = (bool(looks(rig, drawn)) for _ in range(2))
        stays += first == again
        rig.world.carry_robot(load_flat().start @ Pose2(0.4, 0.0))
        changes += first != bool(looks(rig, drawn))
    assert stays >= 26
    assert changes >= 1


def test_whoever_the_picture_does_not_show_is_not_found() -> None:
    rig = rig_with(before_robot("user", -2.0))
    for seed in range(20):
        found = looks(rig, DrawnPeople(rig.world, rig.robot.kinect, seed))
        assert all(each.x > 0.0 for each in found)


def test_the_same_seed_draws_the_same_run() -> None:
    ends = []
    for _ in range(2):
        rig = make_rig(seed=5, person=before_robot("user", 2.5), drawn_people=True)
        run = rig.run("goto_user", limit_s=60.0)
        ends.append((run.status, run.ended, rig.world.robot_pose))
    assert ends[0] == ends[1]
