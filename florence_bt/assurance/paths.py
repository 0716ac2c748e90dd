"""Paths in a graph of states: the shortest to a state, the longest to an end, and the circles in it."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable

from florence_bt.assurance.explorer import Edge, Graph

Allowed = Callable[[Edge], bool]


def by_itself(edge: Edge) -> bool:
    """Tell whether a step needs nobody who pauses or stops the mission."""
    return edge.event.what not in ("pause", "stop", "override")


def shortest(
    graph: Graph, is_goal: Callable[[int], bool], start: int = 0, allowed: Allowed | None = None
) -> list[Edge] | None:
    """Return the path with the fewest steps from a state to one of some states; None: there is none."""
    came: dict[int, tuple[int, Edge] | None] = {start: None}
    todo = deque([start])
    while todo:
        state = todo.popleft()
        if is_goal(state):
            return _back(came, state)
        for edge in graph.edges[state]:
            if edge.target not in came and (allowed is None or allowed(edge)):
                came[edge.target] = (state, edge)
                todo.append(edge.target)
    return None


def _back(came: dict[int, tuple[int, Edge] | None], state: int) -> list[Edge]:
    path: list[Edge] = []
    while (step := came[state]) is not None:
        state, edge = step
        path.append(edge)
    return path[::-1]


def circles(graph: Graph, allowed: Allowed) -> list[list[int]]:
    """Return the strongly connected parts of a graph, in an order in which each comes after what it leads to.

    The algorithm is that of Tarjan (1972), without recursion.
    """
    index: dict[int, int] = {}
    low: dict[int, int] = {}
    stack: list[int] = []
    on_stack: set[int] = set()
    found: list[list[int]] = []
    for root in range(len(graph.edges)):
        if root in index:
            continue
        work = [(root, iter(graph.edges[root]))]
        index[root] = low[root] = len(index)
        stack.append(root)
        on_stack.add(root)
        while work:
            state, edges = work[-1]
            for edge in edges:
                if not allowed(edge):
                    continue
                target = edge.target
                if target not in index:
                    index[target] = low[target] = len(index)
                    stack.append(target)
                    on_stack.add(target)
                    work.append((target, iter(graph.edges[target])))
                    break
                if target in on_stack:
                    low[state] = min(low[state], index[target])
            else:
                work.pop()
                if work:
                    above = work[-1][0]
                    low[above] = min(low[above], low[state])
                if low[state] == index[state]:
                    found.append(_popped(stack, on_stack, state))
    return found


def _popped(stack: list[int], on_stack: set[int], until: int) -> list[int]:
    part: list[int] = []
    while True:
        state = stack.pop()
        on_stack.discard(state)
        part.append(state)
        if state == until:
            return part


def is_circle(graph: Graph, part: Iterable[int], allowed: Allowed) -> bool:
    """Tell whether a strongly connected part is more than one state without a way back to itself."""
    states = set(part)
    return any(edge.target in states and allowed(edge) for state in states for edge in graph.edges[state])


def longest(graph: Graph) -> tuple[float, list[Edge]]:
    """Return the longest time from the first state to an end without a stop, and a path that takes it.

    Returns:
        Seconds, infinite where time passes in a circle; and the path, to the circle then.
    """
    best: dict[int, tuple[float, Edge | None]] = {}
    for part in circles(graph, by_itself):
        inside = set(part)
        round_s = max(
            (e.seconds for s in part for e in graph.edges[s] if e.target in inside and by_itself(e)),
            default=0.0,
        )
        out: tuple[float, Edge | None, int] = (-math.inf, None, part[0])
        for state in part:
            if state in graph.endings:
                out = max(out, (0.0, None, state), key=lambda each: each[0])
            for edge in graph.edges[state]:
                if edge.target not in inside and by_itself(edge):
                    total = edge.seconds + best[edge.target][0]
                    if total > out[0]:
                        out = (total, edge, state)
        seconds = math.inf if round_s > 0.0 else out[0]
        for state in part:
            best[state] = (seconds, out[1])
        _lead_inside(graph, inside, out, best, seconds)
    return best[0][0], _walk(graph, best)


def _lead_inside(
    graph: Graph,
    inside: set[int],
    out: tuple[float, Edge | None, int],
    best: dict[int, tuple[float, Edge | None]],
    seconds: float,
) -> None:
    """Let every state of a circle lead to the one at which its longest way out begins."""
    came = {out[2]}
    todo = deque([out[2]])
    back: dict[int, list[tuple[int, Edge]]] = {}
    for state in inside:
        for edge in graph.edges[state]:
            if edge.target in inside and by_itself(edge):
                back.setdefault(edge.target, []).append((state, edge))
    while todo:
        target = todo.popleft()
        for state, edge in back.get(target, ()):
            if state not in came:
                came.add(state)
                best[state] = (seconds, edge)
                todo.append(state)


def _walk(graph: Graph, best: dict[int, tuple[float, Edge | None]]) -> list[Edge]:
    path: list[Edge] = []
    state, seen = 0, set[int]()
    while (edge := best[state][1]) is not None and state not in seen:
        seen.add(state)
        path.append(edge)
        state = edge.target
    return path
