"""The parameters of the localisation; the names are those of amcl where it has them (REFERENCE 7.7)."""

from __future__ import annotations

from dataclasses import dataclass

from florence_bt.core.errors import ConfigError


@dataclass(frozen=True, slots=True)
class LocaliserParameters:
    """How to localise.

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
        update_min_d: Metres to drive before a scan counts again.
        update_min_a: Radians to turn before a scan counts again.
        resample_interval: Updates between two resamplings.
        refine: Whether to fit the scan to the map after the filter.
        match_sigma: Spread of a beam end around the map's surface in the fit, in metres.
        match_independent_beams: How many independent beams a scan is worth in the fit.
        match_min_near: The part of the beams that must fit the map for the fit to count.
        match_prior_d: How far the fit may leave the particles at little cost, in metres.
        match_prior_a: The same for the heading, in radians.
        match_inject: The part of the particles that is drawn anew around a good fit.
        match_max_shift: Longest correction by the fit in metres.
        match_max_turn: Largest correction by the fit in radians.
        surface_offset: See ``build_likelihood_field``, in cells.
    """

    particles: int = 800
    laser_max_beams: int = 90
    match_max_beams: int = 240
    laser_min_range: float = 0.25
    laser_max_range: float = 0.0
    alpha1: float = 0.004
    alpha2: float = 0.002
    alpha3: float = 0.003
    alpha4: float = 0.001
    z_hit: float = 0.95
    z_rand: float = 0.05
    sigma_hit: float = 0.1
    likelihood_max_dist: float = 2.0
    update_min_d: float = 0.10
    update_min_a: float = 0.10
    resample_interval: int = 1
    refine: bool = True
    match_sigma: float = 0.05
    match_independent_beams: float = 60.0
    match_min_near: float = 0.4
    match_prior_d: float = 0.1
    match_prior_a: float = 0.05
    match_inject: float = 0.2
    match_max_shift: float = 0.4
    match_max_turn: float = 0.25
    surface_offset: float = 0.5

    def __post_init__(self) -> None:
        """Refuse numbers that cannot work.

        Raises:
            ConfigError: A number is outside its range.
        """
        for name, least in (
            ("particles", 10),
            ("laser_max_beams", 4),
            ("match_max_beams", 4),
            ("resample_interval", 1),
        ):
            if getattr(self, name) < least:
                raise ConfigError(f"{name} is {getattr(self, name)}", valid=[f"{least} or more"])
        for name in ("sigma_hit", "likelihood_max_dist", "match_sigma", "match_independent_beams"):
            if not getattr(self, name) > 0.0:
                raise ConfigError(f"{name} is {getattr(self, name)}", valid=["a number above 0"])
        for name in (
            "alpha1",
            "alpha2",
            "alpha3",
            "alpha4",
            "z_hit",
            "z_rand",
            "update_min_d",
            "update_min_a",
        ):
            if not getattr(self, name) >= 0.0:
                raise ConfigError(f"{name} is {getattr(self, name)}", valid=["a number from 0 on"])
