"""The folder of a run beside the journal: its final tree, its result and the path driven.

``<runs>/<run id>/tree.txt`` has the final tree with the reason; ``result.json`` the end and what was measured
on the way; pictures are drawn from that file. What happened in between is in the journal
(``florence_bt.runtime.journal``).
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from florence_bt.core.clock import Clock, Timer, call_every
from florence_bt.core.file_sets import replace_files
from florence_bt.core.geometry import Pose2
from florence_bt.runtime.events import EventKind, RunEvent, plain
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.run import MissionRun
from florence_bt.runtime.status import status_text

PATH_PERIOD_S = 0.2
"""Period of noting the robot's position while a mission runs."""

PATH_LIMIT = 20_000
"""Points of the path that are kept; of a longer one every second, and so on."""

LOOK_SKILL = "look_for_user"


@dataclass
class RunRecord:
    """The notes on a run.

    Attributes:
        folder: Where its files are.
        path: (time, pose of the robot in the map frame), in order.
        looks: Where the robot stood at each look for a person.
        person: Where the last look found a person, None when none did.
    """

    folder: Path
    path: list[tuple[float, Pose2]] = field(default_factory=list)
    looks: list[Pose2] = field(default_factory=list)
    person: Pose2 | None = None


class RunRecorder:
    """Listens to an executor and keeps a folder per run.

    A folder that cannot be written to, or a full disk, stops no mission: the rest of that run is not
    recorded, which is reported once.

    Args:
        executor: Whose runs are recorded.
        runs_folder: Parent of the runs' folders; made when needed.
        clock: Times the notes of the path.
        robot_pose: Where the robot is now in the map frame, None when unknown.
        on_recorded: Called with the record when all its files are written; not of a run that only waited.
        on_trouble: Told in one sentence that a run cannot be recorded; without it the error is raised.
    """

    def __init__(
        self,
        executor: Executor,
        runs_folder: Path,
        clock: Clock,
        robot_pose: Callable[[], Pose2 | None],
        on_recorded: Callable[[RunRecord], None] | None = None,
        on_trouble: Callable[[str], None] | None = None,
    ) -> None:
        self._executor = executor
        self._runs_folder = runs_folder
        self._clock = clock
        self._robot_pose = robot_pose
        self._on_recorded = on_recorded
        self._on_trouble = on_trouble
        self._open: dict[str, RunRecord] = {}
        self._given_up: str | None = None
        self._timer: Timer | None = None
        self._closed = False
        executor.add_listener(self._on_event)

    def folder_of(self, run_id: str) -> Path:
        """Return the folder of a run."""
        return self._runs_folder / run_id

    def close(self) -> None:
        """Record nothing more."""
        self._open.clear()
        self._stop_timer()
        self._closed = True

    def _on_event(self, run: MissionRun, event: RunEvent) -> None:
        if self._closed or self._given_up == run.run_id:
            return
        try:
            self._record(run, event)
        except OSError as error:
            if self._on_trouble is None:
                raise
            self._give_up(run)
            self._on_trouble(f"the run {run.run_id} is not recorded any further: {error}")

    def _give_up(self, run: MissionRun) -> None:
        """Record nothing more of a run; the others go on, perhaps there is room again."""
        self._given_up = run.run_id
        self._open.pop(run.run_id, None)
        if run is self._executor.current:
            self._stop_timer()

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _record(self, run: MissionRun, event: RunEvent) -> None:
        if run.run_id not in self._open:
            self._open[run.run_id] = RunRecord(self.folder_of(run.run_id))
        record = self._open[run.run_id]
        if event.kind in (EventKind.STARTED, EventKind.RECOVERED):
            self._stop_timer()
            self._note_pose(record)
            self._timer = call_every(self._clock, PATH_PERIOD_S, lambda: self._note_pose(record))
        elif event.kind is EventKind.SKILL_STARTED and event.data["skill"] == LOOK_SKILL:
            pose = self._robot_pose()
            if pose is not None:
                record.looks.append(pose)
        elif event.kind is EventKind.SKILL_ENDED and event.data["skill"] == LOOK_SKILL:
            record.person = event.data["outputs"].get("user", record.person)
        elif event.kind is EventKind.ENDED:
            self._finish(run, record)

    def _note_pose(self, record: RunRecord) -> None:
        pose = self._robot_pose()
        if pose is not None:
            record.path.append((self._clock.now(), pose))
        if len(record.path) > PATH_LIMIT:
            # Half as many points for a long way: a run of a week takes no more memory than one of an hour.
            del record.path[1:-1:2]

    def _finish(self, run: MissionRun, record: RunRecord) -> None:
        if run.started is not None and self._timer is not None:
            self._stop_timer()
            self._note_pose(record)
        del self._open[run.run_id]
        texts = {
            "tree.txt": status_text(run, run.tree, self._clock.now()),
            "result.json": json.dumps(result_json(run, record), indent=1),
        }
        files = {record.folder / name: f"{text}\n".encode() for name, text in texts.items()}
        replace_files(files, make_folders=True)
        if self._on_recorded is not None and run.started is not None:
            self._on_recorded(record)


def result_json(run: MissionRun, record: RunRecord) -> dict[str, Any]:
    """Write the end of a run and what was noted, as plain JSON values; metres, radians, seconds."""
    return {
        "run_id": run.run_id,
        "mission": run.mission,
        "caller": run.request.caller,
        "inputs": plain(run.inputs),
        "status": run.status.value,
        "code": run.code,
        "reason": run.reason,
        "cause": run.why.path if run.why else "",
        "outputs": plain(run.outputs),
        "started": run.started,
        "ended": run.ended,
        "ticks": run.ticks,
        "person": plain(record.person),
        "looks": plain(record.looks),
        "path": [[round(t, 3), round(p.x, 4), round(p.y, 4), round(p.yaw, 4)] for t, p in record.path],
    }
