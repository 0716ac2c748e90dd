"""The table of the trials: what it counts, from made-up runs and from one real one."""

from dataclasses import replace

import pytest
from florence_sweep.best_case import BestCase
from florence_sweep.outcome import is_false
from florence_sweep.outcome import met as whom_it_met

from florence_bt.core.geometry import Pose2
from florence_bt.runtime.run import RunStatus
from florence_bt.simulation.home.closeness import Closeness
from florence_bt.simulation.home.person import PersonSpec
from tools.trials import SUMMARY, Trial, main, run_trial, summary, table_of, told

STANDING = PersonSpec("user", Pose2(1.0, 1.0))
WALKING = PersonSpec("other", Pose2(1.0, 1.0), "walking", ((9.0, 1.0),))


def trial(**changes):
    values = {
        "situation": "standing",
        "seed": 1,
        "room": "kitchen",
        "person": "standing, 1.70 m",
        "best_case": BestCase(True, 0.5, 4.5),
        "status": RunStatus.SUCCEEDED,
        "reason": "",
        "end": Closeness(0.52, 0.1),
        "false_find": False,
        "contacts": (),
        "simulated": 60.0,
        "ideal": 12.0,
        "wall": 3.0,
    }
    return Trial(**(values | changes))


@pytest.mark.parametrize(
    ("changes", "polite", "good"),
    [
        ({}, True, True),
        ({"end": Closeness(0.62, 0.1)}, False, False),
        ({"end": Closeness(0.52, 0.5)}, False, False),
        ({"status": RunStatus.FAILED}, False, False),
        ({"contacts": ("sofa",)}, True, False),
        ({"best_case": BestCase(True, 0.9, 4.5), "end": Closeness(0.85, 0.1)}, True, True),
        ({"best_case": BestCase(True, 0.9, 4.5)}, True, True),
        ({"best_case": BestCase(True, 0.9, 4.5), "end": Closeness(1.02, 0.1)}, False, False),
        ({"best_case": BestCase(True, 0.9, 4.5), "end": Closeness(0.38, 0.1)}, False, False),
        ({"best_case": BestCase(True, None, None)}, True, True),
        ({"best_case": BestCase(True, None, None), "end": Closeness(0.8, 0.1)}, False, False),
        ({"best_case": None, "end": None, "status": RunStatus.FAILED}, False, True),
        ({"best_case": None, "end": None, "status": RunStatus.FAILED, "false_find": True}, False, False),
    ],
)
def test_what_is_polite_and_what_is_good(changes, polite, good):
    assert (trial(**changes).polite, trial(**changes).good) == (polite, good)


def test_the_table_has_a_line_of_totals_for_each_class():
    runs = [
        trial(seed=4711),
        trial(seed=2, contacts=("sofa", "user")),
        trial(seed=3, false_find=True, end=Closeness(2, 0)),
        trial(seed=4, status=RunStatus.FAILED),
    ]
    nobody = trial(situation="nobody", best_case=None, end=None, status=RunStatus.FAILED)
    text = table_of([*runs, nobody])
    totals = ["4", "4", "**2**", "1", "2", "1", "60", "5.0"]
    assert f"| standing or leaning anywhere free | {' | '.join(totals)} |" in text
    assert "| nobody at home, with plants and coats | 1 |  |  | 0 | 0 | 0 |  |  |" in text
    assert f"| all with people | {' | '.join(totals)} |" in text
    assert "sitting on the furniture |" not in text
    assert "4711" not in text, "single runs are in the rows only"


def test_a_success_with_nobody_at_home_is_a_wrong_one():
    nobody = trial(situation="nobody", best_case=None, end=None)
    assert dict(zip(SUMMARY, summary("nobody", [nobody]), strict=True))["wrong success"] == "1"


def test_a_single_run_is_told_with_what_was_touched_and_why_it_failed():
    line = told(trial(contacts=("sofa", "user")))
    assert line == (
        "standing, seed 1, standing, 1.70 m: bad, SUCCEEDED, 0.52 m away, touched sofa, user, 60 s"
    )
    nobody = trial(best_case=None, end=None, status=RunStatus.FAILED, reason="nobody was met")
    assert "good, FAILED: nobody was met, 60 s" in told(nobody)


@pytest.mark.parametrize(
    ("found", "people", "false"),
    [
        (Pose2(1.0, 1.0), [], True),
        (Pose2(1.5, 1.0), [STANDING], False),
        (Pose2(2.5, 1.0), [STANDING], True),
        (Pose2(5.0, 1.5), [WALKING], False),
        (Pose2(5.0, 2.5), [WALKING], True),
        (Pose2(5.0, 1.5), [STANDING, WALKING], False),
        (Pose2(5.0, 2.5), [STANDING, WALKING], True),
    ],
)
def test_a_find_is_false_where_nobody_has_ever_been(found, people, false):
    assert is_false(found, people) is false


@pytest.mark.parametrize(
    ("ends", "met"),
    [
        ({"user": Closeness(0.62, 0.0), "visitor": Closeness(0.61, 1.6)}, "user"),
        ({"user": Closeness(1.5, 0.0), "visitor": Closeness(0.61, 1.6)}, "visitor"),
        ({}, ""),
    ],
)
def test_who_came_up_to_the_robot_is_not_whom_itmet(ends, met):
    best_cases = {"user": BestCase(True, 0.6, 4.5), "visitor": BestCase(True, 0.5, 4.5)}
    assert whom_it_met(ends, best_cases) == met


@pytest.mark.slow
def test_of_a_company_the_run_tells_of_whom_the_robotmet():
    assert run_trial("company", 1, homes=1).person.count(";") in (1, 2)


@pytest.mark.slow
@pytest.mark.sweep
def test_a_trial_in_one_of_some_homes_is_a_trial_in_that_home():
    among = run_trial("company", 1, homes=1)
    assert among == replace(run_trial("company", 1, world_seed=0), wall=among.wall)


@pytest.mark.slow
def test_a_run_of_the_easy_class_is_good():
    result = run_trial("easy", 1)
    assert result.good and result.best_case.visible
    assert 1.0 < result.simulated / result.ideal < 20.0


def test_mistakes_are_told(tmp_path, capsys):
    bad = tmp_path / "bad.yaml"
    bad.write_text("name: x\nstart: nowhere\n")
    assert main(["--runs", "1", "--world", str(bad)]) == 2
    assert f"{bad}:" in capsys.readouterr().err
    assert main(["--world", str(bad), "--world-seed", "1"]) == 2
    assert "--world-seed SEED" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["--classes", "siting"])
    assert "sitting" in capsys.readouterr().err
