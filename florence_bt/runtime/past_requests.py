"""A request that names an earlier run in place of a mission: the same mission with the same inputs again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.runtime.journal import JournalReader
from florence_bt.runtime.recovery.replay import typed
from florence_bt.runtime.run import RUN_ID, Request
from florence_bt.trees.language.loader import MissionLibrary


def same_again(request: Request, library: MissionLibrary, runs_folder: Path) -> Request:
    """Replace the id of a run by its mission and inputs.

    Args:
        request: What a caller asks for; one that names a mission is given back as it is.
        library: The missions, which know the types of the inputs.
        runs_folder: The folder of the journal.

    Raises:
        ConfigError: No such run is in the journal, or the request brings inputs of its own.
    """
    run_id = request.mission
    if not RUN_ID.fullmatch(run_id):
        return request
    with JournalReader(runs_folder) as reader:
        row = reader.run(run_id)
    if row is None:
        raise ConfigError(f"no run {run_id!r} is in the journal", valid=["a run that florence runs shows"])
    if request.inputs:
        raise ConfigError(
            f"{run_id} is a run, and runs again with the inputs that it had", valid=["no inputs"]
        )
    mission = library.find(row.mission)
    ports = mission.inputs if mission is not None else {}
    inputs = {name: typed(value, ports.get(name)) for name, value in row.inputs.items()}
    return replace(request, mission=row.mission, inputs=inputs)
