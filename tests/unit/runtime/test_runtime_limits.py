"""The small parts under the executor: who waits, who is admitted, clocks of runs, requests, the journal."""

from __future__ import annotations

from pathlib import Path

import pytest

from florence_bt.behaviours.why import Why
from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.runtime import requests
from florence_bt.runtime.arbiter import Admission, decide
from florence_bt.runtime.event_bus import EventBus, NoLog
from florence_bt.runtime.events import EventKind, RunEvent
from florence_bt.runtime.journal import Journal, JournalParameters, JournalReader
from florence_bt.runtime.requests import MAX_INPUTS, check_in_time, request_from_texts, same_again
from florence_bt.runtime.run import RUN_ID, MissionRequest, MissionRun, RunStatus, TriggerPolicy, utc_stamp
from florence_bt.runtime.run_clock import RunClock
from florence_bt.runtime.run_queue import RunQueue
from florence_bt.runtime.status import details_line, duration_text, head_line, values_text, why_line
from florence_bt.trees.language.loader import MissionLibrary

QUEUE, PREEMPT, REJECT = TriggerPolicy.QUEUE, TriggerPolicy.PREEMPT, TriggerPolicy.REJECT


def run(name: str, priority: int = 0, status: RunStatus = RunStatus.RUNNING) -> MissionRun:
    return MissionRun(name, MissionRequest("tidy", priority=priority), {}, status)


# ---- who waits, and who is admitted --------------------------------------------------------------------


def test_the_queue_goes_by_priority_then_by_order() -> None:
    queue = RunQueue(9)
    for name, priority in (("a", 0), ("b", 5), ("c", 0), ("d", 5), ("e", -1), ("f", 3)):
        queue.add(run(name, priority))
    assert [each.run_id for each in queue] == ["b", "d", "f", "a", "c", "e"]
    queue.add(run("g", 0), first=True)
    queue.add(run("h", 9), first=True)
    queue.add(run("i", -5), first=True)
    assert [each.run_id for each in queue] == ["h", "b", "d", "f", "g", "a", "c", "e", "i"]
    assert queue.take().run_id == "h"
    found = queue.remove("f")
    assert found is not None and found.run_id == "f"
    assert queue.remove("f") is None
    assert [each.run_id for each in queue.take_all()] == ["b", "d", "g", "a", "c", "e", "i"]
    assert len(queue) == 0


def test_a_queue_is_full_at_its_limit_and_crowded_one_above() -> None:
    queue, seen = RunQueue(2), []
    for name in "abc":
        seen.append((queue.full, queue.crowded))
        queue.add(run(name))
    assert [*seen, (queue.full, queue.crowded)] == [
        (False, False),
        (False, False),
        (True, False),
        (True, True),
    ]
    assert RunQueue(1).limit == 1
    with pytest.raises(ValueError, match="room for at least one run, not 0"):
        RunQueue(0)


@pytest.mark.parametrize(
    ("policy", "priority", "waiting", "admission"),
    [
        (REJECT, 9, 0, Admission.REJECT),
        (QUEUE, 0, 0, Admission.QUEUE),
        (QUEUE, 0, 1, Admission.QUEUE),
        (QUEUE, 9, 2, Admission.REJECT),
        (PREEMPT, 4, 0, Admission.REJECT),
        (PREEMPT, 5, 0, Admission.PREEMPT),
        (PREEMPT, 6, 0, Admission.PREEMPT),
        (PREEMPT, 5, 2, Admission.PREEMPT),
        (PREEMPT, 5, 3, Admission.REJECT),
        (PREEMPT, 4, 3, Admission.REJECT),
    ],
)
def test_a_request_while_a_mission_runs(
    policy: TriggerPolicy, priority: int, waiting: int, admission: Admission
) -> None:
    queue = RunQueue(2)
    for number in range(waiting):
        queue.add(run(f"w{number}"))
    decision = decide(MissionRequest("tidy", policy=policy, priority=priority), run("R-1", 5), queue=queue)
    assert decision.admission is admission
    if admission is Admission.REJECT:
        assert "R-1" in decision.reason and "priority 5" in decision.reason


