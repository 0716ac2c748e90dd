import sys
from subprocess import run

import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.simulation.home.build_map import laser_map
from florence_bt.simulation.home.flat import load_flat
from florence_bt.simulation.home.picture import draw_run

pytestmark = pytest.mark.slow

PNG = b"\x89PNG\r\n\x1a\n"


def test_a_run_is_drawn_and_equal_runs_give_equal_files(tmp_path):
    grid, labels = laser_map(load_flat()), {"here": Pose2(2.0, 2.0), "there": Pose2(4.0, 2.0, 1.0)}
    path = [Pose2(8.0 - 0.1 * step, 2.95, 3.14) for step in range(30)]
    looks = [Pose2(5.1, 2.95, 3.14)]
    for name in ("deep/a.png", "b.png"):
        draw_run(grid, path, Pose2(4.6, 2.95), looks, tmp_path / name, "run", labels)
    content = (tmp_path / "b.png").read_bytes()
    assert content.startswith(PNG) and content == (tmp_path / "deep/a.png").read_bytes()
    draw_run(grid, path[:15], None, [], tmp_path / "c.png", "run", labels)
    assert (tmp_path / "c.png").read_bytes() != content
    draw_run(grid, path, Pose2(4.6, 2.95), looks, tmp_path / "d.png", "run", {})
    assert (tmp_path / "d.png").read_bytes() != content


def test_short_runs_can_be_drawn(tmp_path):
    grid = laser_map(load_flat())
    draw_run(grid, [], None, [], tmp_path / "a.png", "nothing", {})
    draw_run(grid, [Pose2(1.0, 1.0)], None, [], tmp_path / "b.png", "a moment", {"here": Pose2(2.0, 2.0)})
    assert all((tmp_path / f"{name}.png").read_bytes().startswith(PNG) for name in "ab")


def test_matplotlib_is_loaded_only_to_draw():
    code = "import sys, florence_bt.simulation.home.picture; sys.exit('matplotlib' in sys.modules)"
    assert run([sys.executable, "-c", code], check=False).returncode == 0
