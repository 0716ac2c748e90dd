"""A process dies on its runs and another one takes them up: simulated in one process on manual clocks."""

from __future__ import annotations

import random
import sqlite3

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import failure, success
from florence_bt.core.skill import Event, RunState
from florence_bt.runtime.executor import Executor, RequestRefused
from florence_bt.runtime.journal import Journal, JournalReader
from florence_bt.runtime.missions import MissionFolders
from florence_bt.runtime.recovery import MAX_IN_A_ROW, SAFE_LIMIT_S, Recovery
from florence_bt.runtime.run import Policy, Request, RunIds, RunStatus
from florence_bt.testing.mocks import ScriptedSkill, Step

DRIVE = SkillDeclaration(
    "drive",
    "Drive somewhere",
    inputs={"goal": Port(Kind.POSE, "where to")},
    outputs={"pose": Port(Kind.POSE, "where it stopped")},
    failures={"blocked": "something is in the way"},
    resources=frozenset({"base"}),
    deadline_s=30.0,
)
SPEAK = SkillDeclaration("speak", "Say something", inputs={"text": Port(Kind.TEXT, "what to say")})
LOOK = SkillDeclaration("look", "Look round", outputs={"count": Port(Kind.INTEGER, "how many people")})

ROUND_TRIP = """
mission: round_trip
description: Drives there and back, with everything on the way that has a memory.
inputs:
  there: {type: pose}
outputs:
  pose: {type: pose, description: where it stopped}
on_restart: POLICY
tree:
  sequence:
    - speak: {text: I go}
    - retry: 3
      on: [blocked]
      do:
        timeout: 20 s
        do:
          drive: {goal: $there}
          out: {pose: pose}
    - wait: 2 s
    - parallel:
        - look:
          out: {count: count}
        - succeed:
            timeout: 1.5 s
            do:
              wait: 5 s
    - selector:
        - sequence:
            - look:
              out: {count: count}
            - fail: nobody there
        - speak: {text: "$count people"}
    - run: home
      with: {from: $pose}
      out: {pose: pose}
"""
HOME = """
mission: home
description: Drives home.
inputs:
  from: {type: pose}
outputs:
  pose: {type: pose, description: where it stopped}
tree:
  repeat: 2
  do:
    drive: {goal: $from}
    out: {pose: pose}
"""


THERE = {"there": "{x: 1 m, y: 2 m, yaw: 0 deg}"}


def trip(**options):
    return Request("round_trip", options.pop("inputs", THERE), **options)


class Late:
    """A clock whose timers ring a little late, each by another while, as on a real machine."""

    def __init__(self, base, seed):
        self._base = base
        self._random = random.Random(seed)

    def now(self):
        return self._base.now()

    def call_at(self, when, callback):
        late = self._random.uniform(0.0001, 0.0015) if when > self._base.now() else 0.0
        return self._base.call_at(when + late, callback)


class Process:
    """A process with an executor; it dies when nobody drives its clock any more."""

    def __init__(self, folder, *, start=0.0, name="A", make_safe=None, drive=None, late=None):
        self.clock = ManualClock(start)
        scripts = {
            "drive": drive
            or [
                Step(failure("blocked", "a chair"), after=1.0),
                Step(success(pose=Pose2(1.0, 2.0, 0.0)), after=3.0),
                Step(success(pose=Pose2(0.5, 0.0, 0.0)), after=3.0),
            ],
            "speak": [Step(after=0.5)],
            "look": [Step(success(count=2), after=1.0)],
        }
        declarations = {d.name: d for d in (DRIVE, SPEAK, LOOK)}
        self.skills = {n: ScriptedSkill(d, self.clock, scripts[n]) for n, d in declarations.items()}
        self.journal = Journal(folder / "runs")
        missions = MissionFolders.of([folder], declarations, built_in=False)
        clock = self.clock if late is None else Late(self.clock, late)
        self.executor = Executor(missions, self.skills, declarations, clock, RunIds(name), log=self.journal)
        self.told = []
        self.recovery = Recovery(self.executor, self.journal, declarations, self.clock, self.told.append)
        self.recovering = self.recovery.begin(make_safe)

    def past(self, run_id):
        with JournalReader(self.journal.folder) as reader:
            return reader.run(run_id)

    def all(self):
        with JournalReader(self.journal.folder) as reader:
            return {run.run_id: run for run in reader.runs(limit=100)}


