"""The judge of who follows a person, on made-up tracks, its tables, and a run in which the robot stands."""

import numpy as np
import pytest

from florence_bt.app.demo.rigs import make_rig
from florence_bt.runtime.run import MissionRequest, MissionRun, RunStatus
from florence_bt.simulation.home.flat import load_flat
from florence_bt.simulation.home.situations import led_walk
from tools.follow_trials import Sample, Trial, judge, main, table_of, told, watch


def track(*leader, visitor=5.0, running=True, after=(1.0,)):
    """Samples of a walk and of what follows it."""
    walk = [Sample(distance, visitor, True, running) for distance in leader]
    return walk + [Sample(distance, visitor, False, running) for distance in after]


def test_who_keeps_one_metre_is_kept_without_an_error():
    verdict = judge(track(1.0, 1.0, 1.0))
    assert verdict.over and verdict.kept and verdict.followed == "leader"
    assert (verdict.error, verdict.nearest, verdict.losses, verdict.lost) == (0.0, 1.0, 0, 0.0)


def test_the_error_counts_both_ways_and_only_during_the_walk():
    verdict = judge(track(0.8, 1.4, after=(0.5, 9.0)))
    assert verdict.error == pytest.approx(0.3) and verdict.nearest == 0.5


@pytest.mark.parametrize(
    ("changes", "over", "kept"),
    [
        ({"after": (3.0, 1.4)}, True, True),
        ({"after": (3.0, 1.6)}, True, False),
        ({"running": False}, True, False),
        ({"after": ()}, False, False),
    ],
)
def test_kept_means_near_and_running_when_the_walk_is_over(changes, over, kept):
    verdict = judge(track(1.0, 1.0, **changes))
    assert (verdict.over, verdict.kept) == (over, kept)


def test_each_time_the_person_gets_far_is_a_loss():
    verdict = judge(track(2.1, 2.2, 1.0, 2.5, 1.9, after=(5.0,)))
    assert verdict.losses == 2 and verdict.lost == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("leader", "visitor", "followed"),
    [(1.0, 1.2, "leader"), (4.0, 1.2, "visitor"), (4.0, 1.6, "nobody")],
)
def test_who_is_nearest_in_the_end_was_followed(leader, visitor, followed):
    verdict = judge(track(1.0, visitor=visitor, after=(leader,)))
    assert verdict.followed == followed and verdict.nearest_visitor == visitor


def test_a_kind_of_home_is_a_line_of_the_page_and_a_walk_one_for_people():
    good = Trial("flat", 1, 61.0, 0.3, "", judge(track(1.0, 1.2)), (), 210.0, 20.0)
    lost = Trial(
        "flat", 2, 62.0, 0.4, "FAILED: lost", judge(track(3.0, after=(9.0,))), ("sofa",), 160.0, 15.0
    )
    text = table_of([good, lost])
    assert "| the hand-made flat | 2 | 2 | **1** | 1.05 | 1.00 | 5.00 | 1 | 0 | 1 |" in text
    assert "generated homes |" not in text and "FAILED" not in text
    line = told(lost)
    assert line.startswith("flat, seed 2, 62 m at 0.40 m/s: not kept, 2.00 m off, lost for 0 s, ")
    assert "followed nobody, touched sofa. FAILED: lost" in line


@pytest.mark.slow
def test_a_robot_that_stands_still_loses_the_person():
    flat = load_flat()
    walk = led_walk(flat, np.random.default_rng(1), 8.0)
    rig = make_rig(person=walk.leader, others=[walk.visitor], start=walk.start, flat=flat)
    samples = watch(rig, walk, MissionRun("x", MissionRequest("follow_me"), {}, RunStatus.RUNNING))
    assert samples[0].leader == pytest.approx(1.2, abs=0.06)
    verdict = judge(samples)
    assert verdict.over and not verdict.kept
    assert verdict.losses >= 1 and verdict.lost > 1.0 and verdict.followed != "leader"


def test_mistakes_are_told(tmp_path, capsys):
    bad = tmp_path / "bad.yaml"
    bad.write_text("name: x\nstart: nowhere\n")
    assert main(["--runs", "1", "--jobs", "1", "--homes", "flat", "--world", str(bad)]) == 2
    assert f"{bad}:" in capsys.readouterr().err
