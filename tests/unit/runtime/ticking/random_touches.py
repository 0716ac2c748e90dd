"""Random trees in which mostly one node is touched between two ticks; leaves write keys in the middle of one.

Written independently of ``random_reactive``: few kinds of leaves, deeper trees, more ticks.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

from py_trees import composites, decorators
from py_trees.behaviour import Behaviour
from py_trees.behaviours import Failure, Running, Success
from py_trees.common import OneShotPolicy, ParallelPolicy, Status

from florence_bt.behaviours.composites import Selector
from florence_bt.behaviours.decorators import ForceFailure, Invert
from florence_bt.behaviours.keys import KeyStore
from florence_bt.behaviours.parallel import CountingParallel
from florence_bt.behaviours.reactive import AlwaysSettled, Reactive

KEYS = tuple(f"key {n}" for n in range(8))
TICKS = 50
ENDS = (Status.SUCCESS, Status.FAILURE, None)


class Plant:
    """Grows the tree of a seed."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.keys = KeyStore(dict.fromkeys(KEYS, 1))
        self.log: list[tuple[Any, ...]] = []
        self.jobs: list[Errand] = []
        self._names = 0
        self._decorators = self.random.choice((0.0, 0.0, 0.1, 0.3))
        self._memory = self.random.choice((0.0, 0.2, 0.5))

    def name(self) -> str:
        self._names += 1
        return f"n{self._names}"

    def grow(self, depth: int) -> Behaviour:
        dice = self.random.random()
        if depth == 0 or dice < 0.1:
            return self.random.choice(LEAVES)(self)
        if dice < 0.1 + self._decorators:
            child = self.grow(depth - 1)
            return self.random.choice(DECORATORS)(self.name(), child)
        children = [self.grow(depth - 1) for _ in range(self.random.choice((1, 2, 2, 3, 3, 4)))]
        return self.random.choice(COMPOSITES)(self, children)

    def memory(self) -> bool:
        return self.random.random() < self._memory

    def policy(self, children: list[Behaviour]) -> ParallelPolicy.Base:
        chosen = self.random.sample(children, self.random.randint(1, len(children)))
        passes_over = self.random.random() < 0.3
        policies: list[ParallelPolicy.Base] = [
            ParallelPolicy.SuccessOnAll(synchronise=passes_over),
            ParallelPolicy.SuccessOnOne(),
            ParallelPolicy.SuccessOnSelected(chosen, synchronise=passes_over),
        ]
        return self.random.choice(policies)


class Question(AlwaysSettled, Behaviour):
    """A condition over a key; some of them also run."""

    def __init__(self, plant: Plant, *answers: Status) -> None:
        super().__init__(plant.name())
        self.asked = 0
        self._keys, self._key = plant.keys, plant.random.choice(KEYS)
        self._answers = answers
        plant.keys.watch((self._key,), lambda key: self.touch())

    def update(self) -> Status:
        self.asked += 1
        value = self._keys.read(self._key)
        self.feedback_message = f"{value}"
        return self._answers[value]


class Errand(Reactive, Behaviour):
    """Works until somebody ends it; now and then it writes keys when there is news."""

    def __init__(self, plant: Plant) -> None:
        super().__init__(plant.name())
        self._plant = plant
        self._random = random.Random(plant.random.random())
        self._news = False
        self._end: Status | None = None
        plant.jobs.append(self)

    def initialise(self) -> None:
        self._plant.log.append((self.name, "starts"))
        self._news, self._end = True, None

    def update(self) -> Status:
        if self._news:
            self._news = False
            self.feedback_message = f"{self._random.random():.1f}"
            for _ in range(self._random.choice((0, 1, 2))):
                self._plant.keys.write(self._random.choice(KEYS), self._random.randrange(4))
        return self._end or Status.RUNNING

    def terminate(self, new_status: Status) -> None:
        if self.status is Status.RUNNING:
            self._plant.log.append((self.name, "ends", new_status))

    def hear(self, end: Status | None) -> None:
        self._news, self._end = True, end
        self.touch()


S, F, R = Status.SUCCESS, Status.FAILURE, Status.RUNNING
LEAVES: list[Callable[[Plant], Behaviour]] = [
    *(4 * [lambda p: Question(p, *p.random.choice(((F, S, S, S), (F, F, S, S), (F, F, F, S))))]),
    lambda p: Question(p, S, F, R, R),
    *(3 * [Errand]),
    lambda p: p.random.choice((Success, Failure, Running))(p.name()),
]
DECORATORS: list[Callable[[str, Behaviour], Behaviour]] = [
    decorators.Inverter,
    decorators.FailureIsRunning,
    decorators.RunningIsFailure,
    decorators.SuccessIsRunning,
    lambda name, child: decorators.Retry(name, child, 2),
    lambda name, child: decorators.Repeat(name, child, 2),
    lambda name, child: decorators.OneShot(name, child, OneShotPolicy.ON_COMPLETION),
    lambda name, child: decorators.Condition(name, child, S),
    Invert,
    ForceFailure,
]
COMPOSITES: list[Callable[[Plant, list[Behaviour]], Behaviour]] = [
    *(3 * [lambda p, c: composites.Sequence(p.name(), p.memory(), c)]),
    *(2 * [lambda p, c: composites.Selector(p.name(), p.memory(), c)]),
    *(2 * [lambda p, c: Selector(p.name(), p.memory(), c)]),
    *(2 * [lambda p, c: composites.Parallel(p.name(), p.policy(c), c)]),
    lambda p, c: CountingParallel(p.name(), c, p.random.randint(1, len(c)), p.random.choice((None, 1))),
]

TellStop = Callable[[Behaviour], object]
Ticks = tuple[Callable[[], object], Callable[[], object], TellStop]
"""What ticks a tree, what stops it, and what is told of a node that was stopped."""


def play(seed: int, make: Callable[[Behaviour], Ticks]) -> tuple[list[Any], int]:
    """What can be seen after each tick, and how many questions were asked."""
    plant = Plant(seed)
    root = plant.grow(plant.random.choice((2, 3, 4, 5)))
    tick, stop, tell = make(root)
    chance = random.Random(seed + 1)
    story: list[Any] = []
    for _ in range(TICKS):
        tick()
        story.append((_state(root), tuple(plant.log)))
        plant.log.clear()
        dice = chance.random()
        for _ in range(0 if dice < 0.2 else 1 if dice < 0.85 else 3):
            working = [job for job in plant.jobs if job.status is R]
            if chance.random() < 0.55 or not working:
                plant.keys.write(chance.choice(KEYS), chance.randrange(4))
            else:
                chance.choice(working).hear(chance.choice(ENDS))
        if dice > 0.98:
            stop()
        elif dice > 0.96:
            node = chance.choice(list(root.iterate()))
            node.stop(Status.INVALID)
            tell(node)
    return story, sum(node.asked for node in root.iterate() if isinstance(node, Question))


def _state(root: Behaviour) -> list[Any]:
    return [
        (node.name, node.status, node.feedback_message, getattr(node, "current_child", None) is not None, tip)
        for node in root.iterate()
        for tip in [node.tip() and node.tip().name]
    ]
