"""The ticker: ticks a tree of py_trees with the same outcome as py_trees, but faster, and records changes.

The nodes of a class are ticked and stopped by two plain functions, which are made when a node of the class is
met for the first time. They do what the ``tick`` and ``stop`` of py_trees do, in the same order and on the
children as they are at that moment, without debug texts, generators and a search through the list of all
statuses. Nothing is kept per node, so the tree may change its shape at any moment.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from py_trees import composites, decorators
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status

from florence_bt.behaviours.branching import If
from florence_bt.behaviours.composites import ReactiveSelector, ReactiveSequence, Selector
from florence_bt.behaviours.decorators import (
    CallMission,
    ForceSuccess,
    Invert,
    Once,
    PreparedDecorator,
    StartGuard,
    While,
)
from florence_bt.behaviours.pacing import Timeout
from florence_bt.behaviours.stepping import Stepping
from florence_bt.behaviours.until import Interruptible, Until, WaitUntil

RUNNING, SUCCESS, FAILURE, INVALID = Status.RUNNING, Status.SUCCESS, Status.FAILURE, Status.INVALID

Tick = Callable[[Any], Status]
"""Ticks a node with what is below it; returns the new status of the node."""
Halt = Callable[[Any], None]
"""Stops a node with what is below it: ``node.stop(Status.INVALID)``."""
Holds = Callable[[Behaviour], bool]
"""Tells whether a node is not to be started yet."""
HELD = "held at a breakpoint"
"""Message of a node that is not started yet."""
StatusChange = tuple[Behaviour, Status, Status]
"""A node, its status before and its status after."""


_KNOWN: tuple[Any, ...] = (
    Behaviour,
    *(
        each
        for each in vars(decorators).values()
        if isinstance(each, type) and issubclass(each, decorators.Decorator)
    ),
    *(CallMission, ForceSuccess, Invert, Once, StartGuard, Timeout, While),
    *(If, Interruptible, ReactiveSelector, ReactiveSequence, Until, WaitUntil),
)
LEAVE_CHILDREN = frozenset(
    method for each in _KNOWN for method in (each.initialise, each.update, each.terminate)
) - {decorators.Timeout.update}
"""Methods that stop no child. Any other ``initialise``, ``update`` and ``terminate`` may, whoever has written
it, and what it changes is looked for where changes are recorded."""


class TickTable:
    """The functions for the nodes of one tree, and the changes of their statuses.

    Args:
        record: Whether every change of a status is kept in :attr:`changes`.

    Attributes:
        ticks: How a node is ticked, by its class.
        halts: How a node is stopped, by its class.
        changes: The changes since they were cleared, in order.
        held: The nodes that were not started because :meth:`hold` says so, though their parents see them run.
    """

    def __init__(self, record: bool) -> None:
        self.record = record
        self.changes: list[StatusChange] = []
        self.held: list[Behaviour] = []
        self._holds: Holds | None = None
        self._plain: dict[type, Tick] = {}
        self.ticks: dict[type, Tick] = _ByClass(self._learn)
        self.halts: dict[type, Halt] = _ByClass(self._learn)

    def _learn(self, cls: type) -> None:
        self._plain[cls], self.halts[cls] = _functions_of(self, cls)
        self.ticks[cls] = self._with_holds(self._plain[cls])

    def hold(self, holds: Holds | None) -> None:
        """Ask before each start of a node from now on; None for no longer, which costs nothing."""
        if holds is not self._holds:
            self._holds = holds
            for cls, tick in self._plain.items():
                self.ticks[cls] = self._with_holds(tick)

    def _with_holds(self, tick: Tick) -> Tick:
        holds = self._holds
        if holds is None:
            return tick

        def tick_or_hold(node: Any) -> Status:
            if node.status is RUNNING:
                # A loop may come to a node twice in a tick.
                return RUNNING if node in self.held else tick(node)
            if not holds(node):
                return tick(node)
            if node not in self.held:
                self.held.append(node)
            node.feedback_message = HELD
            self.change(node, RUNNING)
            return RUNNING

        return tick_or_hold

    def change(self, node: Behaviour, new: Status) -> None:
        """Give a node another status."""
        if self.record:
            self.changes.append((node, node.status, new))
        node.status = new

    def halt(self, node: Behaviour) -> None:
        """Stop a node with what is below it."""
        self.halts[node.__class__](node)

    def halt_from(self, children: Sequence[Behaviour], first: int) -> None:
        """Stop the children from an index on, except those at INVALID."""
        for child in children[first:]:
            if child.status is not INVALID:
                self.halts[child.__class__](child)

    def watch(self, nodes: Sequence[Behaviour], action: Callable[[], Any]) -> Any:
        """Let other code tick or stop nodes, and record what that changed in them and below."""
        if not self.record:
            return action()
        before = {node: node.status for node in _children_first(nodes)}
        try:
            return action()
        finally:
            for node in _children_first(nodes):
                old = before.get(node, INVALID)
                if node.status is not old:
                    self.changes.append((node, old, node.status))

    def stop_by_itself(self, node: Behaviour) -> None:
        """Let a node with a ``stop`` of its own stop itself, and record what that changed."""
        self.watch((node,), lambda: node.stop(INVALID))


class _ByClass(dict[type, Any]):
    """Functions by class; asks for those of a class that is new."""

    def __init__(self, learn: Callable[[type], None]) -> None:
        self._learn = learn

    def __missing__(self, cls: type) -> Any:
        self._learn(cls)
        return self[cls]


def _children_first(nodes: Sequence[Behaviour]) -> list[Behaviour]:
    """Return nodes with all below them, children before their parents."""
    found: list[Behaviour] = []
    for node in nodes:
        if node.children:
            found += _children_first(node.children)
        found.append(node)
    return found


class Ticker:
    """Ticks the tree below a root; the tree stays an ordinary tree of py_trees.

    Args:
        root: The root of the tree.
        record: Whether :attr:`changes` has every change of a status.

    Attributes:
        root: The root of the tree.
        count: How many ticks there were.
    """

    def __init__(self, root: Behaviour, *, record: bool = False) -> None:
        self.root = root
        self.count = 0
        self._table = TickTable(record)

    @property
    def changes(self) -> tuple[StatusChange, ...]:
        """List what the last tick changed, in order; only when recording.

        What other code changed between two ticks is not in it: stop the tree with :meth:`stop`.
        """
        return tuple(self._table.changes)

    @property
    def held(self) -> tuple[Behaviour, ...]:
        """The nodes that the last tick has not started because of its argument."""
        return tuple(self._table.held)

    def tick(self, holds: Holds | None = None) -> Status:
        """Tick once.

        Args:
            holds: Asked before each start of a node whether it is not started yet; the node is shown as
                running. Those that were held in the tick before are started without asking.

        Returns:
            The new status of the root.
        """
        root, table = self.root, self._table
        table.changes.clear()
        self.count += 1
        passing = set(self.let_go())
        table.hold(_unless_passing(holds, passing) if passing and holds else holds)
        return table.ticks[root.__class__](root)

    def let_go(self) -> list[Behaviour]:
        """Let the nodes that were held be what they are, not started; return them."""
        held, self._table.held = self._table.held, []
        for node in held:
            if node.status is RUNNING:
                node.status = INVALID
        return held

    def stop(self) -> None:
        """Stop the whole tree with INVALID; when recording, :attr:`changes` has what that changed."""
        self._table.changes.clear()
        self._table.halt(self.root)


def _unless_passing(holds: Holds, passing: set[Behaviour]) -> Holds:
    """Let each of some nodes start once without asking."""

    def ask(node: Behaviour) -> bool:
        if node in passing:
            passing.discard(node)
            return False
        return holds(node)

    return ask


# ---- leaves, decorators, and nodes with a ``tick`` or ``stop`` of their own -----------------------------


def checked(node: Behaviour, answer: object) -> Status:
    """Return what ``update`` returned, or INVALID with py_trees' error message when that is not a status."""
    for status in Status:
        if answer == status:
            return status
    node.logger.error(f"A behaviour returned an invalid status, setting to INVALID [{answer}][{node.name}]")
    return INVALID


