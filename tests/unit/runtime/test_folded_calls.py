"""Dumps with folded calls: what runs and what failed is shown, the rest of called missions is not."""

from __future__ import annotations

import pytest
from py_trees.common import Status

from florence_bt.core.outcome import failure
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.run import MissionRequest
from florence_bt.trees.drawings.ascii import TreeRow
from florence_bt.trees.drawings.folding import fold_calls
from tests.unit.trees.dumps import run_dump

TOUR = """\
mission: tour
description: Calls one mission after the other.
tree:
  sequence:
    - wait: 1 s
    - run: trip
    - succeed:
        run: trip
        name: again
    - sequence:
        - run: trip
          name: home
      finally:
        wait: 1 s
"""
TRIP = """\
mission: trip
description: Calls what drives, and works meanwhile.
tree:
  sequence:
    - name: get ready
      succeed: {fail: there is no coffee}
    - parallel:
        - run: leg
        - wait: 1 s
    - work:
"""
LEG = """\
mission: leg
description: Drives, and tidies up.
tree:
  sequence:
    - set: {way: 1 m}
    - selector:
        - drive: {way: $way}
          name: short cut
        - drive: {way: $way}
          name: long way
  finally:
    wait: 1 s
    name: tidy up
"""

IN_THE_FIRST_TRIP = """\
[>] tour (sequence)
    [+] wait 1 s
    [>] run trip
        [>] sequence
            [>] parallel
                [>] run leg
                    [>] sequence (finally)
                        [>] sequence
                            [>] selector
                                [x] short cut -- a chair is in the way
                                [>] long way
    [ ] try again
        [ ] again
    [ ] sequence (finally)
        [ ] sequence
            [ ] home
        [ ] wait 1 s"""
# A failure that was dealt with (the short cut of the first trip) is gone when its mission has succeeded; what
# failed altogether stays, with everything that its reason tells.
AFTER_THE_SECOND_TRIP = """\
[>] tour (sequence)
    [+] wait 1 s
    [+] run trip
    [+] try again
        [x] again
            [x] sequence
                [x] parallel
                    [x] run leg
                        [x] sequence (finally)
                            [x] sequence
                                [x] selector
                                    [x] short cut -- a chair is in the way
                                    [x] long way -- a door is closed
    [>] sequence (finally)
        [>] sequence
            [>] home
                [>] sequence
                    [>] parallel
                        [>] run leg
                            [>] sequence (finally)
                                [>] sequence
                                    [>] selector
                                        [>] short cut
        [ ] wait 1 s"""
# What was stopped is still seen, and the clean-up that goes on.
WHILE_IT_ENDS = """\
    [-] sequence (finally)
        [-] sequence
            [-] home
                [-] sequence
                    [-] parallel
                        [-] run leg
                            [-] sequence (finally)
                                [-] sequence
                                    [-] selector
                                        [-] short cut
                                [>] tidy up
        [>] wait 1 s"""


@pytest.fixture
def bench(make_bench, tmp_path):
    bench = make_bench()
    for name, text in (("tour", TOUR), ("trip", TRIP), ("leg", LEG)):
        (tmp_path / f"{name}.yaml").write_text(text)
        bench.executor.library.add_file(tmp_path / f"{name}.yaml")
    chair = Step(failure("blocked", "a chair is in the way"), after=0.1)
    door = Step(failure("blocked", "a door is closed"), after=0.1)
    bench.script(chair, Step(after=2.0), chair, door, Step(after=5.0))
    return bench


def test_called_missions_show_what_runs_and_what_failed(bench):
    run = bench.executor.trigger(MissionRequest("tour"))
    for moment, expected in ((102.5, IN_THE_FIRST_TRIP), (107.5, AFTER_THE_SECOND_TRIP)):
        bench.clock.advance_to(moment)
        assert run_dump(bench.executor, run) == expected
        whole = run_dump(bench.executor, run, whole=True).splitlines()
        lines = iter(whole)
        assert all(line in lines for line in expected.splitlines()), "not a part of the whole tree, in order"
        assert "            [+] get ready" in whole
    bench.executor.stop("enough")
    assert run_dump(bench.executor, run).endswith(WHILE_IT_ENDS)
    bench.clock.advance(10.0)
    assert run.status.final and "[-] short cut" in run_dump(bench.executor, run)
    assert run_dump(bench.executor, run, whole=True) == run.tree


def test_a_call_that_was_left_on_the_way_is_one_line(bench, tmp_path):
    (tmp_path / "race.yaml").write_text(
        "mission: race\ndescription: Drives until the time is up.\n"
        "tree: {sequence: [{run: leg, until: {wait: 1 s}}, {wait: 9 s}]}\n"
    )
    bench.executor.library.add_file(tmp_path / "race.yaml")
    bench.script(Step(after=5.0))
    run = bench.executor.trigger(MissionRequest("race"))
    bench.clock.advance(0.5)
    assert "[>] short cut" in run_dump(bench.executor, run)
    bench.clock.advance(5.0)
    text = run_dump(bench.executor, run)
    assert "[-] run leg\n" in text and "short cut" not in text
    assert "short cut" in run_dump(bench.executor, run, whole=True)


def test_between_two_rounds_the_last_one_is_still_seen():
    rows = [
        TreeRow(0, Status.RUNNING, "tour", ""),
        TreeRow(1, Status.RUNNING, "run trip", "", call=True),
        TreeRow(2, Status.RUNNING, "repeat forever", ""),
        TreeRow(3, Status.SUCCESS, "drive and work", ""),
        TreeRow(4, Status.SUCCESS, "drive", ""),
    ]
    assert fold_calls(rows) == tuple(rows[:4])
