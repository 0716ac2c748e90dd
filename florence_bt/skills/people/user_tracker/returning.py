"""The match of somebody who appears with somebody who was lost: by place and time, height and posture."""

from __future__ import annotations

import math
from dataclasses import dataclass

from florence_bt.core.sensing import TrackedUser
from florence_bt.skills.people.user_tracker.detector import Detection
from florence_bt.skills.people.user_tracker.parameters import TrackerParameters

SEEN_HIGHER = 0.4
"""Metres that the Kinect sees higher for each metre further away: the tangent of half its vertical field of
view (REFERENCE 5.4). Nearby it cuts off heads."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """A person as they were seen at a moment.

    Attributes:
        time: Seconds.
        user: Position and velocity in a frame that does not jump; posture, height, and distance from the
            camera. The ids do not count.
        surest: The greatest confidence with which they had been seen by then.
    """

    time: float
    user: TrackedUser
    surest: float = 0.0


def away(lost: Sighting, came: Sighting) -> float:
    """Return the metres between two sightings."""
    return math.hypot(came.user.x - lost.user.x, came.user.y - lost.user.y)


def reach(seconds: float, params: TrackerParameters) -> float:
    """Return the distance in metres within which somebody can be seen so much later than they were last."""
    return params.return_speed * max(0.0, seconds) + params.gate_margin


def walked_share(lost: Sighting, came: Sighting, params: TrackerParameters) -> float:
    """Return the distance as a share of what could be walked meanwhile; above 1 it is too far."""
    return away(lost, came) / reach(came.time - lost.time, params)


def may_return(lost: Sighting, came: Sighting, params: TrackerParameters) -> bool:
    """Tell whether place, time, height, posture and confidence let somebody be the one who was lost."""
    return (
        0.0 < came.time - lost.time <= params.return_s
        and walked_share(lost, came, params) <= 1.0
        and not is_doubtful(lost, came.surest, away(lost, came), params)
        and not contradict(lost.user, came.user, params.height_tolerance)
    )


def is_doubtful(lost: Sighting, confidence: float, away_m: float, params: TrackerParameters) -> bool:
    """Tell whether the place of somebody who was nearby is not to be believed.

    From half a metre away the camera shows a part of them. The detector may take that, or a chair behind
    them, for somebody half a metre beside, with less confidence than it had.

    Args:
        lost: How they were seen last.
        confidence: Of what is seen now.
        away_m: How far that is from their place, metres.
        params: How people are followed.
    """
    was_sure = lost.surest >= params.sure and lost.user.distance < params.reject_nearest
    return was_sure and confidence < params.sure and away_m > params.gate_margin


def contradict(one: TrackedUser | Detection, other: TrackedUser | Detection, tolerance: float) -> bool:
    """Tell whether heights or postures cannot be those of one person.

    Within seconds nobody lies down or gets up. A nearer person may look lower: the picture ends above.
    """
    if "unknown" in (one.posture, other.posture):
        return False
    if (one.posture == "lying") != (other.posture == "lying"):
        return True
    if one.posture != other.posture or not one.height or not other.height:
        return False
    near, far = sorted((one, other), key=lambda user: user.distance)
    more = far.height - near.height
    return not -tolerance <= more <= tolerance + SEEN_HIGHER * (far.distance - near.distance)
