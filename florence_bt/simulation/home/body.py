"""The body of a person for the sensors: simple solids, with what is pushed, sat in or carried.

Measures are those of an adult of 1.72 m; lengths grow with the height, a child's breadth with it too. Bodies
are stiff: somebody who walks glides.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from florence_bt.simulation.home.flat import Colour
from florence_bt.simulation.home.person import TROUSERS, PersonSpec

_SKIN: Colour = (224, 172, 138)
_HAIR: Colour = (72, 52, 38)
_STOOL: Colour = (120, 90, 60)
_LOAD: Colour = (150, 112, 70)
_BLANKET: Colour = (226, 222, 210)
_METAL: Colour = (70, 74, 82)
"""Colours. Chosen."""

WHEELCHAIR_SEAT_M = 0.5
"""Height of its seat. Chosen."""

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class BodyPart:
    """A cylinder, a sphere (bottom to top is its diameter) or a box of a person, turned about its middle.

    Attributes:
        shape: What it is.
        x: Centre in the person's frame (x forward), metres.
        y: Centre in the person's frame (y left), metres.
        bottom: Height of its lowest point above the floor while it is upright, metres.
        top: Height of its highest point while it is upright, metres.
        size: (radius,) or half of the box's sides, metres.
        colour: Its colour.
        tilt: How far its upper end leans forward (x), radians.
        turn: The direction in which it leans, counter-clockwise from x, radians.
    """

    shape: Literal["cylinder", "sphere", "box"]
    x: float
    y: float
    bottom: float
    top: float
    size: tuple[float, ...]
    colour: Colour
    tilt: float = 0.0
    turn: float = 0.0

    def seen_from_above(self) -> tuple[float, float]:
        """Return half of its sides along and across ``turn``, metres."""
        half_x, half_y = self.size if len(self.size) == 2 else (self.size[0], self.size[0])
        if self.shape == "sphere":
            return half_x, half_y
        half_z = (self.top - self.bottom) / 2
        return abs(half_x * math.cos(self.tilt)) + abs(half_z * math.sin(self.tilt)), half_y


def body_parts(spec: PersonSpec) -> tuple[BodyPart, ...]:
    """Build the parts of the body of a person.

    Of somebody who stands it stays, below 0.6 m, within 0.18 m (sitting: 0.2 m) of the middle.
    """
    if spec.posture == "sitting":
        return tuple(_sitting(spec.shirt))
    if spec.posture == "lying":
        return tuple(_lying(spec))
    if spec.aid == "wheelchair":
        return (*_seated(spec, WHEELCHAIR_SEAT_M), *_wheelchair())
    if spec.posture == "seated":
        return tuple(_seated(spec, spec.surface))
    if spec.posture == "leaning":
        return tuple(_leaning(spec))
    return (*_upright(spec), *(_rollator() if spec.aid == "rollator" else ()), *_carried(spec))


def _build(height: float) -> float:
    """Return a child's breadth as a part of an adult's."""
    return min(1.0, height / 1.6)


def _limb(start: Point, end: Point, radius: float, colour: Colour) -> BodyPart:
    """Make a cylinder between two points."""
    length = math.dist(start, end)
    x, y, z = ((a + b) / 2 for a, b in zip(start, end, strict=True))
    dx, dy, dz = (b - a for a, b in zip(start, end, strict=True))
    return BodyPart(
        "cylinder",
        x,
        y,
        z - length / 2,
        z + length / 2,
        (radius,),
        colour,
        tilt=math.atan2(math.hypot(dx, dy), dz),
        turn=math.atan2(dy, dx),
    )


def _legs(spec: PersonSpec) -> Iterator[BodyPart]:
    hip, build = _hip(spec), _build(spec.height)
    for side in (1, -1):
        yield BodyPart("cylinder", 0.0, side * 0.095 * build, 0.0, hip, (0.065 * build,), spec.trousers)
        yield BodyPart("box", 0.04, side * 0.09 * build, 0.0, 0.07, (0.08 * build, 0.04 * build), _HAIR)


def _hip(spec: PersonSpec) -> float:
    return 0.48 * spec.height


def _upright(spec: PersonSpec) -> Iterator[BodyPart]:
    hip, shoulder, build = _hip(spec), 0.82 * spec.height, _build(spec.height)
    yield from _legs(spec)
    hands = _hands(spec)
    for side in (1, -1):
        if hands is not None:
            x, y, z = hands
            yield _limb(
                (0.0, side * 0.2 * build, shoulder - 0.04), (x, side * y, z), 0.042 * build, spec.shirt
            )
            continue
        yield BodyPart("cylinder", 0.0, side * 0.2 * build, hip, shoulder, (0.045 * build,), spec.shirt)
        yield BodyPart("cylinder", 0.02, side * 0.2 * build, hip - 0.12 * build, hip, (0.04 * build,), _SKIN)
    yield BodyPart("box", 0.0, 0.0, hip, shoulder, (0.11 * build, 0.16 * build), spec.shirt)
    yield from _head(spec.height, build)


def _hands(spec: PersonSpec) -> Point | None:
    """Return where both hands hold something before the body (y of the left one), None when they hang."""
    if spec.aid == "rollator":
        return 0.26, 0.24, min(0.9, 0.55 * spec.height)
    return (0.26, 0.2, _hip(spec) + 0.12) if spec.load == "box" else None


def _head(top: float, build: float, x: float = 0.0) -> Iterator[BodyPart]:
    size = 0.6 + 0.4 * build
    yield BodyPart("cylinder", x, 0.0, top - 0.32 * size, top - 0.2 * size, (0.055 * size,), _SKIN)
    yield BodyPart("sphere", x, 0.0, top - 0.22 * size, top, (0.11 * size,), _SKIN)
    yield BodyPart("cylinder", x - 0.02, 0.0, top - 0.1 * size, top - 0.01 * size, (0.1 * size,), _HAIR)


def _sitting(shirt: Colour) -> Iterator[BodyPart]:
    seat, shoulder, height = 0.45, 0.98, 1.26
    yield BodyPart("cylinder", -0.03, 0.0, 0.0, seat, (0.15,), _STOOL)
    for side in (1, -1):
        yield BodyPart("cylinder", 0.12, side * 0.085, 0.0, seat, (0.05,), TROUSERS)
        yield BodyPart("box", 0.05, side * 0.08, seat, seat + 0.12, (0.1, 0.045), TROUSERS)
        yield BodyPart("cylinder", -0.02, side * 0.195, 0.62, shoulder, (0.045,), shirt)
    yield BodyPart("box", -0.03, 0.0, seat, shoulder, (0.1, 0.15), shirt)
    yield from _head(height, 1.0)


def _leaning(spec: PersonSpec) -> Iterator[BodyPart]:
    """Build a person who bends forward over something, the arms hanging."""
    hip, build, lean = _hip(spec), _build(spec.height), 0.38
    trunk = 0.36 * spec.height
    yield from _legs(spec)
    shoulder = (trunk * math.sin(lean), hip + trunk * math.cos(lean))
    for side in (1, -1):
        top = (shoulder[0], side * 0.2 * build, shoulder[1] - 0.04)
        yield _limb(top, (shoulder[0] + 0.08, side * 0.2 * build, hip), 0.045 * build, spec.shirt)
    yield _trunk(hip, trunk, lean, build, spec.shirt)
    yield from _head(hip + 0.5 * spec.height * math.cos(lean), build, 0.46 * spec.height * math.sin(lean))


def _trunk(hip: float, length: float, lean: float, build: float, shirt: Colour) -> BodyPart:
    """Make a trunk that leans about the hips, which are at x = 0."""
    x, middle = length / 2 * math.sin(lean), hip + length / 2 * math.cos(lean)
    half = (0.11 * build, 0.16 * build)
    return BodyPart("box", x, 0.0, middle - length / 2, middle + length / 2, half, shirt, tilt=lean)


def knee_reach(height: float) -> float:
    """Return how far the knees of somebody who sits are before the hips, metres."""
    return 0.42 * height / 1.72


def _seated(spec: PersonSpec, seat: float) -> Iterator[BodyPart]:
    """Build a person who leans back, the hands in the lap; a child's feet do not reach the floor."""
    long, build, lean = spec.height / 1.72, _build(spec.height), -0.18
    trunk, knee, thigh = 0.53 * long, knee_reach(spec.height), seat + 0.07 * build
    foot = max(0.07, thigh - 0.45 * long)
    shoulder = (0.48 * long * math.sin(lean), seat + 0.48 * long * math.cos(lean))
    for side in (1, -1):
        y = side * 0.1 * build
        yield _limb((0.0, y, thigh), (knee, y, thigh), 0.07 * build, spec.trousers)
        yield _limb((knee, y, thigh), (knee + 0.04, y, foot), 0.052 * build, spec.trousers)
        yield BodyPart("box", knee + 0.1, y, foot - 0.07, foot, (0.11 * build, 0.045 * build), _HAIR)
        elbow = (0.04, side * 0.23 * build, seat + 0.24 * long)
        yield _limb((shoulder[0], side * 0.2 * build, shoulder[1]), elbow, 0.045 * build, spec.shirt)
        yield _limb(elbow, (0.28 * long, side * 0.1 * build, thigh + 0.1 * build), 0.038 * build, _SKIN)
    yield _trunk(seat, trunk, lean, build, spec.shirt)
    yield from _head(seat + 0.52 * spec.height, build, 0.6 * long * math.sin(lean))


