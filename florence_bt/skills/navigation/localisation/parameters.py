"""The parameters of the localisation; the names are those of amcl where it has them (REFERENCE 7.7)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from florence_bt.core.limits import CheckedParameters, Finite, Limits, NotNegative, Positive, check_order


@dataclass(frozen=True, slots=True)
class LocaliserParameters(CheckedParameters):
    """The parameters of localisation.

    The motion noise is smaller than amcl's default: the base has a gyro.

    Attributes:
        particles: How many poses are followed.
        laser_max_beams: Beams per scan that weigh the particles, evenly chosen.
        match_max_beams: Beams per scan for the final fit.
        laser_min_range: Nearer beams are ignored: the robot's own structure, in metres.
        laser_max_range: Farther beams are ignored, in metres; 0 takes the scan's own limit.
        alpha1: Variance of turning per squared turn (rad^2 / rad^2).
        alpha2: Variance of turning per squared way (rad^2 / m^2).
        alpha3: Variance of the way per squared way.
        alpha4: Variance of the way per squared turn (m^2 / rad^2).
        z_hit: Weight of the measured surface.
        z_rand: Weight of anything else.
        sigma_hit: Spread of a beam end around the surface in metres.
        likelihood_max_dist: Where distances to surfaces are cut, in metres.
        match_least_fit: A scan says nothing when the map explains a smaller part of it at the best particle.
        match_full_fit: From this part on its likelihood counts in full, and between the two in proportion.
        update_min_d: Metres to drive before a scan counts again.
        update_min_a: Radians to turn before a scan counts again.
        resample_interval: Updates between two resamplings.
        refine: Whether to fit the scan to the map after the filter.
        match_sigma: Spread of a beam end around the map's surface in the fit, in metres.
        match_independent_beams: How many independent beams a scan is worth in the fit.
        match_min_near: The part of the beams that must fit the map for the fit to count.
        match_prior_d: How far the fit may leave the particles at little cost, in metres.
        match_prior_a: The same for the heading, in radians.
        match_inject: The part of the particles that is drawn again around a good fit.
        match_max_shift: Longest correction by the fit in metres.
        match_max_turn: Largest correction by the fit in radians.
        surface_offset: See ``build_likelihood_field``, in cells.
        relocalise_fit: The robot is looked for elsewhere when a smaller part of the beams fits the map.
        relocalise_gain: It is nearby when so much more of the beams fits there.
        lost_fit: When a smaller part fits for many scans, and nothing better is found, it is lost.
    """

    particles: Annotated[int, Limits(10)] = 800
    laser_max_beams: Annotated[int, Limits(4)] = 90
    match_max_beams: Annotated[int, Limits(4)] = 240
    laser_min_range: NotNegative = 0.25
    laser_max_range: NotNegative = 0.0
    alpha1: NotNegative = 0.004
    alpha2: NotNegative = 0.002
    alpha3: NotNegative = 0.003
    alpha4: NotNegative = 0.001
    z_hit: NotNegative = 0.95
    z_rand: NotNegative = 0.05
    sigma_hit: Positive = 0.1
    likelihood_max_dist: Positive = 2.0
    match_least_fit: Annotated[float, Limits(0.0, 1.0)] = 0.4
    match_full_fit: Annotated[float, Limits(0.0, 1.0)] = 0.7
    update_min_d: NotNegative = 0.10
    update_min_a: NotNegative = 0.10
    resample_interval: Annotated[int, Limits(1)] = 1
    refine: bool = True
    match_sigma: Positive = 0.05
    match_independent_beams: Positive = 60.0
    match_min_near: NotNegative = 0.6
    match_prior_d: NotNegative = 0.1
    match_prior_a: NotNegative = 0.05
    match_inject: NotNegative = 0.2
    match_max_shift: NotNegative = 0.4
    match_max_turn: NotNegative = 0.25
    surface_offset: Finite = 0.5
    relocalise_fit: Annotated[float, Limits(0.0, 1.0)] = 0.65
    relocalise_gain: Annotated[float, Limits(0.0, 1.0)] = 0.15
    lost_fit: Annotated[float, Limits(0.0, 1.0)] = 0.35

    def _check(self) -> None:
        check_order(self, ("match_least_fit", "match_full_fit"))
