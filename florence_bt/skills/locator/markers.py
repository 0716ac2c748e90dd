"""The hotspots as markers, for RViz and the page: an arrow each, its label, and the edge of a room."""

from __future__ import annotations

from collections.abc import Iterator

from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from florence_bt.core.geometry import Pose2
from florence_bt.ros.conversions import pose_from_ros, pose_to_ros
from florence_bt.skills.locator.hotspots import KINDS, Hotspot, Hotspots

ARROW_M, TEXT_M, EDGE_M = 0.4, 0.25, 0.03
"""Length of an arrow, height of a letter, width of an edge, metres."""
_LABEL, _EDGE = "label", "edge"
_PLACE = ColorRGBA(r=0.1, g=0.5, b=0.35, a=0.9)
_TEXT = ColorRGBA(r=0.1, g=0.1, b=0.1, a=1.0)


def hotspots_to_ros(hotspots: Hotspots, header: Header) -> MarkerArray:
    """Make the markers of all hotspots; viewers drop those of earlier messages.

    The namespace of an arrow is the hotspot's kind and its text the label; the edge of a room has its id.
    """
    clear = Marker(header=header, action=Marker.DELETEALL)
    parts = (part for number, spot in enumerate(hotspots) for part in _markers(number, spot, header))
    return MarkerArray(markers=[clear, *parts])


def _markers(number: int, spot: Hotspot, header: Header) -> Iterator[Marker]:
    arrow = Marker(header=header, ns=spot.kind, id=number, type=Marker.ARROW, color=_PLACE, text=spot.label)
    arrow.pose = pose_to_ros(spot.pose)
    arrow.scale.x, arrow.scale.y, arrow.scale.z = ARROW_M, ARROW_M / 5, ARROW_M / 5
    yield arrow
    label = Marker(header=header, ns=_LABEL, id=number, type=Marker.TEXT_VIEW_FACING, color=_TEXT)
    label.text, label.scale.z = spot.label, TEXT_M
    label.pose = pose_to_ros(Pose2(spot.pose.x, spot.pose.y))
    label.pose.position.z = TEXT_M
    yield label
    if spot.polygon:
        edge = Marker(header=header, ns=_EDGE, id=number, type=Marker.LINE_STRIP, color=_PLACE)
        edge.pose, edge.scale.x = pose_to_ros(Pose2()), EDGE_M
        edge.points = [Point(x=float(x), y=float(y)) for x, y in (*spot.polygon, spot.polygon[0])]
        yield edge


def hotspots_from_ros(message: MarkerArray) -> Hotspots:
    """Return the hotspots that markers show; markers of others, and poses that are none, are passed over."""
    edges = {
        each.id: tuple((point.x, point.y) for point in each.points[:-1])
        for each in message.markers
        if each.ns == _EDGE
    }
    return Hotspots(
        Hotspot(each.text, pose_from_ros(each.pose), each.ns, edges.get(each.id, ()))
        for each in message.markers
        if each.ns in KINDS and pose_from_ros(each.pose).is_finite()
    )
