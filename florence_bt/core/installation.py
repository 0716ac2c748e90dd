"""Ways by which this installation of Florence gets what it lacks: checkout, pip or a ROS workspace."""

from __future__ import annotations

import importlib.metadata
import shlex

from florence_bt.core.paths import PACKAGE, share_folder

DISTRIBUTION = "florence-bt"
EXTRAS = {
    "robot": ("numpy", "numba", "scipy", "cv2", "onnxruntime", "serial", "usb", "xacro", "pydantic"),
    "sim": ("mujoco", "matplotlib"),
    "draw": ("resvg_py",),
    "home": ("paho",),
    "record": ("foxglove", "mcap", "lz4", "zstandard", "uvicorn", "h11", "websockets"),
    "mapping": ("gtsam", "rosbags", "lz4", "zstandard"),
    "test": ("pytest",),
}
"""Extra of the distribution -> the modules that come with it."""
PACKAGES = {
    "florence-page": ("florence_page", "nicegui", "fastapi", "starlette"),
    "florence-sweep": ("florence_sweep",),
    "florence-sweep[dask]": ("distributed",),
}
"""Distributions beside it -> the modules that come with them. What is in neither is of ROS."""
OWN_INTERFACES = ("florence_interfaces", "nav2_msgs", "py_trees_ros_interfaces", "tf2_msgs")
"""Interface packages that no package index has; their definitions come with Florence."""


def in_checkout() -> bool:
    """Tell whether the package lies in a checkout, as in an editable install of one."""
    return (PACKAGE.parent / "pyproject.toml").is_file()


def how_to_get(module: str) -> str:
    """Return what to do in this installation to get a module, for people."""
    name = module.partition(".")[0]
    extra = next((extra for extra, modules in EXTRAS.items() if name in modules), "")
    if in_checkout():
        return "make setup"
    beside = next((package for package, modules in PACKAGES.items() if name in modules), "")
    if beside:
        return f"pip install {shlex.quote(beside)}"
    if extra:
        return f"pip install '{DISTRIBUTION}[{extra}]'"
    if not _installed_by_pip():
        return f"rosdep install --from-paths src, or apt install ros-jazzy-{name.replace('_', '-')}"
    if name in OWN_INTERFACES:
        folder = share_folder() / "interfaces" / name
        return f"florence interfaces add {folder if folder.is_dir() else name}"
    return f"source a ROS 2 Jazzy, or pip install '{DISTRIBUTION}[ros]'"


def _installed_by_pip() -> bool:
    try:
        return bool(importlib.metadata.distribution(DISTRIBUTION).read_text("INSTALLER"))
    except importlib.metadata.PackageNotFoundError:
        return False
