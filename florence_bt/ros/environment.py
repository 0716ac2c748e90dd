"""The environment that every process of ours gives ROS, unless somebody has set it already."""

from __future__ import annotations

import os


def stay_on_this_machine() -> None:
    """Find only nodes of this machine; call before ROS starts. A set variable is left as it is."""
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
