"""filter_user_tracker: people without those who are lost or out of the Kinect's range."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from florence_bt.core.sensing import TrackedUser

ZERO_RADIUS = 0.5
"""Metres; the minimum range of the Kinect."""
FARTHEST = 4.5
OLDEST_S = 0.5


def filter_users(
    users: Sequence[TrackedUser],
    ages_s: Mapping[int, float] | None = None,
    *,
    zero_radius: float = ZERO_RADIUS,
    farthest: float = FARTHEST,
    oldest_s: float = OLDEST_S,
) -> tuple[TrackedUser, ...]:
    """Drop everybody who is not really there; the order stays.

    Args:
        users: The tracked people.
        ages_s: How old the position of a person is, by device id, seconds; 0 where it is not given.
        zero_radius: Nearer people are lost, metres.
        farthest: People further away are dropped, metres.
        oldest_s: People with an older position are dropped, seconds.

    Source:
        REFERENCE 12.9; document, section 4.2.
    """
    ages = ages_s or {}
    return tuple(
        user
        for user in users
        if math.isfinite(user.x)
        and math.isfinite(user.y)
        and zero_radius <= user.distance <= farthest
        and ages.get(user.device_id, 0.0) <= oldest_s
    )
