"""Places at which people were seen, from the frames of the user tracker."""

from __future__ import annotations

import math

from florence_bt.core.geometry import Point2
from florence_bt.core.transforms import HISTORY_S, TransformBuffer, TransformUnavailable
from florence_bt.skills.navigation.navigate.navigator import Navigator

_USER_FRAME = "user_"
"""The frame of a person is this and their persistent id."""


def see_people(navigator: Navigator, buffer: TransformBuffer, odom_frame: str, now: float) -> None:
    """Tell the navigator where people were seen lately.

    Args:
        navigator: It.
        buffer: Has a frame for each person.
        odom_frame: The frame that the navigator knows people in.
        now: Seconds.
    """
    oldest = now - HISTORY_S
    seen: list[tuple[float, Point2]] = []
    for frame in buffer.frames():
        user_id, stamp = frame.removeprefix(_USER_FRAME), buffer.latest_stamp(frame)
        if user_id == frame or not user_id.isdecimal() or stamp is None or stamp < oldest:
            continue  # of all who were ever seen there are frames
        try:
            place = buffer.lookup_pose(odom_frame, frame, stamp)
        except TransformUnavailable:
            continue  # it overtook the pose of the robot, or is old
        navigator.saw_person(stamp, int(user_id), place.x, place.y)
        seen.append((stamp, (place.x, place.y)))
    newest = max((stamp for stamp, _ in seen), default=-math.inf)
    navigator.saw_people(newest, [place for stamp, place in seen if stamp == newest])
