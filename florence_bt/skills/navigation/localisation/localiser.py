"""The localisation as a whole: scans and odometry in, the place of the odometry frame in the map out."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.beam_ends import beam_ends
from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.core.sensing import LaserScan, OccupancyGrid
from florence_bt.core.transforms import Transform3
from florence_bt.skills.navigation.localisation.laser_odometry import LaserOdometry
from florence_bt.skills.navigation.localisation.likelihood_field import build_likelihood_field
from florence_bt.skills.navigation.localisation.parameters import LocaliserParameters
from florence_bt.skills.navigation.localisation.particle_filter import ParticleFilter
from florence_bt.skills.navigation.localisation.pose_search import PoseSearch
from florence_bt.skills.navigation.localisation.relocaliser import Relocaliser
from florence_bt.skills.navigation.localisation.scan_match import Match, evenly, match_scan

INITIAL_DEVIATIONS = (0.5, 0.5, math.pi / 12.0)
"""Standard deviations of x, y (metres) and yaw (radians) of an initial pose (REFERENCE 7.7)."""

_REST_DISTANCE_M, _REST_ANGLE = 0.002, 0.002
_SETTLE_DISTANCE_M, _SETTLE_ANGLE = 0.01, 0.01
_MIN_POINTS = 10
_FOUND_DEVIATIONS = (0.1, 0.1, 0.06)
_FOUND_SHARE = 0.8
"""Deviations around a better place nearby (metres, radians), and the part of the particles drawn there
again."""
_UNFIT_DEVIATIONS = np.array((0.1, 0.1, 0.03))
"""Growth of the told deviations (metres, radians) for each metre in which nothing fits. Chosen: ten times the
drift of the laser odometry, as nobody knows whether the place is right at all."""


class Localiser:
    """Finds the robot in a map.

    Each scan of a robot that moves corrects the odometry. It counts, that is, it is compared with the map,
    when the robot has moved far enough since the last one that did, and once more when it has come to rest
    after any motion. The scan must be the laser's own, not the filtered one (document, section 3.5.3).

    Until somebody says where the robot is (:meth:`set_pose`) it is looked for everywhere.

    Attributes:
        pose: base_footprint in the map at the last update, None before the first; a guess while lost.
        covariance: Shape (3, 3), of x, y, yaw; the longer nothing fits, the greater.
        fit: The part of the newest scan that ended near surfaces of the map, from where the robot was
            believed to be.
        map_from_odom: The place of the odometry frame in the map; None before the first update or
            :meth:`believe`, and while the robot is lost.
    """

    def __init__(
        self, grid: OccupancyGrid, parameters: LocaliserParameters | None = None, seed: int = 0
    ) -> None:
        self._parameters = parameters or LocaliserParameters()
        self._field = build_likelihood_field(
            grid, self._parameters.likelihood_max_dist, self._parameters.surface_offset
        )
        self._filter = ParticleFilter(self._field, self._parameters, np.random.default_rng(seed))
        near = np.diag(np.square(_FOUND_DEVIATIONS))
        search = PoseSearch(self._field, grid, lambda points, pose: self._fit(points, pose, near))
        self._relocaliser = Relocaliser(search, self._parameters)
        self._laser = LaserOdometry()
        # How sure the motion since the last scan that counted is, in the robot's frame.
        self._drift = np.zeros((3, 3))
        self._given: Pose2 | None = None
        self._previous_odom: Pose2 | None = None
        # At the last scan that counted: the corrected odometry, the wheels' own, and the place in the map.
        self._counted: Pose2 | None = None
        self._counted_odom = self._there = Pose2()
        self._resting = self._resumed = False
        self._unfit_m, self._was_carried = 0.0, False
        self.fit = 0.0
        self.pose: Pose2 | None = None
        self.covariance: NDArray[np.float64] = np.diag(np.square(INITIAL_DEVIATIONS))
        self.map_from_odom: Pose2 | None = None
        if self._parameters.refine:
            self.lose()
        else:
            self.set_pose(Pose2())

    @property
    def particles(self) -> NDArray[np.float64]:
        """Shape (n, 3): x, y, yaw of the particles in the map frame."""
        return self._filter.particles

    def set_pose(
        self, pose: Pose2, standard_deviations: tuple[float, float, float] = INITIAL_DEVIATIONS
    ) -> None:
        """Set where the robot is; the next scan counts in any case.

        Args:
            pose: base_footprint in the map frame.
            standard_deviations: Of x, y in metres and of yaw in radians.

        Raises:
            ValueError: A number is not finite, or a deviation is below zero.
        """
        if not pose.is_finite() or not all(0.0 <= deviation < math.inf for deviation in standard_deviations):
            raise ValueError(f"the robot cannot be at {pose} with the deviations {standard_deviations}")
        self._filter.set_pose(pose, standard_deviations)
        self._relocaliser.reset()
        self._given = self._there = pose
        self._counted, self._resumed = None, False
        self._unfit_m, self._was_carried = 0.0, False
        self.covariance = np.diag(np.square(standard_deviations))

    def resume(
        self, pose: Pose2, standard_deviations: tuple[float, float, float] = INITIAL_DEVIATIONS
    ) -> None:
        """Begin where the robot was last; that pose is published once a scan has fitted there.

        The robot may have been carried meanwhile: when the first scan does not fit it is lost.

        Args:
            pose: base_footprint in the map frame.
            standard_deviations: Of x, y in metres and of yaw in radians.

        Raises:
            ValueError: As :meth:`set_pose`.
        """
        self.set_pose(pose, standard_deviations)
        self._given, self._resumed = None, self._parameters.refine

    def lose(self) -> None:
        """Forget where the robot is: the whole map is searched, and until it is found there is no pose.

        Raises:
            ValueError: The parameter ``refine`` is off.
        """
        if not self._parameters.refine:
            raise ValueError("without fits of scans the robot cannot be found (would have worked: refine)")
        self._relocaliser.lose()
        self._counted = self._given = self.map_from_odom = None

    @property
    def lost(self) -> bool:
        """Tell whether the scans do not fit the estimated pose, and the robot was not found elsewhere."""
        return self._relocaliser.lost

    @property
    def doubtful(self) -> bool:
        """Tell whether hardly anything of the newest scan fits the map at the pose (``lost_fit``)."""
        return self._counted is not None and self.fit < self._parameters.lost_fit

    def believe(self, odom_pose: Pose2) -> None:
        """Take the pose of :meth:`set_pose` for true until a scan says better.

        Args:
            odom_pose: base_footprint in the odometry frame, at the pose that was set.
        """
        if self._given is not None and odom_pose.is_finite():
            self.map_from_odom, self._given = self._given @ odom_pose.inverse(), None

    def update(self, scan: LaserScan, laser_in_base: Transform3, odom_pose: Pose2) -> Pose2 | None:
        """Take a scan.

        Args:
            scan: The laser's own scan.
            laser_in_base: The laser's frame in base_footprint; a laser that hangs upside down is
                turned by this alone (REFERENCE 4.11).
            odom_pose: base_footprint in the odometry frame at the time of the scan.

        Returns:
            The new map_from_odom, or None: the robot has not moved, too few beams hit anything, or the
            robot is lost.
        """
        if not odom_pose.is_finite() or self._rests(odom_pose):
            return None
        p = self._parameters
        points = beam_ends(scan, laser_in_base, p.laser_min_range, p.laser_max_range)
        if len(points) < _MIN_POINTS:
            return None
        self._laser.update(points, odom_pose, len(scan.ranges))
        self._drift += self._laser.covariance
        if self._laser.broken:
            self._relocaliser.unconfirm()
            self._was_carried = True
        motion = (self._counted or self._laser.pose).inverse() @ self._laser.pose
        self.pose = self._there @ motion
        if self._counts(motion):
            self.pose = self._there = self._compare(points, motion, scan.range_max)
            self._counted, self._counted_odom, self._given = self._laser.pose, odom_pose, None
            self._drift = np.zeros((3, 3))
        self.map_from_odom = None if self._relocaliser.lost else self.pose @ odom_pose.inverse()
        return self.map_from_odom

    def _rests(self, odom_pose: Pose2) -> bool:
        previous, self._previous_odom = self._previous_odom, odom_pose
        if self._counted is None:
            self._resting = False
            return False
        self._resting = previous is not None and not _moved(
            previous, odom_pose, _REST_DISTANCE_M, _REST_ANGLE
        )
        return self._resting and not _moved(self._counted_odom, odom_pose, _SETTLE_DISTANCE_M, _SETTLE_ANGLE)

    def _counts(self, motion: Pose2) -> bool:
        p = self._parameters
        return (
            self._counted is None or self._resting or _moved(Pose2(), motion, p.update_min_d, p.update_min_a)
        )

    def _fit(self, points: NDArray[np.float64], belief: Pose2, covariance: NDArray[np.float64]) -> Match:
        p = self._parameters
        return match_scan(
            self._field,
            evenly(points, p.match_max_beams),
            belief,
            covariance,
            sigma=p.match_sigma,
            independent_beams=p.match_independent_beams,
        )

    def _compare(self, points: NDArray[np.float64], motion: Pose2, range_max: float) -> Pose2:
        """Return where the robot is by the map, after a motion since the last scan that counted."""
        if self._relocaliser.lost:
            found = self._relocaliser.look_everywhere(points, self._laser.pose)
            if found is None:
                return self._there @ motion
            self._filter.set_pose(found.pose, _FOUND_DEVIATIONS)
            self._fitted(found)
            return found.pose
        self._filter.move(motion, self._drift)
        self._filter.weigh(evenly(points, self._parameters.laser_max_beams), range_max)
        return self._estimate_and_resample(points, motion)

    def _estimate_and_resample(self, points: NDArray[np.float64], motion: Pose2) -> Pose2:
        p = self._parameters
        mean, covariance = self._filter.estimate()
        self._filter.resample()
        if not p.refine:
            self.covariance = covariance
            return mean
        # The cloud has seen this scan already and may be surer than it should be: it only guides the fit.
        floor = np.diag(np.square([p.match_prior_d, p.match_prior_d, p.match_prior_a]))
        match = self._fit(points, mean, covariance + floor)
        self.fit = match.near_fraction
        if self._resumed and match.near_fraction < p.relocalise_fit:
            self.lose()
            return mean
        self._resumed = False
        found = self._relocaliser.look(points, match, motion)
        if found:
            wider = found.covariance + np.diag(np.square(_FOUND_DEVIATIONS))
            self._filter.inject(found.pose, wider, _FOUND_SHARE)
            return self._fitted(found)
        fits = match.near_fraction >= p.match_min_near
        if not fits or _moved(mean, match.pose, p.match_max_shift, p.match_max_turn):
            self._unfit_m += math.hypot(motion.x, motion.y)
            self.covariance = covariance + self._doubt()
            return mean
        self._filter.inject(match.pose, match.covariance, p.match_inject)
        return self._fitted(match)

    def _fitted(self, match: Match) -> Pose2:
        self.fit, self.covariance = match.near_fraction, match.covariance
        self._unfit_m, self._was_carried = 0.0, False
        return match.pose

    def _doubt(self) -> NDArray[np.float64]:
        """Return what is added to the covariance while nothing fits: somebody may have carried the robot."""
        carried = np.square(INITIAL_DEVIATIONS) * self._was_carried
        return np.diag(carried + np.square(self._unfit_m * _UNFIT_DEVIATIONS))


def _moved(start: Pose2, end: Pose2, distance: float, angle: float) -> bool:
    return start.distance_to(end) >= distance or abs(normalize_angle(end.yaw - start.yaw)) >= angle
