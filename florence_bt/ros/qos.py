"""Quality of service, by what a topic is for."""

from __future__ import annotations

from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

_OWN_DEADLINE = Duration(seconds=86_400)
"""Chosen: a day, which nothing waits for. DDS lets a subscriber that asks for a deadline hear only publishers
that offer one (DDS 1.4, 2.2.3.7), and by default nobody does: so a listener tells Florence's own transforms
from those of other programs, which hear both."""


def _profile(depth: int, *, reliable: bool = True, latched: bool = False, own: bool = False) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        **({"deadline": _OWN_DEADLINE} if own else {}),
    )


NO_EVENTS = SubscriptionEventCallbacks(use_default_callbacks=False)
"""For subscriptions that end before their process does. An event of the middleware, such as a publisher with
another quality of service, that came just before then ends the process: the events executor of rclpy 7.1 lets
go of what the event needed without the interpreter's lock."""

SENSOR = _profile(5, reliable=False)
"""Readings that are soon replaced: scans, images."""

STATE = _profile(10, reliable=False)
"""Subscribers of what is published many times a second, such as odometry; see :data:`TF_LISTENER`."""

COMMAND = _profile(1, reliable=False)
"""Subscribers of velocity commands: the newest one counts. A reliable subscriber that misses one is given all
the later ones seconds after they were meant, also after the robot was stopped; see :data:`TF_LISTENER`.
"""

RELIABLE = _profile(10)
"""Commands and events that must not be lost."""

LATCHED = _profile(1, latched=True)
"""States that a late subscriber needs too: the map, the tree."""

LATCHED_BY_MANY = _profile(100, latched=True)
"""Subscribers of what several nodes keep for who comes later, such as ``diagnostics``: of a depth of one only
the last word of them all is left."""

TF = _profile(100, own=True)
"""Florence's publishers of ``/tf``, as in tf2."""

TF_LISTENER = _profile(100, reliable=False)
"""Subscribers of ``/tf``. Each sample is soon replaced by the next one. A reliable subscriber that misses one
sample is given none of the later ones until the writer's next heartbeat, which Fast DDS sends every 3 s."""

OWN_TF_LISTENER = _profile(100, reliable=False, own=True)
"""Subscribers that hear only Florence's publishers of ``/tf``."""

TF_STATIC = _profile(1, latched=True, own=True)
"""Florence's publishers of ``/tf_static``."""

TF_STATIC_LISTENER = _profile(100, latched=True)
"""Subscribers of ``/tf_static``: every publisher has a latched message of its own."""

OWN_TF_STATIC_LISTENER = _profile(100, latched=True, own=True)
"""Subscribers that hear only Florence's publishers of ``/tf_static``."""
