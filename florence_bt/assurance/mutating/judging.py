"""Who notices a small change of a mission: the check, its scenarios, its properties, or nobody."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from florence_bt.assurance.explorer import Limits
from florence_bt.assurance.mutating.draft import (
    Draft,
    Observed,
    draft_of,
    expectation_of,
    observed,
    shortened,
)
from florence_bt.assurance.mutating.mission_mutations import Mutation
from florence_bt.assurance.mutating.pairs import Pair
from florence_bt.assurance.mutating.scenario_text import ScenarioText
from florence_bt.assurance.report import verdict_on
from florence_bt.assurance.verifier import Verifier
from florence_bt.core.declaration import Port, SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.mission_testing.mocks.stubs import copied
from florence_bt.mission_testing.scenarios.scenario import ScenarioResult, run_scenario
from florence_bt.mission_testing.scenarios.scenario_file import Libraries, ScenarioFile, read_scenarios
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.findings import has_errors
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission
from florence_bt.trees.language.parse import parse_mission

REFUSED, SCENARIOS, PROPERTIES = "refused", "scenarios", "properties"
EQUIVALENT, UNDECIDED, UNNOTICED = "equivalent", "undecided", "unnoticed"
MAX_STEPS = 20_000
"""How many steps two versions are explored side by side."""
MAX_DRAFTS = 12
"""How many differences are tried until a scenario shows one."""


@dataclass(frozen=True, slots=True)
class Judged:
    """A change, and who notices it.

    Attributes:
        mutation: The change.
        verdict: One of the constants of this module.
        by: The scenario, or the sentence of the property.
        states: How many pairs of states were looked at to tell it from the original.
        draft: A scenario that passes on the original and fails on the changed mission.
    """

    mutation: Mutation
    verdict: str
    by: str = ""
    states: int = 0
    draft: Draft | None = None


@dataclass
class Judge:
    """Looks at changes of one mission.

    Args:
        name: The mission.
        library: The missions.
        declarations: The skills.
        files: Its scenario files.
        new_file: The file to which scenarios are added.
        folders: Folders of missions for the scenarios.
        limit_s: Seconds of the processor that the verifier may take for the properties of one change, and
            again to tell it from the original.
    """

    name: str
    library: MissionLibrary
    declarations: Mapping[str, SkillDeclaration]
    files: Sequence[Path]
    new_file: Path
    folders: tuple[Path, ...] = ()
    limit_s: float = 10.0

    @property
    def mission(self) -> Mission:
        """The mission as it is."""
        return self.library.get(self.name)

    @cached_property
    def original(self) -> Verifier:
        """The verifier of the missions as they are."""
        return Verifier(self.library, self.declarations, Limits(self.limit_s))

    @cached_property
    def _broken(self) -> frozenset[str]:
        """Everything that is broken already."""
        return frozenset(each.text for each in verdict_on(self.name, self.original).broken)

    @cached_property
    def scenario_text(self) -> ScenarioText:
        """The file to which scenarios are added."""
        return ScenarioText.of(self.new_file, self.mission)

    def see_that_all_pass(self) -> int:
        """Play the scenarios of the mission as it is, and return how many there are.

        Raises:
            ConfigError: One fails.
        """
        count = 0
        for result in self._results(self.files, ()):
            count += 1
            if not result.passed:
                scenario = result.scenario
                problem = f"the scenario {scenario.name!r} fails on the mission as it is"
                raise ConfigError(
                    problem,
                    file=scenario.file,
                    line=scenario.position.line,
                    valid=["florence test, until all pass"],
                )
        return count

    def prepare(self) -> None:
        """Find out what is needed for every change, before processes are forked."""
        for name in ("_broken", "_ports", "scenario_text"):
            getattr(self, name)

    def judge(self, mutation: Mutation) -> Judged:
        """Say who notices a change; the cheapest to ask is asked first."""
        mission = parse_mission(mutation.text, self.mission.file)
        library = copied(self.library)
        library.put(mission)
        if has_errors(mission.findings) or has_errors(check(mission, library, self.declarations)):
            return Judged(mutation, REFUSED)
        scenario = self.failing(mission)
        if scenario is not None:
            return Judged(mutation, SCENARIOS, scenario)
        broken = self._broken  # what is called is explored once, and kept
        changed = self.original.with_changed(library, [self.name])
        new = [each.text for each in verdict_on(self.name, changed).broken if each.text not in broken]
        if new:
            return Judged(mutation, PROPERTIES, new[0])
        return self._told_apart(mutation, mission, changed)

    def failing(self, mission: Mission) -> str | None:
        """Return the first scenario that fails when this mission counts in place of the original."""
        for result in self._results(self.files, [mission]):
            if not result.passed:
                return result.scenario.name
        return None

    def _results(self, files: Iterable[Path], instead: Sequence[Mission]) -> Iterable[ScenarioResult]:
        libraries = Libraries(self.folders, instead)
        for file in files:
            read = read_scenarios(file, libraries)
            for scenario in read.scenarios:
                if scenario.trigger.mission == self.name:
                    yield run_scenario(scenario)
            yield from self._unreadable(read, instead)

    def _unreadable(self, read: ScenarioFile, instead: Sequence[Mission]) -> Iterable[ScenarioResult]:
        """Yield a failure for scenarios that cannot be read with the changed mission."""
        if has_errors(read.findings) and not instead:
            first = next(each for each in read.findings if each.severity == "error")
            raise first.as_error()
        if has_errors(read.findings):
            first = next(each for each in read.findings if each.severity == "error")
            before = read_scenarios(read.file, Libraries(self.folders)).scenarios
            named = max(
                (each for each in before if each.position.line <= first.line),
                key=lambda each: each.position.line,
                default=before[0],
            )
            if named.trigger.mission == self.name:
                yield ScenarioResult(named, ((named.position, first.message),), "", ())

    # ---- told apart -----------------------------------------------------------------------------------

    def _told_apart(self, mutation: Mutation, mission: Mission, changed: Verifier) -> Judged:
        """Look for a difference, at last in every way in which the two missions can go."""
        states = differences = 0
        for at_once in (False, True):
            pair = Pair(self.original, changed, self.name, at_once=at_once)
            draft = self._draft(pair, mission)
            states += pair.explored.states
            differences += pair.explored.differences
            if draft is not None:
                return Judged(mutation, UNNOTICED, "", states, draft)
            if not pair.explored.equivalent:
                return Judged(mutation, UNNOTICED if differences else UNDECIDED, "", states)
        return Judged(mutation, EQUIVALENT, "", states)

    def _draft(self, pair: Pair, mission: Mission) -> Draft | None:
        """Return a scenario that shows a difference; None when none was found that does."""
        for number, way in enumerate(pair.differences(self.limit_s, MAX_STEPS)):
            draft = draft_of(pair, way, self.mission, pair.declarations)
            if draft is not None and (shown := self._shown(draft, mission)) is not None:
                return shown
            if number + 1 == MAX_DRAFTS:
                break
        return None

    def _shown(self, draft: Draft, mission: Mission) -> Draft | None:
        """Return a scenario with what must hold, if it passes on the original and fails on the change."""
        finished = self._finished(draft, mission)
        if finished is None:
            return None
        for name in (*(each for each in draft.skills if each not in draft.named), *draft.inputs):
            shorter = shortened(draft, name)
            again = self._finished(shorter, mission)
            if again is not None:
                draft, finished = shorter, again
        return finished

    def _finished(self, draft: Draft, mission: Mission) -> Draft | None:
        before, after = self._played(draft, ()), self._played(draft, [mission])
        if before is None or not before.runs or after is None:
            return None
        run = before.runs[0]
        other = observed(after.runs[0]) if after.runs else Observed("", "", "", {}, None, ())
        if observed(run) == other or not run.done or any("mock" in text for _, text in before.problems):
            return None
        finished = replace(draft, then=expectation_of(run, other, self.mission, self._ports))
        return finished if self.passes(finished, ()) and not self.passes(finished, [mission]) else None

    def passes(self, draft: Draft, instead: Sequence[Mission]) -> bool:
        """Tell whether a scenario passes on the mission, or on another in its place."""
        result = self._played(draft, instead)
        return result is not None and result.passed

    def _played(self, draft: Draft, instead: Sequence[Mission]) -> ScenarioResult | None:
        with tempfile.TemporaryDirectory(prefix="florence_mutate_") as scratch:
            file = self.scenario_text.alone(draft, Path(scratch))
            read = read_scenarios(file, Libraries(self.folders, instead))
        return run_scenario(read.scenarios[0]) if read.scenarios and not has_errors(read.findings) else None

    @cached_property
    def _ports(self) -> Mapping[str, Mapping[str, Port]]:
        skills = {name: each.inputs for name, each in self.original.declarations.items()}
        return {**skills, **{each.name: each.inputs for each in self.library if each.name not in skills}}
