"""Runs every function once that numba compiles, so that its compiled code is on disk (``kernel_cache``).

The first call of such a function takes seconds to compile. On a robot, or in a simulation with a clock, that
would be seconds without control.
"""

from __future__ import annotations

import fcntl
import functools
import importlib
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numba.core.caching import IndexDataCacheFile
from numba.core.registry import CPUDispatcher

from florence_bt.app.bringup.parent import child_command
from florence_bt.app.bringup.simulated import robot_frames
from florence_bt.app.demo.kernel_cache import PACKAGE, kernel_modules, mark_compiled
from florence_bt.app.demo.rigs import make_rig
from florence_bt.core.errors import FlorenceError
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.drivers.kinect.camera import View
from florence_bt.drivers.kinect.codec import pack_11_bit
from florence_bt.drivers.kinect.driver import KinectDriver, KinectParameters
from florence_bt.drivers.kinect.frames import DepthEncoding, DepthFrame, VideoFrame
from florence_bt.runtime.run import RunStatus
from florence_bt.simulation.home.flat import load_flat
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.rig.robot import BASE_FRAME, CAMERA_FRAME
from florence_bt.simulation.sensors.kinect_sensor import KinectSensor
from florence_bt.skills.navigation.localisation.scan_match import spread_around
from florence_bt.skills.navigation.localisation.submap import Submap
from florence_bt.skills.navigation.mapping import panes
from florence_bt.skills.navigation.mapping.grid_builder import GridBuilder
from florence_bt.skills.navigation.mapping.kept_scan import KeptScan
from florence_bt.skills.navigation.navigate.costmap import Costmap, CostmapParameters, Rays
from florence_bt.skills.navigation.navigate.planner import PlannerParameters, plan_path

REST = "rest"
"""The word of the command line for a process that does only what the mission does not need at first."""


def warm_up() -> None:
    """Run the main job once in the rig, and beside it, in a process for a second core, all the rest.

    What both of them need is compiled by the one that comes to it first, or by both.

    Raises:
        FlorenceError: The main job does not work on this machine, or the rest of it.
    """
    _share_the_cache()
    if len(os.sched_getaffinity(0)) == 1:
        _warm_up_rest()
        _run_mission()
        return
    with subprocess.Popen(
        child_command("florence_bt.app.demo.warm_up", REST), stderr=subprocess.PIPE, text=True
    ) as beside:
        try:
            _run_mission()
        except BaseException:
            beside.kill()
            raise
        _, said = beside.communicate()
    if beside.returncode != 0:
        raise FlorenceError((said.strip().splitlines() or [f"code {beside.returncode}"])[-1])


def _run_mission() -> None:
    run = make_rig(seed=1, person="kitchen").run("goto_user")
    if run.status is not RunStatus.SUCCEEDED:
        raise FlorenceError(f"goto_user in the rig: {run.status.value}: {run.reason}")


def _warm_up_rest() -> None:
    """Take one image in colour, and do what the mission comes to late or never."""
    KinectSensor(SimulatedWorld(load_flat()), robot_frames().lookup(BASE_FRAME, CAMERA_FRAME)).measure()
    _warm_up_planning()
    _warm_up_kinect()
    _warm_up_mapping()


def _share_the_cache() -> None:
    """Let one process at a time touch numba's cache.

    It has an index for each function, which numba reads, adds to and writes: of two that do so at once, one
    entry is lost, or both name one file.
    """

    def alone(touch: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(touch)
        def touch_alone(*arguments: Any) -> Any:
            with open(__file__, encoding="utf-8") as file:
                fcntl.flock(file, fcntl.LOCK_EX)
                return touch(*arguments)

        return touch_alone

    for name in ("load", "save"):
        setattr(IndexDataCacheFile, name, alone(getattr(IndexDataCacheFile, name)))


def _warm_up_planning() -> None:
    """See two walls on an empty map, and plan a path between them."""
    grid = OccupancyGrid(0.05, Pose2(), np.zeros((80, 80), np.int8))
    costmap, start = Costmap(CostmapParameters(), grid), Pose2(1.0, 1.0)
    ends = np.array([[3.0, 1.0], [1.0, 3.0]])
    costmap.add_rays("laser", Rays(1.0, 1.0, ends, np.full(2, 2.0), nearest=0.1, farthest=5.0), start)
    plan_path(costmap, start, Pose2(3.0, 3.0), PlannerParameters())


def _warm_up_kinect() -> None:
    """Make an image of every encoding, and coloured points."""
    driver, raw = KinectDriver(KinectParameters()), np.full((2, 8), 800, np.uint16)
    packed = pack_11_bit(raw)
    for payload, encoding in (
        (packed, DepthEncoding.PACKED),
        (raw, DepthEncoding.RAW),
        (raw, DepthEncoding.MILLIMETRES),
    ):
        driver.depth(DepthFrame(8, 2, 0.0, payload, encoding, View.DEPTH), 0.0)
    driver.coloured_points(driver.colour(VideoFrame(8, 2, 0.0, bytes(48)), 0.0))
    large = np.zeros((480, 640, 3), np.uint8)
    driver.depth(DepthFrame(8, 2, 0.0, raw, DepthEncoding.RAW, View.DEPTH), 0.0)
    driver.coloured_points(driver.colour(VideoFrame(640, 480, 0.0, large), 0.0))


def _warm_up_mapping() -> None:
    """Draw a scan into a map, look at what a gap in it is, and look round for where the scan fits."""
    points = np.array([[1.0, 0.0], [0.0, 1.0]])
    ends = points.astype(np.float32)
    scan = KeptScan(0.0, start=np.zeros(2, np.float32), points=ends, clear=ends + 1.0)
    builder = GridBuilder(0.05, 8.0)
    builder.add(scan, Pose2())
    panes.BeamMap.of(builder.grid(), [scan], [Pose2()]).look(panes.Gap(-0.5, 0.0, 1.0, 1))
    field = Submap(Pose2()).field
    spread_around(field, points, Pose2(), reach=0.1, step=0.1, near=0.1, scale=1.0)


def compiled_files() -> list[str]:
    """Return Numba's index files, one for each function that it has compiled.

    Raises:
        FlorenceError: A function of a kernel module has none: the run did not call it, or it is not cached.
    """
    files = []
    for module_file in kernel_modules():
        name = ".".join(module_file.relative_to(PACKAGE.parent).with_suffix("").parts)
        module = importlib.import_module(name)
        for function in vars(module).values():
            if not isinstance(function, CPUDispatcher) or function.py_func.__module__ != name:
                continue
            folder = Path(function.stats.cache_path or "")
            found = sorted(folder.glob(f"{module_file.stem}.{function.py_func.__qualname__}-*.nbi"))
            if not found:
                raise FlorenceError(f"{name}.{function.py_func.__name__} was not compiled")
            files += [str(file) for file in found]
    return files


if __name__ == "__main__":
    if sys.argv[1:] == [REST]:
        _share_the_cache()
        _warm_up_rest()
    else:
        warm_up()
        mark_compiled(compiled_files())
