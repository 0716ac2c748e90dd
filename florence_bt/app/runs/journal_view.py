"""Shows recorded runs without a running system: the list of runs, one run with its tree and its timeline."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from florence_bt.app.bringup.locks import running_folder
from florence_bt.app.wrapping import in_columns
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.runtime.journal import JOURNAL_FILE, JournaledEvent, JournaledRun, JournalReader
from florence_bt.runtime.journal.text import journal_text, timeline
from florence_bt.runtime.run import RunStatus
from florence_bt.runtime.status import duration_text, outputs_text
from florence_bt.trees.language.declarations import collect_declarations

RUNS = Path("runs")
"""Folder of the verbs' runs when none is given, and of a bring-up's runs within its own."""


def runs_table(
    folder: Path | None, *, mission: str, state: str, limit: int, columns: int | None = None
) -> list[str]:
    """List the latest runs, a line each, under a head line.

    Args:
        folder: The folder of the journal; that of :func:`journal_folder` when not given.
        mission: Only runs of this mission.
        state: Only runs in this state.
        limit: At most this many.
        columns: How wide the terminal is: in a narrow one a run has several lines; None for a line each.

    Raises:
        ConfigError: There is no journal, no such state, or a limit below 1.
    """
    states = [status.value.lower() for status in RunStatus]
    if state and state.lower() not in states:
        raise ConfigError(f"there is no state {state!r}", valid=closest_first(state.lower(), states))
    if limit < 1:
        raise ConfigError(f"the limit must be at least 1, not {limit}", valid=["20"])
    place = journal_folder(folder)
    if folder is None and not any(place.glob(f"{Path(JOURNAL_FILE).stem}*")):
        return [f"the running system has recorded no run yet in {place}"]
    with JournalReader(place) as reader:
        runs = reader.runs(limit, mission, state)
        missions = {run.mission for run in reader.runs(10_000)} if mission and not runs else set()
    if missions and mission not in missions:
        raise ConfigError(f"no run of {mission!r} is recorded", valid=closest_first(mission, missions))
    if not runs:
        return ["no run is recorded that fits"]
    head = ("accepted (UTC)", "state", "took", "run", "why, or outputs")
    return in_columns([head, *(_cells(run) for run in runs)], columns)


def run_text(folder: Path | None, run_id: str, *, events: bool) -> str:
    """Describe one recorded run: where it stands or how it ended, its tree, and what happened when.

    Args:
        folder: The folder of the journal; that of :func:`journal_folder` when not given.
        run_id: The run; the latest one when empty.
        events: Whether to add the timeline.

    Raises:
        ConfigError: There is no journal or no such run.
    """
    run, happened = read_run(journal_folder(folder), run_id)
    lines = [journal_text(run, happened)]
    if run.lost:
        lines.append(f"note: {run.lost} events of this run could not be kept")
    if events:
        lines += ["", *timeline(happened, collect_declarations())]
    return "\n".join(lines)


def read_run(folder: Path, run_id: str) -> tuple[JournaledRun, list[JournaledEvent]]:
    """Read one run of a journal with its events; the latest one when the id is empty.

    Raises:
        ConfigError: There is no journal or no such run.
    """
    with JournalReader(folder) as reader:
        latest = reader.runs(1)
        run = reader.run(run_id) if run_id else (latest[0] if latest else None)
        if run is None:
            known = [each.run_id for each in reader.runs(5)]
            raise ConfigError(f"no run {run_id!r} is recorded in {reader.path}", valid=known)
        return run, list(reader.events(run.run_id))


def left_runs(folder: Path) -> list[str]:
    """Return the runs without an end in a folder that no system uses now; none without a journal.

    One that cannot be read hides them, and the log of the mission server says so.
    """
    try:
        with JournalReader(folder) as reader:
            return [run.run_id for run in reader.unfinished()]
    except ConfigError:
        return []


def outcomes_of(folder: Path, run_ids: Sequence[str]) -> list[str]:
    """Return a line for each of the runs that :func:`left_runs` found before the system started.

    Raises:
        ConfigError: The journal cannot be read any more.
    """
    if not run_ids:
        return []
    with JournalReader(folder) as reader:
        runs = [run for run_id in run_ids if (run := reader.run(run_id)) is not None]
    return [
        f"{run.run_id} had not ended when the last system did; now {run.state}"
        + (f", {run.reason}" if run.reason else "")
        for run in runs
    ]


def journal_folder(folder: Path | None) -> Path:
    """Return the folder whose journal is meant: the one given, that of the running system, or the one used
    last below ``runs``.

    Raises:
        ConfigError: None was given, no system runs and there is no journal below ``runs``.
    """
    if folder is not None:
        return folder
    running = running_folder()
    if running is not None:
        return running / RUNS
    found = [*RUNS.glob(f"*/{JOURNAL_FILE}"), *RUNS.glob(f"*/*/{JOURNAL_FILE}")]
    found += [path for path in (RUNS / JOURNAL_FILE,) if path.is_file()]
    if not found:
        raise ConfigError(
            f"no system runs here, and there is no journal below {str(RUNS)!r}",
            valid=[f"--folder FOLDER with a file {JOURNAL_FILE}"],
        )
    return max(found, key=_last_written).parent


def _last_written(path: Path) -> float:
    files = [path, path.with_name(f"{path.name}-wal")]
    return max(file.stat().st_mtime for file in files if file.exists())


def _cells(run: JournaledRun) -> tuple[str, ...]:
    accepted = run.accepted.replace("T", " ").partition(".")[0]
    took = duration_text(run.as_run(), run.ended) if run.ended is not None else ""
    why = f"{run.code}: {run.reason}" if run.reason and run.code else run.reason
    return accepted or "-", run.state, took or "-", run.run_id, why or outputs_text(run.as_run())