def _lying(spec: PersonSpec) -> Iterator[BodyPart]:
    """Build a person who lies on the back, the head towards x; in a bed under a blanket."""
    height, build, low = spec.height, _build(spec.height), spec.surface
    for side in (1, -1):
        y, ankle = side * 0.09 * build, -0.46 * height
        yield _limb(
            (0.0, y, low + 0.075 * build), (ankle, y, low + 0.06 * build), 0.062 * build, spec.trousers
        )
        yield BodyPart("box", ankle - 0.02, y, low, low + 0.22 * build, (0.04, 0.045 * build), _HAIR)
        y = side * 0.21 * build
        yield _limb((0.31 * height, y, low + 0.06), (0.0, y, low + 0.05), 0.043 * build, spec.shirt)
    yield BodyPart(
        "box", 0.16 * height, 0.0, low, low + 0.21 * build, (0.18 * height, 0.16 * build), spec.shirt
    )
    size = 0.6 + 0.4 * build
    middle = 0.5 * height - 0.11 * size
    yield BodyPart("sphere", middle, 0.0, low + 0.02, low + 0.02 + 0.22 * size, (0.11 * size,), _SKIN)
    yield BodyPart("sphere", middle + 0.015, 0.0, low, low + 0.21 * size, (0.105 * size,), _HAIR)
    if low > 0.0:
        length = (0.72 * height + 0.05) / 2
        yield BodyPart("box", 0.22 * height - length, 0.0, low, low + 0.24 * build, (length, 0.36), _BLANKET)


