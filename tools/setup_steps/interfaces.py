"""Builds the ROS interface packages that Florence needs into ``.venv``, as many at once as there are cores.

The packages do not depend on each other. Those that other distributions bring too (nav2_msgs, tf2_msgs,
py_trees_ros_interfaces) are built only where the environment lacks them, and what ``florence interfaces add``
has put there stays. How a package is built, and the cache of built ones, is in
``florence_bt/app/interfaces/building.py``.
"""

from __future__ import annotations

import time

from florence_bt.app.interfaces.building import (
    SET_UP,
    Environment,
    InterfacePackage,
    content_hash,
    provide,
    recipe,
)

from . import machine
from .progress import Log, Step, stamped

SOURCES = machine.ROOT / "interfaces"
NAV2_MSGS = machine.ROOT / "florence_bt" / "app" / "interfaces" / "definitions" / "nav2_msgs"
OF_NAV2 = (
    *("action/BackUp.action", "action/ComputePathToPose.action", "action/DriveOnHeading.action"),
    *("action/FollowPath.action", "action/NavigateThroughPoses.action", "action/NavigateToPose.action"),
    *(
        "action/Spin.action",
        "action/Wait.action",
        "msg/CostmapFilterInfo.msg",
        "srv/ClearCostmapAroundRobot.srv",
    ),
    *("srv/ClearCostmapExceptRegion.srv", "srv/ClearEntireCostmap.srv", "srv/LoadMap.srv", "srv/SaveMap.srv"),
)
"""Interfaces of nav2_msgs that Florence itself speaks; ``florence interfaces add nav2_msgs`` builds all of
it."""


def step(log: Log) -> Step:
    """Make the step that builds, or takes from the cache, every package that is not up to date."""
    return stamped(
        "ROS interfaces",
        _environment().state / SET_UP / "all.stamp",
        lambda: content_hash([recipe(_environment()), *(package.made_from() for package in _packages())]),
        lambda: _provide_all(log),
    )


def _environment() -> Environment:
    return Environment(machine.VENV, machine.VENV, SET_UP)


def _packages() -> list[InterfacePackage]:
    packages = [InterfacePackage.read(file.parent) for file in SOURCES.glob("*/package.xml")]
    packages.append(InterfacePackage.read(NAV2_MSGS, OF_NAV2))
    # The largest one first: the others fit beside it.
    return sorted(packages, key=lambda package: -len(package.files))


def _provide_all(log: Log) -> None:
    def provided(package: InterfacePackage) -> None:
        begin = time.monotonic()
        source = "built" if provide(log.call, package, _environment()) else "from the cache"
        print(f"      {package.name} {source}, {time.monotonic() - begin:.0f} s", flush=True)

    log.side_by_side(
        *(
            lambda package=package: provided(package)
            for package in _packages()
            if _environment().files_list(package.name).is_file() or _environment().share(package.name) is None
        )
    )
