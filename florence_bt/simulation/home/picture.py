"""Draws runs on their map as PNG files; matplotlib is loaded on the first call."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.file_sets import replace_files
from florence_bt.core.geometry import Pose2
from florence_bt.core.polygons import Point
from florence_bt.core.sensing import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from florence_bt.core.zones import KEEP_OUT, SLOW
from florence_bt.skills.locator.hotspots import ROOM, Hotspots

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_INK = "#3a3a40"
_LABEL_M = 1.0, 0.25
"""Labels of hotspots that are nearer to each other than this, along x and y, would cover each other."""
_ROOMS = ("#4c9ac0", "#e0a030", "#6ab070", "#b080c0", "#d07060", "#90a0b0")
_ZONES = {KEEP_OUT: ("#c02020", "///"), SLOW: ("#a06a00", "..")}
_CHANGES = (
    (OCCUPIED, (0.75, 0.1, 0.1, 1.0), "now occupied"),
    (FREE, (0.25, 0.75, 0.35, 1.0), "now free"),
    (UNKNOWN, (0.4, 0.5, 0.95, 1.0), "now unknown"),
)
"""Changes of a cell, with their colours and words."""
_ROBOT_RADIUS_M = 0.17
_LOOK_REACH_M = 1.1
"""Of the robot and of a look in the picture. Chosen."""
_LOOK_HALF_ANGLE_RAD = math.radians(31.3)
"""Half of the Kinect's field of view. Source: REFERENCE 5.2 (f = 525)."""


def draw_run(
    grid: OccupancyGrid,
    path: Sequence[Pose2],
    person: Pose2 | None,
    looks: Sequence[Pose2],
    file: Path,
    title: str,
    labels: Mapping[str, Pose2],
) -> None:
    """Draw what the robot did.

    Args:
        grid: The map.
        path: The poses of the robot in the map frame, first to last.
        person: Where the person was, and looked; None for nobody.
        looks: From where and in which direction the robot looked for people.
        file: The PNG file to write; its folder is made when missing.
        title: A line above the picture.
        labels: The hotspots.
    """
    figure, axes = _new_figure(grid, title)
    for label, pose in labels.items():
        _draw_hotspot(axes, label, pose)
    _draw_looks(axes, looks)
    if person is not None:
        _draw_person(axes, person)
    _draw_path(axes, path)
    _legend(axes)
    replace_files({file: _saved(figure, "png")}, make_folders=True)


def _saved(figure: Figure, form: str) -> bytes:
    data = io.BytesIO()
    # The version of matplotlib and the date stay out of the file, so that equal runs give equal bytes.
    figure.savefig(data, format=form, metadata={"Software": None} if form == "png" else {"Date": None})
    return data.getvalue()


def _legend(axes: Axes) -> None:
    if axes.get_legend_handles_labels()[1]:
        axes.legend(
            loc="upper center",
            bbox_to_anchor=(0.5, -0.045),
            ncols=6,
            frameon=False,
            fontsize=11,
            labelcolor=_INK,
        )


def draw_places(
    grid: OccupancyGrid,
    hotspots: Hotspots,
    form: str,
    title: str,
    changed: NDArray[np.bool_] | None = None,
) -> bytes:
    """Draw rooms, hotspots with their directions, and zones.

    Args:
        grid: The map.
        hotspots: What to draw.
        form: ``png`` or ``svg``.
        title: A line above the picture.
        changed: Cells to colour by what they have become, shape of the grid's; None for none.

    Returns:
        The picture.
    """
    figure, axes = _new_figure(grid, title)
    if changed is not None:
        _draw_changed(axes, grid, changed)
    for number, room in enumerate(hotspots.rooms()):
        if room.polygon:
            colour = _ROOMS[number % len(_ROOMS)]
            _draw_area(axes, room.polygon, colour, facecolor=colour, alpha=0.22)
    for zone in hotspots.zones:
        colour, hatch = _ZONES[zone.kind]
        _draw_area(axes, zone.polygon, colour, facecolor="none", hatch=hatch, linestyle="--", alpha=0.8)
        x, y = _inner_point(zone.polygon)
        _write(axes, "\n".join(filter(None, (zone.label.replace("_", " "), zone.limit_text))), x, y, colour)
    drawn: list[Pose2] = []
    for spot in hotspots:
        crowded = any(
            abs(pose.x - spot.pose.x) < _LABEL_M[0] and abs(pose.y - spot.pose.y) < _LABEL_M[1]
            for pose in drawn
        )
        drawn.append(spot.pose)
        colour = "#1f4e8c" if spot.kind == ROOM else "#66666d"
        _draw_hotspot(axes, spot.label, spot.pose, colour, other_side=crowded)
    _legend(axes)
    return _saved(figure, form)


def _draw_area(axes: Axes, polygon: Sequence[Point], edge: str, **style: Any) -> None:
    from matplotlib.patches import Polygon

    axes.add_patch(Polygon(polygon, closed=True, edgecolor=edge, linewidth=1.2, zorder=2, **style))


def _inner_point(polygon: Sequence[Point]) -> Point:
    """Return the middle of the corners: inside of the shapes that people draw."""
    return sum(x for x, _ in polygon) / len(polygon), sum(y for _, y in polygon) / len(polygon)


def _write(axes: Axes, text: str, x: float, y: float, colour: str) -> None:
    written = axes.text(x, y, text, ha="center", va="center", fontsize=8.5, color=colour, zorder=9)
    written.set_path_effects(_halo())


