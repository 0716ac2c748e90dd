"""The robot's voice as a component."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.outcome import Outcome, Result, cancelled, failure, success
from florence_bt.simulation.rig.wires import ComponentRun, Wires
from florence_bt.skills.served import BINDINGS
from florence_bt.skills.speech.speaking import SAY, SPEAK, SPEAKING, Speaking
from florence_bt.skills.speech.voice import LONGEST_TEXT, SECONDS_PER_CHARACTER, SilentVoice

(SERVED,) = (served for served in BINDINGS if served.skill == "say")


class Listener:
    """Somebody who hears what is said, and by when."""

    def __init__(self, voice: Any = None) -> None:
        self.clock = ManualClock()
        self.wires = Wires(self.clock, [])
        self.speaking = Speaking(self.wires.ports("speech"), voice or SilentVoice(self.clock))
        self.heard: dict[str, list[str]] = {}
        for topic in (SAY, SPEAKING):
            self.wires.ports("listener").listen(topic, self.heard.setdefault(topic.name, []).append)
        self.clock.advance(0.0)

    def say(self, text: str) -> ComponentRun:
        run = self.wires.actions[SPEAK.name].start({"text": text}, SERVED.result, SERVED.feedback)  # type: ignore[attr-defined]
        self.clock.advance(0.0)
        return run


def test_a_sentence_lasts_and_is_shown_as_long() -> None:
    listener = Listener()
    assert listener.heard == {"say": [], "speaking": [""]}, "what an earlier one has left is over"
    run = listener.say("Please drink\nsomething.")
    assert run.feedback == "says: Please drink something."
    assert listener.heard == {
        "say": ["Please drink something."],
        "speaking": ["", "Please drink something."],
    }
    listener.clock.advance(23 * SECONDS_PER_CHARACTER - 0.01)
    assert run.poll() is None
    listener.clock.advance(0.02)
    assert run.poll() == success() and listener.heard["speaking"][-1] == ""


def test_a_newer_sentence_takes_the_place_of_an_older_one() -> None:
    listener = Listener()
    older, newer = listener.say("one " * 20), listener.say("two")
    older_end: Result | None = older.poll()
    assert older_end is not None and older_end.outcome is Outcome.CANCELLED
    listener.clock.advance(3 * SECONDS_PER_CHARACTER)
    assert newer.poll() == success()
    listener.clock.advance(10.0)
    assert listener.heard["speaking"] == ["", ("one " * 20).strip(), "two", ""], "the older one ends no more"


def test_a_sentence_that_is_stopped_is_silent_at_once() -> None:
    listener = Listener()
    run = listener.say("a long story")
    run.cancel()
    listener.clock.advance(0.0)
    assert run.poll() == cancelled() and listener.heard["speaking"][-1] == ""


@pytest.mark.parametrize("text", ["", " \n\t", "a" * (LONGEST_TEXT + 1)])
def test_what_cannot_be_said_is_refused_and_interrupts_nobody(text: str) -> None:
    listener = Listener()
    refused = listener.say(text).poll()
    assert refused is not None and refused.code == "rejected"
    assert listener.heard["say"] == []


def test_a_voice_that_fails_says_why() -> None:
    broken = SimpleNamespace(begin=lambda text, end: end("espeak ended with 1"), stop=lambda: None)
    listener = Listener(broken)
    assert listener.say("hello").poll() == failure("not_said", "espeak ended with 1")