def _wheelchair() -> Iterator[BodyPart]:
    seat = WHEELCHAIR_SEAT_M
    for side in (1, -1):
        yield _limb((-0.05, side * 0.27, 0.3), (-0.05, side * 0.3, 0.3), 0.3, _METAL)
        yield _limb((0.36, side * 0.2, 0.08), (0.36, side * 0.23, 0.08), 0.08, _METAL)
        yield _limb((-0.24, side * 0.21, 0.92), (-0.38, side * 0.21, 0.92), 0.018, _METAL)
        yield BodyPart("box", 0.02, side * 0.26, seat + 0.18, seat + 0.21, (0.18, 0.025), _METAL)
    yield BodyPart("box", 0.0, 0.0, seat - 0.06, seat, (0.22, 0.23), _METAL)
    yield BodyPart("box", -0.25, 0.0, seat - 0.06, 0.95, (0.02, 0.23), _METAL)
    yield BodyPart("box", 0.5, 0.0, 0.05, 0.08, (0.1, 0.18), _METAL)


def _rollator() -> Iterator[BodyPart]:
    for side in (1, -1):
        y = side * 0.27
        yield _limb((0.22, y, 0.1), (0.3, side * 0.25, 0.9), 0.016, _METAL)
        yield _limb((0.56, y, 0.1), (0.34, side * 0.25, 0.7), 0.016, _METAL)
        for x in (0.22, 0.56):
            yield _limb((x, y - 0.015, 0.1), (x, y + 0.015, 0.1), 0.1, _METAL)
        yield _limb((0.18, side * 0.24, 0.9), (0.32, side * 0.24, 0.9), 0.02, _METAL)
    yield BodyPart("box", 0.4, 0.0, 0.54, 0.58, (0.12, 0.24), _METAL)
    yield BodyPart("box", 0.44, 0.0, 0.32, 0.5, (0.1, 0.17), _METAL)


def _carried(spec: PersonSpec) -> Iterator[BodyPart]:
    hip = _hip(spec)
    if spec.load == "bag":
        low = max(0.1, hip - 0.5)
        yield BodyPart("box", 0.02, -0.27, low, hip - 0.14, (0.17, 0.06), _LOAD)
    elif spec.load == "box":
        yield BodyPart("box", 0.33, 0.0, hip + 0.04, hip + 0.3, (0.15, 0.22), _LOAD)
