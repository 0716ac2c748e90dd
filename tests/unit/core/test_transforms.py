"""The buffer of transforms: chains of frames, and loops that somebody else closed."""

import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.transforms import TransformBuffer, TransformUnavailable


@pytest.fixture
def frames():
    buffer = TransformBuffer()
    buffer.set_moving("map", "odom", 1.0, Pose2(1.0, 0.0, 0.0))
    buffer.set_moving("odom", "base_footprint", 1.0, Pose2(0.0, 2.0, 0.0))
    return buffer


def test_a_loop_above_the_two_frames_does_no_harm(frames):
    """The localiser needs odom to base_footprint in order to publish the transform that mends odom."""
    frames.set_moving("base_footprint", "odom", 1.1, Pose2(5.0, 5.0, 0.0))
    assert frames.lookup_pose("odom", "base_footprint") == Pose2(0.0, 2.0, 0.0)
    with pytest.raises(TransformUnavailable, match="form a loop"):
        frames.lookup_pose("map", "base_footprint")
    frames.set_moving("map", "odom", 1.2, Pose2(1.0, 0.0, 0.0))
    assert frames.lookup_pose("map", "base_footprint") == Pose2(1.0, 2.0, 0.0)


def test_two_branches_meet_at_their_common_parent(frames):
    frames.set_moving("map", "user_1", 1.0, Pose2(3.0, 3.0, 0.0))
    assert frames.lookup_pose("user_1", "base_footprint") == Pose2(-2.0, -1.0, 0.0)
    assert frames.lookup_pose("base_footprint", "map") == Pose2(-1.0, -2.0, 0.0)
