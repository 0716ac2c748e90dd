"""People whom the camera does not see at the moment, and the laser does."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from florence_bt.core.geometry import Point2, Pose2
from florence_bt.core.sensing import LaserScan, OccupancyGrid, TrackedUser
from florence_bt.core.transforms import Transform3
from florence_bt.skills.people.user_tracker.detector import Detection
from florence_bt.skills.people.user_tracker.known_obstacles import KnownObstacles
from florence_bt.skills.people.user_tracker.tracker import UserTracker

ROBOT = Pose2()
STEP_S = 0.1


def legs(*people: Point2) -> NDArray[np.float64]:
    """Return where beams end at the legs of people who stand at places, as seen from the robot."""
    beside = np.linspace(-0.08, 0.08, 5)
    points = [
        np.array([x, y]) * (1.0 - 0.06 / math.hypot(x, y))
        + np.outer(beside, [-y, x]) / max(math.hypot(x, y), 1e-6)
        for x, y in people
    ]
    return np.concatenate([np.empty((0, 2)), *points])


class Home:
    """A tracker whose camera sees some people in every step, and whose laser sees some others."""

    def __init__(self) -> None:
        self.tracker = UserTracker()
        self.tracker.start()
        self.now = 0.0
        self.users: tuple[TrackedUser, ...] = ()
        self.by_laser: dict[int, Point2] = {}

    def step(self, camera: list[Point2], laser: list[Point2]) -> None:
        self.now += STEP_S
        self.users = self.tracker.update(self.now, [Detection(x, y, math.hypot(x, y)) for x, y in camera])
        held = self.tracker.saw_scan(self.now, legs(*laser), ROBOT)
        self.by_laser = {user.user_id: (user.x, user.y) for user in held}


@pytest.fixture
def home() -> Home:
    return Home()


def walk(home: Home, steps: int = 12) -> float:
    """Somebody walks to the left in the picture, 2 m ahead; return how far they came."""
    for k in range(steps):
        home.step([(2.0, 0.06 * k)], [(2.0, 0.06 * k)])
    return 0.06 * (steps - 1)


def test_who_leaves_the_picture_is_where_their_legs_are(home: Home) -> None:
    y = walk(home)
    assert home.by_laser == {}, "the camera sees them"
    for _ in range(30):
        y += 0.06
        home.step([], [(2.0, y)])
    assert home.by_laser == {1: (pytest.approx(2.0, abs=0.1), pytest.approx(y, abs=0.1))}
    assert [(user.user_id, user.distance) for user in home.users] == [(1, 0.0)], "the camera has lost them"


def test_who_comes_back_into_the_picture_is_the_same_person(home: Home) -> None:
    y = walk(home)
    for _ in range(25):
        y += 0.06
        home.step([], [(2.0, y)])
    for _ in range(25):
        y -= 0.06
        home.step([], [(2.0, y)])
    home.step([(2.0, y)], [(2.0, y)])
    (user,) = home.users
    assert (user.user_id, user.device_id) == (1, 1)
    assert user.distance == pytest.approx(math.hypot(2.0, y))


def test_legs_that_only_stand_are_believed_in_for_some_seconds(home: Home) -> None:
    for _ in range(10):
        home.step([(2.0, 0.0)], [(2.0, 0.0)])
    until = 0.0
    for _ in range(80):
        home.step([], [(2.0, 0.0)])
        until = home.now if home.by_laser else until
    assert until == pytest.approx(1.0 + 6.0, abs=0.3)


def test_who_was_hidden_is_taken_up_again_by_legs_that_walk(home: Home) -> None:
    y = walk(home)
    for _ in range(20):
        home.step([], [])
    assert home.by_laser == {}
    for _ in range(10):
        y += 0.06
        home.step([], [(2.0, y)])
    assert home.by_laser == {1: (pytest.approx(2.0, abs=0.1), pytest.approx(y, abs=0.1))}


def test_what_stood_there_before_is_nobody(home: Home) -> None:
    chair = (2.0, 1.3)
    for k in range(21):
        home.step([(2.0, 0.06 * k - 0.6)], [chair, (2.0, 0.06 * k - 0.6)])
    for _ in range(20):
        home.step([], [chair])
        assert home.by_laser == {}


def test_the_legs_of_somebody_else_are_not_theirs(home: Home) -> None:
    for k in range(12):
        home.step([(2.0, 0.06 * k), (2.0, 1.9)], [(2.0, 0.06 * k), (2.0, 1.9)])
    for _ in range(10):
        home.step([(2.0, 1.9)], [(2.0, 1.9)])
    for k in range(10):
        home.step([(2.0, 1.9 - 0.06 * k)], [(2.0, 1.9 - 0.06 * k)])
        assert home.by_laser == {}


def test_a_tracker_that_is_stopped_follows_no_legs(home: Home) -> None:
    walk(home)
    home.tracker.stop()
    assert home.tracker.saw_scan(home.now + 1.0, legs((2.0, 0.7)), ROBOT) == ()


def test_beams_that_end_at_something_of_the_map_or_at_nothing_are_no_legs() -> None:
    cells = np.zeros((60, 60), np.int8)
    cells[40, :] = 100
    known = KnownObstacles(OccupancyGrid(0.05, Pose2(0.0, 0.0), cells))
    # Ahead 1 m, to the left the wall, and nothing within reach to the right.
    scan = LaserScan(
        0.0, "laser", -math.pi / 2, math.pi / 2, 0.1, 5.0, np.array([5.0 - 1e-4, 1.0, 1.02], np.float32)
    )
    ends = known.unmapped_ends(scan, Transform3.identity(), Pose2(1.0, 1.0))
    assert ends == pytest.approx(np.array([[1.0, 0.0]]), abs=1e-6)
