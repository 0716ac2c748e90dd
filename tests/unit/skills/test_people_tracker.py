"""The tracker of people, its filter, the colours, and the look for a user."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import CameraModel, ColourImage, Posture, TrackedUser
from florence_bt.skills.people.user_tracker._kalman import ConstantVelocity
from florence_bt.skills.people.user_tracker.appearance import (
    Histogram,
    blend,
    colour_histogram,
    distance_if_known,
)
from florence_bt.skills.people.user_tracker.bindings import BINDINGS
from florence_bt.skills.people.user_tracker.detector import Detection
from florence_bt.skills.people.user_tracker.evidence import Region
from florence_bt.skills.people.user_tracker.identity import Gallery
from florence_bt.skills.people.user_tracker.look import GOAL_LIMITS, LookForUser, Wanted
from florence_bt.skills.people.user_tracker.parameters import LookParameters, TrackerParameters
from florence_bt.skills.people.user_tracker.tracker import UserTracker, filter_users, on_the_floor
from florence_bt.trees.language.declarations import own_declarations

LOOK_FOR_USER = own_declarations()["look_for_user"]

PERIOD = 0.1


def colours(hue_bin: int) -> Histogram:
    histogram = np.zeros((3, 16, 8), np.float32)
    histogram[:, hue_bin, 5] = 0.8
    histogram[:, hue_bin, 6] = 0.2
    return histogram


def seen(x: float, y: float, histogram: Histogram | None = None) -> Detection:
    return Detection(x, y, math.hypot(x, y), histogram=histogram)


class Run:
    """Feeds a tracker picture by picture."""

    def __init__(self, tracker: UserTracker) -> None:
        self.tracker = tracker
        self.now = 100.0
        tracker.start()

    def __call__(self, *people: Detection, times: int = 1) -> tuple[TrackedUser, ...]:
        users: tuple[TrackedUser, ...] = ()
        for _ in range(times):
            self.now += PERIOD
            users = self.tracker.update(self.now, people)
        return users


@pytest.fixture
def run() -> Run:
    return Run(UserTracker())


def ids(users: Iterable[TrackedUser]) -> list[tuple[int, int]]:
    return [(user.user_id, user.device_id) for user in users]


def test_a_person_counts_from_the_third_picture(run: Run) -> None:
    assert run(seen(2, 0), times=2) == ()
    assert ids(run(seen(2, 0))) == [(1, 1)]


def test_three_of_four_pictures_are_enough_and_two_are_not(run: Run) -> None:
    run(seen(2, 0))
    run()
    run(seen(2, 0))
    assert ids(run(seen(2, 0))) == [(1, 1)]
    other = Run(UserTracker())
    for _ in range(6):
        assert other(seen(2, 0)) == ()
        assert other() == ()


def test_flicker_in_other_places_never_becomes_a_person(run: Run) -> None:
    for k in range(20):
        assert run(seen(2, 2.0 * (k % 3))) == ()


def test_a_walking_person_keeps_its_id_and_is_where_it_is(run: Run) -> None:
    rng = np.random.default_rng(3)
    errors = []
    for k in range(60):
        x, y = 1.0 + 0.05 * k, 0.5
        users = run(seen(x + rng.normal(0, 0.03), y + rng.normal(0, 0.03)))
        if k > 10:
            assert ids(users) == [(1, 1)]
            errors.append(math.hypot(users[0].x - x, users[0].y - y))
    assert np.mean(errors) < 0.04


def test_two_people_who_pass_each_other_keep_their_ids(run: Run) -> None:
    users: tuple[TrackedUser, ...] = ()
    for k in range(41):
        x = -1.0 + 0.05 * k
        users = run(seen(x, 2.3), seen(-x, 2.0))
    assert ids(users) == [(1, 1), (2, 2)]
    assert users[0].x == pytest.approx(1.0, abs=0.1)
    assert users[1].x == pytest.approx(-1.0, abs=0.1)


def test_a_short_gap_is_bridged_where_the_person_should_be(run: Run) -> None:
    for k in range(20):
        run(seen(1.0 + 0.1 * k, 0))
    (user,) = run(times=3)
    assert user.x == pytest.approx(1.0 + 0.1 * 22, abs=0.12)
    assert user.distance > 0.5


def test_a_lost_person_has_no_distance_and_comes_back_with_its_ids(run: Run) -> None:
    run(seen(2, 0), times=5)
    (lost,) = run(times=10)
    assert (lost.user_id, lost.device_id, lost.distance) == (1, 1, 0.0)
    assert filter_users((lost,)) == ()
    (back,) = run(seen(2.1, 0.1))
    assert (back.user_id, back.device_id) == (1, 1)
    assert back.distance > 2.0


@pytest.mark.parametrize("hidden", [0, 2])
@pytest.mark.parametrize("angle", [60.0, 90.0, 145.0])
def test_two_who_cross_keep_their_ids_though_one_hides_the_other(hidden: int, angle: float) -> None:
    """At 5 Hz and with 5 cm of noise, which is more than measured; without colours."""
    towards = math.radians(angle)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        tracker = UserTracker()
        tracker.start()
        for k in range(-10, 11):
            walked = 0.2 * k
            ahead = walked + 0.5
            truth = ((2.5 + walked, 0.0), (2.5 + ahead * math.cos(towards), ahead * math.sin(towards)))
            shown = truth[1:] if hidden and abs(k) <= hidden else truth
            users = tracker.update(
                walked, [seen(*(np.array(each) + rng.normal(0, 0.05, 2))) for each in shown]
            )
            if k == -6:
                ids_at_first = _nearest_ids(truth, users)
        assert sorted(ids_at_first) == [1, 2]
        assert _nearest_ids(truth, users) == ids_at_first, seed


def _nearest_ids(truth: Iterable[tuple[float, float]], users: Iterable[TrackedUser]) -> list[int]:
    there = [each for each in users if each.distance]
    return [min(there, key=lambda user: math.dist(at, (user.x, user.y))).user_id for at in truth]


def test_two_who_meet_and_turn_round_keep_their_ids_by_their_colours(run: Run) -> None:
    """By their positions alone they pass each other."""
    for k in range(-10, 11):
        apart = 0.05 + 0.1 * abs(k)
        users = run(seen(2 - apart, 0, colours(3)), seen(2 + apart, 0, colours(9)))
    assert ids(users) == [(1, 1), (2, 2)]
    assert users[0].x < 2 < users[1].x


def test_an_unsure_detection_behind_somebody_is_nobody(run: Run) -> None:
    """The network sees a second person behind the outline of the first."""
    front = replace(seen(2.0, 0.0), region=Region(0.4, 0.1, 0.6, 1.0))
    behind = Detection(2.6, 0.1, 2.6, confidence=0.7, region=Region(0.45, 0.1, 0.65, 1.0))
    assert len(run(front, behind, times=5)) == 1, "no new track"
    assert len(run(front, replace(behind, confidence=0.9), times=3)) == 2, "a sure one is somebody"


def test_an_unsure_detection_behind_somebody_does_not_move_who_is_hidden(run: Run) -> None:
    front = replace(seen(2.0, 0.0), region=Region(0.4, 0.1, 0.6, 1.0))
    run(front, seen(2.6, 0.0), times=5)
    behind = Detection(2.8, 0.1, 2.8, confidence=0.7, region=Region(0.45, 0.1, 0.65, 1.0))
    _, hidden = run(front, behind, times=2)
    assert (hidden.x, hidden.y) == pytest.approx((2.6, 0.0), abs=0.01)


def test_an_unsure_detection_that_nobody_hides_counts(run: Run) -> None:
    front = replace(seen(2.0, 0.0), region=Region(0.4, 0.1, 0.6, 1.0))
    beside = Detection(2.6, 0.5, 2.6, confidence=0.7, region=Region(0.55, 0.1, 0.75, 1.0))
    assert len(run(front, beside, times=3)) == 2


def test_who_is_too_far_to_have_walked_there_is_not_who_was_hidden(run: Run) -> None:
    """Though the person was expected there: somebody else appears where a walk would have led."""
    for k in range(20):
        run(seen(1.0 + 0.08 * k, 0))
    run(times=4)
    assert ids(run(seen(1.0 + 0.08 * 19 + 0.75, 0), times=3))[-1] == (2, 2)


def test_who_appears_beside_somebody_who_just_left_the_picture_is_somebody_new(run: Run) -> None:
    for k in range(20):
        run(seen(2.0, -0.08 * k))
    run(times=2)
    assert ids(run(seen(2.0, -0.08 * 19 + 0.65), times=3))[-1] == (2, 2)


def test_somebody_in_another_shirt_who_shares_some_colours_is_not_who_was_hidden(run: Run) -> None:
    """The Bhattacharyya distance is 0.5: trousers and skin are like those of many."""
    run(seen(2.0, 0.0, colours(3)), times=10)
    other = 0.5625 * colours(3) + 0.4375 * colours(9)
    assert ids(run(seen(2.1, 0.0, other.astype(np.float32)), times=3)) == [(1, 1), (2, 2)]


@pytest.mark.parametrize("histogram", [None, colours(3)])
def test_who_returns_from_where_they_can_have_walked_is_the_lost_one(
    run: Run, histogram: Histogram | None
) -> None:
    run(seen(2, 0, histogram), times=5)
    run(times=20)
    assert ids(run(seen(3.5, 0, histogram), times=3)) == [(1, 2)]


def test_who_comes_from_too_far_or_too_late_is_somebody_new(run: Run) -> None:
    run(seen(2, 0), times=5)
    run(times=20)
    far = seen(2, 4)
    assert ids(run(far, times=3)) == [(1, 1), (2, 2)]
    run(far, times=50)
    assert ids(run(far, seen(3.5, 0), times=3)) == [(1, 1), (2, 2), (3, 3)]


def test_other_colours_are_never_the_lost_one_even_in_the_same_place(run: Run) -> None:
    run(seen(2, 0, colours(3)), times=5)
    run(times=10)
    assert ids(run(seen(2, 0, colours(9)), times=3)) == [(1, 1), (2, 2)]


def test_another_height_or_posture_is_not_the_lost_one(run: Run) -> None:
    tall = Detection(2.0, 0.0, 2.0, height=1.35)
    run(tall, times=5)
    run(times=10)
    assert ids(run(replace(tall, height=0.8), times=3))[-1] == (2, 2), "a child"
    assert ids(run(replace(tall, posture="lying", y=1.0), times=3))[-1] == (3, 3)
    assert ids(run(replace(tall, height=0.8, x=1.7, distance=1.7)))[0] == (1, 1), "the picture ends above"


def test_a_stranger_who_crosses_does_not_steal_the_id(run: Run) -> None:
    """Somebody goes behind a door frame; another one walks past it from afar; the first one comes back."""
    run(seen(2, 0), times=5)
    run(times=10)
    for k in range(20):
        users = run(seen(2.5, 2.0 - 0.1 * k))
        assert all(user.user_id == 2 for user in users if user.distance)
    assert ids(run(seen(1.5, -0.5), seen(2.5, -0.1), times=3))[-2:] == [(2, 2), (1, 3)]


def test_when_two_may_be_meant_it_is_somebody_new(run: Run) -> None:
    run(seen(2, 1), seen(2, -1), times=5)
    run(times=20)
    assert ids(run(seen(2, 0.1), times=3))[-1] == (3, 3)


@pytest.mark.parametrize(("confidence", "user_id"), [(0.7, 1), (1.0, 2)])
def test_only_who_is_surely_there_may_be_meant_too(run: Run, confidence: float, user_id: int) -> None:
    run(seen(2, 0), times=5)
    run(times=20)
    users = run(seen(2.7, 0), replace(seen(1.3, 0), confidence=confidence), times=3)
    assert next(user for user in users if user.x == pytest.approx(2.7)).user_id == user_id


def test_the_velocity_is_told_and_none_of_a_lost_one(run: Run) -> None:
    for k in range(30):
        users = run(seen(1.0 + 0.05 * k, 1.0 - 0.02 * k))
    (user,) = users
    assert (user.vx, user.vy) == pytest.approx((0.5, -0.2), abs=0.03)
    moved = user.moved_by(Pose2(1.0, 0.0, math.pi / 2))
    assert (moved.x, moved.y) == pytest.approx((1.0 - user.y, user.x))
    assert (moved.vx, moved.vy) == pytest.approx((-user.vy, user.vx))
    (lost,) = run(times=10)
    assert (lost.vx, lost.vy) == (0.0, 0.0)


def test_a_person_lost_for_long_is_forgotten_and_returns_as_a_new_one(run: Run) -> None:
    run(seen(2, 0), times=5)
    assert run(times=110) == ()
    assert ids(run(seen(2, 0), times=3)) == [(2, 2)]


def test_colours_bring_the_persistent_id_back(run: Run) -> None:
    run(seen(2, 0, colours(3)), seen(2, 1.5, colours(9)), times=5)
    run(times=120)
    assert ids(run(seen(3, -1, colours(9)), times=3)) == [(2, 3)]
    assert ids(run(seen(3, -1, colours(9)), seen(1, 1, colours(3)), times=3)) == [(2, 3), (1, 4)]


@pytest.mark.parametrize(("pictures", "user_id"), [(20, 1), (10, 2)])
def test_who_moved_unseen_is_one_person_and_who_is_too_far_for_that_another(
    run: Run, pictures: int, user_id: int
) -> None:
    run(seen(2, 0, colours(3)), times=5)
    run(times=pictures)
    assert ids(run(seen(3, 2, colours(3)), times=3))[-1] == (user_id, 2)


@pytest.mark.parametrize(("x", "user_id"), [(2.9, 1), (3.2, 2)])
def test_without_the_colours_that_are_known_only_who_is_near_is_the_lost_one(
    run: Run, x: float, user_id: int
) -> None:
    run(seen(2, 0, colours(3)), times=5)
    run(times=20)
    assert run(seen(x, 0), times=3)[-1].user_id == user_id


def test_who_is_seen_without_colours_first_is_recognised_when_they_are_seen(run: Run) -> None:
    run(seen(2, 0, colours(3)), times=20)
    run(times=20)
    assert run(seen(3.4, 0), times=3)[-1].user_id == 2
    assert run(seen(3.4, 0, colours(9)), times=3)[-1].user_id == 2
    run(seen(1, 0), times=3)
    assert ids(run(seen(1, 0, colours(3)))) == [(2, 2), (1, 3)]


def test_who_was_forgotten_for_somebody_else_comes_back_with_colours_and_keeps_the_ids() -> None:
    run = Run(UserTracker(TrackerParameters(remembered_people=1)))
    run(seen(2, 0), times=4)
    run(seen(1, 2.5, colours(3)), times=4)
    assert ids(run(seen(2, 0, colours(9)), seen(1, 2.5, colours(3)))) == [(1, 1), (2, 2)]


@pytest.mark.parametrize("gap", [0, 6, 20])
@pytest.mark.parametrize(
    ("before", "now", "x", "user_id"),
    [(0.95, 0.74, 0.6, 2), (0.95, 0.9, 0.6, 1), (0.74, 0.74, 0.6, 1), (0.95, 0.74, 2.0, 1)],
)
def test_a_part_of_somebody_nearby_is_not_somebody_beside_them(
    run: Run, gap: int, before: float, now: float, x: float, user_id: int
) -> None:
    """Half a metre before them the camera shows a part, which looks less like them, and elsewhere."""
    person = replace(seen(x, 0.0, colours(3)), confidence=before)
    run(person, times=10)
    run(times=gap)
    part = replace(seen(x + 0.25, 0.35, colours(3)), confidence=now)
    assert run.tracker.in_view == ([] if gap else [1])
    run(part, times=5)
    assert run.tracker.in_view == [user_id]


def test_who_is_believed_in_is_not_in_the_picture(run: Run) -> None:
    run(seen(2, 0), seen(2, 1.5), times=5)
    assert run.tracker.in_view == [1, 2]
    users = run(seen(2, 1.5))
    assert [bool(user.distance) for user in users] == [True, True]
    assert run.tracker.in_view == [2]


def test_two_in_the_same_shirt_are_two(run: Run) -> None:
    assert ids(run(seen(2, 0, colours(3)), seen(2, 1.5, colours(3)), times=4)) == [(1, 1), (2, 2)]


def test_start_forgets_the_tracks_and_counts_devices_from_one(run: Run) -> None:
    run(seen(2, 0, colours(3)), times=5)
    run.tracker.stop()
    assert not run.tracker.running
    assert run(seen(2, 0, colours(3)), times=5) == ()
    run.tracker.start()
    assert run.tracker.running
    assert run() == ()
    assert ids(run(seen(2, 0, colours(3)), times=3)) == [(1, 1)], "the colours are remembered"


def test_the_gallery_keeps_the_latest_people_and_forgets_after_an_hour() -> None:
    gallery = Gallery(TrackerParameters(remembered_people=2))
    assert [gallery.identify(colours(bin_), bin_, ()) for bin_ in (1, 2, 3)] == [1, 2, 3]
    assert gallery.identify(colours(1), 4.0, ()) == 4, "the oldest one made room"
    assert gallery.identify(colours(3), 5.0, ()) == 3
    assert gallery.identify(colours(3), 5.0 + 3601.0, ()) == 5


def test_the_kalman_filter_learns_the_speed() -> None:
    track = ConstantVelocity(np.zeros(2), 0.05, 1.0)
    for k in range(1, 40):
        track.predict(0.1)
        track.update(np.array([0.05 * k, -0.02 * k]), 0.05)
    assert track.state == pytest.approx([1.95, -0.78, 0.5, -0.2], abs=0.02)
    before = np.trace(track.covariance)
    track.predict(1.0)
    assert np.trace(track.covariance) > before
    assert track.state[:2] == pytest.approx([2.45, -0.98], abs=0.03)
    track.halt()
    track.predict(5.0)
    assert track.state[:2] == pytest.approx([2.45, -0.98], abs=0.03)


CAMERA = CameraModel(32, 24, 26.0, 26.0, 15.5, 11.5)


def picture(colour: tuple[int, int, int]) -> ColourImage:
    return ColourImage(0.0, "c", CAMERA, np.full((24, 32, 3), colour, np.uint8))


def test_histograms_tell_colours_apart() -> None:
    rows, columns = np.divmod(np.arange(24 * 32), 32)
    heights = 1.6 - rows / 16
    red, dark_red, blue = (
        colour_histogram(picture(c), rows, columns, (24, 32), heights)
        for c in ((200, 30, 30), (190, 40, 30), (30, 30, 200))
    )
    assert red is not None and dark_red is not None and blue is not None
    assert distance_if_known(red, red) == pytest.approx(0.0, abs=1e-6)
    assert distance_if_known(red, blue) == pytest.approx(1.0)
    alike = distance_if_known(red, dark_red)
    assert alike is not None and alike < 0.35
    grey = colour_histogram(picture((90, 90, 90)), rows, columns, (24, 32), heights)
    assert grey is None, "grey has no hue"
    for few in (rows[:5], rows[:0]):
        some = len(few)
        assert colour_histogram(picture((200, 30, 30)), few, columns[:some], (24, 32), heights[:some]) is None


def test_only_the_bands_that_both_pictures_show_are_compared() -> None:
    rows, columns = np.divmod(np.arange(24 * 32), 32)
    heights = 1.6 - rows / 16
    image = picture((200, 30, 30))
    image.pixels[rows[heights < 0.6], columns[heights < 0.6]] = (30, 30, 200)

    def of(shown: NDArray[np.bool_]) -> Histogram:
        histogram = colour_histogram(image, rows[shown], columns[shown], (24, 32), heights[shown])
        assert histogram is not None
        return histogram

    whole, trousers, shirt = of(heights > 0.0), of(heights < 0.6), of(heights > 1.05)
    assert distance_if_known(whole, trousers) == pytest.approx(0.0, abs=1e-6)
    assert distance_if_known(whole, shirt) == pytest.approx(0.0, abs=1e-6)
    assert distance_if_known(trousers, shirt) is None
    both = blend(trousers, shirt, 0.05)
    assert distance_if_known(both, whole) == pytest.approx(0.0, abs=1e-6)
    assert distance_if_known(blend(both, trousers, 0.5), whole) == pytest.approx(0.0, abs=1e-6)


# ---- filter_user_tracker ------------------------------------------------------------------------------


def user(distance: float, device_id: int = 1, x: float = 1.0) -> TrackedUser:
    return TrackedUser(7, device_id, x, 0.0, distance)


@pytest.mark.parametrize(
    ("distance", "kept"),
    [(0.0, False), (0.49, False), (0.5, True), (4.5, True), (4.51, False), (math.nan, False)],
)
def test_the_filter_keeps_the_range_of_the_kinect(distance: float, kept: bool) -> None:
    assert bool(filter_users((user(distance),))) is kept


def test_the_filter_drops_old_and_undefined_positions_and_keeps_the_order() -> None:
    users = (user(2.0, 3), user(0.0, 1), user(1.0, 2), user(1.0, 4, x=math.nan))
    assert [each.device_id for each in filter_users(users)] == [3, 2]
    assert [each.device_id for each in filter_users(users, {3: 0.6, 2: 0.4})] == [2]


@given(st.lists(st.floats(allow_nan=True, allow_infinity=True)))
def test_the_filter_only_ever_drops(distances: list[float]) -> None:
    users = tuple(user(distance, index) for index, distance in enumerate(distances))
    kept = filter_users(users)
    assert [each for each in users if each in kept] == list(kept)
    assert filter_users(kept) == kept


# ---- look for user ------------------------------------------------------------------------------------


@pytest.fixture
def look() -> LookForUser:
    look = LookForUser()
    look.start(10.0, 5.0)
    return look


def tracked(x: float, y: float, user_id: int = 1, distance: float | None = None) -> TrackedUser:
    return TrackedUser(user_id, user_id, x, y, math.hypot(x, y) if distance is None else distance)


def see_nobody(look: LookForUser, pictures: int) -> None:
    for k in range(pictures):
        look.feed(11.0 + 0.1 * k, [])


def test_nobody_is_told_when_enough_pictures_are_empty(look: LookForUser) -> None:
    assert look.deadline == 15.0
    for k in range(6):
        look.feed(11.0 + 0.125 * k, [])
        assert (look.result(11.0 + 0.125 * k) is not None) is (k == 5), "as long as a position takes"
    result = look.result(11.625)
    assert result is not None and not result.succeeded
    assert (result.code, result.reason) == ("no_user_seen", "no user seen within 1.6 s in 6 images")
    assert result.code in LOOK_FOR_USER.failures


def test_who_may_be_a_person_is_looked_at_until_the_end_of_the_window(look: LookForUser) -> None:
    for k in range(30):
        look.feed(11.0 + 0.1 * k, [], undecided=True)
    assert look.result(14.9) is None
    result = look.result(15.0)
    assert result is not None and result.reason == "no user seen within 5.0 s in 30 images"


def test_a_tracker_is_undecided_while_somebody_is_not_confirmed() -> None:
    tracker = UserTracker()
    tracker.start()
    decided = []
    for k, people in enumerate(([], [seen(2.0, 0.0)], [], [seen(2.0, 0.0)], [seen(2.0, 0.0)])):
        tracker.update(0.1 * k, people)
        decided.append(not tracker.undecided)
    assert decided == [True, False, True, False, True]


@pytest.mark.parametrize("pictures", [0, 1, 4])
def test_too_few_pictures_do_not_say_that_nobody_is_there(look: LookForUser, pictures: int) -> None:
    see_nobody(look, 9)
    look.start(20.0, 2.0)
    see_nobody(look, pictures)
    assert look.pictures == pictures
    assert look.result(21.9) is None
    result = look.result(22.0)
    assert result is not None and result.code == "no_image"
    assert result.reason.startswith(f"{pictures} usable images within 2 s, 5 would")
    assert result.code in LOOK_FOR_USER.failures


def test_enough_pictures_are_those_in_which_somebody_in_view_is_seen() -> None:
    """What the tracker takes to confirm a person and the look to count it."""
    tracker, look = UserTracker(), LookForUser()
    tracker.start()
    look.start(0.0, 5.0)
    pictures = 0
    while not look.users_seen or not (result := look.result(5.0)) or not result.succeeded:
        users = tracker.update(0.5 * pictures, [seen(2.0, 0.0)])
        look.feed(0.5 * pictures, users)
        pictures += 1
    assert pictures == LookParameters().enough_pictures


def test_a_person_is_told_when_the_average_settled(look: LookForUser) -> None:
    robot = Pose2(0.0, 0.0, 0.3)
    told_at = None
    for k in range(20):
        now = 11.0 + 0.1 * k
        look.feed(now, [tracked(2.0 + 0.05 * (-1) ** k, 2.0)], robot)
        result = look.result(now)
        if result is not None:
            told_at = now
            break
    assert told_at == pytest.approx(11.65, abs=0.06)
    assert result is not None and result.succeeded
    found = result.outputs["user"]
    assert (found.x, found.y) == pytest.approx((2.0, 2.0), abs=0.051)
    assert found.yaw == pytest.approx(math.radians(-135), abs=0.05), "from the person to the robot"
    assert result.outputs["user_id"] == 1
    assert set(result.outputs) == set(LOOK_FOR_USER.outputs)
    for name, value in result.outputs.items():
        assert LOOK_FOR_USER.outputs[name].problem_with(value) is None


def test_the_nearest_person_wins(look: LookForUser) -> None:
    for k in range(8):
        look.feed(11.0 + 0.1 * k, [tracked(3.0, 0.0, 1), tracked(1.5, 0.5, 2)])
    result = look.result(11.8)
    assert result is not None and result.outputs["user_id"] == 2
    assert look.users_seen == 2


@pytest.mark.parametrize("distance", [0.0, 0.49, 4.01, math.nan])
def test_people_out_of_range_do_not_count(look: LookForUser, distance: float) -> None:
    for k in range(40):
        look.feed(
            11.0 + 0.1 * k, [tracked(2.0, 0.0, distance=distance), tracked(math.nan, 0.0, distance=2.0)]
        )
    assert look.result(14.9) is None
    result = look.result(15.0)
    assert result is not None and result.code == "no_user_seen"


def test_who_comes_at_the_last_moment_still_counts(look: LookForUser) -> None:
    for k in range(3):
        look.feed(14.7 + 0.1 * k, [tracked(2.0, 0.0)])
    assert look.result(14.95) is None
    result = look.result(15.0)
    assert result is not None and result.succeeded


@pytest.mark.parametrize(
    ("best", "often", "wanted", "found"),
    [
        (0.74, 1, 0, False),
        (0.95, 4, 0, False),
        (0.8, 2, 0, True),
        (0.74, 1, 1, True),
        (0.74, 1, 2, False),
    ],
)
def test_what_does_not_look_like_a_person_for_certain_in_most_pictures_is_nobody(
    best: float, often: int, wanted: int, found: bool
) -> None:
    """In each so many-th picture it looks most like one."""
    look = LookForUser()
    look.start(10.0, 5.0, Wanted(wanted))
    results = []
    for k in range(26):
        now = 11.0 + 0.1 * k
        look.feed(now, [replace(tracked(2.0, 0.0), confidence=0.7 if k % often else best)])
        results.append(look.result(now))
    (result, *_) = [each for each in results if each is not None] or [look.result(15.0)]
    assert result is not None and result.succeeded is found
    assert found or wanted == 2 or results[19] is None is not results[20], "after two seconds it is decided"


def test_who_was_certain_once_is_so_in_the_next_look_and_nobody_else() -> None:
    look = LookForUser()
    for start, user_id, confidence, found in ((10.0, 1, 0.9, 1), (20.0, 1, 0.7, 1), (30.0, 2, 0.7, 0)):
        look.start(start, 2.0)
        for k in range(8):
            look.feed(start + 0.1 * k, [replace(tracked(2.0, 0.0, user_id), confidence=confidence)])
        result = look.result(start + 2.0)
        assert result is not None and result.succeeded == found


def test_one_flicker_is_not_enough(look: LookForUser) -> None:
    look.feed(14.8, [tracked(2.0, 0.0)])
    look.feed(14.9, [tracked(2.0, 0.0)])
    result = look.result(15.0)
    assert result is not None and not result.succeeded


def test_a_new_look_has_no_memory(look: LookForUser) -> None:
    for k in range(8):
        look.feed(11.0 + 0.1 * k, [tracked(2.0, 0.0)])
    look.start(20.0, 1.0)
    assert look.result(20.5) is None
    assert look.users_seen == 0


@pytest.mark.parametrize(
    "make",
    [
        lambda: TrackerParameters(confirm_hits=5),
        lambda: TrackerParameters(coast_s=11.0),
        lambda: TrackerParameters(gate=-1.0),
        lambda: TrackerParameters(blend=1.5),
        lambda: TrackerParameters(match_distance=0.7),
        lambda: LookParameters(nearest=4.0),
        lambda: LookParameters(settle_s=math.nan),
    ],
)
def test_senseless_parameters_are_refused(make: object) -> None:
    with pytest.raises(ConfigError):
        make()  # type: ignore[operator]


def test_the_declarations_are_whole() -> None:
    assert [served.skill for served in BINDINGS] == [
        "start_tracker",
        "stop_tracker",
        "look_for_user",
        "user_lying",
    ]
    assert LOOK_FOR_USER.complete({}) == {"window": 5.0, "user_id": 0, "x": 0.0, "y": 0.0}
    assert LOOK_FOR_USER.problems_with({"window": 100.0})
    for name, port in LOOK_FOR_USER.inputs.items():
        assert replace(port, description="") == GOAL_LIMITS[name], "the server takes what the skill may give"


def near(x: float, **more: object) -> Detection:
    """Somebody so near that the picture cuts them."""
    return replace(seen(x, 0.0), posture="unknown", **more)


def test_who_comes_too_near_keeps_their_ids_and_soon_has_no_posture(run: Run) -> None:
    tall = replace(seen(2.4, 0.0), height=1.7)
    first = run(tall, times=12)[0]
    assert (first.posture, first.height) == ("standing", 1.7)
    for x in np.arange(2.3, 0.9, -0.1):
        run(near(x))
    (last,) = run(near(0.9), times=12)
    assert (last.posture, last.height) == ("unknown", 0.0)
    assert (last.user_id, last.device_id) == (first.user_id, first.device_id)


@pytest.mark.parametrize("posture", ["standing", "sitting", "lying"])
def test_pictures_that_do_not_tell_the_posture_leave_what_others_tell(run: Run, posture: Posture) -> None:
    told = replace(seen(1.5, 0.0), posture=posture, height=0.9)
    run(told, times=4)
    users = run(near(1.5), times=3)
    assert [(user.posture, user.height) for user in users] == [(posture, 0.9)]


@pytest.mark.parametrize("posture", ["standing", "sitting", "lying"])
def test_who_was_lost_may_come_back_too_near_to_tell_what_they_do(run: Run, posture: Posture) -> None:
    (lost,) = run(replace(seen(1.8, 0.0), posture=posture, height=0.7), times=5)
    run(times=12)
    back = run(near(1.5), times=4)
    assert [user.user_id for user in back] == [lost.user_id]


def test_nobody_lies_on_the_floor_of_whom_the_posture_is_not_known(run: Run) -> None:
    assert not on_the_floor(run(near(0.9), times=5))
    assert on_the_floor(run(replace(seen(1.9, 0.5), posture="lying", height=0.25), near(0.9), times=5))
