"""A question of the robot, as a dialog: what it asks, the usual answers, and a field for any other."""

from __future__ import annotations

from florence_interfaces.srv import AnswerQuestion
from nicegui import ui

from florence_bt.app.page.acting import Actor

LOOK_S = 0.5
"""How often a viewer's page looks whether there is a question."""
USUAL = ("yes", "no")
"""Answers that are buttons: missions tell words, and do not declare which they understand."""
LONGEST_ANSWER = 200


class QuestionDialog:
    """Opens when a mission waits for an answer, and closes when somebody has given it.

    Args:
        actor: Gives the answer.
    """

    def __init__(self, actor: Actor) -> None:
        self._actor = actor
        self._shown = ""
        with ui.dialog() as self._dialog, ui.card().classes("w-80 items-stretch"):
            ui.label("The robot asks").classes("text-sm text-grey")
            self._text = ui.label().classes("text-lg").mark("question")
            with ui.row():
                for word in USUAL:
                    ui.button(word, on_click=lambda word=word: self._answer(word)).mark(word)
            self._field = ui.input("another answer").props(f"dense maxlength={LONGEST_ANSWER}").mark("words")
            self._field.on("keydown.enter", lambda: self._answer(self._field.value))
            with ui.row():
                ui.button("Answer", on_click=lambda: self._answer(self._field.value)).props("outline").mark(
                    "say"
                )
                ui.button("Later", on_click=self._dialog.close).props("flat")
        self._button = ui.button("Answer…", on_click=self._dialog.open, color="warning").mark("answer")
        self._button.set_visibility(False)
        ui.timer(LOOK_S, self._look)

    def _look(self) -> None:
        question = self._actor.ros.node.question
        if question == self._shown:
            return
        self._shown, self._text.text = question, question
        self._button.set_visibility(bool(question))
        self._dialog.open() if question else self._dialog.close()

    async def _answer(self, text: str | None) -> None:
        words = (text or "").strip()[:LONGEST_ANSWER]
        if not words:
            ui.notify("an answer needs words", type="warning")
            return
        request = AnswerQuestion.Request(text=words)
        work = self._actor.ros.ask(AnswerQuestion, "florence_bt/answer", request)
        done = await self._actor.told(work, lambda answer: answer.message)
        if done is not None and done.accepted:
            self._actor.ros.node.get_logger().info(f"{self._actor.caller} answered {words!r}")
            self._field.value = ""
            self._dialog.close()
