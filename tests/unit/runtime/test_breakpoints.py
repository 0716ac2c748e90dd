"""Breakpoints and steps: the run is paused before a node starts, and goes on as if nothing had been."""

from __future__ import annotations

import random

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.outcome import success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.executor import RequestRefused
from florence_bt.runtime.journal import Journal, JournalReader
from florence_bt.runtime.replay.replay import check
from florence_bt.runtime.run import MissionRequest, MissionRun, RunStatus
from tests.sweeps import sweep
from tests.unit.behaviours.ticking.random_missions import DECLARATIONS, SUB, Author
from tests.unit.runtime.conftest import Bench
from tests.unit.runtime.recovery_bench import Process, missions, trip
from tests.unit.runtime.test_recovery_random import process


def start(bench, tree, *breakpoints):
    """Begin a mission of this tree with breakpoints."""
    file = bench.folder / "own.yaml"
    file.write_text(f"mission: own\ntree: {tree}\n")
    bench.executor.library.add_file(file)
    bench.executor.break_before(breakpoints)
    run = bench.executor.trigger(MissionRequest("own"))
    bench.clock.advance(0.0)
    return run


def test_a_run_is_paused_before_the_node_and_starts_it_when_it_goes_on(bench):
    run = start(bench, "{sequence: [work: , drive: ]}", "drive")
    bench.clock.advance(50.0)
    assert run.status is RunStatus.PAUSED and "drive" in run.paused
    assert bench.work.runs and not bench.drive.runs, "nothing drives while it stands there"
    bench.executor.resume()
    bench.clock.advance(50.0)
    assert run.status is RunStatus.SUCCEEDED and len(bench.drive.runs) == 1


def test_no_time_passes_for_the_run_while_it_stands(bench):
    run = start(bench, "{timeout: 4 s, do: {sequence: [work: , drive: ]}}", "drive")
    bench.clock.advance(500.0)
    bench.executor.resume()
    bench.clock.advance(50.0)
    assert run.status is RunStatus.SUCCEEDED, "1 s of work and 2 s of driving are less than 4 s"


def test_what_ran_beside_it_stands_and_is_started_again(bench):
    bench.script(Step(after=5.0))
    run = start(bench, "{parallel: [drive: , {sequence: [wait: 1 s, work: ]}]}", "work")
    bench.clock.advance(20.0)
    assert run.status is RunStatus.PAUSED and bench.drive.active == 0
    bench.executor.resume()
    bench.clock.advance(20.0)
    assert run.status is RunStatus.SUCCEEDED and len(bench.drive.runs) == 2 and len(bench.work.runs) == 1


def test_it_stands_before_every_round_of_a_loop(bench):
    run = start(bench, "{repeat: 3, do: {work: }}", "work")
    for number in range(3):
        bench.clock.advance(10.0)
        assert run.status is RunStatus.PAUSED and len(bench.work.runs) == number
        bench.executor.resume()
    bench.clock.advance(10.0)
    assert run.status is RunStatus.SUCCEEDED


def test_steps_go_from_leaf_to_leaf(bench):
    run = start(bench, "{sequence: [wait: 1 s, {work: }, {succeed: {drive: }}]}", "wait 1 s")
    stood = []
    while run.status is RunStatus.PAUSED:
        stood.append(bench.executor.tip())
        bench.executor.step()
        bench.clock.advance(10.0)
    assert stood == ["wait 1 s", "work", "drive"] and run.status is RunStatus.SUCCEEDED


def test_a_step_of_a_run_that_goes_on_stands_before_its_next_leaf(bench):
    run = start(bench, "{sequence: [work: , drive: ]}")
    bench.executor.step()
    bench.clock.advance(10.0)
    assert run.status is RunStatus.PAUSED and bench.executor.tip() == "drive"
    with pytest.raises(RequestRefused):
        bench.executor.step("another-run")


def test_a_step_that_comes_to_no_further_leaf_does_not_hold_the_next_run(bench):
    start(bench, "{sequence: [work: ]}")
    bench.executor.step()
    bench.clock.advance(10.0)
    assert start(bench, "{sequence: [work: ]}").status is RunStatus.RUNNING


@pytest.mark.parametrize("stop", ["stop", "override"])
def test_a_stop_ends_it_as_always_and_what_was_not_begun_is_not_cleaned_up(bench, stop):
    run = start(bench, "{sequence: [work: , {sequence: [drive: ], name: trip, finally: {work: }}]}", "trip")
    bench.clock.advance(10.0)
    assert run.status is RunStatus.PAUSED
    getattr(bench.executor, stop)("enough")
    bench.clock.advance(10.0)
    assert run.status is RunStatus.STOPPED and len(bench.work.runs) == 1 and not bench.drive.runs


