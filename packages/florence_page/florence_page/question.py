"""Questions of the robot, as cards: what it asks, a button for each answer, and a field for any other."""

from __future__ import annotations

from functools import partial

from florence_interfaces.srv import AnswerQuestion
from nicegui import ui

from florence_bt.core.message_skills import NOT_ASKED, AskedQuestion
from florence_page.acting import Actor

QUESTION_LOOK_S = 0.5
"""How often a viewer's page looks whether there is a question."""
USUAL = ("yes", "no")
"""Answers that are buttons where the mission names none."""
LONGEST_ANSWER = 200
FRESH = "florence-fresh"
NEW_CARD_S = 0.5
"""For how long a new card takes no tap: the finger may have been on its way to what was there before. Chosen:
people need some 0.3 s to see a change."""
_FRESH_CSS = f"""
.{FRESH} :is(.q-btn, .q-field) {{ animation: {FRESH} {NEW_CARD_S}s; }}
@keyframes {FRESH} {{ from, to {{ pointer-events: none; opacity: 0.5; }} }}
"""


class QuestionCards:
    """Shows a card for each question that a mission waits with; none lies over anything else that takes taps.

    Whenever a question comes or goes, all cards are made anew: no button changes its meaning, and none that
    moves takes a tap that was meant for another.

    Args:
        actor: Gives the answer.
    """

    def __init__(self, actor: Actor) -> None:
        self._actor = actor
        self._shown: tuple[AskedQuestion, ...] = ()
        self._sending = False
        ui.add_css(_FRESH_CSS)
        place = "fixed left-2 bottom-[calc(var(--florence-bar,0px)+8px)] z-10 max-w-full"
        self._place = ui.column().classes(f"{place} max-h-[50vh] overflow-auto")
        ui.timer(QUESTION_LOOK_S, self._look)

    def _look(self) -> None:
        questions = self._actor.ros.node.questions
        if questions == self._shown:
            return
        self._shown = questions
        self._place.clear()
        with self._place:
            for question in questions:
                self._add_card(question)

    def _add_card(self, question: AskedQuestion) -> None:
        with ui.card().classes(f"w-80 max-w-full items-stretch {FRESH}").props("role=group").mark("card"):
            ui.label("The robot asks").classes("text-sm text-grey")
            ui.label(str(question)).classes("text-lg").mark("question")
            with ui.row():
                for word in question.choices or USUAL:
                    button = ui.button(word).mark(word)
                    self._actor.on_press(button, partial(self._answer, question, word))
            with ui.row().classes("items-center no-wrap"):
                field = ui.input("another answer").props(f"dense maxlength={LONGEST_ANSWER}").mark("words")
                self._actor.on_press(field, lambda: self._answer(question, field.value), "keydown.enter")
                say = self._actor.on_press(ui.button("Answer"), lambda: self._answer(question, field.value))
                say.props("outline").mark("say")

    async def _answer(self, question: AskedQuestion, text: str | None) -> None:
        words = (text or "").strip()[:LONGEST_ANSWER]
        if self._sending:
            return
        self._sending = True
        try:
            with self._place:  # what was tapped may be gone before the answer is there
                await self._send(question, words)
        finally:
            self._sending = False

    async def _send(self, question: AskedQuestion, words: str) -> None:
        if not words:
            ui.notify("an answer needs words", type="warning")
            return
        node = self._actor.ros.node
        if question not in node.questions:
            ui.notify(NOT_ASKED, type="warning")
            return
        request = AnswerQuestion.Request(text=words, question=question.id)
        work = self._actor.ros.ask(AnswerQuestion, "florence_bt/answer", request)
        done = await self._actor.told(work, lambda answer: answer.message)
        if done is not None:
            node.take_away(question)  # answered, or not open any more
        if done is not None and done.accepted:
            node.get_logger().info(f"{self._actor.caller} answered {words!r}")
