"""``florence test``: reads scenario files, plays them, and reports."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.mission_testing.coverage import Coverage, coverage_text, total_of
from florence_bt.mission_testing.scenarios.files import scenario_files
from florence_bt.mission_testing.scenarios.junit import junit_xml
from florence_bt.mission_testing.scenarios.keyword import keyword_filter
from florence_bt.mission_testing.scenarios.scenario import Result, Scenario
from florence_bt.mission_testing.scenarios.scenario_file import Libraries, ScenarioFile, read_scenarios
from florence_bt.mission_testing.scenarios.scenario_run import run_scenario
from florence_bt.trees.checks.report import Excerpts, report_full

PASSED, FAILED = "[+]", "[x]"
FEW = 25
"""So many scenarios are named each without being asked for."""

Say = Callable[[str, str], None]
"""Takes a line and its style: ``good``, ``bad``, ``head`` or empty."""


@dataclass(frozen=True, slots=True)
class TestOptions:
    """What ``florence test`` was asked for.

    Attributes:
        files: Scenario files, and folders of them.
        folders: More folders of missions.
        keyword: Which scenarios; empty for all.
        junit: Where the results go as JUnit XML, or None.
        coverage: Whether to report what was seen of the missions.
        min_coverage: The least share of outcomes in per cent, or None.
        named: Whether to name each scenario (True) or only those that failed (False); None for each when
            there are few of them.
    """

    files: Sequence[Path]
    folders: Sequence[Path] = ()
    keyword: str = ""
    junit: Path | None = None
    coverage: bool = False
    min_coverage: float | None = None
    named: bool | None = None


def run_scenarios(options: TestOptions, say: Say) -> bool:
    """Play scenarios and say how they went.

    Args:
        options: What was asked for.
        say: Takes each line of the report.

    Returns:
        Whether all passed, no file had an error and the coverage was enough.

    Raises:
        ConfigError: There is no such file, nothing to play, or the keyword cannot be read.
    """
    chosen = keyword_filter(options.keyword)
    libraries = Libraries(tuple(options.folders))
    found = scenario_files(options.files)
    reads = [read_scenarios(file, libraries) for file in found.files]
    wanted = [[each for each in read.scenarios if chosen(each.id)] for read in reads]
    named = options.named if options.named is not None else sum(map(len, wanted)) <= FEW
    results: list[Result] = []
    coverage = Coverage()
    for read, scenarios in zip(reads, wanted, strict=True):
        played = [run_scenario(scenario, libraries, time.perf_counter) for scenario in scenarios]
        _say_file(read, played, options, named, say)
        for result in played:
            scenario = result.scenario
            coverage.add_mission(scenario.library.get(scenario.trigger.mission), scenario.library)
            coverage.add_runs(result.plays)
        results += played
    if not options.keyword:
        for mission, library in libraries.own_missions():
            coverage.add_mission(mission, library)
    findings = [finding for read in reads for finding in read.findings]
    if not results and not findings:
        raise ConfigError(f"no scenario is called like {options.keyword!r}", valid=_names(reads))
    if options.junit is not None:
        _write(options.junit, junit_xml(reads, results))
    for result in results:
        if not result.passed:
            _say_problems(result, say)
    # Nothing was played when every file has errors: what was not seen then says nothing of the missions.
    enough = not results or _say_coverage(coverage, libraries, options, say)
    _say_summary(results, len(findings), found.left_out, say)
    return enough and not findings and all(result.passed for result in results)


def _say_file(read: ScenarioFile, results: list[Result], options: TestOptions, named: bool, say: Say) -> None:
    failed = [result for result in results if not result.passed]
    if options.named is False and not failed and not read.findings:
        return
    if named and results:
        say(str(read.file), "head")
    elif results:
        marks = f"{FAILED if failed else PASSED} {read.file}: {_passed_of(results)}"
        say(marks, "bad" if failed else "good")
    elif read.findings:
        say(str(read.file), "head")
    if read.findings:
        for line in report_full(read.findings, Excerpts()).splitlines():
            say(f"  {line}", "bad" if ": error:" in line else "")
    for result in results if named else failed:
        mark, style = (PASSED, "good") if result.passed else (FAILED, "bad")
        say(f"  {mark} {result.scenario.name}", style)


def _passed_of(results: Sequence[Result]) -> str:
    failed = sum(not result.passed for result in results)
    parts = [f"{len(results) - failed} passed", *([f"{failed} failed"] if failed else [])]
    return ", ".join(parts)


def _say_problems(result: Result, say: Say) -> None:
    scenario = result.scenario
    say("", "")
    say(f"{FAILED} {scenario.name}", "bad")
    for position, problem in result.problems:
        first, *more = problem.splitlines() or [""]
        say(f"{scenario.file}:{position.line}:{position.column}: {first}", "bad")
        for line in more:
            say(f"    {line}", "")
    say("", "")
    for line in result.report.splitlines():
        say(f"    {line}".rstrip(), "")


def _say_coverage(coverage: Coverage, libraries: Libraries, options: TestOptions, say: Say) -> bool:
    """Say what was seen; whether it was enough."""
    if not options.coverage and options.min_coverage is None:
        return True
    reports = coverage.report(libraries.declarations)
    share = total_of(reports).percent
    enough = options.min_coverage is None or share >= options.min_coverage
    if options.coverage or not enough:
        say("", "")
        for line in coverage_text(reports, codes=options.coverage).splitlines():
            say(line, "")
    if not enough:
        say(f"the coverage is {share:.1f} %, below the {options.min_coverage:g} % that are asked for", "bad")
    return enough


def _say_summary(results: list[Result], findings: int, left_out: Sequence[Path], say: Say) -> None:
    failed = any(not result.passed for result in results)
    parts = [_passed_of(results)]
    if findings:
        parts.append(f"{findings} error{'s' * (findings != 1)} in the files")
    say("", "")
    if left_out:
        names = ", ".join(map(str, left_out[:3])) + f" and {len(left_out) - 3} more" * (len(left_out) > 3)
        say(f"not scenarios, left out: {names}", "")
    count = f"{len(results)} scenario{'s' * (len(results) != 1)}"
    say(f"{count}: {', '.join(parts)}", "bad" if failed or findings else "good")


def _names(reads: Iterable[ScenarioFile]) -> list[str]:
    return [scenario.name for scenario in _scenarios(reads)][:8]


def _scenarios(reads: Iterable[ScenarioFile]) -> Iterator[Scenario]:
    for read in reads:
        yield from read.scenarios


def _write(file: Path, text: str) -> None:
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ConfigError(
            f"cannot be written: {error.strerror}", file=file, valid=["a file in a folder that exists"]
        ) from error