def make_leaf(table: TickTable, cls: Any) -> tuple[Tick, Halt]:
    """Make the functions of a leaf that keeps ``Behaviour.tick`` and ``stop``."""
    change = table.change

    def tick(node: Any) -> Status:
        if node.status is not RUNNING:
            node.initialise()
        new: Status = node.update()
        if new is not RUNNING:
            if new.__class__ is not Status:
                new = checked(node, new)
            node.terminate(new)
        if node.status is not new:
            change(node, new)
        return new

    def halt(node: Any) -> None:
        node.terminate(INVALID)
        if node.status is not INVALID:
            change(node, INVALID)

    return tick, halt


def make_decorator(table: TickTable, cls: Any) -> tuple[Tick, Halt]:
    """Make those of a decorator that keeps ``Decorator.tick`` and ``stop``."""
    ticks, halts, change = table.ticks, table.halts, table.change
    watched = table.record and cls.update not in LEAVE_CHILDREN

    def tick(node: Any) -> Status:
        if node.status is not RUNNING:
            node.initialise()
        child = node.decorated
        ticks[child.__class__](child)
        new: Status = table.watch((child,), node.update) if watched else node.update()
        if new is not RUNNING:
            if new.__class__ is not Status:
                new = checked(node, new)
            stop(node, new)
        elif node.status is not RUNNING:
            change(node, RUNNING)
        return new

    def stop(node: Any, new: Status) -> None:
        node.terminate(new)
        child = node.decorated
        if new is INVALID:
            halts[child.__class__](child)
        if child.status is RUNNING:
            halts[child.__class__](child)
        if node.status is not new:
            change(node, new)

    return tick, lambda node: stop(node, INVALID)


