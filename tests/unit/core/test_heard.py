"""How old the last word is, by the clock that applies, and what it is worth then."""

from __future__ import annotations

import math

import pytest

from florence_bt.core.heard import LEAST_S, MISSED_PERIODS, Freshness, Heard, age_text


class Clocks:
    """The clocks of a listener, set by hand."""

    def __init__(self, simulated: float | None = None) -> None:
        self.now, self.date, self.simulated, self.stands = 50.0, 2_000.0, simulated, False

    def steady(self) -> float:
        return self.now

    def of_stamp(self, stamp: float) -> float | None:
        if self.simulated is not None:
            return self.simulated
        return self.date if abs(stamp - self.date) < 1_000.0 else None

    def pass_s(self, seconds: float) -> None:
        self.now += seconds
        self.date += seconds
        if self.simulated is not None and not self.stands:
            self.simulated += seconds


def test_nothing_is_known_before_the_first_word() -> None:
    heard: Heard[str] = Heard(Clocks(), 1.0)
    assert heard.last is None and heard.fresh is None and heard.age == math.inf
    assert heard.freshness is Freshness.NEVER


@pytest.mark.parametrize(("period_s", "limit_s"), [(1.0, MISSED_PERIODS), (0.1, LEAST_S), (0.5, LEAST_S)])
def test_a_word_is_old_after_some_periods_and_is_kept_with_its_age(period_s: float, limit_s: float) -> None:
    clocks = Clocks()
    heard: Heard[str] = Heard(clocks, period_s)
    heard.take("90 %")
    clocks.pass_s(limit_s)
    assert (heard.fresh, heard.freshness) == ("90 %", Freshness.FRESH)
    clocks.pass_s(0.01)
    assert (heard.fresh, heard.last, heard.freshness) == (None, "90 %", Freshness.OLD)
    assert heard.age == pytest.approx(limit_s + 0.01)
    heard.take("89 %")
    assert heard.fresh == "89 %"


def test_what_is_told_when_it_changes_is_never_old() -> None:
    clocks = Clocks()
    heard: Heard[str] = Heard(clocks, None)
    heard.take("the bumper is pressed")
    clocks.pass_s(1e6)
    assert heard.fresh == "the bumper is pressed" and heard.age == 1e6


@pytest.mark.parametrize("simulated", [None, 100.0])
def test_a_word_that_was_kept_is_as_old_as_its_stamp_when_it_comes(simulated: float | None) -> None:
    clocks = Clocks(simulated)
    heard: Heard[str] = Heard(clocks, 1.0)
    present = clocks.date if simulated is None else simulated
    heard.take("90 %", present - 60.0)
    assert heard.age == 60.0 and heard.freshness is Freshness.OLD
    heard.take("90 %", present + 60.0)
    assert heard.age == 0.0, "a stamp of the future makes nothing younger than it is"
    clocks.pass_s(5.0)
    assert heard.age == 5.0


def test_a_stamp_of_an_unknown_clock_tells_nothing() -> None:
    clocks = Clocks()
    heard: Heard[str] = Heard(clocks, 1.0)
    heard.take("90 %", 17.0)
    assert heard.age == 0.0 and heard.fresh == "90 %"


def test_when_the_simulated_time_stands_the_machine_tells_the_age() -> None:
    clocks = Clocks(100.0)
    heard: Heard[str] = Heard(clocks, 1.0)
    heard.take("90 %", 100.0)
    clocks.stands = True
    clocks.pass_s(4.0)
    assert heard.age == 4.0 and heard.fresh is None


def test_a_simulation_that_begins_again_makes_nothing_younger() -> None:
    clocks = Clocks(100.0)
    heard: Heard[str] = Heard(clocks, 1.0)
    heard.take("90 %", 100.0)
    clocks.simulated = 1.0
    clocks.pass_s(4.0)
    assert heard.age == 4.0


def test_who_waits_for_news_is_told() -> None:
    news: list[int] = []
    heard: Heard[str] = Heard(Clocks(), 1.0, lambda: news.append(1))
    heard.take("a")
    heard.take("a")
    assert len(news) == 2


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.4, "0 s"), (119.4, "119 s"), (120.0, "2 min"), (7_200.0, "2.0 h")]
)
def test_ages_for_people(seconds: float, text: str) -> None:
    assert age_text(seconds) == text


def test_what_changes_seldom_is_as_old_as_the_last_sign_of_its_teller() -> None:
    clocks = Clocks()
    sign: Heard[bool] = Heard(clocks, 0.5)
    heard: Heard[str] = Heard(clocks, None, vouched_by=sign)
    heard.take("a chair is in the way")
    clocks.pass_s(60.0)
    assert heard.fresh == "a chair is in the way", "nobody has vouched for it yet, and nobody has ceased to"
    sign.take(True)
    clocks.pass_s(1.0)
    assert heard.freshness is Freshness.FRESH and heard.age == 1.0
    clocks.pass_s(9.0)
    assert heard.freshness is Freshness.OLD and heard.fresh is None and heard.age == 10.0
    assert heard.last == "a chair is in the way", "to be shown with its age"
    sign.take(True)
    assert heard.fresh == "a chair is in the way"


def test_what_nobody_tells_any_more_is_forgotten_and_told() -> None:
    news: list[str | None] = []
    heard: Heard[str] = Heard(Clocks(), None, lambda: news.append(heard.last))
    heard.take("a")
    heard.forget()
    assert heard.freshness is Freshness.NEVER and news == ["a", None]
