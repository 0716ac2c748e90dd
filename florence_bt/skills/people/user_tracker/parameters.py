"""The parameters of the detectors, of the tracker and of the look for a person."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from florence_bt.core.limits import CheckedParameters, Limits, NotNegative, Positive, check_order


@dataclass(frozen=True, slots=True)
class DetectorParameters(CheckedParameters):
    """The parameters of what counts as a person in a depth picture.

    Attributes:
        minimum_probability: From here on a pixel is taken to show a person.
        minimum_confidence: Mean probability of the pixels of a person, lowered by the map.
        minimum_pixels: How many of the network's answers (each for 4 x 4 pixels of 320 x 240) show a person.
        minimum_area: What they cover together, square metres.
        merge_radius: Two people are at least this far apart, metres.
        vote_spread: Standard deviation of where one pixel says the middle of the person is, metres.
        maximum_distance: People further away are left alone, metres (horizontal, from the camera).
        map_margin: What is this near to a wall or to larger furniture of the map may be that, metres.
        map_penalty: How much confidence is lost when all of a person may be something of the map.
        unknown_depth: Whose middle is further than this from everything that the map knows stands behind its
            walls, metres: a reflection in a mirror, mostly.
        unknown_penalty: How much confidence is lost then: nobody whom a look has not been sure of elsewhere.
    """

    minimum_probability: Annotated[float, Limits(0.0, 1.0, above=True)] = 0.5
    minimum_confidence: Annotated[float, Limits(0.0, 1.0)] = 0.65
    minimum_pixels: Annotated[int, Limits(1)] = 15
    minimum_area: Positive = 0.03
    merge_radius: Positive = 0.35
    vote_spread: Positive = 0.1
    maximum_distance: Positive = 4.3
    map_margin: Positive = 0.12
    map_penalty: Annotated[float, Limits(0.0, 1.0)] = 0.1
    unknown_depth: Positive = 0.3
    unknown_penalty: Annotated[float, Limits(0.0, 1.0)] = 0.25


@dataclass(frozen=True, slots=True)
class ColourParameters(CheckedParameters):
    """The parameters of what the colour detector says (docs/notes/people.md has their trial).

    Attributes:
        colour_person: From this score on it shows a person.
        colour_nobody: Below this score it shows nobody, when it is seen well.
        colour_smallest: Columns or rows that somebody must have in the colour picture to be looked at.
        colour_darkest: What is darker than this share of full brightness may be anybody.
        colour_margin: What is seen around somebody, as a share of their height (or width) on each side.
        colour_overlap: A person counts when their box and the proposed region have this intersection over
            union.
    """

    colour_person: Annotated[float, Limits(0.0, 1.0, above=True)] = 0.3
    colour_nobody: Annotated[float, Limits(0.0, 1.0)] = 0.15
    colour_smallest: Annotated[int, Limits(1)] = 64
    colour_darkest: Annotated[float, Limits(0.0, 1.0)] = 0.1
    colour_margin: Annotated[float, Limits(0.0)] = 0.2
    colour_overlap: Annotated[float, Limits(0.0, 1.0)] = 0.3

    def _check(self) -> None:
        check_order(self, ("colour_nobody", "colour_person"), equal=True)


@dataclass(frozen=True, slots=True)
class TrackerParameters(CheckedParameters):
    """The parameters of following people from picture to picture.

    Attributes:
        confirm_hits: A person counts when seen in this many ...
        confirm_window: ... of this many pictures.
        agreed_hits: In this many, when the verifier says that it is a person.
        verdict_s: With a verifier, a candidate waits this long for its verdict, seconds, and
            again after each that was against it.
        rejections: A track that was called nobody this often, and never a person, is not confirmed.
        walked: A track that has moved this far is a person anyway, metres.
        gate: Largest squared Mahalanobis distance of a detection from where a person was expected: the
            99.9 % quantile of the chi-square distribution with two degrees of freedom.
        gate_margin: Nor is a detection further than this, metres, and what return_speed covers since, from
            where the person was seen last: the covariance of somebody out of view lets a track jump to
            somebody else. Three standard deviations of a detection.
        acceleration: How much a person changes its speed, standard deviation, m/s^2.
        position_sigma: Standard deviation of a detection, metres.
        legs_sigma: Standard deviation of legs in a scan from the middle of the person, metres.
        sure: A detection of less confidence may be nobody.
        colour_sigma: Standard deviation of the distance between two colour histograms of one person; weighs
            colours against positions in the assignment.
        coast_s: An unseen person is believed in for this long, seconds; then it is lost.
        posture_window: What a person does is what most of this many pictures say that tell it.
        forget_s: A lost person keeps its device id for this long (REFERENCE 9), seconds.
        match_distance: Two colour histograms nearer than this belong to one person (REFERENCE 12.9).
        differ_distance: From here on two colour histograms never belong to one person: of 2600 pictures of
            people in coloured shirts one was further from the colours of the same person, and the median of
            other people was 0.5 to 0.6.
        return_s: A person who appears this long after somebody was last seen, seconds, may be them without
            colours ...
        return_speed: ... when they can have come there at this speed, m/s, and gate_margin more.
        return_margin: So near, metres, a lost person is taken up again at once.
        height_tolerance: Heights of one person differ by at most this much, metres, from the same distance;
            it is a lot because of heads that are hidden or beside the picture.
        blend: Share of the newest picture in the remembered colours.
        known_pictures: A person seen in fewer images is recognised only when nobody else fits.
        remembered_people: How many people are remembered by their colours.
        remember_s: For how long, seconds.
        reject_nearest: From this far away, metres, ...
        reject_farthest: ... to this far, metres, a person in full view is recognised for sure.
        reject_pictures: Where a person was seen from further away, and this many pictures from so near show
            something else, nobody counts who is seen there from further away, unless they come walking, or
            are seen better than ever before. A look of 2 s has as many, also at five pictures a second.
        reject_radius: The place is so large, metres.
        reject_s: For so long after the last picture from nearby, seconds: longer than a search of a room.
    """

    confirm_hits: Annotated[int, Limits(1)] = 3
    confirm_window: Annotated[int, Limits(1)] = 4
    agreed_hits: Annotated[int, Limits(1)] = 2
    verdict_s: NotNegative = 0.5
    rejections: Annotated[int, Limits(1)] = 3
    walked: Positive = 0.6
    gate: Positive = 13.8
    gate_margin: Positive = 0.2
    acceleration: Positive = 1.5
    position_sigma: Positive = 0.07
    legs_sigma: Positive = 0.1
    sure: Annotated[float, Limits(0.0, 1.0)] = 0.85
    colour_sigma: Positive = 0.2
    coast_s: Positive = 0.8
    posture_window: Annotated[int, Limits(1)] = 9
    forget_s: Positive = 10.0
    match_distance: Annotated[float, Limits(0.0, 1.0, above=True)] = 0.35
    differ_distance: Annotated[float, Limits(0.0, 1.0, above=True)] = 0.45
    return_s: Positive = 6.0
    return_speed: Positive = 1.0
    return_margin: Positive = 0.5
    height_tolerance: Positive = 0.5
    blend: Annotated[float, Limits(0.0, 1.0, above=True)] = 0.05
    known_pictures: Annotated[int, Limits(1)] = 15
    remembered_people: Annotated[int, Limits(1)] = 20
    remember_s: Positive = 3600.0
    reject_nearest: Positive = 1.0
    reject_farthest: Positive = 1.9
    reject_pictures: Annotated[int, Limits(1)] = 8
    reject_radius: Positive = 0.4
    reject_s: Positive = 600.0

    def _check(self) -> None:
        check_order(
            self,
            ("agreed_hits", "confirm_hits"),
            ("confirm_hits", "confirm_window"),
            ("coast_s", "forget_s"),
            ("match_distance", "differ_distance"),
            ("reject_nearest", "reject_farthest"),
            equal=True,
        )


@dataclass(frozen=True, slots=True)
class LookParameters(CheckedParameters):
    """The parameters of what counts as a person seen.

    Attributes:
        nearest: Nearer people are not measured well, metres (the Kinect's minimum range).
        farthest: People further away do not count, metres.
        settle_s: The position is averaged over this time, seconds; pictures that show nothing for so long
            are enough, too.
        minimum_pictures: How often a person must have been seen.
        certain: In most pictures of a look the confidence must have been this large, of this look or, for the
            same person, of one before, unless one person is looked for: a thing that looks like a person does
            so from one side, in some pictures, and never quite.
        uncertain_s: What is not certain after so many seconds is nobody.
        place_tolerance: A person this near to the place that was asked for may be meant, metres
            (REFERENCE 12.6).
        enough_pictures: A look at fewer pictures cannot say that nobody is there. A person who stands in view
            is confirmed in the third picture and seen often enough in the fifth.
    """

    nearest: Positive = 0.5
    farthest: Positive = 4.0
    settle_s: Positive = 0.6
    minimum_pictures: Annotated[int, Limits(1)] = 3
    certain: Annotated[float, Limits(0.0, 1.0)] = 0.78
    uncertain_s: Positive = 2.0
    place_tolerance: Positive = 0.5
    enough_pictures: Annotated[int, Limits(1)] = 5

    def _check(self) -> None:
        check_order(self, ("nearest", "farthest"))
