"""The picture of a run: the flat from above with the path driven, the looks and the person."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from florence_bt.core.geometry import Pose2
from florence_bt.runtime.recorder import RunRecord

PICTURE = "flat.png"


def draw_in_background(map_file: Path, hotspots_file: Path, record: RunRecord) -> None:
    """Start a process that draws the picture into the run's folder; the robot does not wait for it."""
    subprocess.Popen(
        [
            sys.executable,
            "-m",
            "florence_bt.wiring.pictures",
            str(map_file),
            str(hotspots_file),
            str(record.folder),
        ],
        stdin=subprocess.DEVNULL,
    )


def draw_picture(map_file: Path, hotspots_file: Path, folder: Path) -> Path:
    """Draw ``flat.png`` from ``result.json`` of a run's folder.

    Args:
        map_file: The map (map_server YAML).
        hotspots_file: The hotspots, for the labels.
        folder: The run's folder.

    Returns:
        The picture's file.
    """
    from florence_bt.simulation.picture import draw_run
    from florence_bt.skills.locate.hotspots import load_hotspots
    from florence_bt.skills.serve_map.map_file import load_map

    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    person = result["person"]
    picture = folder / PICTURE
    draw_run(
        load_map(map_file),
        [Pose2(x, y, yaw) for _, x, y, yaw in result["path"]],
        Pose2(**person) if person else None,
        [Pose2(**look) for look in result["looks"]],
        picture,
        f"{result['mission']}: {result['status']}",
        labels={spot.label: spot.pose for spot in load_hotspots(hotspots_file)},
    )
    return picture


if __name__ == "__main__":
    draw_picture(Path(sys.argv[1]), Path(sys.argv[2]), Path(sys.argv[3]))
