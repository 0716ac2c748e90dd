"""What was taken for a person from far away, and is none from nearby."""

from __future__ import annotations

import math

import numpy as np
import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import CameraModel, DepthImage
from florence_bt.core.transforms import Transform3
from florence_bt.skills.people.user_tracker.camera_view import CameraView, view_of
from florence_bt.skills.people.user_tracker.detector import Detection
from florence_bt.skills.people.user_tracker.parameters import TrackerParameters
from florence_bt.skills.people.user_tracker.tracker import UserTracker

USE = TrackerParameters()
STAND = (3.0, 0.0)


class Watch:
    """A tracker that is shown something at one place, or not, from different places."""

    def __init__(self) -> None:
        self.now = 10.0
        self.tracker = UserTracker()

    def look(
        self,
        camera: Pose2,
        found: tuple[float, float] | None,
        times: int,
        *,
        stands: bool = True,
        confidence: float = 0.8,
    ) -> int:
        """Look anew; how many people there are in the end."""
        self.tracker.start()
        users: tuple[object, ...] = ()
        for _ in range(times):
            self.now += 0.1
            away = math.dist(found, (camera.x, camera.y)) if found else 0.0
            seen = [Detection(*found, away, confidence)] if found else []
            users = self.tracker.update(self.now, seen, CameraView(camera, lambda x, y: stands))
        return len(users)


FAR, NEAR = Pose2(), Pose2(1.6, 0.0)


@pytest.fixture
def watch() -> Watch:
    watch = Watch()
    assert watch.look(FAR, STAND, 5) == 1
    return watch


def test_what_is_no_person_from_nearby_is_none_from_far_away(watch: Watch) -> None:
    assert watch.look(NEAR, None, USE.reject_pictures) == 0
    assert watch.look(FAR, STAND, 20) == 0
    assert not watch.tracker.undecided, "a look does not wait for it"
    assert watch.look(FAR, (3.0, 1.0), 5) == 1, "somebody beside it"
    assert watch.look(NEAR, STAND, 5) == 1, "from nearby it is seen anew"
    assert watch.look(FAR, STAND, 5) == 1, "and believed"


def test_after_a_while_it_is_forgotten(watch: Watch) -> None:
    watch.look(NEAR, None, USE.reject_pictures)
    watch.now += USE.reject_s
    assert watch.look(FAR, STAND, 5) == 1


@pytest.mark.parametrize(
    ("camera", "found", "stands", "times"),
    [
        (NEAR, None, True, USE.reject_pictures - 1),
        (NEAR, None, False, 30),
        (NEAR, (3.1, 0.2), True, 30),
        (Pose2(1.6, 0.0, 0.5), None, True, 30),
        (Pose2(0.9, 0.0), None, True, 30),
        (Pose2(2.1, 0.0), None, True, 30),
    ],
    ids=["too few pictures", "nothing there", "somebody there", "at the edge", "too far away", "too near"],
)
def test_a_place_is_rejected_for_good_reasons_only(
    watch: Watch, camera: Pose2, found: tuple[float, float] | None, stands: bool, times: int
) -> None:
    watch.look(camera, found, times, stands=stands)
    assert watch.look(FAR, STAND, 5) == 1


def test_a_look_of_two_seconds_at_five_pictures_a_second_rejects_a_place(watch: Watch) -> None:
    watch.look(NEAR, None, 8)
    assert watch.look(FAR, STAND, 20) == 0


def test_a_rejected_place_is_remembered_for_longer_than_a_search_takes(watch: Watch) -> None:
    watch.look(NEAR, None, 15)
    for _ in range(5):
        watch.now += 100.0
        assert watch.look(FAR, STAND, 20) == 0


def test_what_looks_like_a_person_up_to_where_it_was_looked_at_from_is_rejected_there_too(
    watch: Watch,
) -> None:
    watch.look(Pose2(1.5, 0.0), None, 15)
    assert watch.look(Pose2(1.4, 0.0), STAND, 20) == 0
    assert watch.look(Pose2(1.5, 0.0), STAND, 5) == 1


def test_who_is_seen_better_than_the_thing_ever_was_stands_at_its_place(watch: Watch) -> None:
    watch.look(NEAR, None, 15)
    assert watch.look(FAR, STAND, 20, confidence=0.8) == 0
    assert watch.look(FAR, STAND, 20, confidence=0.9) == 1


def walk(watch: Watch, places: list[tuple[float, float]]) -> int:
    """Somebody goes from place to place, seen from far away; how many people there are in the end."""
    watch.tracker.start()
    users: tuple[object, ...] = ()
    for x, y in places:
        watch.now += 0.1
        seen = Detection(x, y, math.hypot(x, y), 0.8)
        users = watch.tracker.update(watch.now, [seen], CameraView(FAR, lambda x, y: True))
    return len(users)


def test_a_person_who_walks_away_from_a_rejected_place_is_somebody_there_later_too(watch: Watch) -> None:
    watch.look(NEAR, None, 15)
    assert walk(watch, [(3.0, 0.08 * step) for step in range(12)]) == 1
    assert watch.look(FAR, STAND, 5) == 1


def test_where_somebody_walked_no_place_is_rejected() -> None:
    watch = Watch()
    assert walk(watch, [(3.0, -1.0 + 0.08 * step) for step in range(14)]) == 1
    watch.look(NEAR, None, 30)
    assert watch.look(FAR, (3.0, 0.04), 5) == 1


def test_a_view_shows_what_stands_where() -> None:
    camera = CameraModel(320, 240, 262.5, 262.5, 159.5, 119.5)
    depth = np.full((240, 320), np.nan, np.float32)
    depth[:, 150:170] = 1.5  # something narrow, straight ahead
    mount = Transform3.from_xyz_rpy((-0.1, 0.0, 0.5), (-math.pi / 2, 0.0, -math.pi / 2))
    view = view_of(DepthImage(0.0, "optical", camera, depth), mount, Pose2(2.0, 1.0, math.pi / 2))
    assert view.camera.distance_to(Pose2(2.0, 0.9)) < 1e-9
    assert view.camera.yaw == pytest.approx(math.pi / 2)
    assert view.shows(2.0, 2.4) and view.shows(2.1, 2.5)
    assert not view.shows(2.0, 1.9) and not view.shows(2.0, 3.0) and not view.shows(2.8, 2.4)
