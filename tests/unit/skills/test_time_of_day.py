"""The time of day: when it is the next time, in the time zone of the robot, and who waits for it."""

from __future__ import annotations

import time
from datetime import UTC, datetime
from pathlib import Path

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.skill import Skill
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.journal import Journal
from florence_bt.runtime.missions import MissionFolders
from florence_bt.runtime.recovery.recovery import Recovery
from florence_bt.runtime.run import MissionRequest, RunIds, RunStatus
from florence_bt.skills.time_of_day.bindings import BINDINGS, DATE_LOOK_S, TimeReached, next_moment
from florence_bt.trees.language.declarations import own_declarations


def seconds(*date: int) -> float:
    return datetime(*date, tzinfo=UTC).timestamp()


@pytest.fixture(params=["UTC", "Europe/Berlin"])
def zone(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("TZ", request.param)
    time.tzset()
    yield request.param
    monkeypatch.undo()
    time.tzset()


# Now, UTC | the time | the moment in UTC, and in Berlin
@pytest.mark.parametrize(
    ("now", "text", "utc", "berlin"),
    [
        ((2026, 1, 5, 12, 0), "22:00", (2026, 1, 5, 22, 0), (2026, 1, 5, 21, 0)),
        ((2026, 1, 5, 21, 30), "22:00", (2026, 1, 5, 22, 0), (2026, 1, 6, 21, 0)),
        ((2026, 1, 5, 22, 0), "22:00", (2026, 1, 6, 22, 0), (2026, 1, 6, 21, 0)),
        ((2026, 1, 5, 12, 0), "3:00", (2026, 1, 6, 3, 0), (2026, 1, 6, 2, 0)),
        # The night in which the clocks are put forward has 23 hours.
        ((2026, 3, 28, 22, 0), "08:00", (2026, 3, 29, 8, 0), (2026, 3, 29, 6, 0)),
    ],
)
def test_the_next_time_that_it_is(zone: str, now, text: str, utc, berlin) -> None:
    assert next_moment(text, seconds(*now)) == seconds(*(utc if zone == "UTC" else berlin))


@pytest.mark.parametrize("text", ["24:00", "12:60", "noon", "", "12"])
def test_what_is_no_time_of_day(text: str) -> None:
    assert next_moment(text, 0.0) is None
    clock = ManualClock()
    (look_up,) = (served.make(clock, clock.now) for served in BINDINGS if served.skill == "look_up_time")
    assert look_up.start({"time": text}).poll().code == "no_time"


def test_the_condition_reports_the_moment() -> None:
    clock, told = ManualClock(100.0), []
    skill = TimeReached(clock, clock.now)
    assert skill.start({"date": 130.0}).poll().code == "too_early"
    end = skill.watch({"date": 130.0}, lambda: told.append(clock.now()))
    skill.watch({"date": 140.0}, lambda: told.append(clock.now()))
    end()
    clock.advance(60.0)
    assert told == [140.0]
    assert skill.start({"date": 130.0}).poll().succeeded


def test_the_moment_comes_sooner_or_later_when_the_date_is_set() -> None:
    clock, told, ahead = ManualClock(), [], 0.0
    skill = TimeReached(clock, lambda: clock.now() + ahead)
    skill.watch({"date": 9000.0}, lambda: told.append(clock.now()))
    clock.advance(1000.0)
    ahead = 7900.0
    clock.advance(DATE_LOOK_S)
    assert told == [] and 0.0 < 9000.0 - ahead - clock.now() < DATE_LOOK_S
    ahead = 6000.0
    clock.advance_to(2999.0)
    assert told == []
    clock.advance_to(3001.0)
    assert told == [3000.0]


DECLARATIONS = own_declarations()
MISSION = 'mission: m\non_restart: resume\ntree: {wait_until: "22:00"}\n'


def process(folder: Path, now: float, name: str):
    clock = ManualClock(now)
    skills: dict[str, Skill] = {served.skill: served.make(clock, clock.now) for served in BINDINGS}
    missions = MissionFolders.of([folder], DECLARATIONS, built_in=False)
    journal, told = Journal(folder / "runs"), []
    executor = Executor(missions, skills, DECLARATIONS, clock, RunIds(name), log=journal)
    Recovery(executor, journal, DECLARATIONS, clock, told.append).begin()
    return clock, executor, told


@pytest.mark.parametrize("later", [60.0, 1800.0, 7200.0])
def test_a_mission_waits_for_the_same_moment_after_a_restart(zone: str, tmp_path: Path, later: float) -> None:
    (tmp_path / "m.yaml").write_text(MISSION)
    start = seconds(2026, 1, 5, 20, 0)
    moment = next_moment("22:00", start)
    clock, executor, _ = process(tmp_path, start, "A")
    executor.trigger(MissionRequest("m"))
    clock.advance_to(moment - 1200.0)
    assert executor.current.status is RunStatus.RUNNING
    again = moment - 1200.0 + later
    clock, executor, told = process(tmp_path, again, "B")
    assert "aborted" not in " ".join(told), told
    clock.advance(1.0)
    assert (executor.current is None) == (again + 1.0 >= moment)
    clock.advance_to(max(moment, clock.now()) + 1.0)
    assert executor.last.status is RunStatus.SUCCEEDED


def test_a_mission_wakes_at_the_moment_and_not_before(zone: str, tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(MISSION)
    start = seconds(2026, 1, 5, 12, 0)
    clock, executor, _ = process(tmp_path, start, "A")
    run = executor.trigger(MissionRequest("m"))
    clock.advance(1.0)
    ticks = run.ticks
    clock.advance_to(next_moment("22:00", start) - 0.1)
    assert (run.status, run.ticks) == (RunStatus.RUNNING, ticks)
    clock.advance(0.2)
    assert run.status is RunStatus.SUCCEEDED