def test_a_request_while_nothing_runs_or_everything_is_blocked() -> None:
    for policy in TriggerPolicy:
        request = MissionRequest("tidy", policy=policy)
        assert decide(request, None).admission is Admission.START
        for current in (None, run("R-1")):
            blocked = decide(request, current, "the override is on")
            assert (blocked.admission, blocked.reason) == (Admission.REJECT, "the override is on")


# ---- the clock of a run --------------------------------------------------------------------------------


def test_a_frozen_clock_stands_still_and_calls_nobody() -> None:
    base = ManualClock(100.0)
    clock, told = RunClock(base), list[tuple[str, float]]()
    for name, when in (("b", 103.0), ("a", 102.0), ("c", 103.0)):
        clock.call_at(when, lambda name=name: told.append((name, clock.now())))
    base.advance(1.0)
    assert (clock.now(), clock.frozen) == (101.0, False)
    clock.freeze()
    base.advance(10.0)
    clock.freeze()
    clock.call_at(101.5, lambda: told.append(("d", clock.now())))
    base.advance(10.0)
    assert (clock.now(), clock.frozen, told) == (101.0, True, [])
    clock.thaw()
    clock.thaw()
    assert (clock.now(), clock.frozen) == (101.0, False)
    base.advance(1.5)
    assert told == [("d", 101.5), ("a", 102.0)]
    clock.freeze()
    base.advance(5.0)
    clock.thaw()
    base.advance(9.0)
    assert told[2:] == [("b", 103.0), ("c", 103.0)], "equal moments in the order of the calls"
    assert clock.now() == 111.5


def test_a_cancelled_timer_never_rings_also_when_it_was_cancelled_while_frozen() -> None:
    base = ManualClock()
    clock, told = RunClock(base), list[str]()
    early, late = (clock.call_at(when, lambda: told.append("rang")) for when in (1.0, 2.0))
    early.cancel()
    early.cancel()
    clock.freeze()
    late.cancel()
    clock.thaw()
    base.advance(10.0)
    assert told == []


def test_a_clock_that_is_moved_goes_on_from_its_own_time_once_it_is_thawed() -> None:
    clock, told = RunClock(ManualClock(50.0)), list[float]()
    clock.call_at(53.0, lambda: told.append(clock.now()))
    other = ManualClock(1000.0)
    clock.move_to(other)
    other.advance(7.0)
    assert (clock.now(), clock.frozen) == (50.0, True)
    clock.thaw()
    other.advance(2.9)
    assert told == []
    other.advance(0.1)
    assert told == [pytest.approx(53.0)]


# ---- requests ------------------------------------------------------------------------------------------


def test_a_request_may_have_as_many_inputs_as_the_limit() -> None:
    names = [f"i{number}" for number in range(MAX_INPUTS)]
    assert len(request_from_texts("m", names, names, caller="me").inputs) == MAX_INPUTS
    with pytest.raises(ConfigError, match=f"{MAX_INPUTS + 1} inputs are too many"):
        request_from_texts("m", [*names, "one"], [*names, "1"], caller="me")


def test_what_comes_too_late_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(requests.time, "time", lambda: 1000.0)
    for valid_until in (0.0, 1000.0, 1000.5):
        check_in_time(valid_until)
    with pytest.raises(ConfigError, match=r"this came 2\.5 s after the date until which it was wanted"):
        check_in_time(997.5)


def test_a_run_is_named_by_its_id_and_no_mission_is(tmp_path: Path) -> None:
    assert RUN_ID.fullmatch(f"{utc_stamp()}-001-tidy")
    library = MissionLibrary.load([tmp_path], built_in=False)
    request = MissionRequest("tidy", {"room": "hall"})
    assert same_again(request, library, tmp_path) is request
    journal = Journal(tmp_path)
    old = MissionRun("20240501T101500Z-001-tidy", MissionRequest("tidy"), {})
    journal.write(old, RunEvent(1.0, old.run_id, EventKind.STARTED, {}, 0))
    journal.close()
    with pytest.raises(ConfigError, match="no run '20240501T101500Z-002-tidy' is in the journal"):
        same_again(MissionRequest("20240501T101500Z-002-tidy"), library, tmp_path)
    with pytest.raises(ConfigError, match="runs again with the inputs that it had"):
        same_again(MissionRequest(old.run_id, {"room": "hall"}), library, tmp_path)


