"""Everything that can be given as the script of a mock, and what it means for one skill."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.core.outcome import Result
from florence_bt.core.skill import Inputs
from florence_bt.mission_testing.mocks._script_text import parse_script
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.mission_testing.mocks.replies import AGAIN, ALWAYS, Ending, Reply, bind_reply, check_result

Function = Callable[[Inputs], Any]
"""A mock as a function: from the inputs of a call to a text, a reply, outputs or a result; or a generator
(:mod:`florence_bt.mission_testing.mocks.routine`)."""
Item = Reply | Step | Result
"""What one call gets."""
Script = str | Item | Function | Sequence[str | Item]
"""A text, one item, a list of both (in turn, the last for every further call), or a function."""

_VALID = ("'running 3 s, then SUCCESS'", "succeed()", "fail('no_path')", "never()", "a function")


def items_of(script: Script) -> tuple[Item, ...]:
    """The items of a script that is no function.

    Raises:
        ConfigError: It cannot be read.
    """
    if isinstance(script, str):
        return parse_script(script)
    if isinstance(script, (Reply, Step, Result)):
        return (script,)
    if not isinstance(script, Sequence):
        raise ConfigError(f"{script!r} is no script", valid=_VALID)
    if not script:
        raise ConfigError("a script needs at least one step", valid=_VALID)
    items: list[Item] = []
    for part in script:
        if items and endless(items[-1]):
            raise ConfigError("nothing can follow a step that is for always or begins anew", valid=_VALID)
        items += items_of(part)
    return tuple(items)


def endless(item: Item) -> bool:
    """Whether no further step of a script can be reached after this one."""
    return isinstance(item, Reply) and item.times in (ALWAYS, AGAIN)


def in_turn(items: Sequence[Item]) -> Iterator[Item]:
    """The item of each call; it ends when the script provides for no further call."""
    again = True
    while again:
        again = False
        for index, item in enumerate(items):
            times = item.times if isinstance(item, Reply) else None
            if times is None:
                times = ALWAYS if index == len(items) - 1 else 1
            while times == ALWAYS:
                yield item
            again = times == AGAIN
            for _ in range(1 if again else times):
                yield item


def to_step(answer: Any, declaration: SkillDeclaration) -> Step:
    """The run that an item, or the answer of a function, means for a skill.

    Raises:
        ConfigError: The skill cannot do that, or it is nothing that a script may hold.
    """
    match answer:
        case str():
            replies = parse_script(answer)
            if len(replies) > 1 or (replies[0].times, replies[0].lasts) != (None, None):
                raise ConfigError(
                    f"{answer!r} is for several calls; one is wanted here",
                    valid=["running 3 s, then SUCCESS"],
                )
            return bind_reply(replies[0], declaration)
        case None:
            return bind_reply(Reply(Ending.SUCCESS), declaration)
        case Mapping():
            return bind_reply(Reply(Ending.SUCCESS, outputs=answer), declaration)
        case Reply():
            return bind_reply(answer, declaration)
        case Step():
            if answer.result is not None:
                check_result(answer.result, declaration)
            return answer
        case Result():
            check_result(answer, declaration)
            return Step(answer)
    raise ConfigError(f"a mock of {declaration.name} cannot be {answer!r}", valid=_VALID)