@pytest.mark.parametrize("name", ["work", "drive_and_work", "second/work", "run drive_and_work/work"])
def test_nodes_are_named_as_people_see_them(bench, name):
    run = start(bench, "{sequence: [{run: drive_and_work, name: second}]}", name)
    bench.clock.advance(50.0)
    assert (run.status is RunStatus.PAUSED) is not name.startswith("run ")


@pytest.mark.parametrize(
    ("name", "stands"),
    [("wait $pause", True), ("wait 2 s", True), ("own/wait 2 s", True), ("wait 3 s", False)],
)
def test_a_value_in_a_name_is_written_as_its_key_or_as_it_is_shown(bench, name, stands):
    run = start(bench, "{sequence: [set: {pause: 2 s}, wait: $pause]}", name)
    bench.clock.advance(10.0)
    assert (run.status is RunStatus.PAUSED) is stands


def test_breakpoints_are_told_until_they_are_taken_away(bench):
    run = start(bench, "{sequence: [work: , drive: ]}", "drive", "work")
    assert bench.executor.breakpoints == ("drive", "work") and "drive" in "".join(bench.executor.warnings())
    with pytest.raises(ConfigError, match="drvie"):
        bench.executor.clear(["drvie"])
    bench.executor.clear(["drive"])
    assert bench.executor.breakpoints == ("work",)
    bench.executor.clear()
    assert not bench.executor.warnings() and run.status is RunStatus.PAUSED, "only a person lets it go on"
    bench.executor.resume()
    bench.clock.advance(50.0)
    assert run.status is RunStatus.SUCCEEDED


def test_breakpoints_of_a_process_that_died_are_told_and_its_run_stays_paused(tmp_path):
    missions(tmp_path, "resume")
    first = Process(tmp_path)
    first.executor.break_before(["look"])
    run = first.executor.trigger(trip())
    first.clock.advance(30.0)
    assert run.status is RunStatus.PAUSED and not first.skills["look"].runs
    second = Process(tmp_path, start=900.0, name="B", drive=[Step(success(pose=None), after=1.0)])
    recovered = second.executor.current
    assert recovered is not None and recovered.status is RunStatus.PAUSED, second.told
    assert "look" in " ".join(second.executor.warnings()) and "look" in " ".join(second.told)
    second.clock.advance(60.0)
    assert not second.skills["look"].runs
    second.executor.resume()
    second.clock.advance(1.0)
    assert second.skills["look"].runs, "it goes on from where it stood"


def test_a_run_with_breakpoints_is_run_again_without_a_difference(tmp_path):
    bench = Bench(tmp_path, log=Journal(tmp_path / "runs"))
    run = start(bench, "{repeat: 2, do: {parallel: [drive: , {sequence: [wait: 1 s, work: ]}]}}", "work")
    for _ in range(3):
        bench.clock.advance(20.0)
        if run.status is RunStatus.PAUSED:
            bench.executor.resume()
    bench.clock.advance(50.0)
    assert run.status is RunStatus.SUCCEEDED
    assert _difference(tmp_path / "runs", "own", bench.executor.library, bench.declarations) is None


def _difference(runs, mission, library, declarations):
    with JournalReader(runs) as reader:
        row = reader.runs(100)[-1]
        events = reader.events(row.run_id)
    return check(MissionRun(row.run_id, MissionRequest(mission), {}), events, library, declarations)


@pytest.mark.parametrize(("asks", "catches"), [(False, False), (True, True)])
@pytest.mark.parametrize("first", sweep(range(0, 100, 20), every=5))
def test_random_missions_are_stepped_through_to_their_end(tmp_path, first, asks, catches):
    held = 0
    for seed in range(first, first + 20):
        folder = tmp_path / str(seed)
        folder.mkdir()
        (folder / "sub.yaml").write_text(SUB)
        (folder / "m.yaml").write_text(Author(seed, asks=asks, catches=catches).file())
        clock, executor, _ = process(folder, seed, start=0.0, name="A")
        chance = random.Random(seed)
        executor.break_before(chance.sample(["work", "count", "ask", "n1", "n5", "sub", "n9", "other"], 5))
        run = executor.trigger(MissionRequest("m"))
        for _ in range(400):
            clock.advance(chance.choice((0.0, 0.5, 3.0, 20.0)))
            if run.status.final:
                break
            if run.status is RunStatus.PAUSED:
                held += 1
                chance.choice((executor.resume, executor.step))()
        else:
            executor.stop("long enough")
            clock.advance(100.0)
        with JournalReader(folder / "runs") as reader:
            broken = [e.data["detail"] for e in reader.events(run.run_id) if e.kind == "broken"]
        assert run.status.final and not broken, (seed, broken)
        assert _difference(folder / "runs", "m", executor.library, DECLARATIONS) is None, seed
    assert held > 3, "it would show little"
