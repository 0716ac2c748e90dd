"""Writes a recorded run as a scenario that ``florence test`` plays."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

from florence_bt.app.mission_files.output import write_output
from florence_bt.app.runs.recorded_mission import RecordedMission, read_recorded_mission, write_texts
from florence_bt.mission_testing.scenarios.from_run import MARK, scenario_of
from florence_bt.mission_testing.scenarios.scenario_file import Libraries
from florence_bt.trees.language.loader import BUILT_IN


def run_to_scenario(folder: Path | None, run_id: str, out: Path, missions: Sequence[Path] = ()) -> str:
    """Write the scenario of a recorded run.

    Args:
        folder: The folder of the journal; that of ``journal_view.journal_folder`` when not given.
        run_id: The run; the latest one when empty.
        out: The file.
        missions: Folders of missions that count instead of the recorded texts, when given.

    Returns:
        What was done, for people.

    Raises:
        ConfigError: There is no such run, no scenario does what it did, or the file cannot be written.
    """
    recorded = read_recorded_mission(folder, run_id, missions)
    home = _home(recorded, missions)
    named = os.path.relpath(home, out.parent) if home is not None else ""
    with tempfile.TemporaryDirectory(prefix="florence_scenario_") as scratch:
        folders = [Path(each).resolve() for each in missions] or write_texts(recorded.texts, Path(scratch))
        text = scenario_of(
            recorded.row,
            recorded.events,
            recorded.library,
            recorded.declarations,
            Libraries(tuple(folders)),
            Path(scratch),
            named,
        )
    write_output(out, text, mark=MARK.encode())
    return "\n".join(
        [f"{out} does what {recorded.row.run_id} did; it was played and passes", *_notes(recorded, home)]
    )


def _home(recorded: RecordedMission, missions: Sequence[Path]) -> Path | None:
    """Return the folder of the mission's file; None for one that comes with Florence."""
    if missions:
        return missions[-1].resolve()
    files = [file for file in recorded.texts if file.stem == recorded.row.mission]
    home = files[0].parent if files else BUILT_IN
    return None if home == BUILT_IN else home


def _notes(recorded: RecordedMission, home: Path | None) -> list[str]:
    """Tell what may keep the scenario from passing where the missions are now."""
    if home is not None and not home.is_dir():
        return [f"its mission was in {home}, which is not there: change missions in the file"]
    edited = [file.name for file, text in recorded.texts.items() if _text_now(file) != text]
    return [f"edited since the run, and played as it was then: {name}" for name in edited]


def _text_now(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8")
    except OSError:
        return ""
