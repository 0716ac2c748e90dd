"""Fit one scan to the likelihood field by a few Gauss-Newton steps, held back by what is believed already."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.skills.navigation.localisation._kernels import best_pose, gauss_newton, scores_around
from florence_bt.skills.navigation.localisation.likelihood_field import LikelihoodField


@dataclass(frozen=True, slots=True)
class Match:
    """A scan that was fitted.

    Attributes:
        pose: The best pose of the base in the map frame.
        covariance: Shape (3, 3), of x, y, yaw.
        near_fraction: The part of the beams that end close to a surface of the map.
    """

    pose: Pose2
    covariance: NDArray[np.float64]
    near_fraction: float


def match_scan(
    field: LikelihoodField,
    points: NDArray[np.float64],
    belief: Pose2,
    covariance: NDArray[np.float64],
    *,
    sigma: float,
    independent_beams: float,
    start: Pose2 | None = None,
    steps: int = 8,
) -> Match:
    """Find the pose that fits the scan and the belief best.

    Args:
        field: The map.
        points: Shape (n, 2), beam ends in the base frame.
        belief: Where the robot is believed to be.
        covariance: Shape (3, 3), how sure that is; along a bare corridor only the belief holds the pose.
        sigma: Standard deviation of a beam end from the map's surface in metres.
        independent_beams: How many beams' worth of knowledge a whole scan holds: neighbouring beams see
            the same error of the map.
        start: Where to begin, None for the belief.
        steps: Most steps to take.

    Returns:
        The match; with few points near a surface it stays close to the belief; the start itself when that
        fits better.

    Source:
        Probabilistic Robotics, section 6.4, as a maximum a posteriori estimate.
    """
    begin = start or belief
    here, fitted, near = gauss_newton(
        np.array([begin.x, begin.y, begin.yaw]),
        points,
        field.signed,
        field.normals,
        field.frame,
        np.array([belief.x, belief.y, belief.yaw]),
        covariance,
        min(1.0, independent_beams / max(1, len(points))) / sigma**2,
        sigma,
        steps,
    )
    pose = Pose2(float(here[0]), float(here[1]), normalize_angle(float(here[2])))
    return Match(pose, fitted, near / max(1, len(points)))


def search_around(
    field: LikelihoodField,
    points: NDArray[np.float64],
    centre: Pose2,
    *,
    reach: float,
    turn: float,
    step: float,
    turn_step: float,
    near: float,
    cost_d: float,
    cost_a: float = 0.0,
) -> Pose2:
    """Return the pose, out of a grid of poses, at which a scan fits best, for a fit to begin at.

    Args:
        field: The map.
        points: Shape (n, 2), beam ends in the base frame, metres.
        centre: The middle of the search.
        reach: How far from there, metres.
        turn: How far from its heading, radians.
        step: From place to place, metres.
        turn_step: From heading to heading, radians.
        near: A beam that ends farther from a surface does not fit, metres.
        cost_d: How much more of the scan has to fit at a place, per squared metre from the middle: along a
            corridor all places look alike.
        cost_a: The same per squared radian.

    Source:
        Olson, Real-time correlative scan matching, ICRA 2009.
    """
    x, y, yaw = best_pose(
        field.signed,
        points,
        (centre.x, centre.y, centre.yaw),
        field.frame,
        step,
        math.ceil(reach / step - 1e-9),
        turn_step,
        math.ceil(turn / turn_step - 1e-9),
        near,
        cost_d,
        cost_a,
    )
    return Pose2(x, y, normalize_angle(yaw))


def spread_around(
    field: LikelihoodField,
    points: NDArray[np.float64],
    pose: Pose2,
    *,
    reach: float,
    step: float,
    near: float,
    scale: float,
) -> NDArray[np.float64]:
    """Measure how far from a pose a scan fits about as well as there.

    The covariance of a fit believes every wrinkle of a wall; along a bare corridor it is far too sure.

    Args:
        field: The map.
        points: Shape (n, 2), beam ends in the base frame, metres.
        pose: Where the scan fits.
        reach: How far is looked, metres along each axis.
        step: From place to place, metres.
        near: A beam that ends farther from a surface does not fit, metres.
        scale: A place where so much less of the scan fits is e times less likely; five times as much counts
            as impossible.

    Returns:
        Shape (2, 2): the covariance of x and y about the pose.

    Source:
        Olson, Real-time correlative scan matching, ICRA 2009, section III.D.
    """
    steps = math.ceil(reach / step - 1e-9)
    centre = (pose.x, pose.y, pose.yaw)
    less = -scores_around(field.signed, points, centre, field.frame, step, steps, near)
    less += -less[steps, steps]
    weights = np.where(less < 5.0 * scale, np.exp(-np.maximum(less, 0.0) / scale), 0.0)
    along = step * np.arange(-steps, steps + 1)
    x, y = np.meshgrid(along, along)
    xy = float((weights * x * y).sum())
    moments = np.array([[(weights * x * x).sum(), xy], [xy, (weights * y * y).sum()]])
    return moments / weights.sum()


def evenly(points: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return at most ``count`` of the points, evenly chosen."""
    if len(points) <= count:
        return points
    return np.ascontiguousarray(points[np.linspace(0, len(points) - 1, count).round().astype(int)])


def turned_covariance(covariance: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """Return a covariance of x, y, yaw, shape (3, 3), in axes from which its own are turned by an angle."""
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return turn @ covariance @ turn.T
