"""Environment variables that say who can reach our nodes: every process of ours sets them before ROS starts.

The range ``LOCALHOST`` of rmw_fastrtps says whom a process looks for. Its sockets listen on every interface,
so any program that knows the address (``ROS_STATIC_PEERS``) gets in. A Fast DDS profile with 127.0.0.1 alone
keeps them out. With ``LOCALHOST``, rmw_fastrtps adds its own transports to those of a profile; so our profile
goes with the range ``SYSTEM_DEFAULT``, which leaves a profile as it is.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
LOCALHOST_ONLY = "ROS_LOCALHOST_ONLY"
"""Predecessor of :data:`RANGE`; where it is 1, rcl takes the range LOCALHOST."""
PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"
"""The variable of Fast DDS 2, which is in ROS 2 Jazzy."""
IGNORE_FOLDER = "SKIP_DEFAULT_XML_FILE"
"""With 1, a DEFAULT_FASTRTPS_PROFILES.xml in the current folder does not overrule :data:`PROFILES`."""
THIS_MACHINE = str(Path(__file__).with_name("this_machine.xml"))
NETWORK = str(Path(__file__).with_name("network.xml"))


@dataclass(frozen=True, slots=True)
class Reach:
    """The reach of our nodes.

    Attributes:
        text: In words, for the log.
        this_machine: Whether it is certain that no other machine can.
        variables: What to set for it; None: to remove.
    """

    text: str
    this_machine: bool = False
    variables: Mapping[str, str | None] = field(default_factory=dict)


def reach_of(environment: Mapping[str, str]) -> Reach:
    """Decide who can reach our nodes; what the user has chosen by an environment variable counts.

    Args:
        environment: The environment variables of a process.
    """
    profiles, ours = environment.get(PROFILES, ""), (THIS_MACHINE, NETWORK)
    chosen = environment.get(RANGE) or "LOCALHOST"
    if environment.get(LOCALHOST_ONLY) == "1" or (chosen == "SYSTEM_DEFAULT" and profiles == THIS_MACHINE):
        chosen = "LOCALHOST"
    middleware = environment.get("RMW_IMPLEMENTATION") or "rmw_fastrtps_cpp"
    if not middleware.startswith("rmw_fastrtps"):
        return Reach(f"what {middleware} makes of {RANGE}={chosen}", variables={RANGE: chosen})
    if profiles and profiles not in ours:
        return Reach(
            f"what the Fast DDS profiles in {profiles} allow ({PROFILES})", variables={RANGE: chosen}
        )
    if chosen == "LOCALHOST":
        variables = {
            RANGE: "SYSTEM_DEFAULT",
            PROFILES: THIS_MACHINE,
            IGNORE_FOLDER: "1",
            LOCALHOST_ONLY: None,
        }
        return Reach("this machine only", True, variables)
    if chosen == "SUBNET":
        return Reach(f"the network ({RANGE}=SUBNET)", variables={PROFILES: NETWORK, IGNORE_FOLDER: "1"})
    return Reach(f"what Fast DDS makes of {RANGE}={chosen}", variables={PROFILES: None})


def stay_on_this_machine() -> Reach:
    """Keep others out, unless the environment asks for more; call before ROS starts.

    Returns:
        Who can reach the nodes of this process now.
    """
    reach = reach_of(os.environ)
    for name, value in reach.variables.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value
    return reach
