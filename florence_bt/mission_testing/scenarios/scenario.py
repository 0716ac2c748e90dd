"""A scenario as read from its file, and how it went. Data and small closures; nothing is read or run here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from florence_bt.core.plain_yaml import Position
from florence_bt.mission_testing.known import MissionMaps
from florence_bt.mission_testing.mocks.scripts import Script
from florence_bt.mission_testing.play import Play
from florence_bt.mission_testing.stage import Stage
from florence_bt.trees.language.loader import MissionLibrary


@dataclass(frozen=True, slots=True)
class MockEntry:
    """A mock of a scenario.

    Attributes:
        pattern: Whom it answers.
        make: Makes the script; anew for each scenario, because a script may keep count.
        default: Whether it was given for the whole file.
        position: Where it stands.
    """

    pattern: str
    make: Callable[[], Script]
    default: bool
    position: Position


@dataclass(frozen=True, slots=True)
class Happening:
    """Something that happens while a mission runs.

    Attributes:
        text: What it is, for messages.
        act: Lets it happen.
        position: Where it stands.
    """

    text: str
    act: Callable[[Scene], None]
    position: Position


@dataclass(frozen=True, slots=True)
class Check:
    """Something that must hold.

    Attributes:
        assertion: Raises an AssertionError when it does not.
        position: Where it stands.
    """

    assertion: Callable[[Play], object]
    position: Position


@dataclass(frozen=True, slots=True)
class Trigger:
    """How a mission is started.

    Attributes:
        mission: Its name.
        inputs: Its inputs, as texts.
        options: Policy, priority and caller, as far as they are given.
        refused: What the refusal must contain; None when it must be accepted.
        position: Where it stands.
    """

    mission: str
    inputs: Mapping[str, Any]
    options: Mapping[str, Any]
    refused: str | None
    position: Position


@dataclass(frozen=True, slots=True)
class Expectation:
    """What must hold of one run in the end.

    Attributes:
        checks: The checks in the order of the file.
        goes_on: Whether the run is not expected to have ended.
    """

    checks: tuple[Check, ...] = ()
    goes_on: bool = False


@dataclass(frozen=True, slots=True)
class Scenario:
    """One case.

    Attributes:
        name: What it is about.
        file: The file.
        position: Where it begins.
        trigger: How its mission is started.
        mocks: The mocks.
        when: What happens meanwhile.
        then: What must hold of the mission in the end.
        others: What must hold of missions that were started meanwhile, by the names that ``as`` gave them.
        library: The missions.
        maps: Their maps.
    """

    name: str
    file: Path
    position: Position
    trigger: Trigger
    mocks: tuple[MockEntry, ...]
    when: tuple[Happening, ...]
    then: Expectation
    others: Mapping[str, Expectation]
    library: MissionLibrary
    maps: MissionMaps

    @property
    def id(self) -> str:
        """File and name, to choose it by."""
        return f"{self.file}::{self.name}"


@dataclass(slots=True)
class Scene:
    """A scenario that is being played.

    Attributes:
        stage: The stage.
        plays: The runs by name; the scenario's own mission has the empty name.
        problems: What did not hold so far.
    """

    stage: Stage
    plays: dict[str, Play] = field(default_factory=dict)
    problems: list[tuple[Position, str]] = field(default_factory=list)

    @property
    def play(self) -> Play:
        """The run of the scenario's own mission.

        Raises:
            AssertionError: It was refused.
        """
        if "" not in self.plays:
            raise AssertionError("the mission was refused, so there is no run")
        return self.plays[""]


@dataclass(frozen=True, slots=True)
class Result:
    """How a scenario went.

    Attributes:
        scenario: The scenario.
        problems: Where and what did not hold.
        report: The tree and the calls, for the reader of the problems.
        plays: The runs, for the coverage.
        seconds: How long it took on the wall clock.
    """

    scenario: Scenario
    problems: tuple[tuple[Position, str], ...]
    report: str
    plays: tuple[Play, ...]
    seconds: float

    @property
    def passed(self) -> bool:
        """Whether everything held."""
        return not self.problems
