"""Laws of the plane: poses, turns and arcs."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.core.geometry import (
    MAX_ANGLE_RAD,
    MAX_DISTANCE_M,
    Pose2,
    Twist2,
    angle_difference,
    integrate_twist,
    normalize_angle,
)

numbers = st.floats(-20.0, 20.0)
poses = st.builds(Pose2, numbers, numbers, numbers)


def same(a: Pose2, b: Pose2) -> bool:
    return a.distance_to(b) < 1e-6 and abs(angle_difference(a.yaw, b.yaw)) < 1e-6


@given(numbers)
def test_a_wrapped_angle_is_the_same_direction(angle):
    wrapped = normalize_angle(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.isclose(math.cos(wrapped), math.cos(angle), abs_tol=1e-9)
    assert math.isclose(math.sin(wrapped), math.sin(angle), abs_tol=1e-9)


def test_half_a_turn_is_positive_from_both_sides():
    assert normalize_angle(-math.pi) == normalize_angle(math.pi) == math.pi


def test_the_shortest_turn_goes_over_the_back():
    assert angle_difference(-3.0, 3.0) == pytest.approx(math.tau - 6.0)
    assert angle_difference(3.0, -3.0) == pytest.approx(6.0 - math.tau)


@given(poses, poses, poses)
def test_composing(a, b, c):
    assert same(a @ Pose2(), a) and same(Pose2() @ a, a)
    assert same(a @ a.inverse(), Pose2()) and same(a.inverse() @ a, Pose2())
    assert same((a @ b) @ c, a @ (b @ c))


def test_forward_of_a_body_that_looks_left_is_left():
    seen = Pose2(1.0, 2.0, math.pi / 2) @ Pose2(3.0, -1.0, math.pi)
    assert (seen.x, seen.y, seen.yaw) == pytest.approx((2.0, 5.0, -math.pi / 2))


@given(poses, poses)
def test_a_point_is_taken_along_as_the_pose_there(body, point):
    x, y = body.apply(point.x, point.y)
    there = body @ point
    assert (x, y) == pytest.approx((there.x, there.y))


def test_bearings():
    here = Pose2(1.0, 1.0, math.pi / 2)
    assert here.bearing_to(1.0, 3.0) == pytest.approx(0.0)
    assert here.bearing_to(0.0, 1.0) == pytest.approx(math.pi / 2)
    assert here.bearing_to(2.0, 2.0) == pytest.approx(-math.pi / 4)


@pytest.mark.parametrize("place", range(3))
def test_what_a_pose_may_be(place):
    def pose(value):
        return Pose2(*(value if number == place else 0.0 for number in range(3)))

    limit = (MAX_DISTANCE_M, MAX_DISTANCE_M, MAX_ANGLE_RAD)[place]
    for good in (limit, -limit):
        assert pose(good).is_within_limits() and pose(good).is_finite()
    for beyond in (limit * 1.001, -limit * 1.001):
        assert not pose(beyond).is_within_limits() and pose(beyond).is_finite()
    for bad in (math.nan, math.inf):
        assert not pose(bad).is_within_limits() and not pose(bad).is_finite()


def test_standstill():
    assert Twist2().is_zero() and Twist2(-0.0, 0.0).is_zero()
    assert not Twist2(1e-12, 0.0).is_zero() and not Twist2(0.0, -1e-12).is_zero()


def test_a_quarter_of_a_circle():
    # 1 m/s at 0.5 rad/s: a circle of 2 m to the left.
    end = integrate_twist(Pose2(1.0, 0.0, math.pi / 2), Twist2(1.0, 0.5), math.pi)
    assert (end.x, end.y, abs(end.yaw)) == pytest.approx((-1.0, 2.0, math.pi))


@given(poses, numbers, st.floats(-2.0, 2.0) | st.floats(-1e-8, 1e-8), st.floats(0.0, 5.0))
def test_an_arc_is_its_two_halves(start, speed, turning, seconds):
    twist = Twist2(speed, turning)
    halfway = integrate_twist(start, twist, seconds / 2)
    assert same(integrate_twist(start, twist, seconds), integrate_twist(halfway, twist, seconds / 2))


def test_straight_on_and_on_the_spot():
    assert integrate_twist(Pose2(0.0, 1.0, math.pi), Twist2(0.5, 0.0), 4.0).x == pytest.approx(-2.0)
    turned = integrate_twist(Pose2(3.0, 1.0, 0.0), Twist2(0.0, 0.5), 2.0)
    assert (turned.x, turned.y, turned.yaw) == pytest.approx((3.0, 1.0, 1.0))


@pytest.mark.parametrize(
    ("twist", "limits", "slowed"),
    [
        (Twist2(0.4, 0.8), (0.2,), Twist2(0.2, 0.4)),
        (Twist2(-0.4, 0.8), (0.2,), Twist2(-0.2, 0.4)),
        (Twist2(0.4, -0.8), (1.0, 0.2), Twist2(0.1, -0.2)),
        (Twist2(0.4, 0.8), (0.2, 0.2), Twist2(0.1, 0.2)),
        (Twist2(0.1, 0.2), (0.2, 0.4), Twist2(0.1, 0.2)),
        (Twist2(0.0, 0.8), (0.0,), Twist2(0.0, 0.8)),
        (Twist2(0.4, 0.0), (0.0,), Twist2()),
    ],
)
def test_a_slower_drive_keeps_its_arc(twist, limits, slowed):
    result = twist.slowed_to(*limits)
    assert (result.linear, result.angular) == pytest.approx((slowed.linear, slowed.angular))