def missions(folder, policy):
    (folder / "round_trip.yaml").write_text(ROUND_TRIP.strip().replace("POLICY", policy))
    (folder / "home.yaml").write_text(HOME.strip())


def crash(folder, at=6.0, policy="abort", **request):
    """A process that dies on a round trip; gives the run's id."""
    missions(folder, policy)
    first = Process(folder)
    run = first.executor.trigger(trip(caller="test", **request))
    first.clock.advance(at)
    return run.run_id


def test_nothing_is_left_after_a_run_that_ended(tmp_path):
    missions(tmp_path, "resume")
    first = Process(tmp_path)
    run = first.executor.trigger(trip())
    first.clock.advance(60.0)
    assert run.status is RunStatus.SUCCEEDED, run.reason
    assert not Process(tmp_path, name="B").recovering


def test_abort_closes_the_run_with_what_it_was_doing(tmp_path):
    run_id = crash(tmp_path)
    second = Process(tmp_path, name="B")
    past = second.past(run_id)
    assert (past.state, past.code) == ("ABORTED", "crashed")
    assert "the process died on it" in past.reason and "on_restart says abort" in past.reason
    assert "[+] speak" in past.tree and "[>] wait 2 s" in past.tree
    assert second.executor.current is None and second.told
    assert second.executor.find().run_id == run_id, "people who ask are shown it"
    second.executor.trigger(trip())


def test_what_breaks_when_a_run_is_taken_up_aborts_that_run_only(tmp_path, monkeypatch):
    run_id = crash(tmp_path, policy="resume")

    def breaks(*arguments):
        raise KeyError("a node of somebody else")

    monkeypatch.setattr("florence_bt.runtime.recovery.replay", breaks)
    second = Process(tmp_path, name="B")
    past = second.past(run_id)
    assert past.state == "ABORTED" and "KeyError: 'a node of somebody else'" in past.reason
    second.executor.trigger(trip())


def test_restart_begins_the_mission_anew_with_the_same_inputs(tmp_path):
    run_id = crash(tmp_path, policy="restart", inputs={"there": "{x: 3 m, y: 4 m, yaw: 0 deg}"}, priority=2)
    second = Process(tmp_path, name="B")
    new = second.executor.current
    assert new.run_id != run_id and new.request.caller == f"restart of {run_id}"
    assert new.inputs == {"there": Pose2(3.0, 4.0, 0.0)} and new.request.priority == 2
    assert second.past(run_id).state == "ABORTED" and new.run_id in second.past(run_id).reason
    second.clock.advance(60.0)
    assert new.status is RunStatus.SUCCEEDED


def test_a_mission_that_kills_its_process_is_not_restarted_for_ever(tmp_path):
    crash(tmp_path, policy="restart")
    for number in range(MAX_IN_A_ROW):
        process = Process(tmp_path, name=f"B{number}")
        assert process.executor.current is not None
        process.clock.advance(1.0)
    last = Process(tmp_path, name="Z")
    assert last.executor.current is None
    assert "in a row" in max(last.all().values(), key=lambda run: run.run_id).reason


def whole_life(folder):
    """An undisturbed round trip: the skill starts with inputs, and the outputs."""
    missions(folder, "resume")
    process = Process(folder)
    run = process.executor.trigger(trip())
    process.clock.advance(60.0)
    assert run.status is RunStatus.SUCCEEDED
    return {name: len(skill.runs) for name, skill in process.skills.items()}, run


