"""People who sit or lie, as navigation is told of them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import LaserScan
from florence_bt.core.transforms import Transform3
from florence_bt.skills.navigation.navigate._cell_kernels import LETHAL
from florence_bt.skills.navigation.navigate.navigator import Navigator
from florence_bt.skills.people.user_tracker.body_scan import body_scan
from florence_bt.skills.people.user_tracker.detector import Detection, Outline
from tests.unit.skills.navigation_world import make_map

FRAME = "base_footprint"


def lying(x: float, length: float = 1.6) -> Detection:
    """Somebody who lies across, their middle straight ahead."""
    across = np.linspace(-length / 2, length / 2, 200)
    points = np.stack([np.full_like(across, x - 0.15), across], axis=1).astype(np.float32)
    return Detection(x, 0.0, x, posture="lying", height=0.25, outline=outline_of(points))


def outline_of(points: np.ndarray) -> Outline:
    return Outline(points, np.zeros(len(points), bool))


def ends(scan: LaserScan) -> np.ndarray:
    valid = scan.valid()
    angles, ranges = scan.angles()[valid], scan.ranges[valid]
    return np.stack([ranges * np.cos(angles), ranges * np.sin(angles)], axis=1)


def test_the_whole_body_is_told_from_the_head_to_the_feet() -> None:
    scan = body_scan([lying(1.5)], 7.0, FRAME)
    places = ends(scan)
    assert (scan.stamp, scan.frame_id) == (7.0, FRAME)
    assert places[:, 0] == pytest.approx(np.full(len(places), 1.35), abs=0.03)
    assert (places[:, 1].min(), places[:, 1].max()) == pytest.approx((-0.8, 0.8), abs=0.03)
    assert np.diff(np.sort(places[:, 1])).max() < 0.05, "no gap for the robot, nor of a cell"


def test_the_nearest_part_in_a_direction_counts() -> None:
    assert ends(body_scan([lying(2.5), lying(1.5)], 0.0, FRAME))[:, 0].max() < 1.4
    assert len(ends(body_scan([lying(0.3)], 0.0, FRAME))) < len(ends(body_scan([lying(1.5)], 0.0, FRAME)))


def test_who_stands_is_left_to_the_other_sensors_and_nobody_is_nowhere() -> None:
    standing = Detection(1.5, 0.0, 1.5, outline=lying(1.5).outline)
    for found in ([standing], [Detection(1.5, 0.0, 1.5, posture="lying")], []):
        assert not body_scan(found, 0.0, FRAME).valid().any()


def test_a_body_stays_in_the_costmaps_until_the_person_has_walked_away() -> None:
    navigator = Navigator(make_map())
    here = Pose2(1.0, 1.0)

    def see(*found: Detection) -> None:
        scan = body_scan(found, 0.0, FRAME)
        navigator.add_scan("people", scan, Transform3.identity(), here, Pose2())

    def is_marked(x: float, y: float) -> bool:
        place = here.apply(x, y)
        return all(
            costmap.cost_at(*place) == LETHAL
            for costmap in (navigator.global_costmap, navigator.local_costmap)
        )

    see(lying(1.5, length=0.6))
    assert is_marked(1.34, 0.0) and is_marked(1.34, 0.25)
    # Nearer by, the picture shows the trunk beyond the legs only.
    see(lying(2.0, length=0.6))
    see()
    assert is_marked(1.34, 0.0), "what is not seen any more is still there"
    for stamp, x in enumerate((1.5, 1.8, 2.3)):
        navigator.saw_person(float(stamp), 1, *here.apply(x, 0.0))
    see()
    assert not is_marked(1.34, 0.0)


def test_the_angles_are_those_of_the_robot_frame() -> None:
    left = np.array([[0.8, 0.6]], np.float32)
    scan = body_scan([Detection(1.0, 0.7, 1.2, posture="sitting", outline=outline_of(left))], 0.0, FRAME)
    (beam,) = np.flatnonzero(scan.valid())
    assert scan.angles()[beam] == pytest.approx(math.atan2(0.6, 0.8), abs=math.radians(0.5))
    assert scan.ranges[beam] == pytest.approx(1.0)
