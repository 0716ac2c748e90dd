"""Runs one mission in the simulated flat, as a process: a request comes as a line of JSON, and what is to be
seen goes out as lines of JSON. A second line, or the end of the input, stops the mission.

``python -m florence_page.editor.trial FOLDER``, an empty folder for the journal.
"""

from __future__ import annotations

import base64
import json
import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from florence_bt.app.demo.rigs import make_rig
from florence_bt.app.runs.journal_view import run_text
from florence_bt.core.beam_ends import beam_ends
from florence_bt.core.errors import FlorenceError
from florence_bt.core.geometry import Pose2
from florence_bt.core.transforms import Transform3
from florence_bt.runtime.run import MissionRequest, MissionRun
from florence_bt.runtime.status import RUN_STATES
from florence_bt.simulation.home.closeness import closeness, closeness_text
from florence_bt.simulation.rig.rig import Rig
from florence_bt.simulation.rig.robot import BASE_FRAME
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.parse import parse_mission
from florence_page.editor.trial_request import TrialRequest
from florence_page.parts import places_part, tree_parts
from florence_page.pictures import map_picture

FRAME_S = 0.1
"""Wall seconds between two frames."""
TRIAL_LIMIT_S = 1800.0
"""Simulated seconds after which a mission is stopped."""
SCAN_STEP = 4
"""One of so many points of a scan is shown."""
_AHEAD_S = 0.05
NICENESS = 5


class Trial:
    """One mission in the rig.

    Args:
        request: What to try.
        runs: A folder for the journal.

    Raises:
        FlorenceError: The mission cannot run, or there is no such person.
    """

    def __init__(self, request: TrialRequest, runs: Path) -> None:
        folders = [Path(folder) for folder in request.folders]
        library = MissionLibrary.load(folders)
        library.put(parse_mission(request.text, (folders or [Path()])[-1] / f"{request.name}.yaml"))
        self.rig: Rig = make_rig(
            seed=request.seed, person=request.person or None, runs_folder=runs, missions=library
        )
        self._request = request
        self._runs = runs
        self._stopped = threading.Event()
        self._said = ""
        self._began = 0.0
        self.rig.topics["speaking"].subscribe(self._on_speaking)

    def stop_after(self, lines: TextIO) -> None:
        """Stop the mission soon after another line has come, or the last one; on a thread of its own."""
        lines.readline()
        self._stopped.set()

    def _on_speaking(self, message: Any) -> None:
        self._said = message.data or self._said

    def run(self, show: Callable[[dict[str, Any]], None]) -> dict[str, Any]:
        """Run the mission to its end.

        Args:
            show: Called with the parts that are to be seen.

        Returns:
            How it ended: ``status``, ``code``, ``reason``, ``outputs``, ``seconds``, ``facts``, ``journal``.
        """
        show(self._scenery())
        request = MissionRequest(self._request.name, self._request.inputs or {}, caller="editor")
        run = self.rig.executor.trigger(request)
        clock, begun = self.rig.clock, time.monotonic()
        began = self._began = clock.now()
        next_frame, stopped = begun, False
        while not run.status.final:
            over = clock.now() - began > TRIAL_LIMIT_S
            if (self._stopped.is_set() or over) and not stopped:
                stopped = True
                self.rig.executor.stop(
                    f"not over after {TRIAL_LIMIT_S:.0f} s" if over else "stopped in the editor", run.run_id
                )
            clock.run_next()
            now = time.monotonic()
            if now >= next_frame or run.status.final:
                next_frame = now + FRAME_S
                show(self._frame(run))
            ahead = (
                (clock.now() - began) / self._request.speed - (now - begun) if self._request.speed else 0.0
            )
            if ahead > _AHEAD_S and not stopped:
                self._stopped.wait(min(ahead, FRAME_S))
        clock.advance(1.0)  # the base coasts to a halt behind its filters
        show(self._frame(run))
        return self._outcome(run, clock.now() - began - 1.0)

    def _scenery(self) -> dict[str, Any]:
        grid = self.rig.grid
        rows, columns = grid.cells.shape
        return {
            "map": {
                "origin": _pose(grid.origin),
                "size": [round(columns * grid.resolution, 3), round(rows * grid.resolution, 3)],
                "version": [time.time_ns() // 1_000_000, 0],
                "cells": [columns, rows],
            },
            "places": places_part(self.rig.locator.hotspots),
            "picture": base64.b64encode(map_picture(grid)).decode(),
        }

    def _frame(self, run: MissionRun) -> dict[str, Any]:
        rig, pose = self.rig, self.rig.pose
        people = [
            {"id": number, "text": person.name, **_point(rig.world.person_pose(person.name))}
            for number, person in enumerate(rig.world.people)
        ]
        plan = rig.plan
        way = [] if plan is None else np.round(np.vstack([plan[::4], plan[-1:]]), 3).tolist()
        return {
            "scene": {"pose": _pose(pose), "scan": self._scan(pose), "people": people},
            "plan": way,
            "goal": None,
            "run": {
                "run_id": run.run_id,
                "mission": run.mission,
                "state": RUN_STATES[run.status],
                "code": run.code,
                "reason": run.reason,
            },
            "state": {"battery": round(100 * rig.robot.base.charge_fraction), "said": self._said},
            "seconds": round(rig.clock.now() - self._began, 1),
            **tree_parts(rig.executor.nodes_of(run)),
        }

    def _scan(self, pose: Pose2) -> list[float]:
        scan = self.rig.scan
        if scan is None:
            return []
        sensor = Transform3.from_pose2(pose) @ self.rig.robot.frames.lookup(BASE_FRAME, scan.frame_id)
        ends: list[float] = np.round(beam_ends(scan, sensor, scan.range_min)[::SCAN_STEP], 2).ravel().tolist()
        return ends

    def _outcome(self, run: MissionRun, seconds: float) -> dict[str, Any]:
        world = self.rig.world
        touched = [contact.name for contact in world.contacts]
        facts = [f"The robot touched: {', '.join(touched)}." if touched else "The robot touched nothing."]
        if world.people:
            near = closeness(world.robot_pose, world.person_pose(world.people[0].name))
            facts.insert(0, f"It stands {closeness_text(near)}.")
        return {
            "status": run.status.name,
            "code": run.code,
            "reason": run.reason,
            "outputs": dict(run.output_texts),
            "seconds": round(seconds, 1),
            "facts": facts,
            "journal": run_text(self._runs, run.run_id, events=True),
        }


def _pose(pose: Pose2) -> list[float]:
    return [round(pose.x, 3), round(pose.y, 3), round(pose.yaw, 3)]


def _point(pose: Pose2) -> dict[str, float]:
    return {"x": round(pose.x, 3), "y": round(pose.y, 3)}


def main() -> None:
    """Run the mission that the first line of the input asks for."""
    os.nice(NICENESS)
    out = sys.stdout

    def tell(**parts: Any) -> None:
        out.write(json.dumps(parts, separators=(",", ":"), allow_nan=False) + "\n")
        out.flush()

    try:
        request = TrialRequest(**json.loads(sys.stdin.readline()))
        trial = Trial(request, Path(sys.argv[1]))
        threading.Thread(target=trial.stop_after, args=(sys.stdin,), daemon=True).start()
        tell(over=trial.run(lambda parts: tell(**parts)))
    except FlorenceError as error:
        tell(problem=str(error))


if __name__ == "__main__":
    main()
