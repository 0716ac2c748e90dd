"""The dump of a run: where each node stands or stood, for how long, and what it said."""

from __future__ import annotations

from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.journal import Journal, JournalReader
from florence_bt.runtime.journal.text import tree_from_events
from florence_bt.runtime.run import MissionRequest
from tests.unit.trees.dumps import run_dump

MISSION = """\
mission: visit
description: Drives, and works when it is there.
tree:
  retry: 2
  do:
    timeout: 5 s
    do:
      sequence:
        - selector:
            - drive: {way: 1 m}
            - wait: 1 s
        - work:
          out: {pay: pay}
        - drive: {way: 2 m}
          name: return
"""
FIRST_ROUND = """\
[>] visit (4.5 s)
    [>] within 5 s (4.5 s)
        [>] sequence (4.5 s)
            [+] selector (2.0 s)
                [x] drive (1.0 s) -- a chair is in the way
                [+] wait 1 s (1.0 s)
            [>] work (2.5 s)
            [ ] return"""
# Of what the second round has not reached, nothing is said.
SECOND_ROUND = """\
[>] visit (6.0 s) -- attempt 2 of 2; the last one failed: sequence was not done within 5 s (it was at work)
    [>] within 5 s (1.0 s)
        [>] sequence (1.0 s)
            [>] selector (1.0 s)
                [>] drive (1.0 s)
                [ ] wait 1 s
            [ ] work
            [ ] return"""
# What was left keeps how it ended; what was stopped is marked with [-].
END = """\
[x] visit (10.0 s) -- 2 of 2 attempts failed; last: sequence was not done within 5 s (it was at work)
    [x] within 5 s (5.0 s) -- sequence was not done within 5 s (it was at work)
        [-] sequence (5.0 s)
            [+] selector (2.0 s)
                [+] drive (2.0 s)
                [ ] wait 1 s
            [-] work (3.0 s)
            [ ] return"""

# A run whose process died has only its events: the last word of each node that was reached.
FROM_EVENTS = """\
[x] visit -- 2 of 2 attempts failed; last: sequence was not done within 5 s (it was at work)
    [x] within 5 s -- sequence was not done within 5 s (it was at work)
        [-] sequence
            [+] selector
                [+] drive
                [+] wait 1 s
            [-] work"""


def test_what_a_dump_says_in_the_course_of_a_run(make_bench, tmp_path):
    bench = make_bench(log=Journal(tmp_path / "runs"))
    (tmp_path / "visit.yaml").write_text(MISSION)
    bench.executor.library.add_file(tmp_path / "visit.yaml")
    bench.script(Step(failure("blocked", "a chair is in the way"), after=1.0), Step(after=2.0))
    bench.script_work(Step(success(pay=1), after=10.0))
    run = bench.executor.trigger(MissionRequest("visit"))
    for moment, expected in ((104.5, FIRST_ROUND), (106.0, SECOND_ROUND), (200.0, END)):
        bench.clock.advance_to(moment)
        assert run_dump(bench.executor, run, durations=True) == expected
    with JournalReader(tmp_path / "runs") as reader:
        assert tree_from_events(reader.events(run.run_id)) == FROM_EVENTS


TIDY = """\
mission: tidy
description: Drives and works at the same time, and tidies up whatever happens.
tree:
  sequence:
    - parallel:
        - drive: {way: 1 m}
          name: out
          finally:
            wait: 1 s
            name: inner
        - work:
          out: {pay: pay}
    - wait: 9 s
  finally:
    sequence:
      - drive: {way: 2 m}
        name: back
      - wait: 2 s
"""
WHILE_IT_ENDS = """\
[-] tidy (finally) (2.5 s)
    [-] sequence (2.5 s)
        [-] parallel (2.5 s)
            [-] out (finally) (2.5 s)
                [-] drive (2.5 s)
                [>] inner
            [+] work (2.0 s)
        [ ] wait 9 s
    [>] sequence
        [>] back
        [ ] wait 2 s"""
STOPPED = """\
[-] tidy (finally)
    [-] sequence
        [-] parallel
            [-] out (finally)
                [-] drive
                [+] inner
            [+] work
        [ ] wait 9 s
    [x] sequence
        [x] back -- a chair is in the way
        [ ] wait 2 s"""


def tidying(bench, folder, *drives):
    (folder / "tidy.yaml").write_text(TIDY)
    bench.executor.library.add_file(folder / "tidy.yaml")
    bench.script(*drives)
    bench.script_work(Step(success(pay=1), after=2.0))
    return bench.executor.trigger(MissionRequest("tidy"))


def test_the_tree_of_a_stopped_run_has_what_was_stopped_and_how_its_clean_ups_ended(make_bench, tmp_path):
    bench = make_bench(log=Journal(tmp_path / "runs"))
    blocked = Step(failure("blocked", "a chair is in the way"), after=1.5)
    run = tidying(bench, tmp_path, Step(after=9.0), blocked)
    bench.clock.advance(2.5)
    bench.executor.stop("enough")
    bench.clock.advance(0.5)
    assert run_dump(bench.executor, run, durations=True) == WHILE_IT_ENDS
    bench.clock.advance(30.0)
    assert run.status.final and run_dump(bench.executor, run) == run.tree == STOPPED
    with JournalReader(tmp_path / "runs") as reader:
        assert reader.run(run.run_id).tree == STOPPED


def test_a_clean_up_that_a_process_did_not_finish_was_stopped(bench, tmp_path):
    run = tidying(bench, tmp_path, Step(after=9.0), Step(after=9.0))
    bench.clock.advance(2.5)
    bench.executor.abandon("the process ends")
    assert run.status.final and "[-] back" in run.tree and "[>]" not in run.tree


def test_a_clean_up_beside_the_tree_is_shown_while_the_rest_goes_on(bench, tmp_path):
    text = """\
mission: late
tree:
  sequence:
    - succeed:
        timeout: 1 s
        do:
          drive: {way: 1 m}
          finally: {wait: 1 s}
    - wait: 9 s
"""
    (tmp_path / "late.yaml").write_text(text)
    bench.executor.library.add_file(tmp_path / "late.yaml")
    bench.script(Step(after=5.0))
    run = bench.executor.trigger(MissionRequest("late"))
    for seconds, mark in ((1.5, "[>]"), (1.0, "[+]")):
        bench.clock.advance(seconds)
        assert f"[-] drive\n                {mark} wait 1 s" in run_dump(bench.executor, run)


def test_a_process_that_died_while_it_stopped_a_run_had_stopped_it(make_bench, tmp_path):
    bench = make_bench(log=Journal(tmp_path / "runs"))
    run = tidying(bench, tmp_path, Step(after=9.0), Step(after=9.0))
    bench.clock.advance(2.5)
    bench.executor.stop("enough")
    bench.clock.advance(0.5)
    with JournalReader(tmp_path / "runs") as reader:
        tree = tree_from_events(reader.events(run.run_id))
    assert "[-] parallel" in tree and "[>]" not in tree
