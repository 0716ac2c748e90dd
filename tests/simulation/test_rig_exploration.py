"""A robot that makes its map by itself, in the rig."""

from __future__ import annotations

import numpy as np
import pytest

from florence_bt.app.demo.rigs import make_rig
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import FREE
from florence_bt.runtime.run import RunStatus
from florence_bt.simulation.home.flat import load_flat
from florence_bt.skills.locator.hotspots import Hotspot, Hotspots
from tests.two_rooms import write_two_rooms

pytestmark = pytest.mark.slow


def test_a_home_of_two_rooms_is_explored_and_its_map_is_of_use(tmp_path):
    flat = load_flat(write_two_rooms(tmp_path))
    rig = make_rig(flat=flat, person="absent", seed=5, mapping=True)
    run = rig.run("explore", limit_s=200.0)
    assert run.status is RunStatus.SUCCEEDED, run.reason
    assert rig.world.contacts == []
    assert rig.world.robot_pose.distance_to(flat.start) < 0.2, "it ends where it began"
    grid, to_map = rig.grid, flat.start.inverse()
    for room in flat.rooms:
        x, y = np.meshgrid(np.arange(room.x[0] + 0.3, room.x[1] - 0.2, 0.2), np.arange(0.3, 2.8, 0.2))
        cells = [grid.cell_of(*to_map.apply(*place)) for place in zip(x.flat, y.flat, strict=True)]
        assert np.mean([grid.cells[cell] == FREE for cell in cells]) > 0.95, room.name
    kitchen = to_map @ flat.room("kitchen").hotspot.pose
    places = Hotspots([Hotspot("kitchen", kitchen)])
    again = make_rig(flat=flat, person="absent", seed=5, grid=grid, hotspots=places, believed=Pose2())
    assert again.run("goto_room", {"room": "kitchen"}).status is RunStatus.SUCCEEDED
    assert flat.room("kitchen").contains(again.world.robot_pose.x, again.world.robot_pose.y)


@pytest.mark.sweep
def test_the_same_seed_gives_the_same_exploration(tmp_path):
    flat = load_flat(write_two_rooms(tmp_path))
    rigs = [make_rig(flat=flat, person="absent", seed=5, mapping=True) for _ in range(2)]
    first, second = (rig.run("explore", limit_s=200.0).ended for rig in rigs)
    assert first == second
    assert (rigs[0].grid.cells == rigs[1].grid.cells).all()


def test_a_known_map_is_not_explored():
    run = make_rig(person="absent", seed=1).run("explore", limit_s=60.0)
    assert (run.status, run.code) == (RunStatus.FAILED, "map_is_fixed")