def make_prepared_decorator(table: TickTable, cls: Any) -> tuple[Tick, Halt]:
    """Make those of ``PreparedDecorator``: its gate may end it before the child is ticked."""
    tick_child, halt = make_decorator(table, cls)

    def tick(node: Any) -> Status:
        before = node.status
        node.on_halt = table.halt
        try:
            may_tick_child = node.gate()
        finally:
            node.on_halt = None
        if may_tick_child:
            return tick_child(node)
        new: Status = node.status
        if new is not before and table.record:
            table.changes.append((node, before, new))
        return new

    return tick, halt


def make_own(table: TickTable, cls: Any) -> tuple[Tick, Halt]:
    """Make those of a class with its own ``tick`` or ``stop``: these run, for the node and all below it."""

    def tick(node: Any) -> Status:
        table.watch((node,), node.tick_once)
        status: Status = node.status
        return status

    return tick, table.stop_by_itself


# ---- composites -----------------------------------------------------------------------------------------


def make_stop(table: TickTable) -> Callable[[Any, Status], None]:
    """Make ``Composite.stop``: with INVALID the children are stopped first, otherwise only the node ends."""
    change, halt_from = table.change, table.halt_from

    def stop(node: Any, new: Status) -> None:
        if new is INVALID:
            node.current_child = None
            halt_from(node.children, 0)
        node.terminate(new)
        if node.status is not new:
            change(node, new)

    return stop


def make_initialise(table: TickTable, cls: Any) -> Callable[[Any], None]:
    """Make ``initialise`` of a class of composites; one that is overridden may stop children itself."""
    if cls.initialise is Behaviour.initialise:
        return cls.initialise
    if cls.initialise is Selector.initialise:
        return lambda node: table.halt_from(node.children, 0)
    return lambda node: table.watch(node.children, node.initialise)


