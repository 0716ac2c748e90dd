"""Bindings of what missions leave to chance."""

from __future__ import annotations

from random import Random

from florence_bt.core.outcome import Result, failure, success
from florence_bt.core.serving import AnswerBinding
from florence_bt.core.skill import Inputs


def _pick(inputs: Inputs, chance: Random) -> Result:
    if not inputs["items"]:
        return failure("nothing_to_pick", "there is nothing to choose from")
    return success(item=chance.choice(inputs["items"]))


BINDINGS = (AnswerBinding(skill="pick_random", answer=_pick),)
