"""A second source of evidence: who becomes a person sooner, later, or never."""

from __future__ import annotations

import math

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.sensing import TrackedUser
from florence_bt.skills.people.user_tracker.detector import Detection
from florence_bt.skills.people.user_tracker.evidence import Region, Verdict
from florence_bt.skills.people.user_tracker.parameters import ColourParameters, TrackerParameters
from florence_bt.skills.people.user_tracker.tracker import UserTracker

PERIOD = 0.125
"""Seconds; a sum of these is exact."""
REGION = Region(0.4, 0.1, 0.6, 0.9)


def seen(x: float, y: float, region: Region | None = REGION) -> Detection:
    return Detection(x, y, math.hypot(x, y), region=region)


class Run:
    """Feeds a tracker picture by picture; asks the second source in some of them."""

    def __init__(self) -> None:
        self.tracker = UserTracker(verifier=True)
        self.now = 100.0
        self.tracker.start()

    def __call__(self, *people: Detection, says: Verdict | None = None) -> tuple[TrackedUser, ...]:
        self.now += PERIOD
        users = self.tracker.update(self.now, people)
        for candidate in self.tracker.candidates(9) if says else ():
            self.tracker.take_verdict(candidate.number, says, self.now)
        return users


@pytest.fixture
def run() -> Run:
    return Run()


def test_whom_the_second_source_takes_for_a_person_counts_from_the_second_picture(run: Run) -> None:
    assert run(seen(2, 0), says=Verdict.PERSON) == ()
    assert len(run(seen(2, 0))) == 1


def test_without_a_second_source_the_third_picture_counts_as_ever() -> None:
    tracker = UserTracker()
    tracker.start()
    users = [tracker.update(k * PERIOD, [seen(2, 0)]) for k in range(3)]
    assert [len(each) for each in users] == [0, 0, 1]


def test_a_candidate_waits_for_the_opinion_and_not_for_ever(run: Run) -> None:
    # Seen first at 100.125 s: from 100.625 s on nobody waits for a source that does not answer.
    assert [len(run(seen(2, 0))) for _ in range(7)] == [0, 0, 0, 0, 1, 1, 1]


def test_a_dark_picture_says_nothing_and_the_depth_decides_alone(run: Run) -> None:
    counts = [len(run(seen(2, 0), says=Verdict.NONE)) for _ in range(4)]
    assert counts == [0, 0, 1, 1]


def test_a_plant_that_was_looked_at_never_becomes_a_person(run: Run) -> None:
    for picture in range(100):
        look = Verdict.NOBODY if picture % 3 == 0 and picture < 9 else None
        assert run(seen(2, 0), says=look) == ()
        assert run.tracker.undecided == (picture < 6), "decided with the third look"


def test_who_walks_is_no_plant_whatever_the_second_source_says(run: Run) -> None:
    counts = [len(run(seen(2.5, 0.1 * step), says=Verdict.NOBODY)) for step in range(12)]
    assert counts[4] == 0 and counts[-1] == 1


def test_a_plant_keeps_nobody_else_waiting(run: Run) -> None:
    for _ in range(3):
        run(seen(2, 0), says=Verdict.NOBODY)
    run(seen(2, 0), seen(2, 1.5))
    (first,) = run.tracker.candidates(1)
    run.tracker.take_verdict(first.number, Verdict.PERSON, run.now)
    users = run(seen(2, 0), seen(2, 1.5))
    assert [round(user.y, 1) for user in users] == [1.5], "who was asked about least comes first"


def test_a_few_denials_delay_and_do_not_decide(run: Run) -> None:
    run(seen(2, 0), says=Verdict.NOBODY)
    run(seen(2, 0), says=Verdict.NOBODY)
    # The last denial was at 100.25 s.
    assert [len(run(seen(2, 0))) for _ in range(6)] == [0, 0, 0, 1, 1, 1]


def test_one_look_at_a_person_outweighs_all_denials(run: Run) -> None:
    for _ in range(5):
        assert run(seen(2, 0), says=Verdict.NOBODY) == ()
    run(seen(2, 0), says=Verdict.PERSON)
    assert len(run(seen(2, 0))) == 1


def test_who_is_confirmed_is_not_asked_about_again(run: Run) -> None:
    run(seen(2, 0), says=Verdict.PERSON)
    run(seen(2, 0))
    assert run.tracker.candidates(9) == []


def test_only_who_is_in_the_picture_is_asked_about(run: Run) -> None:
    run(seen(2, 0), seen(2, 1.5, region=None))
    assert [each.region for each in run.tracker.candidates(9)] == [REGION]
    run()
    assert run.tracker.candidates(9) == []


def test_at_most_so_many_are_asked_about(run: Run) -> None:
    run(*(seen(2, y) for y in (-2, 0, 2)))
    assert len(run.tracker.candidates(2)) == 2


def test_an_opinion_about_somebody_who_is_gone_does_not_matter(run: Run) -> None:
    run(seen(2, 0))
    (gone,) = run.tracker.candidates(9)
    run.tracker.start()
    run(seen(2, 0))
    run.tracker.take_verdict(gone.number, Verdict.PERSON, run.now)
    assert run(seen(2, 0)) == ()


def test_senseless_parameters_are_refused() -> None:
    with pytest.raises(ConfigError, match="agreed_hits"):
        TrackerParameters(agreed_hits=4)
    with pytest.raises(ConfigError, match="colour_nobody"):
        ColourParameters(colour_nobody=0.5)