# ---- listeners -----------------------------------------------------------------------------------------


class KeptLog(NoLog):
    """Keeps what was done with it, in order."""

    def __init__(self) -> None:
        self.done: list[str] = []

    def write(self, run: MissionRun, event: RunEvent) -> None:
        self.done.append(event.kind.value)

    def flush(self) -> None:
        self.done.append("flush")


def test_what_somebody_relies_on_is_safe_before_anybody_hears_of_it() -> None:
    log = KeptLog()
    bus = EventBus(ManualClock(7.0), log)
    bus.add_listener(lambda run, event: log.done.append(f"heard {event.kind.value} at {event.time}"))
    bus.publish(run("R-1"), EventKind.STARTED)
    bus.publish(run("R-1"), EventKind.NODE)
    assert log.done == ["started", "flush", "heard started at 7.0", "node", "heard node at 7.0"]
    log.done.clear()
    with bus.publishing(run("R-1"), EventKind.PAUSED):
        log.done.append("urgent")
    assert log.done == ["paused", "urgent", "flush", "heard paused at 7.0"]


def test_a_run_that_is_over_has_no_events_but_its_end() -> None:
    log = KeptLog()
    bus = EventBus(ManualClock(), log)
    over = run("R-1", status=RunStatus.FAILED)
    bus.publish(over, EventKind.NODE)
    assert log.done == []
    bus.publish(over, EventKind.ENDED)
    assert log.done == ["ended", "flush"]


def test_a_listener_that_breaks_is_told_of_once_a_run_and_the_others_hear_on() -> None:
    log = KeptLog()
    bus = EventBus(ManualClock(), log)
    heard: list[tuple[str, str]] = []

    def broken(run: MissionRun, event: RunEvent) -> None:
        raise ValueError("broken")

    bus.add_listener(broken)
    bus.add_listener(lambda run, event: heard.append((run.run_id, event.kind.value)))
    for name in ("R-1", "R-1", "R-2"):
        bus.publish(run(name), EventKind.NODE)
    assert heard == [
        ("R-1", "broken"),
        ("R-1", "node"),
        ("R-1", "node"),
        ("R-2", "broken"),
        ("R-2", "node"),
    ]
    assert log.done.count("broken") == 2
    bus.publish_error(run("R-2"), KeyError("lost"))
    assert log.done[-1] == "broken" and heard[-1] == ("R-2", "broken")


# ---- the journal ---------------------------------------------------------------------------------------


def ended(journal: Journal, number: int, nodes: int = 0) -> MissionRun:
    done = MissionRun(f"R-{number:03d}", MissionRequest("tidy"), {}, RunStatus.RUNNING, started=1.0)
    journal.write(done, RunEvent(1.0, done.run_id, EventKind.STARTED, {}, 0))
    for index in range(nodes):
        data = {"node": f"n{index}", "old": "INVALID", "new": "RUNNING", "reason": ""}
        journal.write(done, RunEvent(1.0, done.run_id, EventKind.NODE, data, 0))
    done.status, done.ended = RunStatus.SUCCEEDED, 2.0
    journal.write(done, RunEvent(2.0, done.run_id, EventKind.ENDED, {}, 0))
    journal.flush()
    return done


def kept(folder: Path) -> list[str]:
    with JournalReader(folder) as reader:
        return [row.run_id for row in reader.runs(limit=1000)]


