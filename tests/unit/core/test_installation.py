from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from florence_bt.core.installation import EXTRAS, how_to_install

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize(
    ("module", "advice"),
    [
        ("mujoco", "pip install 'florence-bt[sim]'"),
        ("numba.core", "pip install 'florence-bt[robot]'"),
        ("rclpy", "source a ROS 2 Jazzy, or where there is none: pip install 'florence-bt[ros]'"),
        ("tea", "install it, e.g. with: pip install tea"),
    ],
)
def test_an_installation_by_pip_is_told_what_pip_installs(tmp_path, module, advice):
    assert how_to_install(module, tmp_path / "florence_bt") == advice


def test_interfaces_do_not_come_by_pip(tmp_path):
    assert "colcon" in how_to_install("florence_interfaces.msg", tmp_path / "florence_bt")


def test_a_checkout_has_its_own_way(tmp_path):
    for name in ("Makefile", "pyproject.toml"):
        (tmp_path / name).write_text("")
    assert how_to_install("mujoco", tmp_path / "florence_bt") == f"run `make setup` in {tmp_path}"


def test_the_extras_are_those_of_the_project():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = {extra: " ".join(project["optional-dependencies"][extra]) for extra in EXTRAS}
    same = {"cv2": "opencv", "serial": "pyserial", "usb": "pyusb", "resvg_py": "resvg-py"}
    for extra, modules in EXTRAS.items():
        for module in modules:
            name = "common-interfaces" if re.search("_(msgs|srvs)$", module) else same.get(module, module)
            assert name in wanted[extra], f"{module} does not come with {extra}"
