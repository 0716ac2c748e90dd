"""Questions on the page in a real browser: a card lies over no button, and its own take no tap too early."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from typing import Any

import pytest

pytest.importorskip("nicegui")
pytest.importorskip("rclpy")
pytest.importorskip("playwright.sync_api", reason="playwright drives the browser")
if shutil.which("chromium") is None:
    pytest.skip("there is no chromium", allow_module_level=True)

from florence_interfaces.msg import Question, RunState
from florence_interfaces.srv import AnswerQuestion
from florence_page.question import FRESH, NEW_CARD_S

from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED

pytestmark = pytest.mark.ros
COME_IN = Question(id="one", text="Shall I come in?", choices=["yes", "no"])
DRINKS = Question(id="two", text="Tea or coffee?", choices=["tea", "coffee"])
MANY = Question(id="many", text="Which room? " * 20, choices=[f"room {number}" for number in range(40)])
COVERED = """() => [...document.querySelectorAll("button")].filter((button) => {
  if (button.closest("[role=group]") || !button.checkVisibility()) return false;
  const { x, y, width, height } = button.getBoundingClientRect();
  const hit = document.elementFromPoint(x + width / 2, y + height / 2);
  return hit && (hit.closest("[role=group]") || hit.querySelector(":scope > [role=group]"));
}).map((button) => button.getAttribute("aria-label") || button.textContent)"""
"""Which buttons beside those of cards have a card, or the column of cards, over their middle."""
FIRST_HIT = """([x, y], fresh) => new Promise((done) => {
  const look = () => {
    const card = document.querySelector("[role=group]");
    if (!card || !card.textContent.includes("Tea or coffee?")) return requestAnimationFrame(look);
    const hit = document.elementFromPoint(x, y);
    const asleep = card.getAnimations({ subtree: true }).filter((each) => each.animationName === fresh);
    done({ card: card.contains(hit), button: hit.closest("button")?.textContent ?? "",
           lasts: asleep.map((each) => each.effect.getTiming().duration) });
  };
  look();
})"""
"""What a tap hits in the first frame that has the card."""


class MissionServer(FlorenceNode):
    """Says that a mission runs and what it asks, and notes the answers."""

    def __init__(self) -> None:
        super().__init__("florence_bt")
        self.questions: list[Question] = []
        self.given: list[tuple[str, str]] = []
        self.create_publisher(RunState, "florence_bt/run_state", LATCHED).publish(
            RunState(run_id="7", mission="greet", state="ACTIVE")
        )
        self.create_service(AnswerQuestion, "florence_bt/answer", self._on_answer)

    def _on_answer(self, request: Any, answer: Any) -> Any:
        if request.text:
            self.given.append((request.question, request.text))
            left = [each for each in self.questions if each.id != request.question]
            answer.accepted, answer.message = left != self.questions, "the server took it"
            self.questions = left
        answer.questions = self.questions
        return answer


@pytest.fixture
def page(open_page: Callable[..., Any]) -> Any:
    """A browser that looks at a page."""
    return open_page()


def card(page: Any, text: str) -> Any:
    return page.get_by_role("group").filter(has_text=text)


@pytest.mark.parametrize("size", [(1280, 800), (390, 700)], ids=["desk", "phone"])
def test_a_card_lies_over_no_button(ros: Any, page: Any, size: tuple[int, int]) -> None:
    page.set_viewport_size({"width": size[0], "height": size[1]})
    server = ros.add(MissionServer())
    server.questions = [MANY, DRINKS]
    ros.spin_until(lambda: page.get_by_role("group").count() == 2, what="the cards")
    assert page.evaluate(COVERED) == []
    assert page.get_by_role("dialog").count() == 0
    page.get_by_role("button", name="STOP THE ROBOT").click(trial=True)


def test_a_tap_that_was_meant_for_the_card_before_answers_nothing(ros: Any, page: Any) -> None:
    server = ros.add(MissionServer())
    server.questions = [COME_IN]
    ros.spin_until(lambda: card(page, "Shall I come in?").count(), what="the card")
    box = card(page, "Shall I come in?").get_by_role("button", name="yes").bounding_box()
    place = [box["x"] + box["width"] / 2, box["y"] + box["height"] / 2]
    page.evaluate(f"([place, fresh]) => {{ window.hit = ({FIRST_HIT})(place, fresh); }}", [place, FRESH])
    server.questions = [DRINKS]
    ros.spin_until(lambda: card(page, "Tea or coffee?").count(), what="the next card")
    hit = page.evaluate("() => window.hit")
    assert hit["card"] and hit["button"] == "", "the card itself takes the tap, and none of its buttons"
    assert set(hit["lasts"]) == {1000.0 * NEW_CARD_S}
    card(page, "Tea or coffee?").get_by_role("button", name="tea").click()
    ros.spin_until(lambda: server.given, what="the answer")
    assert server.given == [("two", "tea")]
    ros.spin_until(lambda: page.get_by_text("the server took it").count(), what="what the server said")


def test_a_card_goes_when_the_mission_server_hangs_and_comes_back_with_it(ros: Any, page: Any) -> None:
    server = ros.add(MissionServer())
    server.questions = [COME_IN]
    ros.spin_until(lambda: card(page, "Shall I come in?").count(), what="the card")
    card(page, "Shall I come in?").wait_for(state="detached")  # nobody serves the node meanwhile
    ros.spin_until(lambda: card(page, "Shall I come in?").count(), what="the card again")
