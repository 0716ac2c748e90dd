"""A recorded run with the mission that is run again: as the journal has it, or from files as they are now."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from florence_bt.app.runs.journal_view import journal_folder, read_run
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.runtime.journal import JournaledEvent, JournaledRun, JournalReader
from florence_bt.runtime.run import MissionRequest, MissionRun, TriggerPolicy
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.loader import MissionLibrary


@dataclass(frozen=True, slots=True)
class RecordedMission:
    """A recorded run and the missions with which it is run again.

    Attributes:
        row: The run as the journal has it.
        events: What happened in it, in order.
        texts: The texts that it rested on, by file, as they were when it began.
        library: The missions.
        declarations: What the skills say about themselves.
    """

    row: JournaledRun
    events: Sequence[JournaledEvent]
    texts: Mapping[Path, str]
    library: MissionLibrary
    declarations: Mapping[str, SkillDeclaration]

    def run(self) -> MissionRun:
        """Return the run as it began, with inputs of the types that its mission declares."""
        row = self.row
        inputs = row.typed_inputs(self.library.get(row.mission))
        request = MissionRequest(row.mission, inputs, row.caller, TriggerPolicy(row.policy), row.priority)
        return MissionRun(row.run_id, request, inputs)


def read_recorded_mission(folder: Path | None, run_id: str, missions: Sequence[Path] = ()) -> RecordedMission:
    """Read a run that is to be run again.

    Args:
        folder: The folder of the journal; that of ``journal_view.journal_folder`` when not given.
        run_id: The run; the latest one when empty.
        missions: Folders of missions that count instead of the recorded texts, when given.

    Raises:
        ConfigError: There is no such run, or it cannot be run again; says why.
    """
    place = journal_folder(folder)
    row, events = read_run(place, run_id)
    with JournalReader(place) as reader:
        texts = reader.texts(row.run_id)
    if row.started is None:
        raise ConfigError(f"the run {row.run_id} never began", valid=["a run that has begun (florence runs)"])
    if row.lost:
        raise ConfigError(f"the run {row.run_id} cannot be run again: its journal lacks {row.lost} events")
    if not texts and not missions:
        raise ConfigError(
            f"the text of its mission was not recorded with the run {row.run_id}",
            valid=["--missions FOLDER, with the mission as it is now"],
        )
    library = MissionLibrary.load(missions) if missions else library_of(texts)
    declarations = library.with_declared(collect_declarations())
    return RecordedMission(row, events, texts, library, declarations)


def library_of(texts: Mapping[Path, str]) -> MissionLibrary:
    """Load missions and files of skills from their texts, behind those that come with the package."""
    with tempfile.TemporaryDirectory(prefix="florence_replay_") as scratch:
        return MissionLibrary.load(write_texts(texts, Path(scratch)))


def write_texts(texts: Mapping[Path, str], scratch: Path) -> list[Path]:
    """Write texts below a folder, those of one folder into one again; return these folders."""
    folders: dict[Path, Path] = {}
    for file, text in texts.items():
        folder = folders.setdefault(file.parent, scratch / str(len(folders)))
        folder.mkdir(exist_ok=True)
        (folder / file.name).write_bytes(text.encode())
    return list(folders.values())
