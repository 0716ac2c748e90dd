"""What of a mission decides how it goes: the keys whose values count, and the codes that are told apart."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from florence_bt.core.declaration import CodeGroup
from florence_bt.trees import kinds
from florence_bt.trees.language import model
from florence_bt.trees.language.code_groups import codes_named
from florence_bt.trees.language.expressions import syntax
from florence_bt.trees.language.model import Literal, Mission, Node, PoseParts, Property, Template, Value


@dataclass(frozen=True, slots=True)
class Plan:
    """The parts of a mission that decide how it goes.

    Attributes:
        deciding: The keys whose values decide something.
        needed: The keys whose values are needed as they stand: numbers of rounds, durations.
        words: The codes and groups of codes that are told apart.
        abstracted: What is taken with values that stand for others, a sentence each.
    """

    deciding: frozenset[str]
    needed: frozenset[str]
    words: frozenset[str]
    abstracted: tuple[str, ...] = ()


class CodeClass(str):
    """A code that stands for all that nothing in the mission tells from it.

    Attributes:
        members: The codes, itself among them.
    """

    __slots__ = ("members",)
    members: frozenset[str]

    def __new__(cls, members: Iterable[str]) -> CodeClass:
        """Make one that is called as the first of its codes."""
        known = frozenset(members)
        made = super().__new__(cls, min(known))
        made.members = known
        return made


def codes_behind(code: str) -> frozenset[str]:
    """Return the codes that a code stands for."""
    return code.members if isinstance(code, CodeClass) else frozenset({code})


def classes_of(
    codes: Iterable[str], words: Iterable[str], groups: Mapping[str, CodeGroup]
) -> tuple[CodeClass, ...]:
    """Put codes together that no word tells apart."""
    named = [codes_named(word, groups) for word in sorted(words)]
    alike: dict[tuple[bool, ...], list[str]] = {}
    for code in sorted(codes):
        alike.setdefault(tuple(code in each for each in named), []).append(code)
    return tuple(CodeClass(each) for each in alike.values())


def plan_of(
    mission: Mission,
    called: Callable[[str], Plan | None],
    asked: Iterable[str] = (),
    properties: Iterable[Property] = (),
) -> Plan:
    """Find what decides in a mission.

    Args:
        mission: The mission.
        called: Gives the plan of a mission that is called.
        asked: Keys that somebody else asks for.
        properties: What the author wants to hold: keys and codes that it tells apart.
    """
    deciding, needed = set(asked), set[str]()
    flows: list[tuple[str, frozenset[str]]] = []
    wanted = tuple(properties)
    words = {event.code for each in wanted for event in each.events if event.code}
    conditions = [each.condition for each in wanted if each.condition is not None]
    for expression in (*conditions, *(each for node in mission.nodes() for each in node.expressions)):
        deciding.update(expression.keys)
        words |= _texts(expression)
    for node in mission.nodes():
        words.update(_words(node))
        deciding |= _read_to_decide(node)
        needed |= _needed(node)
        flows += _flows(node)
        if isinstance(node, kinds.CallMission) and (plan := called(node.mission.text)) is not None:
            for name, value in node.inputs:
                deciding |= _keys(value) if name.text in plan.deciding else set()
                needed |= _keys(value) if name.text in plan.needed else set()
    plan = Plan(_closed(deciding, flows), _closed(needed, flows), frozenset(words))
    return replace(plan, abstracted=tuple(dict.fromkeys(_abstracted(mission, plan, called))))


def _abstracted(mission: Mission, plan: Plan, called: Callable[[str], Plan | None]) -> Iterator[str]:
    """Yield what is put together of other values, which may not be known: texts and poses."""
    for node in mission.nodes():
        counts = plan
        given: Iterable[tuple[Literal, Value]] = ()
        match node:
            case kinds.Set(values=values) | kinds.Append(values=values):
                given = values
            case kinds.CallMission(inputs=values) if (below := called(node.mission.text)) is not None:
                given, counts = values, below
        for name, value in given:
            if name.text in counts.deciding and isinstance(value, (Template, PoseParts)) and _keys(value):
                what = "the text" if isinstance(value, Template) else "the pose"
                yield f"{what} {name.text} is made of values that stand for others"


def _closed(keys: set[str], flows: list[tuple[str, frozenset[str]]]) -> frozenset[str]:
    """Add the keys from which the values of these come."""
    found, before = set(keys), -1
    while len(found) != before:
        before = len(found)
        for target, sources in flows:
            if target in found:
                found |= sources
    return frozenset(found)


def _keys(value: Value | None) -> set[str]:
    return {each.key for each in model.references(value)} if value is not None else set()


def _read_to_decide(node: Node) -> set[str]:
    """Return the keys that a node reads to decide something, its conditions apart."""
    if isinstance(node, (kinds.Switch, kinds.ForEach)):
        return set().union(*map(_keys, node.reads))
    breaks = (each for each in node.reads if isinstance(each, syntax.Expression) and _may_have_no_value(each))
    return set().union(*map(_keys, breaks))


def _may_have_no_value(expression: syntax.Expression) -> bool:
    """Tell whether an expression divides by what is not written out, or takes an item of a list."""
    return any(
        isinstance(each, syntax.Item)
        or (
            isinstance(each, syntax.Binary)
            and each.operator == "/"
            and not isinstance(each.right, syntax.Constant)
        )
        for each in syntax.walk(expression.term)
    )


def _needed(node: Node) -> set[str]:
    match node:
        case kinds.Retry(attempts=value) | kinds.Repeat(rounds=value):
            return _keys(value)
        case kinds.Wait(duration=value) | kinds.Timeout(duration=value):
            return _keys(value)
    return set()


def _flows(node: Node) -> Iterator[tuple[str, frozenset[str]]]:
    """Yield keys that a node writes, each with the keys from which it takes the value."""
    match node:
        case kinds.Set(values=values) | kinds.Append(values=values):
            yield from ((key.text, frozenset(_keys(value))) for key, value in values)
        case kinds.ForEach(items=items, item_key=key):
            yield key.text, frozenset(_keys(items))


def _words(node: Node) -> Iterator[str]:
    """Yield the codes and groups by which a node tells failures apart."""
    literals: Iterable[Literal] = ()
    match node:
        case kinds.Retry(on=words):
            literals = words
        case kinds.ForEach(goes_on_over=words):
            literals = words
        case kinds.OnFailure(handlers=handlers):
            literals = [word for word, _ in handlers]
    yield from (word.text for word in literals)


def _texts(expression: syntax.Expression) -> set[str]:
    """Return the texts that an expression compares with, where a failure is compared."""
    if not set(expression.keys) & {*model.FAILURE_KEYS}:
        return set()
    constants = (each for each in syntax.walk(expression.term) if isinstance(each, syntax.Constant))
    return {each.value for each in constants if isinstance(each.value, str)}
