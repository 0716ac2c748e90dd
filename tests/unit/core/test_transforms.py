"""Transforms in space, and their buffer: moments, chains of frames, and loops that somebody else closed."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from florence_bt.core.geometry import Pose2
from florence_bt.core.transforms import Transform3, TransformBuffer, TransformUnavailable

numbers = st.floats(-10.0, 10.0)
triples = st.tuples(numbers, numbers, numbers)
transforms = st.builds(Transform3.from_xyz_rpy, triples, triples)


def assert_same(a: Transform3, b: Transform3) -> None:
    assert_allclose(a.rotation, b.rotation, atol=1e-9)
    assert_allclose(a.translation, b.translation, atol=1e-6)


@given(transforms, transforms, triples)
def test_laws(a, b, point):
    assert_allclose((a @ b).apply(np.array(point)), a.apply(b.apply(np.array([point])))[0], atol=1e-6)
    assert_same(a @ a.inverse(), Transform3.identity())


@given(triples)
def test_roll_comes_first_and_yaw_last_about_the_axes_of_the_parent(rpy):
    roll, pitch, yaw = (
        Transform3.from_quaternion((0, 0, 0), (*(np.eye(3)[axis] * math.sin(angle / 2)), math.cos(angle / 2)))
        for axis, angle in enumerate(rpy)
    )
    assert_same(Transform3.from_xyz_rpy((0, 0, 0), rpy), yaw @ pitch @ roll)


@given(transforms)
def test_quaternions_there_and_back(transform):
    quaternion = transform.quaternion()
    assert quaternion[3] >= 0.0 and math.hypot(*quaternion) == pytest.approx(1.0)
    assert_same(Transform3.from_quaternion(transform.translation, quaternion), transform)


@pytest.mark.parametrize("axis", range(3))
def test_half_a_turn_and_nearly_has_a_quaternion(axis):
    for angle in (math.pi, math.pi - 1e-7, 1e-9):
        expected = [0.0, 0.0, 0.0, math.cos(angle / 2)]
        expected[axis] = math.sin(angle / 2)
        turned = Transform3.from_xyz_rpy((0, 0, 0), [angle if other == axis else 0.0 for other in range(3)])
        assert_allclose(np.abs(turned.quaternion()), expected, atol=1e-12)


def test_a_quaternion_of_any_length_turns_counter_clockwise():
    left = Transform3.from_quaternion((1, 2, 3), (0.0, 0.0, 5.0, 5.0))
    assert_allclose(left.apply(np.array([1.0, 0.0, 0.0])), (1.0, 3.0, 3.0), atol=1e-12)


@given(numbers, numbers, st.floats(-3.0, 3.0))
def test_poses_in_the_plane_there_and_back(x, y, yaw):
    pose = Transform3.from_pose2(Pose2(x, y, yaw)).to_pose2()
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((x, y, yaw))


@pytest.fixture
def walk():
    """A frame that goes 1 m in 2 s and turns over the back from 3 rad to -3 rad."""
    buffer = TransformBuffer(keep=10.0)
    buffer.set_moving("odom", "base", 5.0, Pose2(0.0, 2.0, 3.0))
    buffer.set_moving("odom", "base", 7.0, Pose2(1.0, 4.0, -3.0))
    return buffer


def test_between_two_samples_the_motion_is_even_and_the_shorter_way_round(walk):
    halfway = walk.lookup_pose("odom", "base", 6.0)
    assert (halfway.x, halfway.y, abs(halfway.yaw)) == pytest.approx((0.5, 3.0, math.pi))
    quarter = walk.lookup_pose("odom", "base", 5.5)
    assert (quarter.x, quarter.y) == pytest.approx((0.25, 2.5))
    assert quarter.yaw == pytest.approx(3.0 + (math.tau - 6.0) / 4)


def test_the_samples_themselves_and_a_little_later(walk):
    assert walk.lookup_pose("odom", "base", 5.0).x == 0.0
    assert [walk.lookup_pose("odom", "base", stamp).x for stamp in (7.0, 7.03, 7.05, None)] == [1.0] * 4


@pytest.mark.parametrize(("stamp", "told"), [(4.9, "known only from 5.00 s on"), (7.06, "0.06 s older")])
def test_what_is_too_far_from_the_samples_is_not_guessed(walk, stamp, told):
    with pytest.raises(TransformUnavailable, match=told):
        walk.lookup("odom", "base", stamp)


def test_samples_that_come_late_or_twice_are_sorted_in(walk):
    walk.set_moving("odom", "base", 6.0, Pose2(8.0, 0.0, 0.0))
    walk.set_moving("odom", "base", 6.0, Pose2(9.0, 0.0, 0.0))
    walk.set_moving("odom", "base", 7.0, Pose2(2.0, 0.0, 0.0))
    assert [walk.lookup_pose("odom", "base", stamp).x for stamp in (5.0, 6.0, 7.0, None)] == [0, 9, 2, 2]
    assert walk.lookup_pose("odom", "base", 5.5).x == pytest.approx(4.5)


def test_old_samples_are_forgotten(walk):
    walk.set_moving("odom", "base", 15.0, Pose2(2.0))
    assert walk.lookup_pose("odom", "base", 5.0).x == 0.0
    walk.set_moving("odom", "base", 15.1, Pose2(2.0))
    with pytest.raises(TransformUnavailable, match=r"known only from 7\.00 s on"):
        walk.lookup("odom", "base", 5.0)


def test_a_frame_that_gets_another_parent_is_known_from_there_on(walk):
    walk.set_moving("map", "base", 8.0, Pose2(5.0))
    assert walk.lookup_pose("map", "base").x == 5.0
    with pytest.raises(TransformUnavailable, match="no transform from 'base' to 'odom'; known frames: base"):
        walk.lookup("odom", "base")


def test_what_is_known(walk):
    walk.set_static("base", "laser", Transform3.from_xyz_rpy((0.1, 0.0, 0.3), (0.0, 0.0, 0.0)))
    assert walk.frames() == ("base", "laser")
    assert (walk.latest_stamp("base"), walk.latest_stamp("laser")) == (7.0, None)
    assert_allclose(
        walk.lookup("odom", "laser", 5.0).translation, (0.1 * math.cos(3), 2 + 0.1 * math.sin(3), 0.3)
    )
    assert walk.newest_between("odom", "laser") == 7.0 and walk.newest_between("base", "laser") is None
    walk.set_moving("map", "odom", 6.5, Pose2(1.0))
    assert walk.newest_between("map", "laser") == walk.newest_between("base", "map") == 6.5
    assert walk.newest_between("odom", "laser") == 7.0
    walk.clear_moving()
    assert walk.frames() == ("laser",) and walk.latest_stamp("base") is None
    with pytest.raises(TransformUnavailable, match="known frames: laser"):
        walk.lookup("odom", "laser")
    with pytest.raises(TransformUnavailable, match="known frames: none"):
        TransformBuffer().lookup("a", "b")


@pytest.fixture
def frames():
    buffer = TransformBuffer()
    buffer.set_moving("map", "odom", 1.0, Pose2(1.0, 0.0, 0.0))
    buffer.set_moving("odom", "base_footprint", 1.0, Pose2(0.0, 2.0, 0.0))
    return buffer


def test_a_loop_above_the_two_frames_does_no_harm(frames):
    """The localiser needs odom to base_footprint in order to publish the transform that mends odom."""
    frames.set_moving("odom", "base_footprint", 1.0, Pose2(0.0, 2.0, 0.0), own=True)
    frames.set_moving("base_footprint", "odom", 1.1, Pose2(5.0, 5.0, 0.0), own=True)
    assert frames.lookup_pose("odom", "base_footprint") == Pose2(0.0, 2.0, 0.0)
    with pytest.raises(TransformUnavailable, match="form a loop"):
        frames.lookup_pose("map", "base_footprint")
    frames.set_moving("map", "odom", 1.2, Pose2(1.0, 0.0, 0.0), own=True)
    assert frames.lookup_pose("map", "base_footprint") == Pose2(1.0, 2.0, 0.0)


def test_two_branches_meet_at_their_common_parent(frames):
    frames.set_moving("map", "user_1", 1.0, Pose2(3.0, 3.0, 0.0))
    assert frames.lookup_pose("user_1", "base_footprint") == Pose2(-2.0, -1.0, 0.0)
    assert frames.lookup_pose("base_footprint", "map") == Pose2(-1.0, -2.0, 0.0)


def test_a_static_frame_that_is_set_again_is_looked_up_again():
    buffer = TransformBuffer()
    buffer.set_static("base", "mast", Transform3.from_pose2(Pose2(1.0, 0.0)))
    buffer.set_static("mast", "camera", Transform3.from_pose2(Pose2(0.0, 2.0)))
    assert buffer.lookup_pose("base", "camera") == Pose2(1.0, 2.0)
    buffer.set_static("base", "mast", Transform3.from_pose2(Pose2(5.0, 0.0)))
    assert buffer.lookup_pose("base", "camera") == Pose2(5.0, 2.0)
    # A frame that moves is never taken from an earlier answer.
    buffer.set_moving("odom", "base", 0.0, Pose2(1.0, 0.0))
    assert buffer.lookup_pose("odom", "camera") == Pose2(6.0, 2.0)
    buffer.set_moving("odom", "base", 1.0, Pose2(2.0, 0.0))
    assert buffer.lookup_pose("odom", "camera") == Pose2(7.0, 2.0)


def test_what_moves_wins_over_what_is_static_whichever_comes_first(frames):
    assert "which moves below 'map'" in frames.set_static("map", "odom", Transform3.from_pose2(Pose2(9.0)))
    assert frames.lookup_pose("map", "odom") == Pose2(1.0, 0.0, 0.0)
    frames.set_static("map", "early", Transform3.from_pose2(Pose2(9.0)))
    assert frames.lookup_pose("map", "early").x == 9.0
    assert "'early' is not used any more" in frames.set_moving("map", "early", 1.0, Pose2(2.0))
    assert frames.lookup_pose("map", "early").x == 2.0


def test_a_second_parent_has_to_wait_until_the_first_one_is_silent(frames):
    assert "second parent" in frames.set_moving("world", "odom", 1.5, Pose2(9.0))
    assert frames.lookup_pose("map", "odom").x == 1.0
    assert frames.set_moving("world", "odom", 2.1, Pose2(9.0)) is None
    assert frames.lookup_pose("world", "odom").x == 9.0
    frames.set_static("base_footprint", "laser", Transform3.identity())
    assert "second parent" in frames.set_static("map", "laser", Transform3.identity())


def test_a_loop_is_refused(frames):
    assert "a loop of frames" in frames.set_moving("base_footprint", "map", 1.0, Pose2(5.0))
    assert "a loop of frames" in frames.set_static("base_footprint", "map", Transform3.identity())
    assert frames.lookup_pose("map", "base_footprint") == Pose2(1.0, 2.0, 0.0)


WRONG = Transform3.from_pose2(Pose2(50.0, 50.0))
FOREIGN = {
    "a sample ahead": lambda b: b.set_moving("map", "odom", 9.0, Pose2(50.0)),
    "a sample of now": lambda b: b.set_moving("odom", "base_footprint", 1.05, Pose2(50.0)),
    "a second parent": lambda b: b.set_moving("map", "base_footprint", 8.0, Pose2(50.0)),
    "a static one": lambda b: b.set_static("map", "odom", WRONG),
    "a static second parent": lambda b: b.set_static("map", "laser", WRONG),
    "a moving sensor": lambda b: b.set_moving("map", "laser", 8.0, Pose2(50.0)),
    "a loop": lambda b: b.set_moving("base_footprint", "map", 1.0, Pose2(50.0)),
    "a static loop": lambda b: b.set_static("laser", "map", WRONG),
}


@pytest.mark.parametrize("foreign_first", [False, True])
@pytest.mark.parametrize("what", FOREIGN)
def test_what_others_say_of_florences_own_frames_has_no_effect(what, foreign_first):
    buffer = TransformBuffer()
    if foreign_first:
        FOREIGN[what](buffer)
    for stamp in (1.0, 1.1):
        buffer.set_moving("map", "odom", stamp, Pose2(1.0, 0.0), own=True)
        buffer.set_moving("odom", "base_footprint", stamp, Pose2(0.0, 2.0), own=True)
        buffer.set_static("base_footprint", "laser", Transform3.identity(), own=True)
    assert FOREIGN[what](buffer) and FOREIGN[what](buffer), "each is told"
    for stamp in (1.1, None):
        assert buffer.lookup_pose("map", "laser", stamp) == Pose2(1.0, 2.0, 0.0)
        assert buffer.lookup_pose("laser", "map", stamp) == Pose2(-1.0, -2.0, 0.0)


def test_what_everybody_hears_of_florences_own_static_frames_is_no_contradiction():
    buffer = TransformBuffer()
    for own in (False, True, False):
        assert buffer.set_static("base", "laser", WRONG, own=own) is None


def test_a_sample_that_lies_on_the_motion_says_the_same_and_any_other_does_not():
    buffer = TransformBuffer()
    for step in range(4):
        buffer.set_moving("odom", "base", 10.0 + step, Pose2(0.4 * step, 0.0, 0.1 * step), own=True)
    assert buffer.agrees("odom", "base", 11.0, Pose2(0.4, 0.0, 0.1))
    assert buffer.agrees("odom", "base", 10.5, Pose2(0.21, 0.0, 0.05)), "the copy of a sample that was lost"
    assert buffer.agrees("odom", "base", 9.0, Pose2(7.0, 0.0, 0.0)), (
        "before the first sample nothing is known"
    )
    assert buffer.agrees("odom", "base", 13.1, Pose2(7.0, 0.0, 0.0)), "nor after the last one"
    assert not buffer.agrees("odom", "base", 11.0, Pose2(0.9, 0.0, 0.1))
    assert not buffer.agrees("odom", "base", 11.0, Pose2(0.4, 0.3, 0.1))
    assert not buffer.agrees("odom", "base", 11.0, Pose2(0.4, 0.0, 0.5))
    assert not buffer.agrees("map", "base", 11.0, Pose2(0.4, 0.0, 0.1))


@pytest.mark.parametrize("lost", [Pose2(0.0, 0.0, 0.0), Pose2(3.0, 0.0, 2.0)])
@pytest.mark.parametrize("stamp", [10.05, 10.5, 10.95])
def test_a_sample_that_was_lost_while_the_frame_jumped_says_the_same(stamp, lost):
    buffer = TransformBuffer()
    for when, pose in ((10.0, Pose2(0.0, 0.0, 0.0)), (11.0, Pose2(3.0, 0.0, 2.0))):
        buffer.set_moving("map", "odom", when, pose, own=True)
    assert buffer.agrees("map", "odom", stamp, lost)


def test_a_sample_of_a_moment_that_was_corrected_says_the_same():
    """The localiser may tell the same moment twice, the second time better."""
    buffer = TransformBuffer()
    for when, x in ((10.0, 0.0), (11.0, 3.0), (12.0, 3.0)):
        buffer.set_moving("map", "odom", when, Pose2(x, 0.0, 0.0), own=True)
    assert buffer.agrees("map", "odom", 11.0, Pose2(0.0, 0.0, 0.0)), "as it was told first"
