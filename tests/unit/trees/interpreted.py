"""Missions for the interpreter and for the engine: how they are written, and how the engine plays them."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from py_trees.common import Status

from florence_bt.behaviours.ticking import Ticker
from florence_bt.behaviours.why import explain
from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import CodeGroup, Kind, Port, SkillDeclaration
from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import ScriptedRun, Step
from florence_bt.trees.language.compile import compile_mission
from florence_bt.trees.language.inputs import parse_inputs
from florence_bt.trees.language.loader import MissionLibrary
from tests.ticking import make_context
from tests.unit.trees.interpreter import GROUPS, LONGEST, SUB, Failed, Node, World

KEYS: dict[str, Any] = {"a": 1, "b": 1, "c": 1, "x": 0, "y": 0}
LISTS: dict[str, Any] = {"l": ()}
TASK = SkillDeclaration(
    "task",
    "Do something",
    inputs={"name": Port(Kind.TEXT, "what")},
    outputs={"n": Port(Kind.INTEGER, "a number")},
    failures={"broken": "it broke", "jammed": "it is stuck", "odd": "it is odd"},
    groups=tuple(CodeGroup(name, frozenset(codes), name) for name, codes in GROUPS.items()),
    deadline_s=1e6,
)


def file_of(tree: Node) -> str:
    keys = {key: {"type": "integer", "default": start} for key, start in KEYS.items()}
    keys |= {key: {"type": "list of integer", "default": list(start)} for key, start in LISTS.items()}
    written = re.sub(r'"(\d+)":', r"\1:", json.dumps(tree))  # cases of a switch are no texts
    return f"mission: m\nkeys: {json.dumps(keys)}\ntree: {written}\n"


SUB_FILE = (
    f"mission: sub\ninputs: {{x: {{type: integer, default: {SUB['inputs']['x']}}}}}\n"
    f"outputs: {{y: {{type: integer}}}}\ntree: {json.dumps(SUB['tree'])}\n"
)
Played = tuple[Any, float, list[tuple[float, str, str]], dict[str, Any]]
"""The result, when all was over, what the tasks did, and the keys."""


class _Run:
    """A run of a task, which notes how it ends."""

    def __init__(self, run: ScriptedRun, note: Callable[[str], None]) -> None:
        self._run = run
        self._note: Callable[[str], None] | None = note

    def poll(self) -> Any:
        result = self._run.poll()
        if result is not None:
            self._end(result.code)
        return result

    def cancel(self) -> None:
        self._end("stopped")
        self._run.cancel()

    def _end(self, how: str) -> None:
        if self._note is not None:
            self._note(how)
            self._note = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._run, name)


class _Tasks:
    """The skill ``task``: each task has a script of its own."""

    declaration = TASK

    def __init__(self, clock: ManualClock, tasks: World) -> None:
        self.log: list[tuple[float, str, str]] = []
        self._clock = clock
        self._tasks = tasks.tasks
        self._runs: dict[str, int] = {}

    def start(self, inputs: Any) -> _Run:
        name = inputs["name"]
        script = self._tasks[name]
        number = self._runs[name] = self._runs.get(name, -1) + 1
        after, code, given = script[min(number, len(script) - 1)]
        result = success(n=given) if code is None else failure(code, code)
        self.log.append((self._clock.now(), name, "begins"))
        run = ScriptedRun(self._clock, Step(result, after=after), dict(inputs))
        return _Run(run, lambda how: self.log.append((self._clock.now(), name, how)))


def by_the_engine(folder: Path, tree: Node, tasks: World, stop_at: float | None = None) -> Played:
    """Compile and tick a mission, as the executor does: whenever something has happened."""
    (folder / "m.yaml").write_text(file_of(tree))
    (folder / "sub.yaml").write_text(SUB_FILE)
    library = MissionLibrary.load([folder], built_in=False)
    mission, clock = library.get("m"), ManualClock()
    skill = _Tasks(clock, tasks)
    context = make_context(clock, {"task": skill}, {"task": TASK})
    root = compile_mission(mission, library, parse_inputs(mission, {}), context, as_reached=True).root
    ticker, result = Ticker(root), None
    context.wake()
    while True:
        while context.wake.take():
            context.tick_beside()
            if result is None:
                ticker.tick()
                if root.status is Status.FAILURE:
                    result = Failed(explain(root).code)
                elif root.status is Status.SUCCESS:
                    result = "ok"
        if result is not None and not context.beside:
            break
        due = clock.next_time()
        if stop_at is not None and (due is None or stop_at < due):
            clock.advance_to(stop_at)
            stop_at = None
            if result is None:
                result = "stopped"
                ticker.stop()
                context.wake()
        elif due is None or due > LONGEST:
            break
        else:
            clock.advance_to(due)
    keys = {key: context.keys.read(key) for key in (*KEYS, *LISTS)}
    return result, clock.now() if result is not None else LONGEST, sorted(skill.log), keys


def by_the_page(tree: Node, tasks: World, stop_at: float | None = None) -> Played:
    world = World(tasks.tasks)
    world.play(tree, {**KEYS, **LISTS}, stop_at)
    keys = {key: world.keys.values[key] for key in (*KEYS, *LISTS)}
    now = world.now if world.result is not None else LONGEST
    return world.result, now, sorted(world.log), keys


class Writer:
    """Writes missions.

    Args:
        pick: Chooses one of several things.
    """

    def __init__(self, pick: Callable[[Sequence[Any]], Any]) -> None:
        self.pick = pick
        self.tasks: dict[str, list[tuple[float, str | None, int]]] = {"sub": [self._end(), self._end()]}

    def chance(self, percent: int) -> bool:
        return bool(self.pick(range(100)) < percent)

    def _end(self) -> tuple[float, str | None, int]:
        code = self.pick((None, None, None, "broken", "jammed", "odd"))
        return self.pick((0.0, 1.0, 1.0, 2.0, 3.0, 0.5)), code, self.pick(range(4))

    def task(self) -> Node:
        name = f"t{len(self.tasks)}"
        self.tasks[name] = [self._end() for _ in range(self.pick((1, 1, 2, 3)))]
        return {"task": {"name": name}, **({"out": {"n": self.key()}} if self.chance(25) else {})}

    def key(self) -> str:
        return str(self.pick(("a", "b", "c")))

    def formula(self) -> str:
        name = self.pick(("a", "b", "c", "x"))
        text = f"${name} {self.pick(('<', '>', '==', '!='))} {self.pick(range(4))}"
        return f"not ({text})" if self.chance(20) else text

    def number(self) -> Any:
        return self.pick((0, 1, 2, 3, f"${self.key()}", f"${{${self.key()} + 1}}", "$x"))

    def node(self, depth: int) -> Node:
        kinds = (
            (self.leaf,) if depth == 0 else (self.composite, self.loop, self.wrapper, self.choice, self.leaf)
        )
        node: Node = self.pick(kinds)(depth - 1)
        return self.modified(node, depth)

    def modified(self, node: Node, depth: int) -> Node:
        for guard, percent in (("when", 15), ("while", 10), ("ensure", 8)):
            if self.chance(percent):
                node[guard] = self.formula()
        if self.chance(10):
            node["until"] = self.formula() if self.chance(50) else self.task()
        if self.chance(8):
            node["interrupted_by"] = self.interruption()
        if {"while", "until", "ensure"} & set(node):
            node.pop("code", None)  # it would not be clear whose it is
        if self.chance(12):
            words = ("broken", "out_of_order", "guard_failed", "timed_out", "skipped", "any")
            node["on_failure"] = {self.pick(words): self.node(min(depth, 1) and depth - 1) for _ in range(2)}
        if self.chance(10):
            node["finally"] = self.pick((self.task(), {"sequence": [self.task(), self.task()]}))
        return node

    def interruption(self) -> Node:
        key = self.key()
        asked = self.task() if self.chance(40) else f"${key} == {self.pick(range(3))}"
        then = self.pick(({"set": {key: 7}}, {"set": {key: 7}}, self.node(0)))
        return {"if": asked, "do": {"sequence": [{"wait": self.pick(("0.5 s", "1 s"))}, then]}}

    def leaf(self, depth: int) -> Node:
        return self.pick(
            (
                self.task,
                self.task,
                lambda: {"condition": self.formula()},
                lambda: {"set": {self.key(): self.number(), self.pick(("x", "y")): self.number()}},
                lambda: {"add": {self.key(): self.pick((1, "$a"))}},
                lambda: {"append": {"l": self.pick((1, "$x", "$a"))}},
                lambda: {"wait": self.pick(("1 s", "2 s", "0.5 s"))},
                lambda: {"fail": "no", "code": self.pick(("broken", "odd"))},
                lambda: {"wait_until": self.formula(), "timeout": "2 s"},
                lambda: {"run": "sub", "with": {"x": f"${self.key()}"}, "out": {"y": self.key()}},
            )
        )()

    def composite(self, depth: int) -> Node:
        children = [self.node(depth) for _ in range(self.pick((1, 2, 2, 3)))]
        kind = self.pick(("sequence", "selector", "parallel", "parallel"))
        node: Node = {kind: children}
        if kind == "parallel":
            for number, child in enumerate(children):
                child["name"] = f"n{number}"
            count = self.pick(range(1, len(children) + 1))
            names = [f"n{number}" for number in range(count)]
            node["policy"] = self.pick(
                ("all", "any", names, {"succeed": count}, {"succeed": count, "fail": 1})
            )
        elif self.chance(25):
            conditions = [{"condition": self.formula()} for _ in range(self.pick((1, 2)))]
            return {kind: [*conditions, children[-1]], "memory": False}
        return node

    def loop(self, depth: int) -> Node:
        do, dice = self.node(depth), self.pick(range(3))
        if dice == 0:
            return {"repeat": self.pick((2, 3)), "do": do}
        if dice == 1:
            more: Node = {"attempt": self.pick(("x", "y", "a"))} if self.chance(50) else {}
            more |= {"between": self.node(0)} if self.chance(40) else {}
            more |= {"on": [self.pick(("broken", "out_of_order"))]} if self.chance(30) else {}
            return {"retry": self.pick((2, 3)), "do": do, **more}
        more = {"index": "y"} if self.chance(40) else {}
        more |= {"first_success": True} if self.chance(50) else {}
        more |= {"go_on_over": [self.pick(("broken", "out_of_order"))]} if self.chance(30) else {}
        return {
            "for_each": self.pick(([], [1], [2, 0, 1])),
            "as": self.pick(("x", "x", "a")),
            "do": do,
            **more,
        }

    def wrapper(self, depth: int) -> Node:
        child, kind = self.node(depth), self.pick(("timeout", "once", "invert", "succeed"))
        return (
            {"timeout": self.pick(("1 s", "1.5 s", "2 s")), "do": child}
            if kind == "timeout"
            else {kind: child}
        )

    def choice(self, depth: int) -> Node:
        if self.chance(40):
            cases = {number: self.node(depth) for number in (0, 1)}
            default = {"default": self.node(depth)} if self.chance(60) else {}
            return {"switch": f"${self.key()}", "cases": cases, **default}
        otherwise = {"else": self.node(depth)} if self.chance(60) else {}
        if self.chance(40):
            return {"if": self.modified(self.task(), 0), "then": self.node(depth), **otherwise}
        memory = {"memory": False} if self.chance(30) else {}
        return {"if": self.formula(), "then": self.node(depth), **memory, **otherwise}