def _new_figure(grid: OccupancyGrid, title: str) -> tuple[Figure, Axes]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows, columns = grid.cells.shape
    left, low = grid.origin.x, grid.origin.y
    right, high = left + columns * grid.resolution, low + rows * grid.resolution
    width = 11.0
    figure = Figure(figsize=(width, width * (high - low) / (right - left) + 0.9), dpi=130, facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.045, 0.075, 0.945, 0.865))
    axes.set_aspect("equal")
    axes.set_xlim(left, right)
    axes.set_ylim(low, high)
    axes.tick_params(colors="#8a8a90", labelsize=8, length=3)
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set_title(title, fontsize=14, color=_INK, loc="left", pad=8)
    grey = np.full(grid.cells.shape, 0.82)
    grey[grid.cells == FREE] = 1.0
    grey[grid.cells == OCCUPIED] = 0.25
    _show_cells(axes, grid, grey, cmap="gray", vmin=0, vmax=1)
    return figure, axes


def _show_cells(axes: Axes, grid: OccupancyGrid, values: NDArray[np.float64], **style: Any) -> None:
    rows, columns = grid.cells.shape
    left, low = grid.origin.x, grid.origin.y
    extent = (left, left + columns * grid.resolution, low, low + rows * grid.resolution)
    axes.imshow(values, origin="lower", extent=extent, interpolation="nearest", **style)


def _draw_changed(axes: Axes, grid: OccupancyGrid, changed: NDArray[np.bool_]) -> None:
    """Colour cells, and say what the colours mean."""
    shown = np.zeros((*grid.cells.shape, 4))
    for value, colour, what in _CHANGES:
        cells = changed & (grid.cells == value)
        if cells.any():
            shown[cells] = colour
            axes.plot([], [], "s", color=colour, label=what)
    _show_cells(axes, grid, shown)


def _draw_hotspot(
    axes: Axes, name: str, pose: Pose2, colour: str = "#7a7a82", *, other_side: bool = False
) -> None:
    axes.plot(pose.x, pose.y, "o", markersize=4.5, color=colour, zorder=3)
    tip = pose.apply(0.22, 0.0)
    axes.plot([pose.x, tip[0]], [pose.y, tip[1]], color=colour, linewidth=1.3, zorder=3)
    above = (math.sin(pose.yaw) <= 0.0) != other_side
    label = axes.annotate(
        name.replace("_", " "),
        (pose.x, pose.y),
        (0, 7 if above else -7),
        textcoords="offset points",
        ha="center",
        va="bottom" if above else "top",
        fontsize=8.5,
        color="#66666d",
        zorder=8,
    )
    label.set_path_effects(_halo())


def _halo() -> list[Any]:
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=2.5, foreground="white", alpha=0.85)]


def _draw_looks(axes: Axes, looks: Sequence[Pose2]) -> None:
    from matplotlib.patches import Wedge

    half = math.degrees(_LOOK_HALF_ANGLE_RAD)
    for index, look in enumerate(looks):
        middle = math.degrees(look.yaw)
        axes.add_patch(
            Wedge(
                (look.x, look.y),
                _LOOK_REACH_M,
                middle - half,
                middle + half,
                facecolor="#f2a93b",
                edgecolor="#c07a10",
                linewidth=0.7,
                alpha=0.22,
                zorder=4,
                label="look" if index == 0 else None,
            )
        )
        x, y = look.apply(0.86 * _LOOK_REACH_M, 0.0)
        number = axes.text(
            x, y, str(index + 1), ha="center", va="center", fontsize=8, color="#7a4a00", zorder=8
        )
        number.set_path_effects(_halo())


def _draw_person(axes: Axes, person: Pose2) -> None:
    from matplotlib.patches import Circle, Ellipse

    angle = math.degrees(person.yaw)
    shirt = {"facecolor": "#c8344a", "edgecolor": "white", "linewidth": 1.0, "zorder": 6}
    axes.add_patch(Ellipse((person.x, person.y), 0.26, 0.5, angle=angle, label="person", **shirt))
    axes.add_patch(Circle((person.x, person.y), 0.11, facecolor="#f0c9a8", edgecolor="#8a2233", zorder=6))
    nose = person.apply(0.12, 0.0)
    axes.plot(nose[0], nose[1], "o", markersize=3, color="#8a2233", zorder=6)
    axes.add_patch(
        Circle(
            (person.x, person.y), 0.5, fill=False, edgecolor="#c8344a", linestyle=":", linewidth=1.1, zorder=6
        )
    )


def _draw_path(axes: Axes, path: Sequence[Pose2]) -> None:
    if not path:
        return
    from matplotlib.collections import LineCollection

    points = np.array([(pose.x, pose.y) for pose in path])
    axes.plot(
        points[:, 0], points[:, 1], color="white", linewidth=4.5, alpha=0.8, zorder=5, solid_capstyle="round"
    )
    lines = LineCollection(
        list(np.stack([points[:-1], points[1:]], axis=1)),
        cmap="viridis",
        linewidths=2.4,
        zorder=5,
        capstyle="round",
    )
    lines.set_array(np.linspace(0.0, 0.9, max(len(points) - 1, 1))[: len(points) - 1])
    lines.set_clim(0.0, 1.0)
    axes.add_collection(lines)
    _draw_robot(axes, path[0], "#440154", "start")
    _draw_robot(axes, path[-1], "#3d9b35", "end")


def _draw_robot(axes: Axes, pose: Pose2, colour: str, label: str) -> None:
    from matplotlib.patches import Circle

    axes.add_patch(
        Circle(
            (pose.x, pose.y),
            _ROBOT_RADIUS_M,
            facecolor=colour,
            edgecolor="white",
            linewidth=1.5,
            zorder=7,
            label=label,
        )
    )
    tip = pose.apply(_ROBOT_RADIUS_M, 0.0)
    axes.plot([pose.x, tip[0]], [pose.y, tip[1]], color="white", linewidth=2.0, zorder=7)
