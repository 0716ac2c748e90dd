"""The robot's voice as a component: sentences in; what is being said out."""

from __future__ import annotations

from dataclasses import dataclass

from florence_bt.core import topic_names
from florence_bt.core.outcome import Outcome
from florence_bt.core.ports import Action, Delivery, Fields, Ports, Topic
from florence_bt.skills.speech.bindings import PROGRAM_FAILED
from florence_bt.skills.speech.voice import LONGEST_TEXT, Voice, spoken_text


@dataclass(frozen=True, slots=True)
class Sentence:
    """A goal of ``florence_interfaces/Speak``."""

    text: str


SAY = Topic(topic_names.SAY, str)
SPEAKING = Topic(topic_names.SPEAKING, str, Delivery.LATCHED)
SPEAK = Action("speak", "florence_interfaces/action/Speak", Sentence)


class Speaking:
    """Serves the action ``speak``, one sentence at a time; a newer one takes the place of an older one.

    Each sentence is published on ``say`` when it begins; ``speaking`` has the sentence while it is said.

    Args:
        ports: Its connections.
        voice: Says it.
    """

    def __init__(self, ports: Ports, voice: Voice) -> None:
        self._ports, self._voice = ports, voice
        self._say, self._speaking = ports.output(SAY), ports.output(SPEAKING)
        self._speaking.send("")  # one that died may have left a sentence
        self._goals = ports.serve_goals(SPEAK, self._begin, self._cancel)

    def close(self) -> None:
        """Fall silent."""
        self._voice.stop()

    def _begin(self, sentence: Sentence) -> str | None:
        text = spoken_text(sentence.text)
        if not text:
            return "there is nothing to say"
        if len(text) > LONGEST_TEXT:
            return f"the text has {len(text)} characters; at most {LONGEST_TEXT} are said"
        self._voice.stop()
        self._ports.tell(f"says: {text}", good=True)
        self._say.send(text)
        self._speaking.send(text)
        self._voice.begin(text, self._end)
        clock = self._ports.clock
        clock.call_at(clock.now(), lambda: self._goals.feedback({"text": text}))
        return None

    def _cancel(self) -> None:
        self._voice.stop()
        self._finish({"error_msg": "the sentence was stopped"}, Outcome.CANCELLED)

    def _end(self, problem: str) -> None:
        if problem:
            self._ports.tell(problem, good=False)
            self._finish({"error_code": PROGRAM_FAILED, "error_msg": problem}, Outcome.FAILED)
        else:
            self._finish({"error_code": 0, "error_msg": ""}, Outcome.SUCCEEDED)

    def _finish(self, result: Fields, outcome: Outcome) -> None:
        self._speaking.send("")
        self._goals.finish(result, outcome)