@pytest.mark.parametrize("tenth", range(0, 190, 3))
def test_a_run_is_resumed_wherever_its_process_died(tmp_path, tenth):
    (tmp_path / "whole").mkdir()
    starts, whole = whole_life(tmp_path / "whole")
    (tmp_path / "died").mkdir()
    died_at = tenth / 10.0 + 0.05
    missions(tmp_path / "died", "resume")
    first = Process(tmp_path / "died")
    run = first.executor.trigger(trip())
    first.clock.advance(died_at)
    if run.status.final:
        return
    done = {name: len(skill.runs) - skill.active for name, skill in first.skills.items()}
    going = {name: skill.active for name, skill in first.skills.items()}
    # The drives that are still to come in the second process.
    script = first.skills["drive"]._script
    drive = [script[min(done["drive"] + n, len(script) - 1)] for n in range(5)]
    second = Process(tmp_path / "died", start=5000.0, name="B", drive=drive)
    resumed = second.executor.current
    assert resumed is not None, second.told
    assert resumed.run_id == run.run_id
    second.clock.advance(60.0)
    assert resumed.status is RunStatus.SUCCEEDED, resumed.reason
    assert resumed.outputs == whole.outputs
    # What had ended is not done again; what went on is started again, once.
    for name, count in starts.items():
        assert len(second.skills[name].runs) == count - done[name], (name, going)
    assert second.past(run.run_id).state == "SUCCEEDED"


@pytest.mark.parametrize("seed", range(12))
def test_timers_that_ring_late_do_not_keep_a_run_from_being_resumed(tmp_path, seed):
    missions(tmp_path, "resume")
    first = Process(tmp_path, late=seed)
    run = first.executor.trigger(trip())
    first.clock.advance(1.0 + 1.2 * seed)
    second = Process(tmp_path, start=70.0, name="B", late=seed + 100)
    assert run.status.final or second.executor.current is not None, second.told


def test_waits_and_limits_go_on_where_they_stood(tmp_path):
    # speak 0.5 s, drive 1 s (blocked), drive 3 s, so the wait of 2 s begins at 4.5 s: the last word of the
    # journal. The time that passed since then is not known to anybody.
    run_id = crash(tmp_path, at=6.0, policy="resume")
    second = Process(tmp_path, start=900.0, name="B")
    assert second.executor.tip() == "wait 2 s" and second.executor.current.run_id == run_id
    second.clock.advance(1.9)
    assert not second.skills["look"].runs
    second.clock.advance(0.2)
    assert second.skills["look"].active == 1


def test_a_run_can_be_resumed_again_and_again_but_not_for_ever(tmp_path):
    run_id = crash(tmp_path, at=2.0, policy="resume")
    for number in range(MAX_IN_A_ROW):
        process = Process(tmp_path, start=1000.0 * (number + 1), name=f"B{number}")
        assert process.executor.current is not None, process.told
        process.clock.advance(0.5)
    last = Process(tmp_path, start=9000.0, name="Z")
    assert last.executor.current is None and "resumed 3 times" in last.past(run_id).reason


def test_a_run_that_was_paused_and_resumed_is_taken_up(tmp_path):
    missions(tmp_path, "resume")
    first = Process(tmp_path)
    run = first.executor.trigger(trip())
    first.clock.advance(2.0)
    first.executor.pause("a child")
    first.clock.advance(100.0)
    first.executor.resume()
    first.clock.advance(3.5)
    second = Process(tmp_path, name="B", drive=[Step(success(pose=Pose2(0.0, 0.0, 0.0)), after=3.0)])
    assert second.executor.current is not None, second.told
    assert second.executor.tip() == "wait 2 s"
    second.clock.advance(60.0)
    assert second.past(run.run_id).state == "SUCCEEDED"


def test_a_run_that_was_paused_stays_paused(tmp_path):
    missions(tmp_path, "resume")
    first = Process(tmp_path)
    first.executor.trigger(trip())
    first.clock.advance(2.0)
    first.executor.pause("a child")
    second = Process(tmp_path, name="B")
    run = second.executor.current
    assert run is not None and run.status is RunStatus.PAUSED and run.paused == "a child", second.told
    second.clock.advance(50.0)
    assert not second.skills["drive"].runs
    second.executor.resume()
    second.clock.advance(60.0)
    assert run.status is RunStatus.SUCCEEDED


def test_a_changed_mission_file_is_not_resumed(tmp_path):
    run_id = crash(tmp_path, policy="resume")
    file = tmp_path / "home.yaml"  # a mission that is called counts as well
    file.write_text(file.read_text().replace("repeat: 2", "repeat: 3"))
    second = Process(tmp_path, name="B")
    assert second.past(run_id).state == "ABORTED" and "changed since" in second.past(run_id).reason


