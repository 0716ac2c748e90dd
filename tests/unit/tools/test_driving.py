"""The tool that drives to random goals."""

from __future__ import annotations

from pathlib import Path

import pytest

from florence_bt.simulation.home.flat import load_flat
from tests.sweeps import sweep
from tools.driving import HEAD, DrivenGoal, Round, main, row_of, table_of, told


def drive(**values: object) -> DrivenGoal:
    made = {
        "home": "flat", "number": 0, "people": 2,
        "reached": True, "reason": "", "driven": 4.4, "shortest": 4.0, "seconds": 9.0, "error": 0.02,
        "contacts": (), "run_into": 0, "acceleration": 0.9, "braking": 2.4,
    }  # fmt: skip
    return DrivenGoal(**{**made, **values})  # type: ignore[arg-type]


def test_the_table_counts_what_was_seen() -> None:
    drives = [
        drive(),
        drive(driven=6.0, error=0.05),
        drive(reached=False, contacts=("wall",), acceleration=1.2),
    ]
    row = dict(zip(HEAD, row_of(drives), strict=True))
    assert row["reached"] == "2 of 3"
    assert row["contacts of the robot"] == "1"
    assert row["driven / shortest, all"] == "1.30"
    assert row["end error at most"] == "5 cm"
    assert row["acceleration at most, m/s^2"] == "1.20"


def test_a_drive_is_told_with_why_it_failed_and_what_it_touched() -> None:
    failed = drive(number=7, reached=False, reason="blocked, by a chair", contacts=("wall", "chair"))
    assert told(failed) == "flat, 7: blocked, by a chair after 4.40 m, 9 s, touched wall, chair"
    assert told(drive()) == "flat, 0: reached after 4.40 m, 9 s"


def test_each_home_has_a_line() -> None:
    lines = table_of([drive(), drive(home="depot", people=1), drive(number=1)]).splitlines()
    assert [line.split(" | ")[:3] for line in lines[2:]] == [
        ["| flat", "2 of 2", "2"],
        ["| depot", "1 of 1", "1"],
    ]


@pytest.mark.slow
def test_a_drive_in_the_flat_is_the_same_each_time() -> None:
    first, second = (Round(load_flat(), None, people=1, seed=4).drive() for _ in range(2))
    assert first == second
    assert first.reached and first.shortest >= 1.0
    assert first.shortest * 0.97 < first.driven < first.shortest * 1.5


@pytest.mark.slow
@pytest.mark.parametrize("start", sweep([2.2, 0.0, 3.4], every=3))
def test_the_acceleration_is_that_of_the_filter_wherever_its_steps_lie_between_the_samples(
    start: float,
) -> None:
    trip = Round(load_flat(), None, people=0, seed=4)
    trip._rig.clock.advance(start)
    assert 0.95 < trip.drive().acceleration < 1.02


def test_what_is_no_home_ends_with_the_reason(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(tmp_path / "none.yaml")]) == 1
    assert "none.yaml" in capsys.readouterr().err


@pytest.mark.parametrize("goals", [["1", "2"], ["1", "2", "3", "4"]])
def test_goals_for_other_than_the_homes_are_refused(
    goals: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["flat", "flat", "flat", "--goals", *goals])
    assert ended.value.code == 2
    assert "--goals takes one number, or one for each of the 3 homes" in capsys.readouterr().err
