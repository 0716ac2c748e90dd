"""``florence mutate``: changes a mission in small ways, and says which of them nobody notices."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from florence_bt.app.mission_files.output import write_output
from florence_bt.app.mission_files.verifying import load_missions
from florence_bt.assurance.mutating.campaign import Campaign, run_campaign
from florence_bt.assurance.mutating.judging import Judge
from florence_bt.assurance.mutating.mutation_report import report_of
from florence_bt.core.errors import ConfigError
from florence_bt.mission_testing.scenarios.scenario_file import Libraries, read_scenarios
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.findings import has_errors, raise_first_error
from florence_bt.trees.language.loader import BUILT_IN, MissionLibrary
from florence_bt.trees.language.model import Mission

SCENARIOS = "scenarios"
"""The folder in which scenarios are looked for: beside a mission, and beside its folder."""


@dataclass(frozen=True, slots=True)
class MutateOptions:
    """The options of ``florence mutate``.

    Attributes:
        folders: More mission folders that the mission may call.
        scenarios: Scenario files, and folders of them; none: those in the usual places.
        limit_s: How long the verifier may look at one change, in seconds.
        jobs: How many changes are looked at at a time.
        write: Whether to write scenarios that notice what nobody notices.
    """

    folders: tuple[Path, ...] = ()
    scenarios: tuple[Path, ...] = ()
    limit_s: float = 10.0
    jobs: int = 1
    write: bool = False


def mutate_mission(mission: str, options: MutateOptions) -> tuple[str, bool]:
    """Change a mission in small ways.

    Args:
        mission: The name of a mission, or its file.
        options: How.

    Returns:
        The report, and whether every change is noticed that makes a difference.

    Raises:
        ConfigError: There is no such mission, the check finds an error in it, or one of its scenarios fails.
    """
    library = MissionLibrary.load(list(options.folders))
    names = load_missions(library, mission)
    if len(names) != 1:
        raise ConfigError(f"{mission} has {len(names)} missions", valid=["one mission, or its file"])
    judge = judge_of(names[0], library, options)
    campaign = run_campaign(judge, options.jobs)
    written = _write(judge, campaign) if options.write and campaign.drafts else None
    return report_of(campaign, written), not campaign.left


def judge_of(name: str, library: MissionLibrary, options: MutateOptions) -> Judge:
    """Make what looks at the changes of a mission.

    Raises:
        ConfigError: The check finds an error in the mission, or there is no such file of scenarios.
    """
    declarations = collect_declarations()
    mission = library.get(name)
    findings = check(mission, library, declarations)
    if has_errors(findings):
        raise_first_error(findings)
    places = options.scenarios or usual_places(mission)
    files = [file for file in scenario_files(places) if _is_about(file, name, options.folders)]
    named = [file for file in files if file.stem == name]
    new_file = next(iter((*named, *files)), None) or _new_file(places, mission)
    return Judge(name, library, declarations, files, new_file, options.folders, options.limit_s)


def usual_places(mission: Mission) -> tuple[Path, ...]:
    """Return where the scenarios of a mission may be: of one that comes with Florence, here."""
    folder = mission.file.parent
    if folder == BUILT_IN:
        return (Path(SCENARIOS),)
    return tuple(each for each in (folder / SCENARIOS, folder.parent / SCENARIOS) if each.is_dir())


def scenario_files(places: Iterable[Path]) -> Iterator[Path]:
    """Yield scenario files, those of folders in the order of their names.

    Raises:
        ConfigError: There is no such file.
    """
    for place in places:
        if place.is_dir():
            yield from sorted(place.glob("*.yaml"))
        elif place.exists():
            yield place
        elif place.suffix not in (".yaml", ".yml") and place.name != SCENARIOS:
            raise ConfigError(f"there are no scenarios {str(place)!r}", valid=["a scenario file", "a folder"])


def _is_about(file: Path, name: str, folders: tuple[Path, ...]) -> bool:
    if name not in file.read_text(encoding="utf-8"):
        return False
    read = read_scenarios(file, Libraries(folders))
    return any(each.trigger.mission == name for each in read.scenarios)


def _new_file(places: Iterable[Path], mission: Mission) -> Path:
    """Return the file that a mission without scenarios gets."""
    for place in places:
        return place if place.suffix in (".yaml", ".yml") else place / f"{mission.name}.yaml"
    return mission.file.parent / SCENARIOS / f"{mission.name}.yaml"


def _write(judge: Judge, campaign: Campaign) -> Path:
    text = judge.scenario_text.with_added(campaign.drafts)
    write_output(judge.new_file, text, make_folder=True)
    return judge.new_file
