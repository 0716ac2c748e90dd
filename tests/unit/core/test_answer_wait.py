"""Which answers count: those to the question that is open, and what was heard a little early."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.message_skills import NOT_ASKED, SAID_WITH_S, AnswerWait
from florence_bt.core.outcome import success
from florence_bt.core.serving import QuestionBinding
from florence_bt.skills.speech.bindings import ANSWERS_KEPT_S, BINDINGS

(ANSWERS,) = (served for served in BINDINGS if isinstance(served, QuestionBinding))
LIMIT = {"time_limit": 30.0, "choices": ()}
DRINKS = LIMIT | {"choices": ("tea", "coffee")}


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


def hear(answers, text="yes"):
    answers.take(SimpleNamespace(data=text))


def give(answers, text="yes", question=""):
    return answers.offer(SimpleNamespace(data=text), question).accepted


def asked(answers):
    return [(each.text, each.choices) for each in answers.questions]


# ---- only a node that waits asks ---------------------------------------------------------------------------


def test_what_the_robot_says_is_no_question(answers, clock, reports):
    answers.hear("Yes it is.")
    assert not answers.questions and not give(answers)
    answers.hear("")
    clock.advance(1.0)
    assert not answers.questions and not give(answers)
    assert len(reports) == 2 and answers.start(LIMIT).poll() is None


def test_a_question_has_its_words_and_choices_from_the_first_moment(answers, clock):
    say(answers, clock, "Tea or coffee?")
    run = answers.start(LIMIT | {"choices": ("tea", "black\ncoffee", " ")})
    assert asked(answers) == [("Tea or coffee?", ("tea", "black coffee"))]
    assert "Tea or coffee?" in run.feedback
    assert give(answers, "black coffee") and run.poll() == success(answer="black\ncoffee")
    assert not answers.questions


def test_what_is_said_while_a_node_waits_does_not_change_its_question(answers, clock):
    say(answers, clock, "Tea or coffee?")
    run = answers.start(DRINKS)
    answers.hear("The door is open.")
    clock.advance(1.0)
    assert asked(answers) == [("Tea or coffee?", ("tea", "coffee"))]
    answers.hear("The door is shut.")
    assert asked(answers) == [("Tea or coffee?", ("tea", "coffee"))] and "Tea" in run.feedback
    hear(answers, "tea")
    assert run.poll() == success(answer="tea")


def test_a_sentence_that_begins_beside_the_wait_is_its_question(answers, clock):
    say(answers, clock, "Here I am.")
    clock.advance(60.0)
    run = answers.start(DRINKS)
    clock.advance(SAID_WITH_S)
    answers.hear("Tea or coffee?")
    assert [each.text for each in answers.questions] == ["Tea or coffee?"] and "Tea" in run.feedback
    clock.advance(0.1)
    answers.hear("The door is open.")
    assert [each.text for each in answers.questions] == ["Tea or coffee?"]


def test_what_is_heard_after_a_wait_beside_the_sentence_is_none_to_the_next(answers, clock, reports):
    run = answers.start(LIMIT)
    answers.hear("Did you drink?")
    run.cancel()
    hear(answers)
    assert answers.start(LIMIT).poll() is None and len(reports) == 1


def test_nothing_that_another_mission_said_is_a_question(answers, clock):
    say(answers, clock, "Here I am.")
    answers.forget()
    run = answers.start(LIMIT)
    assert [str(each) for each in answers.questions] == ["a question without words"]
    assert run.feedback == "waits for an answer"


def test_words_that_were_answered_are_not_those_of_the_next_question(answers, clock):
    say(answers, clock, "Did you drink?")
    answers.start(LIMIT)
    assert give(answers)
    answers.start(LIMIT)
    assert asked(answers) == [("", ())]


@pytest.mark.parametrize("ended", ["in time", "stopped"])
def test_a_wait_that_has_ended_asks_nothing(answers, clock, reports, ended):
    say(answers, clock, "Did you drink?")
    run = answers.start(LIMIT)
    if ended == "stopped":
        run.cancel()
    else:
        clock.advance(30.0)
    assert not answers.questions
    hear(answers)
    assert not give(answers) and len(reports) == 2
    say(answers, clock, "Did you drink?")
    assert answers.start(LIMIT).poll() is None


# ---- an answer belongs to the question that it was given to ------------------------------------------------


def test_an_answer_to_a_question_that_is_over_is_none_to_the_same_words_asked_again(answers, clock):
    say(answers, clock, "Did you drink?")
    first = answers.start(LIMIT)
    (before,) = answers.questions
    first.cancel()
    say(answers, clock, "Did you drink?")
    again = answers.start(LIMIT)
    taken = answers.offer(SimpleNamespace(data="yes"), before.id)
    assert (taken.accepted, taken.text) == (False, NOT_ASKED) and again.poll() is None
    (now,) = answers.questions
    assert give(answers, "yes", now.id) and again.poll() == success(answer="yes")
    assert not give(answers, "yes", now.id), "it was answered"


def test_questions_of_two_servers_have_different_ids(clock):
    servers = [AnswerWait(clock, "topic answer", ANSWERS, print) for _ in range(2)]
    for each in servers:
        each.start(LIMIT)
    assert servers[0].questions[0].id != servers[1].questions[0].id


def test_of_two_nodes_that_wait_each_has_its_own_answer(answers, clock):
    say(answers, clock, "Tea or coffee?")
    drink = answers.start(DRINKS)
    say(answers, clock, "May I come in?")
    enter = answers.start(LIMIT | {"choices": ("come in", "stay out")})
    assert asked(answers) == [
        ("Tea or coffee?", ("tea", "coffee")),
        ("May I come in?", ("come in", "stay out")),
    ]
    assert give(answers, "Stay out.") and drink.poll() is None
    assert enter.poll() == success(answer="stay out")
    again = answers.start(LIMIT)
    assert give(answers, "tea", answers.questions[1].id)
    assert again.poll() == success(answer="tea") and drink.poll() is None


def test_an_answer_that_names_no_question_and_is_no_choice_is_for_all_that_wait(answers):
    one, other = answers.start(DRINKS), answers.start(LIMIT)
    assert give(answers, "water")
    assert one.poll() == other.poll() == success(answer="water")


# ---- what is heard early -----------------------------------------------------------------------------------


def test_what_is_heard_during_the_sentence_counts(answers, clock, reports):
    answers.hear("Did you drink?")
    hear(answers)
    clock.advance(60.0)
    answers.hear("")
    assert answers.start(LIMIT).poll() == success(answer="yes")
    assert not answers.questions
    assert answers.start(LIMIT).poll() is None and reports == []


def test_what_is_heard_between_the_sentence_and_the_wait_counts(answers, clock):
    say(answers, clock, "Did you drink?")
    clock.advance(ANSWERS_KEPT_S - 0.1)
    hear(answers)
    assert answers.start(LIMIT).poll() == success(answer="yes")


def test_what_is_heard_early_and_is_no_choice_is_no_answer(answers, clock, reports):
    answers.hear("Tea or coffee?")
    hear(answers, "yes")
    answers.hear("")
    run = answers.start(DRINKS)
    assert run.poll() is None and len(reports) == 1
    assert "'Tea or coffee?'" in reports[0] and "'yes'" in reports[0]
    hear(answers, "yes")
    assert run.poll() == success(answer="yes"), "any other counts while it waits"


def test_what_is_heard_during_one_sentence_is_no_answer_to_another(answers, clock, reports):
    answers.hear("Here I am.")
    hear(answers)
    answers.hear("")
    say(answers, clock, "Did you drink?")
    assert answers.start(LIMIT).poll() is None
    assert len(reports) == 1 and "'Here I am.'" in reports[0]


def test_what_is_heard_before_a_mission_is_stopped_is_no_answer_to_the_next(answers, clock, reports):
    answers.hear("Did you drink?")
    hear(answers)
    answers.hear("")
    answers.forget()
    assert answers.start(LIMIT).poll() is None and len(reports) == 1


def test_what_was_heard_and_nobody_takes_is_told(answers, clock, reports):
    say(answers, clock, "Did you drink?")
    hear(answers)
    clock.advance(ANSWERS_KEPT_S + 0.1)
    assert len(reports) == 1 and answers.start(LIMIT).poll() is None
    hear(answers)
    assert len(reports) == 1, "somebody waits"
    hear(answers, "well")
    assert len(reports) == 2 and "'well'" in reports[1]


def test_of_two_that_are_heard_during_the_sentence_the_later_one_counts(answers, clock, reports):
    answers.hear("Did you drink?")
    hear(answers, "no")
    hear(answers, "yes")
    answers.hear("")
    assert answers.start(LIMIT).poll() == success(answer="yes") and len(reports) == 1


@pytest.mark.parametrize("early", [False, True])
@pytest.mark.parametrize(
    ("said", "taken"), [("Green tea.", "green tea"), (" green  TEA", "green tea"), ("coffee", "coffee")]
)
def test_an_answer_that_sounds_like_a_choice_is_that_choice(answers, clock, said, taken, early):
    choices = LIMIT | {"choices": ("coffee", "green tea")}
    say(answers, clock, "What will you have?")
    if early:
        hear(answers, said)
        assert answers.start(choices).poll() == success(answer=taken)
    else:
        run = answers.start(choices)
        give(answers, said)
        assert run.poll() == success(answer=taken)


def test_nothing_is_timed_when_nothing_is_open(answers, clock):
    say(answers, clock, "Did you drink?")
    run = answers.start(LIMIT)
    run.cancel()
    clock.advance(ANSWERS_KEPT_S)
    assert clock.next_time() is None
