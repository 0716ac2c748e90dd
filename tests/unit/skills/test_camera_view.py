"""What a depth picture says of a place: somebody is there, it is free, or it is not seen."""

from __future__ import annotations

import math

import numpy as np
import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.transforms import Transform3
from florence_bt.skills.people.user_tracker.camera_view import UPRIGHT, CameraView, view_of
from tests.unit.skills.depth_pictures import CAMERA_HEIGHT, floor, picture, with_box

MOUNT = Transform3.from_xyz_rpy((0.0, 0.0, CAMERA_HEIGHT), (-math.pi / 2, 0.0, -math.pi / 2))
ON_THE_FLOOR, IN_BED = (0.05, 0.25), (0.35, 0.6)
Box = tuple[float, tuple[float, float], float, float]
"""How far away its front is, its heights, and its sides in metres to the left."""


def view(*boxes: Box, robot: Pose2 | None = None) -> CameraView:
    """The view of a room with a wall 4.5 m away, from the middle of the robot."""
    depth = floor()
    for box in boxes:
        depth = with_box(depth, *box)
    return view_of(picture(depth), MOUNT, robot or Pose2())


def body(away: float, top: float = 1.7, left: float = 0.2, bottom: float = 0.0) -> Box:
    return away - 0.12, (bottom, top), left, left - 0.4


@pytest.mark.parametrize("away", [0.5, 0.9, 1.5, 3.0])
def test_an_empty_place_is_free_from_near_and_far(away: float) -> None:
    assert view().is_free(away, 0.0, UPRIGHT)


@pytest.mark.parametrize("away", [0.7, 0.9, 1.5, 3.0])
@pytest.mark.parametrize("top", [1.7, 1.15], ids=["stands", "sits"])
def test_where_somebody_is_upright_it_is_not_free(away: float, top: float) -> None:
    assert not view(body(away, top)).is_free(away, 0.0, UPRIGHT)
    assert view(body(away, top, left=1.0)).is_free(away, 0.0, UPRIGHT), "somebody else is beside"


@pytest.mark.parametrize(("heights", "bottom"), [(ON_THE_FLOOR, 0.0), (IN_BED, 0.3)])
def test_where_somebody_lies_it_is_not_free(heights: tuple[float, float], bottom: float) -> None:
    bed = ((1.2, (0.0, bottom), 0.8, -0.8),) if bottom else ()
    lying = (1.5 - 0.2, (bottom, heights[1]), 0.8, -0.8)
    assert not view(*bed, lying).is_free(1.5, 0.0, heights)
    assert view(*bed).is_free(1.5, 0.0, heights), "they got up"
    assert view(*bed, lying).is_free(1.5, 0.0, UPRIGHT), "over who lies one sees what is behind"


def test_who_is_nearer_than_the_camera_measures_has_not_left() -> None:
    depth = with_box(floor(), *body(0.5))
    depth[depth < 0.5] = np.nan
    assert np.isnan(depth).any()
    assert not view_of(picture(depth), MOUNT, Pose2()).is_free(0.5, 0.0, UPRIGHT)


def test_where_nothing_is_measured_nothing_is_free() -> None:
    blind = view_of(picture(np.full_like(floor(), np.nan)), MOUNT, Pose2())
    assert not blind.is_free(1.5, 0.0, UPRIGHT)


def test_an_empty_armchair_is_free_and_one_where_somebody_sits_is_not() -> None:
    seat, back = (1.2, (0.0, 0.45), 0.35, -0.35), (1.75, (0.0, 0.95), 0.35, -0.35)
    assert view(back, seat).is_free(1.5, 0.0, UPRIGHT)
    assert not view(back, seat, body(1.5, 1.15, bottom=0.45)).is_free(1.5, 0.0, UPRIGHT)


def test_a_low_back_or_somebody_half_beside_does_not_fill_a_place() -> None:
    assert view((1.5, (0.0, 0.55), 0.4, -0.4)).is_free(1.5, 0.0, UPRIGHT)
    assert view(body(1.5, left=0.47)).is_free(1.5, 0.0, UPRIGHT)
    assert not view(body(1.5, left=0.44)).is_free(1.5, 0.0, UPRIGHT)
    assert not view((1.5, (0.0, 0.8), 0.4, -0.4)).is_free(1.5, 0.0, UPRIGHT)


@pytest.mark.parametrize(
    "between",
    [(0.8, (0.0, 1.5), 0.3, -0.3), (1.2, (0.0, 2.0), 0.5, 0.0), (1.0, (0.4, 0.9), 0.3, -0.3)],
    ids=["a cupboard", "the side of a door", "somebody else who sits"],
)
def test_a_place_behind_something_is_not_seen_free(between: Box) -> None:
    assert not view(between).is_free(2.0, 0.0, UPRIGHT)


def test_just_before_a_wall_nobody_can_tell() -> None:
    assert not view().is_free(4.4, 0.0, UPRIGHT)
    assert view().is_free(4.2, 0.0, UPRIGHT)


@pytest.mark.parametrize("place", [(-1.0, 0.0), (0.0, 1.5), (1.0, 1.2), (1.0, -1.2)])
def test_what_is_not_in_the_picture_is_not_seen_free(place: tuple[float, float]) -> None:
    assert not view().is_free(*place, UPRIGHT)
    assert not view().shows(*place)


def test_so_near_the_floor_beside_the_robot_is_below_the_picture() -> None:
    assert not view().is_free(0.4, 0.0, ON_THE_FLOOR)


@pytest.mark.parametrize("turn", [0.0, 1.2, math.pi])
def test_a_place_is_one_of_the_frame_of_the_tracker_or_of_the_one_above(turn: float) -> None:
    robot, frame = Pose2(2.0, 1.0, turn), Pose2(-3.0, 0.5, 0.7)
    for boxes in ((), (body(1.5),)):
        seen = view(*boxes, robot=robot)
        place, behind = robot.apply(1.5, 0.0), robot.apply(3.0, 0.3)
        assert seen.is_free(*place, UPRIGHT) is (not boxes)
        moved = seen.moved_by(frame)
        assert moved.is_free(*frame.apply(*place), UPRIGHT) is (not boxes)
        assert moved.shows(*frame.apply(*place)) is seen.shows(*place) is bool(boxes)
        assert moved.camera.distance_to(frame @ robot) < 1e-9
        assert not seen.is_free(*robot.apply(-1.5, 0.0), UPRIGHT)
        assert view(robot=robot).is_free(*behind, UPRIGHT)
