"""Every failure says why: code, reason and leaf, through whatever stands above it."""

from __future__ import annotations

import pytest

from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.journal import Journal, JournalReader
from florence_bt.runtime.run import MissionRequest, RunStatus

BLOCKED = Step(failure("blocked", "a chair is in the way"), after=0.5)

CASES = {
    "sequence": ("sequence:\n    - work:\n    - drive: {way: 1 m}", "blocked", "a chair is in the way"),
    "retry": (
        "retry: 3\n  do:\n    drive: {way: 1 m}",
        "blocked",
        "3 of 3 attempts failed; last: a chair is in the way",
    ),
    "retry in a sequence in a retry": (
        "retry: 2\n  do:\n    sequence:\n      - retry: 2\n        do:\n          drive: {way: 1 m}",
        "blocked",
        "2 of 2 attempts failed; last: 2 of 2 attempts failed; last: a chair is in the way",
    ),
    "selector": (
        "selector:\n    - name: first\n      fail: no first way\n    - drive: {way: 1 m}",
        "blocked",
        "a chair is in the way (before that, first: no first way)",
    ),
    "selector of sequences": (
        "selector:\n    - name: left\n      sequence:\n        - work:\n        - fail: left is shut\n"
        "    - name: right\n      sequence:\n        - drive: {way: 1 m}",
        "blocked",
        "a chair is in the way (before that, left: left is shut)",
    ),
    "parallel": ("parallel:\n    - work:\n    - drive: {way: 1 m}", "blocked", "a chair is in the way"),
    "parallel any": (
        "parallel:\n    - drive: {way: 1 m}\n    - drive: {way: 2 m}\n  policy: any",
        "blocked",
        "2 of 2 branches failed; first: a chair is in the way",
    ),
    "within": ("timeout: 9 s\n  do:\n    drive: {way: 1 m}", "blocked", "a chair is in the way"),
    "repeat": ("repeat: 2\n  do:\n    drive: {way: 1 m}", "blocked", "a chair is in the way"),
    "finally": (
        "sequence:\n    - drive: {way: 1 m}\n  finally:\n    work:",
        "blocked",
        "a chair is in the way",
    ),
    "call": ("sequence:\n    - run: drive_once", "blocked", "a chair is in the way"),
    "call in a retry in a selector": (
        "selector:\n    - name: not this\n      fail: no\n    - retry: 2\n      do:\n        run: drive_once",
        "blocked",
        "2 of 2 attempts failed; last: a chair is in the way (before that, not this: no)",
    ),
    "because": (
        "retry: 2\n  do:\n    drive: {way: 1 m}\n  because: I cannot get there",
        "blocked",
        "I cannot get there",
    ),
    "if": (
        "if: 1 < 2\n  then:\n    drive: {way: 1 m}",
        "blocked",
        "a chair is in the way",
    ),
    "while": (
        "sequence:\n    - drive: {way: 1 m}\n  while: 1 < 2",
        "blocked",
        "a chair is in the way",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_the_cause_is_told_through_whatever_stands_above(make_bench, tmp_path, case):
    tree, code, reason = CASES[case]
    file = tmp_path / "explained.yaml"
    file.write_text(f"mission: explained\ndescription: Fails.\ntree:\n  {tree}\n")
    bench = make_bench(log=Journal(tmp_path / "runs"))
    bench.executor.library.add_file(file)
    bench.script(BLOCKED)
    bench.script_work(Step(success(pay=1), after=0.2))
    run = bench.executor.trigger(MissionRequest("explained"))
    bench.clock.advance(30.0)
    assert run.status is RunStatus.FAILED
    assert (run.code, run.reason) == (code, reason)
    assert run.why.path.split("/")[-1].startswith("drive"), run.why.path
    # The dump shows the reason of the leaf at the leaf and says each reason once per level at most.
    leaf = next(line for line in run.tree.splitlines() if "[x] drive" in line)
    assert leaf.endswith("-- a chair is in the way")
    with JournalReader(tmp_path / "runs") as reader:
        row, events = reader.run(run.run_id), reader.events(run.run_id)
    assert (row.code, row.reason, row.cause) == (code, reason, run.why.path)
    failures = [event for event in events if event.kind == "node" and event.new == "FAILURE"]
    assert failures and all(event.code and event.reason for event in failures)
    last = failures[-1]
    assert (last.code, last.reason) == (code, reason)
    assert last.data.get("cause") == run.why.path
