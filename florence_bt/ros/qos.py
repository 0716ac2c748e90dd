"""Quality of service, by what a topic is for."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy


def _profile(depth: int, *, reliable: bool = True, latched: bool = False) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


SENSOR = _profile(5, reliable=False)
"""Readings that are soon replaced: scans, pictures."""

RELIABLE = _profile(10)
"""Commands and events that must not be lost."""

LATCHED = _profile(1, latched=True)
"""States that a late subscriber needs too: the map, the tree."""

TF = _profile(100)
"""``/tf`` as in tf2."""

TF_STATIC = LATCHED
"""Publishers of ``/tf_static``."""

TF_STATIC_LISTENER = _profile(100, latched=True)
"""Subscribers of ``/tf_static``: every publisher has a latched message of its own."""