def test_a_journal_that_does_not_fit_the_mission_is_not_resumed(tmp_path):
    run_id = crash(tmp_path, policy="resume")
    with sqlite3.connect(tmp_path / "runs" / "journal.sqlite") as connection:
        connection.execute("UPDATE events SET inputs = '{\"text\":\"I stay\"}' WHERE skill = 'speak'")
    connection.close()
    second = Process(tmp_path, name="B")
    reason = second.past(run_id).reason
    assert second.past(run_id).state == "ABORTED" and "I stay" in reason and "I go" in reason


def test_queued_runs_survive_in_their_order(tmp_path):
    missions(tmp_path, "abort")
    first = Process(tmp_path)
    first.executor.trigger(trip())
    waiting = [
        first.executor.trigger(trip(policy=Policy.QUEUE, priority=p, caller=str(p))) for p in (0, 0, 3)
    ]
    first.clock.advance(1.0)
    second = Process(tmp_path, name="B")
    order = [second.executor.current, *second.executor.waiting]
    # The run that had the robot is aborted, so the first of the queue runs at once.
    assert sorted(run.run_id for run in order) == sorted(run.run_id for run in waiting)
    assert [run.request.caller for run in order] == ["3", "0", "0"]
    second.clock.advance(100.0)
    assert {run.state for run in second.all().values()} == {"ABORTED", "SUCCEEDED"}


def test_a_run_that_was_being_stopped_is_not_taken_up(tmp_path):
    missions(tmp_path, "resume")
    first = Process(tmp_path, drive=[Step(None, cancel_takes=5.0)])
    run = first.executor.trigger(trip())
    first.clock.advance(1.0)
    first.executor.stop("enough")
    first.clock.advance(1.0)
    assert run.status is RunStatus.ENDING
    second = Process(tmp_path, name="B")
    assert second.past(run.run_id).state == "ABORTED" and "being stopped" in second.past(run.run_id).reason


class Brake:
    """Makes safe when it is told to."""

    def __init__(self):
        self.state = RunState()
        self.calls = 0
        self.cancelled = False
        self.feedback = ""

    def __call__(self):
        self.calls += 1
        return self

    def poll(self):
        return self.state.result

    def cancel(self):
        self.cancelled = True

    def on_change(self, callback):
        self.state.on_change(callback)


def test_the_robot_is_made_safe_before_anything_else(tmp_path):
    crash(tmp_path, policy="restart")
    brake = Brake()
    second = Process(tmp_path, name="B", make_safe=brake)
    assert brake.calls == 1 and second.executor.current is None
    with pytest.raises(RequestRefused, match="made safe after a crash"):
        second.executor.trigger(trip())
    second.clock.advance(1.0)
    assert second.executor.current is None
    brake.state.handle(Event.FINISHED, success())
    assert second.executor.current is not None
    second.clock.advance(60.0)
    assert second.executor.last.status is RunStatus.SUCCEEDED


@pytest.mark.parametrize("late", [False, True])
def test_nothing_is_taken_up_when_the_robot_cannot_be_made_safe(tmp_path, late):
    run_id = crash(tmp_path, policy="resume")
    brake = Brake()
    second = Process(tmp_path, name="B", make_safe=brake)
    if late:
        second.clock.advance(SAFE_LIMIT_S + 1.0)
        assert brake.cancelled
    else:
        brake.state.handle(Event.FINISHED, failure("server_lost", "the base does not answer"))
    assert second.executor.current is None
    assert second.past(run_id).state == "ABORTED" and "could not be made safe" in second.past(run_id).reason
    assert second.executor.blocked_by is None


def test_the_override_outlives_the_process(tmp_path):
    missions(tmp_path, "restart")
    first = Process(tmp_path)
    first.executor.override("Anna took the joystick")
    second = Process(tmp_path, name="B")
    with pytest.raises(RequestRefused, match="Anna"):
        second.executor.trigger(trip())
    second.executor.release()
    assert Process(tmp_path, name="C").executor.blocked_by is None


def test_names_of_older_runs_are_not_used_again(tmp_path):
    run_id = crash(tmp_path)
    second = Process(tmp_path)
    assert second.executor.trigger(trip()).run_id not in ("", run_id)
