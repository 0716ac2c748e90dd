"""The picture of a run: the flat from above with the path driven, the looks and the person."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from collections import deque
from pathlib import Path
from typing import TYPE_CHECKING

from florence_bt.app.bringup.parent import child_command
from florence_bt.core.errors import FlorenceError
from florence_bt.core.geometry import Pose2

if TYPE_CHECKING:  # the process that draws has no use for the runtime
    from florence_bt.runtime.recorder import RunRecord

PICTURE = "flat.png"
FINISH_BUDGET_S = 4.0
"""Wall seconds that pictures get to be finished when the system goes down."""
MOST_PICTURES_WAITING = 20
"""Pictures that may wait to be drawn; of more runs than that in a short time the earliest get none."""


class BackgroundPictures:
    """Draws the pictures of runs in a process of its own, one after the other: the robot needs the processor.

    Args:
        map_file: The map (map_server YAML).
        hotspots_file: The hotspots, for the labels.
    """

    def __init__(self, map_file: Path, hotspots_file: Path) -> None:
        self._files = (str(map_file), str(hotspots_file))
        self._todo: deque[list[str]] = deque(maxlen=MOST_PICTURES_WAITING)
        self._changed = threading.Condition()
        self._closed = False
        self._drawing: subprocess.Popen[bytes] | None = None
        self._thread: threading.Thread | None = None

    def draw(self, record: RunRecord) -> None:
        """Let the picture of a run be drawn when its turn comes; waits for nothing."""
        with self._changed:
            self._todo.append(self.command(record))
            self._changed.notify()
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="pictures", daemon=True)
            self._thread.start()

    def command(self, record: RunRecord) -> list[str]:
        """Return the command line that draws the picture of a run."""
        return child_command("florence_bt.app.demo.pictures", *self._files, str(record.folder))

    def close(self) -> None:
        """Wait a little for the pictures that are not drawn yet; none is drawn after the end."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        if self._thread is None:
            return
        self._thread.join(FINISH_BUDGET_S)
        with self._changed:
            self._todo.clear()
            if self._drawing is not None:
                self._drawing.kill()
        self._thread.join()
        self._thread = None

    def _work(self) -> None:
        while not self._closed or self._todo:
            process = self._begin_next()
            if process is not None:
                process.wait()

    def _begin_next(self) -> subprocess.Popen[bytes] | None:
        """Begin with the next picture as soon as there is one; None at the end, or when it does not begin."""
        with self._changed:
            self._changed.wait_for(lambda: self._todo or self._closed)
            self._drawing = None
            while self._todo and self._drawing is None:
                self._drawing = _started(self._todo.popleft())
            return self._drawing


def _started(command: list[str]) -> subprocess.Popen[bytes] | None:
    try:
        return subprocess.Popen(command, stdin=subprocess.DEVNULL)
    except OSError as error:
        print(f"a picture was not drawn: {error}", file=sys.stderr)
        return None


def draw_picture(map_file: Path, hotspots_file: Path, folder: Path) -> Path:
    """Draw ``flat.png`` from ``result.json`` of a run's folder.

    Args:
        map_file: The map (map_server YAML).
        hotspots_file: The hotspots, for the labels.
        folder: The run's folder.

    Returns:
        The picture's file.
    """
    from florence_bt.simulation.home.picture import draw_run
    from florence_bt.skills.locator.hotspots import load_hotspots
    from florence_bt.skills.navigation.map_server.map_file import load_map

    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    person = result["person"]
    picture, unfinished = folder / PICTURE, folder / f"unfinished_{PICTURE}"
    draw_run(
        load_map(map_file),
        [Pose2(x, y, yaw) for _, x, y, yaw in result["path"]],
        Pose2(**person) if person else None,
        [Pose2(**look) for look in result["looks"]],
        unfinished,
        f"{result['mission']}: {result['status']}",
        {spot.label: spot.pose for spot in load_hotspots(hotspots_file)},
    )
    return unfinished.replace(picture)


def main(map_file: str, hotspots_file: str, folder: str) -> int:
    """Draw one picture; gives the exit code."""
    try:
        draw_picture(Path(map_file), Path(hotspots_file), Path(folder))
    except (OSError, FlorenceError) as error:
        print(f"the picture of {folder} was not drawn: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
