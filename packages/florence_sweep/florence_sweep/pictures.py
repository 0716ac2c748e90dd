"""The picture of one case: it is run again, and where it drove is drawn."""

from __future__ import annotations

import tempfile
from pathlib import Path

from florence_bt.simulation.home.picture import draw_run
from florence_sweep.experiment import Case
from florence_sweep.outcome import Outcome
from florence_sweep.running import judge, stage


def drawn(case: Case, file: Path) -> Outcome:
    """Run a case once more and draw its way on the map of its home.

    Args:
        case: The case.
        file: The PNG file.

    Returns:
        What came of it: the same as before.

    Raises:
        ConfigError: The case cannot be run.
    """
    with tempfile.TemporaryDirectory() as folder:
        staged = stage(case, Path(folder))
        outcome = judge(case, staged)
        (record,) = staged.rig.records
    person = staged.rig.world.person_pose(staged.people[0].name) if staged.people else None
    draw_run(
        staged.rig.grid,
        [pose for _, pose in record.path],
        person,
        record.looks,
        file,
        f"{case.setup.mission}, {case.variation or 'run'}, seed {case.seed}: {outcome.status}",
        {spot.label: spot.pose for spot in staged.rig.locator.hotspots},
    )
    return outcome
