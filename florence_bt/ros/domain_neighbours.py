"""Whether another process may be in the ROS domain of this one, by the UDP sockets of this machine.

Discovery cannot tell that nobody is there: somebody may only be slow to answer. But whoever is in a domain
has bound ports of it (DDSI-RTPS 2.2, 9.6.1), and the kernel lists those of all users. Where no other machine
can reach us, no such port means that nobody is there.
"""

from __future__ import annotations

import os
from pathlib import Path

from florence_bt.ros.environment import Reach

_FIRST, _OF_A_DOMAIN = 7400, 250
_SOCKETS = Path("/proc/net/udp")


class DomainNeighbours:
    """Looks for other processes in our domain. Make it before ROS starts, and call :meth:`started` then."""

    def __init__(self) -> None:
        self._before = _domain_ports()
        self._own: frozenset[int] | None = None

    def started(self, reach: Reach) -> None:
        """Take the ports that are bound now for our own.

        Args:
            reach: Who can reach our nodes.
        """
        self._own = _domain_ports() if reach.this_machine and self._before == frozenset() else None

    def certainly_none(self) -> bool:
        """Tell whether it is certain that nobody else is in our domain."""
        return self._own is not None and _domain_ports() == self._own


def _domain_ports() -> frozenset[int] | None:
    """Return the bound UDP ports of our domain; None where they cannot be known."""
    try:
        first = _FIRST + _OF_A_DOMAIN * int(os.environ.get("ROS_DOMAIN_ID") or "0")
        _, *lines = _SOCKETS.read_text(encoding="ascii").splitlines()
    except (OSError, ValueError):
        return None
    # 4711: 0100007F:1CF2 00000000:0000 07 ...
    ports = (int(line.split()[1].rpartition(":")[2], 16) for line in lines)
    return frozenset(port for port in ports if first <= port < first + _OF_A_DOMAIN)
