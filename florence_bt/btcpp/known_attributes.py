"""Which attributes an element can have; what is left over is named, for nothing is dropped in silence."""

from __future__ import annotations

from collections.abc import Iterator

from florence_bt.btcpp.vocabulary import MARK, OWN_PORTS, POST_CONDITIONS, PRE_CONDITIONS, category_of
from florence_bt.btcpp.xml_source import Element

_PORTS = {
    "Parallel": "success_count failure_count threshold success_threshold failure_threshold",
    "ParallelAll": "max_failures",
    "TryCatch": "catch_on_halt",
    "Finally": "halt_timeout_msec",
    "ManualSelector": "repeat_last_selection",
    "RetryUntilSuccessful": "num_attempts",
    "RetryUntilSuccesful": "num_attempts",
    "Repeat": "num_cycles",
    "RunOnce": "then_skip",
    "Precondition": "if else",
    "Timeout": "msec",
    "Delay": "delay_msec",
    "Sleep": "msec",
    "LoopInt": "queue if_empty value",
    "LoopDouble": "queue if_empty value",
    "LoopString": "queue if_empty value",
    "LoopBool": "queue if_empty value",
    "SkipUnlessUpdated": "entry",
    "WaitValueUpdate": "entry",
    "WasEntryUpdated": "entry",
    "BlackboardCheck": "value_A value_B return_on_mismatch",
    "Script": "code",
    "ScriptCondition": "code",
    "SetBlackboard": "value output_key",
    "UnsetBlackboard": "key",
    "RecoveryNode": "number_of_retries",
    "RoundRobin": "wrap_around",
}
"""Built-in nodes -> their ports; those that are not named have none."""


def left_over(element: Element) -> Iterator[str]:
    """The attributes of a node that nothing here reads."""
    for name in element.attributes:
        if name in ("ID", "name"):
            continue
        if name.startswith("_"):
            is_known = name in PRE_CONDITIONS or name in POST_CONDITIONS or name.startswith(MARK)
            if not is_known and name != "_description" and not (name == "_autoremap" and is_call(element)):
                yield name
        elif category_of(element.tag) is not None and name not in ports_of(element.tag):
            yield name


def ports_of(tag: str) -> list[str]:
    """The ports of a node whose meaning is known."""
    if tag.startswith("Switch"):
        return ["variable", *(f"case_{number}" for number in range(1, int(tag.removeprefix("Switch")) + 1))]
    return list(OWN_PORTS.get(tag, ())) or _PORTS.get(tag, "").split()


def attributes_of(tag: str, like: str) -> list[str]:
    """The attributes of a node that a wrong one may have meant."""
    return [*PRE_CONDITIONS, *POST_CONDITIONS] if like.startswith("_") else ports_of(tag)


def is_call(element: Element) -> bool:
    """Whether an element calls a tree."""
    return element.tag == "SubTree"
