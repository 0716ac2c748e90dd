"""Zones of the map as messages."""

from __future__ import annotations

from collections.abc import Iterable

from florence_interfaces.msg import Zone as ZoneMsg
from florence_interfaces.msg import Zones as ZonesMsg
from geometry_msgs.msg import Point32, Polygon
from std_msgs.msg import Header

from florence_bt.core.zones import KEEP_OUT, SLOW, Zone

_KINDS = {KEEP_OUT: ZoneMsg.KEEP_OUT, SLOW: ZoneMsg.SLOW}
_KINDS_BY_NUMBER = {number: kind for kind, number in _KINDS.items()}


def zones_to_ros(zones: Iterable[Zone], header: Header) -> ZonesMsg:
    """Convert all zones of a map; the header names its frame."""
    return ZonesMsg(
        header=header,
        zones=[
            ZoneMsg(
                label=zone.label,
                kind=_KINDS[zone.kind],
                area=Polygon(points=[Point32(x=x, y=y) for x, y in zone.polygon]),
                speed_limit=100.0 * zone.speed_limit if zone.is_share else zone.speed_limit,
                percentage=zone.is_share,
            )
            for zone in zones
        ],
    )


def zones_from_ros(message: ZonesMsg) -> tuple[Zone, ...]:
    """Convert all zones of a map; the message has been checked."""
    return tuple(
        Zone(
            zone.label,
            _KINDS_BY_NUMBER[zone.kind],
            tuple((point.x, point.y) for point in zone.area.points),
            zone.speed_limit / 100.0 if zone.percentage else zone.speed_limit,
            zone.percentage,
        )
        for zone in message.zones
    )