def make_sequence(table: TickTable, cls: Any) -> tuple[Tick, Halt]:
    """Make those of ``py_trees.composites.Sequence``, and of subclasses that tick and stop as it does."""
    initialise, stop = make_initialise(table, cls), make_stop(table)
    ticks, change, halt_from = table.ticks, table.change, table.halt_from

    def tick(node: Any) -> Status:
        index = 0
        if node.status is not RUNNING:
            node.current_child = node.children[0] if node.children else None
            halt_from(node.children, 0)
            initialise(node)
        elif node.memory and node.current_child is not None:
            index = node.children.index(node.current_child)
        elif not node.children:
            node.current_child = None
        children = node.children
        new = SUCCESS
        while index < len(children):
            child = node.current_child = children[index]
            new = ticks[child.__class__](child)
            if new is not SUCCESS:
                if not node.memory:
                    halt_from(children, index + 1)
                break
            index += 1
        if new is not RUNNING:
            stop(node, new)
        elif node.status is not RUNNING:
            change(node, RUNNING)
        return new

    return tick, lambda node: stop(node, INVALID)


def make_selector(table: TickTable, cls: Any) -> tuple[Tick, Halt]:
    """Make those of ``py_trees.composites.Selector``, and of subclasses that tick and stop as it does."""
    initialise, stop = make_initialise(table, cls), make_stop(table)
    ticks, change, halt_from = table.ticks, table.change, table.halt_from

    def first_child(node: Any) -> int:
        """Return where a selector begins; with memory py_trees stops the children before."""
        if not node.children or not node.memory:
            return 0
        assert node.current_child is not None  # as in py_trees: the running child was removed
        index: int = node.children.index(node.current_child)
        for earlier in node.children[:index]:
            if earlier.status is not INVALID:
                table.halt(earlier)
        return index

    def tick(node: Any) -> Status:
        if node.status is not RUNNING:
            node.current_child = node.children[0] if node.children else None
            initialise(node)
        children = node.children
        index = first_child(node)
        previous = node.current_child
        new = FAILURE
        while index < len(children):
            child = children[index]
            new = ticks[child.__class__](child)
            if new is RUNNING or new is SUCCESS:
                node.current_child = child
                if previous is not child:
                    halt_from(children, index + 1)
                break
            index += 1
        else:
            new = FAILURE
        if new is not RUNNING:
            stop(node, new)
            if new is FAILURE:
                node.current_child = children[-1] if children else None
        elif node.status is not RUNNING:
            change(node, RUNNING)
        return new

    return tick, lambda node: stop(node, INVALID)


def make_parallel(table: TickTable, cls: Any) -> tuple[Tick, Halt]:
    """Make those of ``py_trees.composites.Parallel``, and of subclasses that tick and stop as it does."""
    initialise, stop_alone = make_initialise(table, cls), make_stop(table)
    ticks, halts, change, halt_from = table.ticks, table.halts, table.change, table.halt_from

    def tick(node: Any) -> Status:
        node.validate_policy_configuration()
        if node.status is not RUNNING:
            halt_from(node.children, 0)
            node.current_child = None
            initialise(node)
        children = node.children
        synchronise, all_run = node.policy.synchronise, True
        for child in children:
            done = synchronise and child.status is SUCCESS
            if done or ticks[child.__class__](child) is not RUNNING:
                all_run = False
        if not children:
            new, node.current_child = SUCCESS, None
        elif all_run:
            new, node.current_child = RUNNING, children[-1]
        else:
            new, node.current_child = _decision(node)
        if new is not RUNNING:
            stop(node, new)
        elif node.status is not RUNNING:
            change(node, RUNNING)
        return new

    def stop(node: Any, new: Status) -> None:
        for child in node.children:
            if child.status is RUNNING:
                halts[child.__class__](child)
        stop_alone(node, new)

    return tick, lambda node: stop(node, INVALID)


