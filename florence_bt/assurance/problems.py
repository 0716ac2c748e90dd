"""What is wrong with a mission that was explored: what must always hold, and does not."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from py_trees.behaviour import Behaviour
from py_trees.composites import Parallel

from florence_bt.assurance.events import Happening
from florence_bt.assurance.explorer import Edge, Graph
from florence_bt.assurance.lasting import left_on
from florence_bt.assurance.paths import by_itself, circles, is_circle, shortest
from florence_bt.assurance.plan import codes_behind
from florence_bt.assurance.properties import way_that_breaks
from florence_bt.assurance.verifier import Explored, Verifier
from florence_bt.assurance.world import SUCCEEDED
from florence_bt.behaviours.composites import ReactiveSelector, ReactiveSequence
from florence_bt.behaviours.decorators import While
from florence_bt.behaviours.looping import Repeat, Retry
from florence_bt.behaviours.pacing import Timeout
from florence_bt.behaviours.parallel import CountingParallel
from florence_bt.behaviours.until import Interruptible, Until
from florence_bt.behaviours.why import path_of
from florence_bt.core.plain_yaml import Position
from florence_bt.trees import kinds
from florence_bt.trees.checks.outcomes import MISTAKES, mission_outcomes
from florence_bt.trees.language.code_groups import codes_named
from florence_bt.trees.language.compile import origin_of
from florence_bt.trees.language.model import Literal, Node, Property

BROKEN, WARNING = "broken", "warning"
_OF_PEOPLE = ("wait_for_", "await_")
"""How skills begin that wait for a person: they may do so again and again."""
_END_IT = (
    Timeout,
    Until,
    While,
    CountingParallel,
    Parallel,
    ReactiveSelector,
    ReactiveSequence,
    Interruptible,
)
"""What ends a loop below it for another reason."""


@dataclass(frozen=True, slots=True)
class Problem:
    """Something that does not hold.

    Attributes:
        kind: A word for what it is, such as ``left_on``.
        severity: ``broken``, or ``warning``.
        text: A sentence for people.
        position: Where in its file, if that is known.
        path: The shortest way to it.
        about: The node, skill or code that it is about.
        file: The file of the position; None: that of the mission.
    """

    kind: str
    severity: str
    text: str
    position: Position | None = None
    path: tuple[Edge, ...] = ()
    about: str = ""
    file: Path | None = None


def problems_of(explored: Explored, verifier: Verifier) -> list[Problem]:
    """Return what is wrong with a mission that was explored; what was not reached only of a whole graph."""
    found = [
        *_mistakes(explored),
        *_stuck(explored),
        *_endless(explored, verifier),
        *_left_on(explored),
        *_outputs(explored),
        *_codes(explored, verifier),
    ]
    if not explored.way:
        found += _properties(explored, verifier)
    if not explored.graph.unexplored and not explored.way:
        found += _never_reached(explored, verifier)
    return found


def _to(explored: Explored, wanted: Callable[[Edge], bool]) -> tuple[Edge, ...]:
    """Return the shortest way that ends with a step."""
    graph = explored.graph
    sources = {
        state: edge for state, edges in enumerate(graph.edges) for edge in reversed(edges) if wanted(edge)
    }
    way = shortest(graph, sources.__contains__)
    if way is None:
        return ()
    last = sources[way[-1].target if way else 0]
    return (*way, last)


def _position(explored: Explored, path: str) -> Position | None:
    """Return where a node of the tree stands in the file."""
    for node in explored.world.tree.root.iterate():
        if path_of(node) == path:
            origin = origin_of(node)
            return origin.node.position if origin is not None and origin.mission is explored.mission else None
    return None


def place_of(explored: Explored, problem: Problem) -> Position | None:
    """Return where in the mission a problem shows: its own place, else that of the last node on its way."""
    if problem.position is not None and problem.file in (None, explored.mission.file):
        return problem.position
    paths = [each.path for edge in problem.path for each in edge.happened if each.path]
    places = (_position(explored, path) for path in reversed(paths))
    return next((place for place in places if place is not None), None)


# ---- mistakes, waits for nothing ------------------------------------------------------------------------

_WORDS = {
    "missing_key": "reads a key that nothing has written on this way",
    "bad_expression": "computes something that has no value",
    "bad_input": "is given a value that does not fit",
    "bad_output": "gives a value that its key cannot hold",
    "no_skill": "needs a skill that is not there",
}


def _mistakes(explored: Explored) -> Iterator[Problem]:
    wrong: dict[tuple[str, str], Happening] = {}
    for edges in explored.graph.edges:
        for edge in edges:
            for each in edge.happened:
                if each.what == "wrong":
                    wrong.setdefault((each.path, each.text.split()[0]), each)
    for (path, kind), each in wrong.items():
        rest = each.text.removeprefix(kind).strip()
        name = path.rsplit("/", 1)[-1]
        if kind == "resource":
            skill, holder = rest.split()
            text = f"{name} wants what {holder} has: {skill} and {holder} would run at the same time"
        elif kind == "cleanup":
            text = f"a step of a clean-up fails, and {rest} is not done"
        else:
            text = f"{name} {_WORDS.get(kind, kind)}: {rest}"
        way = _to(explored, lambda edge, path=path, kind=kind: _has_wrong(edge, path, kind))  # type: ignore[misc]
        yield Problem(kind, BROKEN, text, _position(explored, path), way, path)


def _has_wrong(edge: Edge, path: str, kind: str) -> bool:
    return any(e.what == "wrong" and e.path == path and e.text.split()[0] == kind for e in edge.happened)


def _stuck(explored: Explored) -> Iterator[Problem]:
    graph = explored.graph
    if graph.stuck and (way := shortest(graph, set(graph.stuck).__contains__)) is not None:
        yield Problem(
            "stuck", BROKEN, "it waits for ever, and nothing is left that could end this", None, tuple(way)
        )


# ---- without an end -------------------------------------------------------------------------------------


def _endless(explored: Explored, verifier: Verifier) -> Iterator[Problem]:
    graph = explored.graph
    for part in circles(graph, _is_idle):
        inside = set(part)
        leaves = any(e.target not in inside and by_itself(e) for s in part for e in graph.edges[s])
        if is_circle(graph, part, _is_idle) and not leaves:
            way = _once_round(graph, inside, _is_idle)
            text = "it goes round for ever, and nothing that the robot or a person does ends that"
            yield Problem("endless", BROKEN, text, None, tuple(way))
            break
    yield from _spinning(explored, verifier)
    yield from _endless_loops(explored, verifier)


def _spinning(explored: Explored, verifier: Verifier) -> Iterator[Problem]:
    """Find a circle of look-ups in which no time passes: the executor ends it after thousands of rounds."""
    instant = {name for name, each in verifier.declarations.items() if each.instant}

    def takes_no_time(edge: Edge) -> bool:
        started = {each.skill for each in edge.happened if each.what == "start"}
        return edge.event.what == "tick" and bool(started) and started <= instant

    for part in circles(explored.graph, takes_no_time):
        if is_circle(explored.graph, part, takes_no_time):
            way = tuple(_once_round(explored.graph, set(part), takes_no_time))
            text = "it looks the same up again and again without a pause"
            yield Problem("spinning", BROKEN, text, None, way)
            return


def _once_round(graph: Graph, inside: set[int], allowed: Callable[[Edge], bool]) -> list[Edge]:
    """Return the shortest way into a circle, and once round it."""
    way = shortest(graph, inside.__contains__) or []
    entry = way[-1].target if way else 0
    first = next(e for e in graph.edges[entry] if e.target in inside and allowed(e))
    back = shortest(
        graph, lambda state: state == entry, first.target, lambda e: e.target in inside and allowed(e)
    )
    return [*way, first, *(back or [])]


def _is_idle(edge: Edge) -> bool:
    return by_itself(edge) and not any(each.what in ("start", "end") for each in edge.happened)


def _endless_loops(explored: Explored, verifier: Verifier) -> Iterator[Problem]:
    """Find loops without end that go on though nothing succeeds, and which nothing else ends.

    A ``retry`` goes on in vain also when something is looked up between two failures. A ``repeat`` that looks
    something up goes on because of what it has found. Who asks again and again waits for an answer.
    """
    instant = frozenset(name for name, each in verifier.declarations.items() if each.instant)
    loops = [node for node in explored.world.tree.root.iterate() if _is_without_end(node)]
    for kind, lookups in ((Retry, instant), (Repeat, frozenset[str]())):
        left = [path_of(node) for node in loops if isinstance(node, kind)]
        if left:
            yield from _in_vain(explored, left, partial(_is_in_vain, lookups=lookups), instant)


def _in_vain(
    explored: Explored, loops: list[str], allowed: Callable[[Edge], bool], instant: frozenset[str]
) -> Iterator[Problem]:
    for part in circles(explored.graph, allowed):
        if not is_circle(explored.graph, part, allowed):
            continue
        inside = set(part)
        failing = _failing_in(explored.graph, inside, allowed, instant)
        path = next((each for each in loops if any(one.startswith(f"{each}/") for one in failing)), None)
        if path is not None:
            loops.remove(path)
            names = " and ".join(sorted({each.rsplit("/", 1)[-1] for each in failing}))
            loop = path.rsplit("/", 1)[-1]
            text = f"{loop} goes on for ever when {names} fails each time: nothing else ends it"
            way = tuple(_once_round(explored.graph, inside, allowed))
            yield Problem("endless_retry", BROKEN, text, _position(explored, path), way, path)


def _is_in_vain(edge: Edge, lookups: frozenset[str]) -> bool:
    """Tell whether nothing succeeds in a step, look-ups apart, and nobody waits for a person in it."""
    ends = [
        (each.skill, each.result) for each in edge.happened if each.what == "end" and each.result is not None
    ]
    return by_itself(edge) and not any(
        (result.succeeded and skill not in lookups) or skill.startswith(_OF_PEOPLE) for skill, result in ends
    )


def _is_without_end(node: Behaviour) -> bool:
    if not isinstance(node, (Retry, Repeat)) or node._rounds != float("inf"):
        return False
    above: Behaviour | None = node.parent
    while above is not None:
        if isinstance(above, _END_IT):
            return False
        above = above.parent
    return True


def _failing_in(
    graph: Graph, inside: set[int], allowed: Callable[[Edge], bool], instant: frozenset[str]
) -> set[str]:
    """Return the paths of what fails in a circle, look-ups apart."""
    steps = (
        edge for state in inside for edge in graph.edges[state] if edge.target in inside and allowed(edge)
    )
    return {
        each.path
        for edge in steps
        for each in edge.happened
        if each.what == "end"
        and each.result is not None
        and not each.result.succeeded
        and each.skill not in instant
    }


# ---- ends -------------------------------------------------------------------------------------------------


def _left_on(explored: Explored) -> Iterator[Problem]:
    """Find what is switched on and not off again, by a mission that switches it itself."""
    own = [node.skill for node in explored.mission.nodes() if isinstance(node, kinds.RunSkill)]
    for thing in sorted({each for ending in explored.graph.endings.values() for each in ending.lasting}):
        endings = explored.graph.endings.items()
        left = {state for state, ending in endings if left_on(ending.lasting, thing, own)}
        if left and (way := shortest(explored.graph, left.__contains__)) is not None:
            ending = explored.graph.endings[way[-1].target]
            how = "when it is stopped" if ending.status == "STOPPED" else f"when it ends with {ending.code}"
            text = f"the {thing.replace('_', ' ')} is left on {how}"
            yield Problem("left_on", BROKEN, text, None, tuple(way), thing)


def _outputs(explored: Explored) -> Iterator[Problem]:
    for name in explored.mission.outputs:
        without = {
            state
            for state, ending in explored.graph.endings.items()
            if ending.status == SUCCEEDED and name not in ending.outputs
        }
        if without and (way := shortest(explored.graph, without.__contains__)) is not None:
            text = f"it can succeed without a value for its output {name}"
            position = explored.mission.positions.get(name)
            yield Problem("no_output", BROKEN, text, position, tuple(way), name)


def occurring_codes(explored: Explored) -> frozenset[str]:
    """Return the codes with which a mission can fail."""
    failed = (ending.code for ending in explored.graph.endings.values() if ending.status == "FAILED")
    return frozenset().union(*map(codes_behind, failed))


def _codes(explored: Explored, verifier: Verifier) -> Iterator[Problem]:
    foreseen = mission_outcomes(explored.mission, verifier.library, verifier.declarations).codes
    for code in sorted(occurring_codes(explored) - foreseen - MISTAKES):
        way = shortest(
            explored.graph,
            lambda state, code=code: (
                state in explored.graph.endings  # type: ignore[misc]
                and code in codes_behind(explored.graph.endings[state].code)
            ),
        )
        text = f"it can fail with {code}, which the check does not foresee"
        yield Problem("unforeseen_code", BROKEN, text, None, tuple(way or ()), code)


def _properties(explored: Explored, verifier: Verifier) -> Iterator[Problem]:
    """Find what the author wants to hold, and does not."""
    for each in verifier.properties(explored.mission):
        way = way_that_breaks(each, explored.graph, verifier.analysis.groups)
        if way is not None:
            text = each.because or f"it does not hold that: {each.text}"
            yield Problem(each.word, BROKEN, text, each.position, way, _about(each), each.file)


def _about(wanted: Property) -> str:
    """Return the skills that a property is about, and how often: what a scenario can expect of them."""
    names = [event.who for event in wanted.events]
    match wanted.word:
        case "at_most":
            return f"{names[0]} {wanted.most}"
        case "after":
            return " ".join(names)
        case "always_before":
            return " ".join(reversed(names))
    return names[0] if names else ""


# ---- what is never reached ------------------------------------------------------------------------------


def _never_reached(explored: Explored, verifier: Verifier) -> Iterator[Problem]:
    seen = explored.world.seen
    missing = [node for node in explored.mission.nodes() if node not in seen.started]
    below = {part for node in missing for part in (*node.parts, *((node.cleanup,) if node.cleanup else ()))}
    for node in missing:
        if node not in below:
            yield Problem(
                "unreachable", WARNING, f"{node.title} is never reached", node.position, (), node.title
            )
    groups = verifier.analysis.groups
    for node in explored.mission.nodes():
        child, words = _caught_by(node)
        if child is None or child not in seen.started:
            continue
        codes = frozenset[str]().union(*(codes_behind(each) for each in seen.codes.get(child, ())))
        for word in words:
            if not codes_named(word.text, groups) & codes:
                text = f"{child.title} never fails with {word.text}"
                yield Problem("unreachable_code", WARNING, text, word.position, (), word.text)


def _caught_by(node: Node) -> tuple[Node | None, tuple[Literal, ...]]:
    match node:
        case kinds.Retry(child=child, on=words):
            return child, words
        case kinds.ForEach(child=child, goes_on_over=words):
            return child, words
    return None, ()
