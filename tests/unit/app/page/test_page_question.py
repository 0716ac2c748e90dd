"""A question of the robot is a dialog: it opens by itself, takes any answer, and closes then."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

pytest.importorskip("nicegui")
pytest.importorskip("rclpy")

from nicegui import ui

from florence_bt.app.page.access import Role
from florence_bt.app.page.question import QuestionDialog
from tests.unit.app.page.page_user import NotedRobot, actor_for, look_at, until


def dialog_of(user):
    (dialog,) = user.find(ui.dialog).elements
    return dialog


@pytest.mark.parametrize("typed", ["", "the kitchen"])
def test_a_question_opens_a_dialog_that_gives_the_answer(typed):
    robot = NotedRobot({"florence_bt/answer": SimpleNamespace(accepted=True, message="answered")})

    async def do(user):
        assert not dialog_of(user).value
        robot.question = "'Shall I come in?'"
        await until(lambda: dialog_of(user).value)
        await user.should_see("'Shall I come in?'")
        if typed:
            user.find("words").type(typed)
        user.find("say" if typed else "yes").click()
        await until(lambda: not dialog_of(user).value)

    look_at(lambda: QuestionDialog(actor_for(robot, Role.RUN)), do)
    (request,) = robot.requests("florence_bt/answer")
    assert request.text == (typed or "yes")


def test_the_answers_that_the_mission_names_are_buttons():
    robot = NotedRobot({"florence_bt/answer": SimpleNamespace(accepted=True, message="answered")})
    robot.question = "'Tea or coffee?'\n  tea\n  black coffee"

    async def do(user):
        await until(lambda: dialog_of(user).value)
        await user.should_see("'Tea or coffee?'")
        await user.should_not_see("yes")
        user.find("black coffee").click()
        await until(lambda: not dialog_of(user).value)

    look_at(lambda: QuestionDialog(actor_for(robot, Role.RUN)), do)
    (request,) = robot.requests("florence_bt/answer")
    assert request.text == "black coffee"


def test_a_double_tap_answers_one_question():
    robot = NotedRobot({"florence_bt/answer": SimpleNamespace(accepted=True, message="answered")})
    robot.question = "'Shall I come in?'"

    async def do(user):
        await until(lambda: dialog_of(user).value)
        user.find("yes").click()
        user.find("yes").click()
        await until(lambda: not dialog_of(user).value)

    look_at(lambda: QuestionDialog(actor_for(robot, Role.RUN)), do)
    assert len(robot.requests("florence_bt/answer")) == 1


def test_an_answer_to_a_question_that_was_answered_is_not_given_to_the_next_one():
    robot = NotedRobot({"florence_bt/answer": SimpleNamespace(accepted=True, message="answered")})
    robot.question = "'Shall I come in?'"

    async def do(user):
        await until(lambda: dialog_of(user).value)
        robot.question = "'Shall I throw it away?'"
        user.find("yes").click()
        await user.should_see("does not ask this any more", retries=100)
        await user.should_see("'Shall I throw it away?'", retries=100)
        assert not robot.asked and dialog_of(user).value

    look_at(lambda: QuestionDialog(actor_for(robot, Role.RUN)), do)


def test_it_closes_when_somebody_else_has_answered():
    robot = NotedRobot({})
    robot.question = "'Who is there?'"

    async def do(user):
        await until(lambda: dialog_of(user).value)
        await user.should_see("'Who is there?'")
        robot.question = ""
        await until(lambda: not dialog_of(user).value)

    look_at(lambda: QuestionDialog(actor_for(robot, Role.RUN)), do)
