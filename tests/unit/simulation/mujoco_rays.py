"""MuJoCo's own rays through the simulated world: the oracle for the compiled loops of the sensors."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from florence_bt.simulation.home.mjcf import SCENE_GROUP
from florence_bt.simulation.home.world import SimulatedWorld


def cast(
    world: SimulatedWorld, origin: NDArray[np.float64], directions: NDArray[np.float64], max_range: float
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Distances (infinite for nothing within the range) and rows of ``world.scene`` (-1) of some rays."""
    count = len(directions)
    rows = np.empty(count, np.int32)
    distances = np.empty(count)
    group = np.zeros(6, np.uint8)
    group[SCENE_GROUP] = 1
    mujoco.mj_multiRay(
        m=world._model,
        d=world._data,
        pnt=np.asarray(origin, float),
        vec=np.ascontiguousarray(directions, float).reshape(-1),
        geomgroup=group,
        flg_static=True,
        bodyexclude=-1,
        geomid=rows,
        dist=distances,
        normal=None,
        nray=count,
        cutoff=max_range,
    )
    missed = (rows < 0) | (distances > max_range)
    distances[missed] = np.inf
    rows[missed] = -1
    return distances, rows
