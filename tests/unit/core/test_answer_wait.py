"""Which answers count: those during the question, and those a little late; the others are reported."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.message_skills import AnswerWait
from florence_bt.core.outcome import success
from florence_bt.core.serving import QuestionBinding
from florence_bt.skills.speech.bindings import ANSWERS_KEPT_S, BINDINGS

(ANSWERS,) = (served for served in BINDINGS if isinstance(served, QuestionBinding))
LIMIT = {"time_limit": 30.0, "choices": ()}


@pytest.fixture
def clock():
    return ManualClock(100.0)


@pytest.fixture
def reports():
    return []


@pytest.fixture
def answers(clock, reports):
    return AnswerWait(clock, "topic answer", ANSWERS, reports.append)


def say(answers, clock, text, seconds=2.0):
    answers.hear(text)
    clock.advance(seconds)
    answers.hear("")


def give(answers, text="yes"):
    return answers.offer(SimpleNamespace(data=text)).accepted


def test_an_answer_during_the_question_counts(answers, clock, reports):
    answers.hear("Did you drink?")
    assert give(answers)
    clock.advance(60.0)
    answers.hear("")
    assert answers.start(LIMIT).poll() == success(answer="yes")
    assert answers.start(LIMIT).poll() is None and reports == []


def test_an_answer_between_the_question_and_the_wait_counts(answers, clock):
    say(answers, clock, "Did you drink?")
    clock.advance(ANSWERS_KEPT_S - 0.1)
    assert give(answers)
    assert answers.start(LIMIT).poll() == success(answer="yes")


@pytest.mark.parametrize("ended", ["in time", "stopped"])
def test_an_answer_shortly_after_the_wait_goes_to_the_same_question(answers, clock, reports, ended):
    say(answers, clock, "Did you drink?")
    run = answers.start(LIMIT)
    if ended == "stopped":
        run.cancel()
    else:
        clock.advance(30.0)
    clock.advance(1.0)
    assert give(answers)
    answers.hear("Did you drink?")
    clock.advance(10.0)
    answers.hear("")
    assert answers.start(LIMIT).poll() == success(answer="yes") and reports == []


def test_an_answer_to_one_question_is_none_to_another(answers, clock, reports):
    say(answers, clock, "Did you drink?")
    answers.start({**LIMIT, "time_limit": 1.0})
    clock.advance(2.0)
    assert give(answers)
    say(answers, clock, "Are you well?")
    assert answers.start(LIMIT).poll() is None
    assert len(reports) == 1 and "'Did you drink?'" in reports[0] and "'yes'" in reports[0]


def test_a_kept_answer_that_nobody_takes_is_reported(answers, clock, reports):
    say(answers, clock, "Did you drink?")
    assert give(answers)
    clock.advance(ANSWERS_KEPT_S + 0.1)
    assert len(reports) == 1 and answers.start(LIMIT).poll() is None


def test_an_answer_that_nobody_waits_for_is_reported(answers, clock, reports):
    assert not give(answers)
    say(answers, clock, "Did you drink?")
    run = answers.start(LIMIT)
    assert give(answers) and run.poll() == success(answer="yes")
    assert not give(answers, "no"), "it was answered"
    say(answers, clock, "Good.", 1.0)
    clock.advance(ANSWERS_KEPT_S + 0.1)
    assert not give(answers, "well")
    assert len(reports) == 3


def test_of_two_answers_during_the_question_the_later_one_counts(answers, clock, reports):
    answers.hear("Did you drink?")
    give(answers, "no")
    give(answers, "yes")
    answers.hear("")
    assert answers.start(LIMIT).poll() == success(answer="yes") and len(reports) == 1


def test_the_open_question_is_known(answers, clock):
    assert answers.question == ""
    run = answers.start(LIMIT)
    assert answers.question
    run.cancel()
    clock.advance(ANSWERS_KEPT_S + 0.1)
    assert answers.question == ""
    say(answers, clock, "Did you drink?")
    assert "Did you drink?" in answers.question
    assert "Did you drink?" in answers.start(LIMIT).feedback
    clock.advance(30.0 + ANSWERS_KEPT_S + 0.1)
    assert answers.question == "" and clock.next_time() is None


def test_the_answers_that_the_mission_names_are_told_while_it_waits(answers, clock):
    answers.hear("Tea or coffee?")
    assert answers.question_with_choices == answers.question
    run = answers.start({"time_limit": 30.0, "choices": ("tea", "black\ncoffee", " ")})
    assert answers.question_with_choices.splitlines() == [answers.question, "  tea", "  black coffee"]
    assert give(answers, "water")
    assert run.poll() == success(answer="water") and not answers.question_with_choices


@pytest.mark.parametrize("kept", [False, True])
@pytest.mark.parametrize(
    ("said", "taken"), [("Green tea.", "green tea"), (" green  TEA", "green tea"), ("Water!", "Water!")]
)
def test_an_answer_that_sounds_like_a_choice_is_that_choice(answers, clock, said, taken, kept):
    choices = LIMIT | {"choices": ("coffee", "green tea")}
    say(answers, clock, "What will you have?")
    if kept:
        give(answers, said)
        assert answers.start(choices).poll() == success(answer=taken)
    else:
        run = answers.start(choices)
        give(answers, said)
        assert run.poll() == success(answer=taken)
