"""What to install for a package that is missing: it depends on how Florence itself was installed."""

from __future__ import annotations

from pathlib import Path

from florence_bt.core.paths import PACKAGE

EXTRAS = {
    "robot": ("numpy", "numba", "scipy", "cv2", "onnxruntime", "serial", "usb", "xacro", "pydantic"),
    "sim": ("mujoco", "matplotlib"),
    "draw": ("resvg_py",),
    "home": ("paho",),
    "test": ("pytest",),
    "ros": ("rclpy", "std_msgs", "std_srvs", "geometry_msgs", "nav_msgs", "sensor_msgs", "diagnostic_msgs"),
}
"""Extra of ``pip install florence-bt[EXTRA]`` -> modules that come with it (``pyproject.toml``)."""
INTERFACES = ("florence_interfaces", "nav2_msgs", "py_trees_ros_interfaces", "tf2_msgs")
"""Packages of ROS interfaces, which no package index has."""


def how_to_install(module: str, package: Path = PACKAGE) -> str:
    """Tell what to install so that a module can be imported.

    Args:
        module: Its name; of one in a package, the package counts.
        package: The folder of Florence's own package.
    """
    name = module.partition(".")[0]
    if (package.parent / "Makefile").is_file() and (package.parent / "pyproject.toml").is_file():
        return f"run `make setup` in {package.parent}"
    if name in INTERFACES:
        return (
            "pip has no ROS interfaces: source a ROS workspace with Florence, built with colcon, or run "
            "`make setup` in a checkout of Florence"
        )
    extra = next((extra for extra, modules in EXTRAS.items() if name in modules), "")
    if extra == "ros":
        return "source a ROS 2 Jazzy, or where there is none: pip install 'florence-bt[ros]'"
    return f"pip install 'florence-bt[{extra}]'" if extra else f"install it, e.g. with: pip install {name}"
