"""A question of the robot, as a dialog: what it asks, a button for each answer, and a field for any other."""

from __future__ import annotations

from florence_interfaces.srv import AnswerQuestion
from nicegui import ui

from florence_bt.app.page.acting import Actor

LOOK_S = 0.5
"""How often a viewer's page looks whether there is a question."""
USUAL = ("yes", "no")
"""Answers that are buttons where the mission names none."""
LONGEST_ANSWER = 200


class QuestionDialog:
    """Opens when a mission waits for an answer, and closes when somebody has given it.

    Args:
        actor: Gives the answer.
    """

    def __init__(self, actor: Actor) -> None:
        self._actor = actor
        self._shown = ""
        self._sending = False
        with ui.dialog() as self._dialog:
            self._card = ui.card().classes("w-80 items-stretch")
        self._button = ui.button("Answer…", on_click=self._dialog.open, color="warning").mark("answer")
        self._button.set_visibility(False)
        ui.timer(LOOK_S, self._look)

    def _look(self) -> None:
        question = self._actor.ros.node.question
        if question == self._shown:
            return
        self._shown = question
        self._card.clear()
        with self._card:
            self._build(question)
        self._button.set_visibility(bool(question))
        self._dialog.open() if question else self._dialog.close()

    def _build(self, question: str) -> None:
        """Make what answers this question; a tap that comes late meets nothing that answers the next one."""
        asked, *choices = map(str.strip, question.splitlines() or [""])
        ui.label("The robot asks").classes("text-sm text-grey")
        ui.label(asked).classes("text-lg").mark("question")
        with ui.row():
            for word in choices or USUAL:
                ui.button(word, on_click=lambda word=word: self._answer(question, word)).mark(word)
        field = ui.input("another answer").props(f"dense maxlength={LONGEST_ANSWER}").mark("words")
        field.on("keydown.enter", lambda: self._answer(question, field.value))
        with ui.row():
            say = ui.button("Answer", on_click=lambda: self._answer(question, field.value))
            say.props("outline").mark("say")
            ui.button("Later", on_click=self._dialog.close).props("flat")

    async def _answer(self, question: str, text: str | None) -> None:
        if self._sending:
            return
        self._sending = True
        try:
            with self._button:  # what was tapped may be gone before the answer is there
                await self._send(question, (text or "").strip()[:LONGEST_ANSWER])
        finally:
            self._sending = False

    async def _send(self, question: str, words: str) -> None:
        node = self._actor.ros.node
        if not words:
            ui.notify("an answer needs words", type="warning")
            return
        if node.question != question:
            ui.notify("the robot does not ask this any more", type="warning")
            return
        request = AnswerQuestion.Request(text=words)
        work = self._actor.ros.ask(AnswerQuestion, "florence_bt/answer", request)
        done = await self._actor.told(work, lambda answer: answer.message)
        if done is not None and done.accepted:
            node.question = ""  # for all who look, until the node has seen whether there is another one
            node.get_logger().info(f"{self._actor.caller} answered {words!r}")
            self._dialog.close()