@pytest.mark.parametrize(("keep", "most"), [(1, 2), (10, 11), (20, 22), (25, 27)])
def test_old_runs_are_dropped_once_in_a_tenth_of_what_is_kept(tmp_path: Path, keep: int, most: int) -> None:
    journal = Journal(tmp_path, JournalParameters(keep_runs=keep))
    counts = []
    for number in range(1, 3 * keep + 5):
        ended(journal, number)
        counts.append(len(kept(tmp_path)))
    full = counts[keep:]
    assert counts[: keep - 1] == list(range(1, keep))
    assert min(full) == keep, "never fewer than are to be kept"
    assert max(full) == most, "and no more than a tenth beyond"
    assert kept(tmp_path)[0] == f"R-{number:03d}"


def test_a_journal_that_was_full_is_pruned_with_the_first_run_of_the_next_process(tmp_path: Path) -> None:
    journal = Journal(tmp_path, JournalParameters(keep_runs=100))
    for number in range(1, 31):
        ended(journal, number)
    journal.close()
    journal = Journal(tmp_path, JournalParameters(keep_runs=20))
    ended(journal, 31)
    assert kept(tmp_path) == [f"R-{number:03d}" for number in range(31, 11, -1)]


@pytest.mark.parametrize("nodes", [8, 9, 10])
def test_the_events_of_a_run_are_kept_up_to_the_limit(tmp_path: Path, nodes: int) -> None:
    journal = Journal(tmp_path, JournalParameters(events_per_run=10))
    done = ended(journal, 1, nodes)
    with JournalReader(tmp_path) as reader:
        row = reader.run(done.run_id)
        assert row is not None and row.lost == max(0, nodes - 9)
        assert len(reader.events(done.run_id)) == nodes + 2 - row.lost


def test_what_is_written_together_is_on_the_disk_at_its_end(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    ended(journal, 1)
    with journal.together():
        with journal.together():
            ended(journal, 2)
            journal.commit()
            assert kept(tmp_path) == ["R-001"]
        assert kept(tmp_path) == ["R-001"]
        ended(journal, 3)
    assert kept(tmp_path) == ["R-003", "R-002", "R-001"]
    assert Journal(tmp_path).knows("R-003") and not Journal(tmp_path).knows("R-004")
    assert not Journal(tmp_path / "nowhere").exists() and not Journal(tmp_path / "nowhere").knows("R-001")


# ---- the status ----------------------------------------------------------------------------------------


def test_how_long_a_run_takes_is_told_from_its_start_to_its_end_or_now() -> None:
    going = run("R-1")
    assert duration_text(going, 50.0) == ""
    going.started = 10.0
    assert duration_text(going, 12.5) == "2.5 s"
    going.ended = 11.0
    assert duration_text(going, 99.0) == "1.0 s"
    assert head_line(going, 99.0) == "tidy: RUNNING · 1.0 s · run R-1 · asked by unknown"
    going.status = RunStatus.ABORTED
    assert duration_text(going, 99.0) == "at least 1.0 s"


def test_inputs_are_told_with_their_units() -> None:
    asked = run("R-1")
    assert details_line(asked) == ""
    asked.inputs = {"way": 1.5, "room": "hall", "goal": Pose2(1.0, 2.0, 0.5), "turns": [0.5]}
    asked.input_kinds = {"way": Kind.LENGTH, "goal": Kind.POSE}
    text = details_line(asked, "2024-05-01T10:15:00.123Z")
    assert text.startswith(
        "accepted 2024-05-01 10:15:00 UTC · inputs way=1.5 m room='hall' goal=(x 1 m, y 2 m, "
    )
    assert text.endswith(" turns=[0.5]")
    assert values_text({}, {}) == ""


@pytest.mark.parametrize(
    ("status", "word"),
    [(RunStatus.STOPPED, "stopped"), (RunStatus.ABORTED, "aborted"), (RunStatus.FAILED, "failed")],
)
def test_why_a_run_ended(status: RunStatus, word: str) -> None:
    done = run("R-1", status=status)
    assert why_line(done) == "" and (done.code, done.reason) == ("", "")
    done.why = Why(path="tidy/drive", code="blocked", reason="a chair")
    assert why_line(done) == f"{word} because: a chair [blocked] at tidy/drive"
    assert (done.code, done.reason) == ("blocked", "a chair")
    assert run("R-2", status=RunStatus.SUCCEEDED).code == "ok"
