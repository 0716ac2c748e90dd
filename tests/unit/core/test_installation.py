from __future__ import annotations

from pathlib import Path

import pytest

from florence_bt.core import installation


def test_a_checkout_is_set_up_again() -> None:
    assert installation.how_to_get("numba") == "make setup"


@pytest.mark.parametrize(
    ("module", "part"),
    [
        ("numba.core", "pip install 'florence-bt[robot]'"),
        ("mujoco", "florence-bt[sim]"),
        ("rclpy", "florence-bt[ros]"),
        ("florence_interfaces.msg", "florence interfaces add "),
        ("nav2_msgs.action", "florence interfaces add nav2_msgs"),
    ],
)
def test_what_pip_installed_is_completed_by_pip(
    monkeypatch: pytest.MonkeyPatch, module: str, part: str
) -> None:
    monkeypatch.setattr(installation, "in_checkout", lambda: False)
    monkeypatch.setattr(installation, "_installed_by_pip", lambda: True)
    assert part in installation.how_to_get(module)


def test_a_workspace_asks_rosdep(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(installation, "in_checkout", lambda: False)
    monkeypatch.setattr(installation, "_installed_by_pip", lambda: False)
    assert "ros-jazzy-nav-msgs" in installation.how_to_get("nav_msgs.msg")
