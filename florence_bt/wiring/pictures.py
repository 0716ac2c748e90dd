"""The picture of a run: the flat from above with the path driven, the looks and the person."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path

from florence_bt.core.geometry import Pose2
from florence_bt.runtime.recorder import RunRecord

PICTURE = "flat.png"
FINISH_BUDGET_S = 4.0
"""Wall seconds that pictures get to be finished when the system goes down."""


class BackgroundPictures:
    """Draws the pictures of runs in processes of their own, so that the robot does not wait for them.

    Args:
        map_file: The map (map_server YAML).
        hotspots_file: The hotspots, for the labels.
    """

    def __init__(self, map_file: Path, hotspots_file: Path) -> None:
        self._files = (str(map_file), str(hotspots_file))
        self._processes: list[subprocess.Popen[bytes]] = []

    def draw(self, record: RunRecord) -> None:
        """Begin to draw the picture of a run."""
        self._processes = [process for process in self._processes if process.poll() is None]
        self._processes.append(subprocess.Popen(self.command(record), stdin=subprocess.DEVNULL))

    def command(self, record: RunRecord) -> list[str]:
        """The command line that draws the picture of a run."""
        return [sys.executable, "-m", "florence_bt.wiring.pictures", *self._files, str(record.folder)]

    def close(self) -> None:
        """Wait a little for the pictures that are being drawn; none is drawn after the end."""
        end = time.monotonic() + FINISH_BUDGET_S
        for process in self._processes:
            try:
                process.wait(max(end - time.monotonic(), 0.0))
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self._processes.clear()


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
