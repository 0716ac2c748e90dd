"""What a run leaves behind: a folder with its journal, its final tree, its result and the path driven.

``<runs>/<run id>/journal.jsonl`` has one event a line, flushed as it happens; ``tree.txt`` the final tree
with the reason; ``result.json`` the end and what was measured on the way; pictures are drawn from that file.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from florence_bt.core.clock import Clock, Timer, call_every
from florence_bt.core.geometry import Pose2
from florence_bt.runtime.events import Event, EventKind, plain
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.run import MissionRun
from florence_bt.runtime.status import status_text

PATH_PERIOD_S = 0.2
"""How often the robot's position is noted while a mission runs."""

LOOK_SKILL = "look_for_user"


@dataclass
class RunRecord:
    """What was noted during a run.

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

    Args:
        executor: Whose runs are recorded.
        runs_folder: Parent of the runs' folders; made when needed.
        clock: Times the notes of the path.
        robot_pose: Where the robot is now in the map frame, None when unknown.
        on_recorded: Called with the record when all its files are written.
    """

    def __init__(
        self,
        executor: Executor,
        runs_folder: Path,
        clock: Clock,
        robot_pose: Callable[[], Pose2 | None],
        on_recorded: Callable[[RunRecord], None] | None = None,
    ) -> None:
        self._executor = executor
        self._runs_folder = runs_folder
        self._clock = clock
        self._robot_pose = robot_pose
        self._on_recorded = on_recorded
        self._open: dict[str, tuple[RunRecord, IO[str]]] = {}
        self._timer: Timer | None = None
        self._closed = False
        executor.add_listener(self._on_event)

    def folder_of(self, run_id: str) -> Path:
        """The folder of a run."""
        return self._runs_folder / run_id

    def close(self) -> None:
        """Close the journals of runs that have not ended; what happened so far is in them."""
        for _, journal in self._open.values():
            journal.close()
        self._open.clear()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self._closed = True

    def _on_event(self, run: MissionRun, event: Event) -> None:
        if self._closed:
            return
        if run.run_id not in self._open:
            folder = self.folder_of(run.run_id)
            folder.mkdir(parents=True, exist_ok=True)
            file = (folder / "journal.jsonl").open("a", encoding="utf-8")
            self._open[run.run_id] = (RunRecord(folder), file)
        record, journal = self._open[run.run_id]
        journal.write(json.dumps(event.to_json()) + "\n")
        journal.flush()
        if event.kind is EventKind.STARTED:
            self._note_pose(record)
            self._timer = call_every(self._clock, PATH_PERIOD_S, lambda: self._note_pose(record))
        elif event.kind is EventKind.SKILL_STARTED and event.data["skill"] == LOOK_SKILL:
            pose = self._robot_pose()
            if pose is not None:
                record.looks.append(pose)
        elif event.kind is EventKind.SKILL_ENDED and event.data["skill"] == LOOK_SKILL:
            record.person = event.data["outputs"].get("user", record.person)
        elif event.kind is EventKind.ENDED:
            self._finish(run, record, journal)

    def _note_pose(self, record: RunRecord) -> None:
        pose = self._robot_pose()
        if pose is not None:
            record.path.append((self._clock.now(), pose))

    def _finish(self, run: MissionRun, record: RunRecord, journal: IO[str]) -> None:
        if run.started is not None and self._timer is not None:
            self._timer.cancel()
            self._timer = None
            self._note_pose(record)
        journal.close()
        del self._open[run.run_id]
        text = status_text(run, self._executor.render(run), self._clock.now())
        (record.folder / "tree.txt").write_text(text + "\n", encoding="utf-8")
        (record.folder / "result.json").write_text(
            json.dumps(result_json(run, record), indent=1) + "\n", encoding="utf-8"
        )
        if self._on_recorded is not None:
            self._on_recorded(record)


def result_json(run: MissionRun, record: RunRecord) -> dict[str, Any]:
    """The end of a run and what was noted, as plain JSON values; metres, radians, seconds."""
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
