"""The tracked people as markers, for RViz: a body for each, and their id with what they do."""

from __future__ import annotations

from collections.abc import Sequence

from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from florence_bt.core.sensing import TrackedUser
from florence_bt.ros.conversions import stamp_to_ros

WIDTH_M, LYING_WIDTH_M = 0.4, 1.2
"""Width of a body, and of a disc for who lies, metres."""
UNKNOWN_HEIGHT_M = 1.6
"""Height of a body while that of the person is not known. Chosen."""
_TEXT_M = 0.2
_BODY = ColorRGBA(r=0.15, g=0.45, b=0.85, a=0.7)
_LYING = ColorRGBA(r=0.9, g=0.2, b=0.15, a=0.8)
_TEXT = ColorRGBA(r=1.0, g=1.0, b=1.0, a=1.0)
"""Height of the letters, and the colours. Chosen."""


def markers_of(users: Sequence[TrackedUser], frame: str, stamp: float) -> MarkerArray:
    """Make the markers of some people; viewers drop those of earlier messages.

    Args:
        users: In the frame.
        frame: Its name.
        stamp: When they were seen, seconds.
    """
    clear = Marker(action=Marker.DELETEALL)
    clear.header.frame_id = frame
    clear.header.stamp = stamp_to_ros(stamp)
    return MarkerArray(markers=[clear, *(part for user in users for part in _markers(user, clear.header))])


def _markers(user: TrackedUser, header: object) -> tuple[Marker, Marker]:
    lying = user.posture == "lying"
    height = user.height or UNKNOWN_HEIGHT_M
    body = Marker(
        header=header, ns="user", id=user.user_id, type=Marker.CYLINDER, color=_LYING if lying else _BODY
    )
    body.scale.x = body.scale.y = LYING_WIDTH_M if lying else WIDTH_M
    body.scale.z = height
    text = Marker(header=header, ns="user_text", id=user.user_id, type=Marker.TEXT_VIEW_FACING, color=_TEXT)
    text.text = f"{user.user_id} {user.posture}"
    text.scale.z = _TEXT_M
    for marker, z in ((body, height / 2), (text, height + _TEXT_M)):
        marker.pose.position.x, marker.pose.position.y, marker.pose.position.z = user.x, user.y, z
        marker.pose.orientation.w = 1.0
    return body, text
