"""What missions leave to chance, and how it is decided."""

from __future__ import annotations

import random

from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.outcome import Result, failure, success
from florence_bt.core.serving import AnswerBinding
from florence_bt.core.skill import Inputs

PICK_RANDOM = SkillDeclaration(
    name="pick_random",
    summary="Pick one of several texts, such as rooms, by chance",
    inputs={"items": Port(Kind.LIST_OF_TEXT, "the texts to choose from")},
    outputs={"item": Port(Kind.TEXT, "the one that was picked")},
    failures={"nothing_to_pick": "the list is empty"},
    deadline_s=5.0,
    instant=True,
)


def _pick(inputs: Inputs) -> Result:
    if not inputs["items"]:
        return failure("nothing_to_pick", "there is nothing to choose from")
    return success(item=random.choice(inputs["items"]))


BINDINGS = (AnswerBinding(skill=PICK_RANDOM, answer=_pick),)
