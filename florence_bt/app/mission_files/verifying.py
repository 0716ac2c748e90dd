"""``florence verify``: explores missions, and says what holds in every way in which they can go."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from florence_bt.assurance.explorer import Limits
from florence_bt.assurance.problems import BROKEN
from florence_bt.assurance.report import Verdict, table_of, text_of, verdict_on
from florence_bt.assurance.scenario import write_scenario
from florence_bt.assurance.verifier import Verifier
from florence_bt.core.errors import ConfigError
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.declared_skills import is_skills_file
from florence_bt.trees.language.findings import has_errors, raise_first_error
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.parse import parse_mission


@dataclass(frozen=True, slots=True)
class VerifyOptions:
    """The options of ``florence verify``.

    Attributes:
        folders: More mission folders that the missions may call.
        limit_s: How long the exploration of one mission may take, in seconds.
        details: Whether to show the longest run.
        table: Whether to write a table instead.
        scenarios: Where scenario files are written; None: none are.
    """

    folders: tuple[Path, ...] = ()
    limit_s: float = 30.0
    details: bool = False
    table: bool = False
    scenarios: Path | None = None


def verify_missions(missions: Sequence[str], options: VerifyOptions) -> tuple[str, bool]:
    """Verify missions.

    Args:
        missions: Names of missions, mission files, and folders of them.
        options: How.

    Returns:
        The report, and whether everything holds.

    Raises:
        ConfigError: There is no such mission, or the check finds errors in one.
    """
    library = MissionLibrary.load(list(options.folders))
    verdicts = _verdicts(
        library, [name for each in missions for name in load_missions(library, each)], options.limit_s
    )
    if options.table:
        report = table_of(verdicts)
    else:
        report = "\n\n".join(_report(each, options) for each in verdicts)
    return report, all(each.holds for each in verdicts)


def verify_text(text: str, file: Path, folders: Sequence[Path], limit_s: float) -> Verdict:
    """Verify a mission that is being written.

    Args:
        text: Its text.
        file: Where it stands, or will: what lies beside it counts.
        folders: Folders of missions beside those that come with Florence.
        limit_s: How long the exploration of one mission may take, in seconds.

    Raises:
        ConfigError: The check finds errors in it.
    """
    library = MissionLibrary.load(list(folders))
    library.put(parse_mission(text, file))
    return _verdicts(library, [file.stem], limit_s)[0]


def _verdicts(library: MissionLibrary, names: Sequence[str], limit_s: float) -> list[Verdict]:
    """Check and explore missions of a library."""
    declarations = collect_declarations()
    for name in names:
        findings = check(library.get(name), library, declarations)
        if has_errors(findings):
            raise_first_error(findings)
    verifier = Verifier(library, declarations, Limits(limit_s))
    return [verdict_on(name, verifier) for name in names]


def _report(verdict: Verdict, options: VerifyOptions) -> str:
    written: dict[int, Path] = {}
    if options.scenarios is not None:
        written = dict(_write_scenarios(verdict, options.scenarios))
    return text_of(verdict, written, details=options.details)


def _write_scenarios(verdict: Verdict, folder: Path) -> Iterator[tuple[int, Path]]:
    """Write a scenario for each broken thing that one can show; yields its number and the file."""
    for number, problem in enumerate(verdict.problems):
        file = folder / f"{verdict.mission.name}_{problem.kind}_{number + 1}.yaml"
        if problem.severity == BROKEN and write_scenario(verdict.explored, problem, file):
            yield number, file


def load_missions(library: MissionLibrary, mission: str) -> list[str]:
    """Make missions known, and return their names."""
    path = Path(mission)
    if path.is_dir():
        files = [each for each in sorted(path.glob("*.yaml")) if not is_skills_file(each)]
        if not files:
            raise ConfigError(f"{mission} has no missions", valid=["a folder of mission files"])
    elif path.suffix in (".yaml", ".yml"):
        files = [path]
    else:
        return [library.get(mission).name]
    for file in files:
        library.add_file(file)
    library.add_neighbours([library.get(file.stem) for file in files])
    return [file.stem for file in files]