def _decision(node: composites.Parallel) -> tuple[Status, Behaviour]:
    """Return what the policy says about the statuses of the children, and the child that decides.

    Raises:
        RuntimeError: The policy is none of py_trees; the message is that of py_trees.
    """
    children, policy = node.children, node.policy
    for child in children:
        if child.status is FAILURE:
            return FAILURE, child
    if isinstance(policy, ParallelPolicy.SuccessOnAll):
        if all(child.status is SUCCESS for child in children):
            return SUCCESS, children[-1]
    elif isinstance(policy, ParallelPolicy.SuccessOnOne):
        for child in reversed(children):
            if child.status is SUCCESS:
                return SUCCESS, child
    elif isinstance(policy, ParallelPolicy.SuccessOnSelected):
        if all(child.status is SUCCESS for child in policy.children):
            return SUCCESS, policy.children[-1]
    else:
        raise RuntimeError(f"this parallel has been configured with an unrecognised policy [{type(policy)}]")
    return RUNNING, children[-1]


def make_stepping(table: TickTable, cls: Any) -> tuple[Tick, Halt]:
    """Make those of ``behaviours.stepping.Stepping``: tick the children that the node names; any ``stop``."""
    ticks, change = table.ticks, table.change
    plain, stop = _stops_as_composites_do(cls), make_stop(table)

    def take_steps(node: Any) -> Status:
        steps = node.steps()
        while True:
            try:
                child = next(steps)
            except StopIteration as end:
                new: Status = end.value
                return new
            ticks[child.__class__](child)

    def tick(node: Any) -> Status:
        node.on_halt = table.halt
        try:
            new = take_steps(node)
            before = node.status
            if plain:
                if new is not RUNNING:
                    stop(node, new)
            elif new is INVALID:
                table.watch(node.children, lambda: node.stop(INVALID))
            elif new is not RUNNING:
                node.stop(new)
        finally:
            node.on_halt = None  # a stop from outside is not for this table
        if node.status is not new:
            change(node, new)
        elif not plain and before is not new and table.record:
            table.changes.append((node, before, new))
        return new

    return tick, (lambda node: stop(node, INVALID)) if plain else table.stop_by_itself


def _stops_as_composites_do(cls: Any) -> bool:
    """Tell whether a class has the ``stop`` of py_trees, and no own ``terminate`` that may stop children."""
    return cls.terminate in LEAVE_CHILDREN and cls.stop in (
        composites.Composite.stop,
        composites.Sequence.stop,
        composites.Selector.stop,
    )


MAKERS = {
    (Behaviour.tick, Behaviour.stop): make_leaf,
    (composites.Sequence.tick, composites.Sequence.stop): make_sequence,
    (composites.Selector.tick, composites.Selector.stop): make_selector,
    (composites.Parallel.tick, composites.Parallel.stop): make_parallel,
    (decorators.Decorator.tick, decorators.Decorator.stop): make_decorator,
    (PreparedDecorator.tick, decorators.Decorator.stop): make_prepared_decorator,
}
"""Makers of the functions for a class, by its ``tick`` and ``stop``."""


def _functions_of(table: TickTable, cls: Any) -> tuple[Tick, Halt]:
    """Make the functions that tick and stop nodes of a class."""
    if cls.tick is Stepping.tick:
        return make_stepping(table, cls)
    make = MAKERS.get((cls.tick, cls.stop), make_own)
    if table.record and make is not make_leaf and not _around(cls) <= LEAVE_CHILDREN:
        make = make_own
    return make(table, cls)


def _around(cls: Any) -> set[Any]:
    """Return what a class does before and after its children; :func:`make_initialise` watches composites."""
    return {cls.terminate, cls.initialise} if issubclass(cls, decorators.Decorator) else {cls.terminate}
