"""``colcon build`` makes an install space; its program runs as ``ros2 run florence_bt florence`` runs it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.installed import CHECKOUT, copy_sources, dependencies_of_florence

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("packaging")]

COLCON = shutil.which("colcon", path=f"{CHECKOUT / 'build/colcon/bin'}{os.pathsep}{os.environ['PATH']}")
"""The one of the machine, or that of ``.ci/run``."""


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if COLCON is None:
        pytest.skip("colcon is not installed (.ci/run gets it)")
    folder = tmp_path_factory.mktemp("workspace")
    copy_sources(folder / "florence_bt")
    without = shutil.ignore_patterns("__pycache__", "tests", "*.egg-info")
    shutil.copytree(CHECKOUT / "packages", folder / "packages", ignore=without)
    # What a sourced ROS 2 sets.
    ros = {"AMENT_PREFIX_PATH": sys.prefix, "CMAKE_PREFIX_PATH": sys.prefix}
    shell(folder, f"{COLCON} build --base-paths florence_bt packages/*", **ros)
    return folder


def shell(folder: Path, command: str, **variables: str) -> str:
    """Run a line of a shell, without the path of the tests; give what it prints."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        ["bash", "-c", command],
        cwd=folder,
        env={**environment, **variables},
        capture_output=True,
        text=True,
        timeout=500,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_program_runs_in_the_install_space(workspace: Path, tmp_path: Path) -> None:
    program = workspace / "install" / "florence_bt" / "lib" / "florence_bt" / "florence"
    assert os.access(program, os.X_OK), "where ros2 run looks"
    dependencies = dependencies_of_florence(tmp_path / "dependencies")
    python = f"PYTHONPATH=$PYTHONPATH:{dependencies} {sys.executable} -S"
    run = f". {workspace}/install/setup.sh && {python} {program}"
    assert shell(tmp_path, f"{run} --version").startswith("florence 0.")
    assert "goto_user" in shell(tmp_path, f"{run} missions")
    assert "missions checked" in shell(
        tmp_path, f"{run} check $(dirname {program})/../python*/*/florence_bt/trees/missions"
    )
    # Of the packages beside it.
    assert "in a browser" in shell(tmp_path, f"{run} page --help")
    assert "BehaviorTree.CPP" in shell(tmp_path, f"{run} import --help")


@pytest.mark.parametrize("package", ["florence_bt", "florence_btcpp", "florence_page", "florence_sweep"])
def test_the_install_space_has_each_package(workspace: Path, package: str) -> None:
    share = workspace / "install" / package / "share"
    assert (share / "ament_index/resource_index/packages" / package).is_file()
    assert (share / package / "package.xml").is_file()


def test_the_install_space_has_what_ros_looks_for(workspace: Path) -> None:
    share = workspace / "install" / "florence_bt" / "share"
    assert (share / "ament_index/resource_index/packages/florence_bt").is_file()
    for name in ("package.xml", "maps/flat.yaml", "config/robot.yaml", "hotspots/flat.yaml"):
        assert (share / "florence_bt" / name).is_file(), name
