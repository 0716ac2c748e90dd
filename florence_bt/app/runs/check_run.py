"""Checks a recorded run: its mission, run again on what the skills answered then, must do the same."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from florence_bt.app.runs.recorded_mission import RecordedMission, read_recorded_mission
from florence_bt.core.errors import ConfigError
from florence_bt.runtime.events import EventKind
from florence_bt.runtime.replay.comparison import Difference
from florence_bt.runtime.replay.replay import ReplayDiverged, check


def check_run(folder: Path | None, run_id: str, missions: Sequence[Path] = ()) -> tuple[bool, str]:
    """Run a recorded run again.

    Args:
        folder: The folder of the journal; that of ``journal_view.journal_folder`` when not given.
        run_id: The run; the latest one when empty.
        missions: Folders of missions that are tried instead of the recorded texts, when given.

    Returns:
        Whether it does the same, and the answer for people.

    Raises:
        ConfigError: There is no such run, or it cannot be run again; says why.
    """
    recorded = read_recorded_mission(folder, run_id, missions)
    difference = difference_of(recorded)
    name = recorded.row.run_id
    if difference is None:
        ticks = max(event.tick for event in recorded.events)
        return True, f"{name}: the same, in all of its {ticks} ticks ({recorded.row.state})"
    return False, "\n".join([f"{name}: another run", *difference_lines(difference)])


def difference_of(recorded: RecordedMission) -> Difference | None:
    """Return where a run differs from what was recorded; None when it does not.

    Raises:
        ConfigError: The run cannot be run again, from some point on; says why.
    """
    broken = [event for event in recorded.events if event.kind == EventKind.BROKEN.value]
    breaks_down = bool(broken) and recorded.row.code == "internal_error"
    events = [event for event in recorded.events if not breaks_down or event.tick < broken[0].tick]
    try:
        difference = check(recorded.run(), events, recorded.library, recorded.declarations)
    except ReplayDiverged as error:
        raise ConfigError(f"the run {recorded.row.run_id} cannot be run again: {error}") from error
    if difference is None and breaks_down:
        raise ConfigError(
            f"the run {recorded.row.run_id} does the same up to tick {broken[0].tick}; there an exception "
            "came out of a skill or a node, which cannot be run again",
            valid=["florence status --events, which has its traceback"],
        )
    return difference


def difference_lines(difference: Difference) -> list[str]:
    """Say where two runs differ, for people."""
    return [
        f"  first at tick {difference.tick}, {difference.at:.1f} s after the start",
        f"  node      {difference.node or '(the whole run)'}",
        f"  recorded  {difference.recorded}",
        f"  now       {difference.replayed}",
    ]
