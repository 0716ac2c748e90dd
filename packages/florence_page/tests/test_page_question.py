"""Questions of the robot are cards: they come by themselves, take any answer, and go when there is one."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

pytest.importorskip("nicegui")
pytest.importorskip("rclpy")

from florence_page.access import Role
from florence_page.question import FRESH, QuestionCards
from nicegui import ui

from florence_bt.core.message_skills import NOT_ASKED, AskedQuestion
from packages.florence_page.tests.page_user import NotedRobot, actor_for, look_at, until

ANSWERED = {"florence_bt/answer": SimpleNamespace(accepted=True, message="answered")}
TOO_LATE = {"florence_bt/answer": SimpleNamespace(accepted=False, message="too late")}
COME_IN = AskedQuestion("one", "Shall I come in?", ())
DRINKS = AskedQuestion("two", "Tea or coffee?", ("tea", "black coffee"))


def cards_of(user):
    return [each for each in user.client.elements.values() if isinstance(each, ui.card)]


def given(robot):
    return [(each.question, each.text) for each in robot.requests("florence_bt/answer")]


def look(robot, do):
    look_at(lambda: QuestionCards(actor_for(robot, Role.RUN)), do)


@pytest.mark.parametrize("typed", ["", "the kitchen"])
def test_a_question_is_a_card_that_gives_the_answer_to_that_question(typed):
    robot = NotedRobot(ANSWERED)

    async def do(user):
        assert not cards_of(user)
        robot.questions = (COME_IN,)
        await user.should_see("'Shall I come in?'", retries=600)
        if typed:
            user.find("words").type(typed)
        user.find("say" if typed else "yes").click()
        await until(lambda: not cards_of(user))

    look(robot, do)
    assert given(robot) == [("one", typed or "yes")]


def test_nothing_is_modal():
    robot = NotedRobot(ANSWERED)
    robot.questions = (COME_IN,)

    async def do(user):
        await user.should_see("'Shall I come in?'", retries=600)
        assert not [each for each in user.client.elements.values() if isinstance(each, ui.dialog)]

    look(robot, do)


def test_the_answers_that_the_mission_names_are_the_buttons():
    robot = NotedRobot(ANSWERED)
    robot.questions = (DRINKS,)

    async def do(user):
        await user.should_see("'Tea or coffee?'", retries=600)
        await user.should_not_see("yes")
        user.find("black coffee").click()
        await until(lambda: not cards_of(user))

    look(robot, do)
    assert given(robot) == [("two", "black coffee")]


def test_two_nodes_that_wait_have_a_card_each():
    robot = NotedRobot(ANSWERED)
    robot.questions = (COME_IN, DRINKS)

    async def do(user):
        await user.should_see("'Shall I come in?'", retries=600)
        await user.should_see("'Tea or coffee?'")
        user.find("tea").click()
        await until(lambda: len(cards_of(user)) == 1)
        user.find("yes").click()
        await until(lambda: not cards_of(user))

    look(robot, do)
    assert given(robot) == [("two", "tea"), ("one", "yes")]


@pytest.mark.parametrize(
    ("then", "left"),
    [
        ((AskedQuestion("new", "Shall I come in?", ("yes", "never")),), 1),
        ((AskedQuestion("new", "Shall I come in?", ()),), 1),
        ((DRINKS, COME_IN), 2),
    ],
)
def test_another_question_is_another_card_that_takes_no_tap_at_first(then, left):
    robot = NotedRobot(ANSWERED)
    robot.questions = (COME_IN,)

    async def do(user):
        await until(lambda: cards_of(user))
        before = cards_of(user)
        robot.questions = then
        await until(lambda: len(cards_of(user)) == left and not set(before) & set(cards_of(user)))
        assert all(FRESH in card.classes for card in cards_of(user))

    look(robot, do)


def test_a_double_tap_answers_one_question():
    robot = NotedRobot(ANSWERED)
    robot.questions = (COME_IN,)

    async def do(user):
        await until(lambda: cards_of(user))
        user.find("yes").click()
        user.find("yes").click()
        await until(lambda: not cards_of(user))

    look(robot, do)
    assert len(given(robot)) == 1


@pytest.mark.parametrize("known", [True, False], ids=["as the page knows", "as the server says"])
def test_an_answer_to_a_question_that_is_over_is_not_given_to_the_next_one(known):
    robot = NotedRobot(TOO_LATE)
    robot.questions = (COME_IN,)

    async def do(user):
        await until(lambda: cards_of(user))
        if known:
            robot.questions = (AskedQuestion("two", "Shall I throw it away?", ()),)
        user.find("yes").click()
        await user.should_see(NOT_ASKED if known else "too late", retries=100)
        await until(lambda: len(cards_of(user)) == known)

    look(robot, do)
    assert given(robot) == ([] if known else [("one", "yes")])


def test_a_card_goes_when_somebody_else_has_answered():
    robot = NotedRobot({})
    robot.questions = (COME_IN,)

    async def do(user):
        await user.should_see("'Shall I come in?'", retries=600)
        robot.questions = ()
        await until(lambda: not cards_of(user))

    look(robot, do)
