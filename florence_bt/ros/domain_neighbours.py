"""Other processes in the ROS domain of this one, by the UDP sockets of this machine.

Discovery cannot tell that nobody is there: somebody may only be slow to answer. But whoever is in a domain
has bound ports of it (DDSI-RTPS 2.2, 9.6.1), and the kernel lists those of all users. Where no other machine
can reach us, no such port means that nobody is there.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from florence_bt.ros.environment import Reach

_FIRST, _OF_A_DOMAIN = 7400, 250
"""The first port of RTPS, and how many a domain has: PB and DG of the DDS interoperability protocol, 9.6."""
_SOCKETS, _OPEN_FILES = Path("/proc/net/udp"), Path("/proc/self/fd")


class DomainNeighbours:
    """Looks for other processes in our domain. Make it before ROS starts, and call :meth:`started` then."""

    def __init__(self) -> None:
        self._before = _domain_sockets()
        self._own: frozenset[str] | None = None

    def started(self, reach: Reach) -> None:
        """Take the sockets that this process has now for those of our nodes.

        Args:
            reach: Who can reach our nodes.
        """
        sockets = _domain_sockets() if reach.this_machine and self._before == frozenset() else None
        self._own = None if sockets is None else sockets.intersection(_own_sockets())

    def certainly_none(self) -> bool:
        """Tell whether it is certain that nobody else is in our domain."""
        return self._own is not None and _domain_sockets() == self._own


def _domain_sockets() -> frozenset[str] | None:
    """Return the inodes of the UDP sockets with ports of our domain; None where they cannot be known."""
    try:
        first = _FIRST + _OF_A_DOMAIN * int(os.environ.get("ROS_DOMAIN_ID") or "0")
        _, *lines = _SOCKETS.read_text(encoding="ascii").splitlines()
    except (OSError, ValueError):
        return None
    # 4711: 0100007F:1CF2 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000  0 98765 ...
    sockets = ((int(parts[1].rpartition(":")[2], 16), parts[9]) for parts in map(str.split, lines))
    return frozenset(inode for port, inode in sockets if first <= port < first + _OF_A_DOMAIN)


def _own_sockets() -> Iterator[str]:
    """Yield the inodes of the sockets of this process."""
    for file in _OPEN_FILES.iterdir():
        try:
            kind, _, inode = os.readlink(file).partition(":")
        except FileNotFoundError:
            continue  # closed meanwhile
        if kind == "socket":
            yield inode.strip("[]")
