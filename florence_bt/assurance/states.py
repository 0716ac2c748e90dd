"""What of a running tree decides how it goes on: two moments with one key go on in the same ways.

Times count from now, so that a loop comes back to where it was. What has ended counts only by how it ended,
and of values only those that decide something. Whatever is not known here counts as it stands: that makes
more states, never fewer.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.assurance.open_clock import OpenClock
from florence_bt.assurance.unknown import Facts, Term, is_unknown, symbols_in
from florence_bt.behaviours._wake_timer import WakeTimer
from florence_bt.behaviours.context import OpenRun, TreeContext
from florence_bt.behaviours.decorators import CallMission, Once
from florence_bt.behaviours.keys import KeyStore, OwnKeys
from florence_bt.behaviours.looping import ForEach, Loop
from florence_bt.behaviours.pacing import Timeout
from florence_bt.behaviours.run_skill import ResourceLock
from florence_bt.behaviours.skipping import was_skipped
from florence_bt.behaviours.until import Question
from florence_bt.behaviours.watched_skill import InCondition
from florence_bt.behaviours.watching import NOWHERE, Spot, Watch
from florence_bt.behaviours.why import Why, explain
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result

_NOT_COUNTED = frozenset(
    {
        *(
            "id",
            "name",
            "qualified_name",
            "status",
            "iterator",
            "parent",
            "children",
            "logger",
            "blackboards",
        ),
        *("feedback_message", "blackbox_level", "annotations", "on_halt", "memory", "inputs", "outputs"),
        *("skill", "child", "called_keys", "watches", "policy", "wanted", "current_child", "branch"),
        *("_path", "_message", "_values", "_literals", "_last", "_times", "_skips", "_seconds", "_left"),
        *("_caught", "_why", "_cleanup", "_body", "_question", "_interruption", "_then", "_otherwise"),
        *("_by_code", "_cases", "_labels", "_default", "_condition", "_between", "decorated", "_keys"),
        *(
            "_on",
            "used_in",
            "_goes_on_over",
            "_waiting",
            "_outputs",
            "_inputs",
            "_ports",
            "_handed",
            "_branch",
            "_beside",
        ),
    }
)
"""What is the same for all moments, is only said to people, or is looked at below."""


class StateKeys:
    """Makes the keys of the moments of one run.

    Args:
        root: The tree.
        context: What it works with.
        clock: Its clock.
        facts: What was decided about values.
        deciding: The keys whose values decide something.
    """

    def __init__(
        self,
        root: Behaviour,
        context: TreeContext,
        clock: OpenClock,
        facts: Facts,
        deciding: frozenset[str],
    ) -> None:
        self._root = root
        self._context = context
        self._clock = clock
        self._facts = facts
        self._deciding = deciding
        self._timers: Mapping[int, tuple[float, int]] = {}
        self._symbols: dict[Term, int] = {}
        self._horizon = math.inf
        self._why: dict[Behaviour, Why] = {}
        self._keepers = {id(node): _keeps(node) for node in root.iterate()}

    def make(self, *more: Any) -> tuple[Any, ...]:
        """Return the key of this moment; facts about values that nothing holds are forgotten.

        Args:
            more: What else decides how it goes on.
        """
        symbols: dict[Term, int] = {}
        moment = self.moment(symbols, *more)
        return (*moment, self.decided(symbols))

    def moment(self, symbols: dict[Term, int], *more: Any) -> tuple[Any, ...]:
        """Return the key of this moment without what was decided about values.

        Args:
            symbols: Values that are not known -> their numbers, in the order in which they were met; goes on.
            more: What else decides how it goes on.
        """
        self._timers = self._pending()
        self._why = {}
        self._symbols = symbols
        context = self._context
        trees = [self._root, *(each.tree for each in context.beside)]
        return (
            tuple(self._node(node) for tree in trees for node in self._running(tree, math.inf)),
            self._keys(context.keys),
            tuple((entry.path, entry.left) for entry in context.runs),
            len(context.waiting),
            *more,
        )

    def decided(self, symbols: dict[Term, int]) -> tuple[tuple[str, bool], ...]:
        """Return what was decided about these values, by their numbers; the rest is forgotten."""
        self._symbols = symbols
        self._facts.forget(set(symbols))
        return tuple(sorted((repr(self._term(atom)), holds) for atom, holds in self._facts.decided.items()))

    def _pending(self) -> dict[int, tuple[float, int]]:
        """Return the timers that wait: how long still, and which of equal moments comes first."""
        now = self._clock.now()
        pending: dict[int, tuple[float, int]] = {}
        before, rank = -1.0, 0
        opened = self._clock.opened
        for when, _, timer in sorted(self._clock.waiting(), key=lambda each: each[:2]):
            if timer in opened:
                pending[id(timer)] = (math.inf, int(opened[timer]))
                continue
            left = round(when - now, 3)
            rank = rank + 1 if left == before else 0
            pending[id(timer)], before = (left, rank), left
        return pending

    # ---- nodes ----------------------------------------------------------------------------------------

    def _running(self, tree: Behaviour, horizon: float) -> Iterator[Behaviour]:
        """Yield the nodes of which something counts: those that run, those directly below, and keepers.

        What happens after a time-out further up ends it all makes no difference.
        """
        if isinstance(tree, Timeout) and tree.status is Status.RUNNING:
            own = self._timers.get(id(tree._timer._timer))
            if own is not None:
                self._horizon = horizon
                yield tree
                horizon = min(horizon, own[0] if math.isfinite(own[0]) else tree._seconds)
                yield from self._below(tree, horizon)
                return
        self._horizon = horizon
        yield tree
        yield from self._below(tree, horizon)

    def _below(self, tree: Behaviour, horizon: float) -> Iterator[Behaviour]:
        for child in tree.children:
            if tree.status is Status.RUNNING or self._keepers.get(id(child), True):
                yield from self._running(child, horizon)

    def _left(self, timer: object) -> tuple[float, int] | None:
        """Return how long a timer waits still; beyond the horizon it does not count how long."""
        left = self._timers.get(id(timer))
        return left if left is None or left[0] <= self._horizon or math.isinf(left[0]) else (math.inf, 0)

    def _node(self, node: Behaviour) -> tuple[Any, ...]:
        status = node.status
        if status is not Status.RUNNING:
            return (status.value[0], self._ended(node), *self._kept(node))
        held = node.__dict__
        parts: list[Any] = [len(node.children)]
        endless = isinstance(node, Loop) and node.rounds == math.inf
        for name, value in held.items():
            if name not in _NOT_COUNTED and not (endless and name == "round"):
                found = self._part(value)
                if found is not None:
                    parts.append((name, found))
        for name in ("current_child", "branch"):
            child = held.get(name)
            if isinstance(child, Behaviour):
                parts.append((name, next((n for n, c in enumerate(node.children) if c is child), -1)))
        question = held.get("_question")
        if isinstance(question, Question):
            parts.append(self._question(question))
        if isinstance(node, ForEach):
            parts.append(self._value(tuple(node._left)))
        parts.append(held.get("_waiting") is not None)
        return tuple(parts)

    def _ended(self, node: Behaviour) -> Any:
        """Return what counts of a node that has ended."""
        if node.status is Status.FAILURE:
            why = explain(node, self._why)
            return (why.code if why is not None else "", was_skipped(node))
        return node.status is Status.SUCCESS and was_skipped(node)

    def _kept(self, node: Behaviour) -> tuple[Any, ...]:
        """Return what a node keeps that does not run."""
        if isinstance(node, Once):
            return (self._part(node._remembered),)
        if isinstance(node, InCondition) or getattr(node, "_spot", None) is not None:
            return tuple(
                (name, found)
                for name, value in node.__dict__.items()
                if name not in _NOT_COUNTED and (found := self._part(value)) is not None
            )
        if isinstance(node, CallMission) and node._watched:
            return (self._keys(node.called_keys), self._value(tuple((node._handed or {}).values())))
        return ()

    def _question(self, question: Question) -> tuple[Any, ...]:
        began = round(question._began - self._clock.now(), 3) if question._rests else 0.0
        watch = self._watch(question.watch) if question.watch is not None else None
        return (question._rests, began, self._timer(question._timer), watch)

    def _part(self, value: Any) -> Any:
        """Return what counts of an attribute; None: nothing."""
        match value:
            case None | bool() | int() | str():
                return value if not is_unknown(value) else self._value(value)
            case float() | Pose2() | tuple() if not callable(value):
                return self._value(value)
            case Status():
                return value.value
            case Result():
                return (value.outcome.value, value.code)
            case Why():
                return value.code
            case WakeTimer():
                return self._timer(value)
            case ResourceLock():
                return (value._waiting, self._timer(value._timer))
            case Watch():
                return self._watch(value)
            case Spot():
                return self._spot(value)
            case OwnKeys():
                return self._own_keys(value)
            case OpenRun():
                return self._run(value)
        status = getattr(value, "status", None)
        if isinstance(status, Status) and not isinstance(value, Behaviour):  # an answer of a condition
            return (status.value, value.result.code if value.result is not None else "")
        return None

    def _timer(self, timer: WakeTimer) -> tuple[Any, ...]:
        return (timer.fired, self._left(timer._timer))

    def _watch(self, watch: Watch) -> tuple[Any, ...]:
        answer = watch.answer.value if watch.answer is not None else None
        changed, real = (None if each == NOWHERE else each for each in (watch._changed, watch.real_from))
        skills = tuple(
            (
                self._part(getattr(each, "_answer", None)),
                each.used_in == watch.root.round,
                each.used_in < watch._began,
            )
            for each in watch.skills
        )
        return (answer, watch.keeps, watch._active, changed, real, skills)

    def _spot(self, spot: Spot) -> Any:
        kept = spot._kept
        if kept is None or kept[0] != spot.watch.root.session:
            return None
        return (spot.replays, self._part(kept[1]))

    # ---- keys and runs --------------------------------------------------------------------------------

    def _keys(self, store: KeyStore) -> tuple[Any, ...]:
        values = store._values
        return tuple(
            (key, self._value(values[key]) if key in self._deciding else "") for key in sorted(values)
        )

    def _own_keys(self, store: OwnKeys) -> tuple[Any, ...]:
        return self._keys(store)

    def _run(self, entry: OpenRun) -> tuple[Any, ...]:
        left = self._left(entry.deadline) if entry.deadline is not None else None
        state, result = getattr(entry.run, "state", None), getattr(entry.run, "result", None)
        ended = (result.code, self._value(tuple(result.outputs.values()))) if result is not None else None
        limit = self._left(getattr(entry.run, "limit", None))
        return (entry.path, entry.left, entry.late, entry.suspended, left, limit, state, ended)

    def _value(self, value: Any) -> Any:
        if is_unknown(value):
            for symbol in symbols_in(value):
                self._symbols.setdefault(symbol, len(self._symbols))
            return self._term(value.term)
        if isinstance(value, tuple):
            return tuple(map(self._value, value))
        if isinstance(value, Pose2):
            return (value.x, value.y, value.yaw)
        return (type(value).__name__, value)

    def _term(self, term: Any) -> Any:
        """Return a term with numbers in the order in which its values were met."""
        if not isinstance(term, tuple):
            return term
        if term and term[0] == "?":
            return ("?", self._symbols[term])
        if term and term[0] == "=":
            return ("=", repr(term[1]))
        return tuple(self._term(part) for part in term)


def _keeps(node: Behaviour) -> bool:
    """Tell whether a node, or one below it, keeps something after its end."""
    own = isinstance(node, (Once, InCondition)) or getattr(node, "_spot", None) is not None
    return own or (isinstance(node, CallMission) and node._watched) or any(map(_keeps, node.children))
