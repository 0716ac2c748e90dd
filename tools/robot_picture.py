"""Draws the robot's description from the side and from above: ``python tools/robot_picture.py``.

Needs the extra ``sim`` (matplotlib). The shapes are those of the URDF; the arrows are its frames: x red, y
green, z blue.
"""

from __future__ import annotations

import math
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.transforms import Transform3, TransformBuffer
from florence_bt.skills.robot_description.description import RobotDescription, load_description
from florence_bt.skills.robot_description.footprint import FLORENCE_FOOTPRINT, corners_from_flat

BASE = "base_footprint"
SHOWN = {
    "base_footprint": "base_footprint",
    "base_laser_round_link": "laser (upside down)",
    "camera_depth_frame": "Kinect",
    "gyro_link": "gyro",
    "plate_0_link": "plate 0",
    "plate_1_link": "plate 1",
    "plate_2_link": "plate 2",
    "plate_3_link": "plate 3",
}
"""Frame -> label."""
ABOVE = {"base_laser_round_link": 0.012, "camera_depth_frame": 0.012}
"""The frames that are named in the view from above, and how far beside them, metres."""
VIEWS = (("from the left", 0, 2), ("from above", 0, 1))
"""Title, and which axes go right and up."""
AXIS_M = 0.07


@dataclass(frozen=True, slots=True)
class Shape:
    """One visible part.

    Attributes:
        points: Shape (n, 3), metres in base_footprint, on its surface.
        colour: Red, green, blue, 0 to 1.
        top: Its highest point, for the order of painting.
    """

    points: NDArray[np.float64]
    colour: tuple[float, float, float]

    @property
    def top(self) -> float:
        """The highest point, metres."""
        return float(self.points[:, 2].max())


def shapes_of(robot: RobotDescription, frames: TransformBuffer) -> Iterator[Shape]:
    """Yield every visible part of a robot."""
    root = ElementTree.fromstring(robot.urdf_text)
    colours = {
        str(material.get("name")): _colour(material)
        for material in root.iter("material")
        if material.find("color") is not None
    }
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            material = visual.find("material")
            name = "" if material is None else str(material.get("name"))
            where = frames.lookup(BASE, str(link.get("name"))) @ _origin(visual)
            geometry = visual.find("geometry")
            assert geometry is not None
            yield Shape(where.apply(_surface(geometry[0])), colours.get(name, (0.6, 0.6, 0.6)))


def draw_robot(file: Path) -> None:
    """Write the picture; the file's ending chooses the form (svg, png, pdf)."""
    import matplotlib

    matplotlib.params("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "florence"
    from matplotlib.figure import Figure

    robot = load_description()
    frames = TransformBuffer()
    robot.fill(frames)
    shapes = list(shapes_of(robot, frames))
    figure = Figure(figsize=(11.0, 6.8), layout="constrained")
    grid = figure.add_gridspec(1, 2, width_ratios=(1.15, 1.0))
    for index, (title, right, up) in enumerate(VIEWS):
        axes = figure.add_subplot(grid[index])
        axes.set_title(title)
        axes.set_aspect("equal")
        axes.set_xlabel(f"{'xyz'[right]} in metres")
        axes.set_ylabel(f"{'xyz'[up]} in metres")
        _paint(axes, shapes, right, up)
        _arrows(axes, frames, right, up)
        if up == 2:
            axes.axhline(0.0, color="0.5", linewidth=1.0)
        else:
            _footprint(axes)
    figure.savefig(file, metadata={"Date": None} if file.suffix == ".svg" else None, dpi=110)


def _paint(axes: Any, shapes: list[Shape], right: int, up: int) -> None:
    from scipy.spatial import ConvexHull

    # Seen from the left the far side is painted first, from above the lower parts.
    depth = (lambda shape: shape.top) if up == 1 else (lambda shape: float(shape.points[:, 1].mean()))
    for shape in sorted(shapes, key=depth):
        flat = shape.points[:, [right, up]]
        hull = flat[ConvexHull(flat).vertices]
        # From above only outlines: each plate would hide all that is below it.
        face = "none" if up == 1 else (*shape.colour, 0.55)
        axes.fill(hull[:, 0], hull[:, 1], facecolor=face, edgecolor="0.35", linewidth=0.8)


def _footprint(axes: Any) -> None:
    outline = corners_from_flat(FLORENCE_FOOTPRINT)
    corners = np.array([*outline, outline[0]])
    axes.plot(corners[:, 0], corners[:, 1], "--", color="tab:orange", linewidth=1.6, label="footprint")
    axes.legend(loc="lower right")


def _arrows(axes: Any, frames: TransformBuffer, right: int, up: int) -> None:
    for frame, label in SHOWN.items():
        where = frames.lookup(BASE, frame)
        start = where.translation[[right, up]]
        for axis, colour in enumerate(("tab:red", "tab:green", "tab:blue")):
            arrow = where.rotation[:, axis][[right, up]] * AXIS_M
            if math.hypot(*arrow) > 0.01:
                axes.annotate(
                    "",
                    start + arrow,
                    start,
                    arrowprops={"arrowstyle": "->", "color": colour, "linewidth": 1.6},
                )
        if up == 1 and frame in ABOVE:
            axes.annotate(label, start, start + np.array([0.01, ABOVE[frame]]), fontsize=9)
        if up == 2:
            text = f"{label}, {where.translation[2]:.3f} m"
            axes.annotate(
                text,
                start,
                (0.30, start[1]),
                va="center",
                fontsize=9,
                arrowprops={"arrowstyle": "-", "color": "0.6", "linewidth": 0.8},
            )
    if up == 2:
        axes.set_xlim(-0.25, 0.75)


def _surface(shape: ElementTree.Element) -> NDArray[np.float64]:
    """Return points on a box, cylinder or sphere, shape (n, 3)."""
    if shape.tag == "box":
        half = np.array([float(word) for word in str(shape.get("size")).split()]) / 2.0
        return half * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    radius = float(str(shape.get("radius")))
    angles = np.linspace(0.0, math.tau, 48, endpoint=False)
    circle = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    if shape.tag == "cylinder":
        half_length = float(str(shape.get("length"))) / 2.0
        return np.array([[x, y, z] for x, y in circle for z in (-half_length, half_length)])
    rings = np.linspace(-1.0, 1.0, 13)
    return np.array([[*(math.sqrt(1 - h * h) * point), radius * h] for h in rings for point in circle])


def _origin(visual: ElementTree.Element) -> Transform3:
    origin = visual.find("origin")
    xyz, rpy = (
        [float(word) for word in ("0 0 0" if origin is None else origin.get(key, "0 0 0")).split()]
        for key in ("xyz", "rpy")
    )
    return Transform3.from_xyz_rpy(xyz, rpy)


def _colour(material: ElementTree.Element) -> tuple[float, float, float]:
    element = material.find("color")
    assert element is not None
    red, green, blue, *_ = (float(word) for word in str(element.get("rgba")).split())
    return red, green, blue


if __name__ == "__main__":
    draw_robot(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/img/robot.png"))
