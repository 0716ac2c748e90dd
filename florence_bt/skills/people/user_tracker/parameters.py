"""The parameters of the detector, of the tracker and of the look for a person."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from florence_bt.core.limits import Limits, Positive, check_limits, check_order


@dataclass(frozen=True, slots=True)
class DetectorParameters:
    """What a person looks like to a depth camera at the height of a knee.

    Attributes:
        minimum_height: Lower points are floor, metres.
        maximum_height: Nobody is taller, metres.
        minimum_top: Nobody is smaller, also when sitting, metres.
        minimum_clipped_top: As above when the upper edge of the picture cuts the top off, metres.
        minimum_cut_top: As above when also a side of the picture cuts the body: above the back of a chair,
            metres.
        tall_height: Points from here on make a blob: above tables, seats and arm rests, metres.
        maximum_depth: Depths from here on are too coarse to judge a shape, metres.
        maximum_distance: People further away are left alone, metres (horizontal, from the camera).
        cell: Size of a plan-view cell, metres.
        minimum_cell_points: Tall points that a cell needs to count.
        minimum_points: Points that a body needs.
        minimum_width: Narrowest body, metres.
        maximum_width: Widest body, arms included, metres.
        maximum_thickness: Largest extent of the visible body along the line of sight, metres.
        usual_half_width: Half of a usual body, for the side that cannot be seen, metres.
        usual_bulge: Half the thickness of a usual body, metres.
        cut_distance: Only nearer people may be cut by the side of the picture, metres: with steps of 45
            degrees the camera sees everybody further away as a whole.
        minimum_cut_bulge: As minimum_bulge when a side of the picture cuts the body, metres.
        maximum_cut_bulge: As maximum_bulge in that case, metres.
        minimum_bulge: A front that is flatter than this is furniture, metres.
        maximum_bulge: A front that bulges more than this is a corner, metres.
        maximum_slope: Steepest turn of the front against the line of sight (1 is 45 degrees).
        maximum_residual: Largest root mean square distance from an elliptic front, metres, for a near body.
        residual_growth: What the above grows by for each square metre of squared distance (the depth noise of
            the Kinect grows with the square of the distance), 1/metre.
        head_height: Height of the part that is judged as head, metres.
        chest_top: Shoulders of a tall person begin about here, metres.
        seat_height: Below this a sitting person may be nothing but legs, metres.
        minimum_shape_spread: Smallest change of width or front from low to high, metres: posts have none.
        minimum_head_width: Narrowest head, metres.
        maximum_head_width: Widest head, metres.
        maximum_head_share: Largest ratio of the width of the head to that of the body.
        minimum_continuity: Share of the visible height layers that the body must fill.
        map_halo: Twice as far or so: what is left of a mapped thing at its rim, metres.
        maximum_halo_share: A blob with a larger share of points in the halo is such a rest.
        map_margin: What is this near to a wall or to larger furniture of the map belongs to the map, metres.
    """

    minimum_height: Positive = 0.1
    maximum_height: Positive = 2.0
    minimum_top: Positive = 1.0
    minimum_clipped_top: Positive = 0.86
    minimum_cut_top: Positive = 0.94
    tall_height: Positive = 0.78
    maximum_depth: Positive = 4.2
    maximum_distance: Positive = 4.0
    cell: Positive = 0.05
    minimum_cell_points: Annotated[int, Limits(1)] = 2
    minimum_points: Annotated[int, Limits(1)] = 80
    minimum_width: Positive = 0.18
    maximum_width: Positive = 0.75
    maximum_thickness: Positive = 0.55
    usual_half_width: Positive = 0.21
    usual_bulge: Positive = 0.14
    cut_distance: Positive = 1.9
    minimum_cut_bulge: Positive = 0.08
    maximum_cut_bulge: Positive = 0.2
    minimum_bulge: Positive = 0.045
    maximum_bulge: Positive = 0.38
    maximum_slope: Positive = 1.2
    maximum_residual: Positive = 0.03
    residual_growth: Positive = 0.001
    head_height: Positive = 0.2
    chest_top: Positive = 1.45
    seat_height: Positive = 0.5
    minimum_shape_spread: Positive = 0.034
    minimum_head_width: Positive = 0.08
    maximum_head_width: Positive = 0.34
    maximum_head_share: Positive = 0.8
    minimum_continuity: Positive = 0.8
    map_halo: Positive = 0.22
    maximum_halo_share: Positive = 0.7
    map_margin: Positive = 0.12

    def __post_init__(self) -> None:
        check_limits(self)
        check_order(
            self,
            ("minimum_height", "tall_height"),
            ("seat_height", "tall_height"),
            ("tall_height", "minimum_top"),
            ("minimum_top", "maximum_height"),
            ("minimum_width", "maximum_width"),
            ("minimum_bulge", "maximum_bulge"),
            ("minimum_head_width", "maximum_head_width"),
        )


@dataclass(frozen=True, slots=True)
class TrackerParameters:
    """How people are followed from picture to picture.

    Attributes:
        confirm_hits: A person counts when seen in this many ...
        confirm_window: ... of this many pictures.
        gate: A person is not further than this from where it was expected, metres.
        acceleration: How much a person changes its speed, standard deviation, m/s^2.
        position_sigma: Standard deviation of a detection, metres.
        coast_s: An unseen person is believed in for this long, seconds; then it is lost.
        forget_s: A lost person keeps its device id for this long (REFERENCE 9), seconds.
        match_distance: Two colour histograms nearer than this belong to one person (REFERENCE 12.9).
        blend: Share of the newest picture in the remembered colours.
        remembered_people: How many people are remembered by their colours.
        remember_s: For how long, seconds.
    """

    confirm_hits: Annotated[int, Limits(1)] = 3
    confirm_window: Annotated[int, Limits(1)] = 4
    gate: Positive = 0.7
    acceleration: Positive = 1.0
    position_sigma: Positive = 0.05
    coast_s: Positive = 0.6
    forget_s: Positive = 10.0
    match_distance: Annotated[float, Limits(0.0, 1.0, above=True)] = 0.35
    blend: Annotated[float, Limits(0.0, 1.0, above=True)] = 0.05
    remembered_people: Annotated[int, Limits(1)] = 20
    remember_s: Positive = 3600.0

    def __post_init__(self) -> None:
        check_limits(self)
        check_order(self, ("confirm_hits", "confirm_window"), ("coast_s", "forget_s"), equal=True)


@dataclass(frozen=True, slots=True)
class LookParameters:
    """When a person counts as seen.

    Attributes:
        nearest: Nearer people are not measured well, metres (the Kinect's minimum range).
        farthest: People further away do not count, metres.
        settle_s: The position is averaged over this time, seconds.
        minimum_pictures: How often a person must have been seen.
        enough_pictures: A look at fewer pictures cannot say that nobody is there. A person who stands in view
            is confirmed in the third picture and seen often enough in the fifth.
    """

    nearest: Positive = 0.5
    farthest: Positive = 4.0
    settle_s: Positive = 0.6
    minimum_pictures: Annotated[int, Limits(1)] = 3
    enough_pictures: Annotated[int, Limits(1)] = 5

    def __post_init__(self) -> None:
        check_limits(self)
        check_order(self, ("nearest", "farthest"))
