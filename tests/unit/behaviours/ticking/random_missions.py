"""Random missions, written as YAML and compiled as every mission is: guards, timers, clean-ups, calls."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.trees.language.compile import compile_mission
from florence_bt.trees.language.inputs import parse_inputs
from florence_bt.trees.language.loader import MissionLibrary
from tests.scripted_skill import ScriptedSkill
from tests.ticking import make_context

KEYS = ("a", "b", "c", "d")
DECLARATIONS = {
    declaration.name: declaration
    for declaration in (
        SkillDeclaration("work", "Work", failures={"broken": "it broke"}, deadline_s=6.0),
        SkillDeclaration("other", "Work too", failures={"broken": "it broke"}),
        SkillDeclaration(
            "count", "Count", outputs={"n": Port(Kind.INTEGER, "n")}, failures={"broken": "it broke"}
        ),
        SkillDeclaration("ask", "Ask", failures={"broken": "it broke"}, instant=True),
    )
}
SUB = """mission: sub
inputs: {x: {type: integer, description: x}}
outputs: {y: {type: integer, description: y}}
tree:
  sequence:
    - selector: [{condition: $x > 1}, {work: }]
      memory: false
    - set: {y: 2}
  memory: false
"""
Node = dict[str, Any]


class Author:
    """Writes the mission of a seed.

    Args:
        seed: The seed.
        asks: Whether some leaves are skills that are watched as conditions.
        catches: Whether some nodes have an ``until`` or an ``on_failure``, a retry something between, and
            what loops over lists.
    """

    def __init__(self, seed: int, *, asks: bool = False, catches: bool = False) -> None:
        self.random = random.Random(seed)
        self._catches = catches
        self._asks = asks
        self._names = 0
        self._left = self.random.choice((6, 12, 25, 40))

    def file(self) -> str:
        keys = {key: {"type": "integer", "default": 1, "description": key} for key in KEYS}
        tree = self.node(self.random.choice((2, 3, 4, 5)))
        if self._asks:
            kind = self.random.choice(("sequence", "selector"))
            tree = {kind: [{"ask": None}, self.node(2), tree, {"wait": "3 s"}], "memory": False}
        return f"mission: m\nkeys: {json.dumps(keys)}\ntree: {json.dumps(tree)}\n"

    def node(self, depth: int) -> Node:
        self._left -= 1
        if depth == 0 or self._left < 0 or self.random.random() < 0.15:
            return self.guarded(self.leaf())
        kind = self.random.choice(
            (self.composite, self.composite, self.composite, self.choice, self.decorator)
        )
        return self.guarded({**kind(depth - 1), "name": self.name()})

    def leaf(self) -> Node:
        key, dice = self.random.choice(KEYS), self.random.random()
        if self._asks and self.random.random() < 0.5:
            asked: Node = self.random.choice(
                [
                    {"ask": None},
                    {"ask": None, "every": "0.7 s"},
                    {"count": None, "out": {"n": key}, "every": "1.5 s"},
                ]
            )
            return {**asked, "name": self.name()}
        if dice < 0.4:
            node: Node = {"condition": self.formula()}
        elif dice < 0.75:
            node = self.random.choice([{"work": None}, {"other": None}, {"count": None, "out": {"n": key}}])
        elif dice < 0.87:
            node = {"wait": self.random.choice(("0.5 s", "1 s", "2 s"))}
        elif dice < 0.96:
            value: Any = self.random.randrange(4)
            node = {"set": {key: self.random.choice((value, f"${{${key} + 1}}"))}}
        else:
            node = {"fail": "because"}
        return {**node, "name": self.name()}

    def composite(self, depth: int) -> Node:
        children = [self.node(depth) for _ in range(self.random.choice((1, 2, 2, 3, 3, 4)))]
        kind = self.random.choice(("sequence", "selector", "parallel"))
        node: Node = {kind: children}
        if kind != "parallel":
            return node | self.random.choice(({}, {"memory": False}, {"memory": False}, {"memory": True}))
        names = [
            child["name"] for child in self.random.sample(children, self.random.randint(1, len(children)))
        ]
        policies = ("all", "any", names, {"succeed": len(names), "fail": 1})
        return {**node, "policy": self.random.choice(policies)}

    def choice(self, depth: int) -> Node:
        if self.random.random() < 0.3:
            cases = {number: self.node(depth) for number in self.random.sample(range(4), 2)}
            return {"switch": f"${self.random.choice(KEYS)}", "cases": cases, "default": self.node(depth)}
        asked = self.random.choice((self.formula(), self.leaf()))
        otherwise = self.random.choice(({}, {"else": self.node(depth)}))
        return {"if": asked, "then": self.node(depth), "memory": self.random.random() < 0.4, **otherwise}

    def decorator(self, depth: int) -> Node:
        key = self.random.choice(KEYS)
        call: Node = {"run": "sub", "with": {"x": f"${key}"}, "out": {"y": key}}
        child = self.node(depth)
        if self._catches and self.random.random() < 0.2:
            return {"retry": 3, "do": child, "between": self.leaf()}
        if self._catches and self.random.random() < 0.2:
            more = self.random.choice(({}, {"first_success": True}, {"go_on_over": ["broken", "failed"]}))
            return {"for_each": [2, 0, 1], "as": key, "do": child, **more}
        return self.random.choice(
            [
                {"retry": 2, "do": child},
                {"repeat": 2, "do": child},
                {"timeout": "0.5 s", "do": child},
                {"timeout": "1.5 s", "do": child},
                {"succeed": child},
                {"sequence": [child, {"fail": "because", "code": "forced"}]},
                {"sequence": [{"wait": "0.5 s"}, child]},
                {"invert": child},
                call,
            ]
        )

    def guarded(self, node: Node) -> Node:
        allowed = self.formula() if self.random.random() < 0.1 else ""
        forbidden = f"not ({self.formula()})" if self.random.random() < 0.06 else ""
        if allowed or forbidden:
            node["when"] = f"({allowed}) and {forbidden}" if allowed and forbidden else allowed or forbidden
        if self.random.random() < 0.12:
            node["while"] = self.formula()
        if self.random.random() < 0.1:
            node["finally"] = self.leaf()
        if self._catches and self.random.random() < 0.15:
            codes = self.random.sample(["broken", "condition_false", "failed", "until_not_met", "any"], 2)
            node["on_failure"] = {code: self.leaf() for code in codes}
        if self._catches and self.random.random() < 0.15:
            node["until"] = self.random.choice((self.formula(), self.leaf()))
        return node

    def formula(self) -> str:
        pick = self.random.choice
        text = f"${pick(KEYS)} {pick(('<', '>', '==', '!='))} {self.random.randrange(4)}"
        return pick((text, text, text, f"{text} or ${pick(KEYS)} > 1", f"not ({text})"))

    def name(self) -> str:
        self._names += 1
        return f"n{self._names}"


def write(seed: int, folder: Path, *, asks: bool = False, catches: bool = False) -> MissionLibrary:
    """The library with the mission of a seed, which is called ``m``."""
    (folder / "sub.yaml").write_text(SUB)
    (folder / "m.yaml").write_text(Author(seed, asks=asks, catches=catches).file())
    return MissionLibrary.load([folder], built_in=False)


class Stage:
    """A mission with scripted skills; the same seed gives the same scripts."""

    def __init__(self, library: MissionLibrary, seed: int, *, as_reached: bool = False) -> None:
        chance = random.Random(seed + 1)
        self.clock = ManualClock()
        self.log: list[tuple[Any, ...]] = []
        skills = {}
        for name, declaration in DECLARATIONS.items():
            outputs = {"n": chance.randrange(4)} if name == "count" else {}
            results = [
                success(**outputs),
                success(**outputs),
                failure("broken", f"it broke {chance.random():.1f}"),
            ]
            steps = [
                Step(chance.choice(results), after=chance.choice((0.0, 0.0, 0.5, 1.0, 1.0, 2.0, 9.0)))
                for _ in range(chance.randint(1, 6))
            ]
            skills[name] = ScriptedSkill(declaration, self.clock, steps)
        self._held: list[Callable[[], None]] | None = None
        self.context = make_context(
            self.clock,
            skills,
            DECLARATIONS,
            later=self._after_tick,
            on_skill_started=lambda path, skill, inputs: self.log.append(("starts", path, skill)),
            on_skill_ended=lambda path, skill, result: self.log.append(("ends", path, result.code)),
        )
        mission = library.get("m")
        inputs = parse_inputs(mission, {})
        self.root = compile_mission(mission, library, inputs, self.context, as_reached=as_reached).root

    def tick(self, tick: Callable[[], object]) -> None:
        """Tick, then do what was put off."""
        self._held = []
        tick()
        held, self._held = self._held, None
        for callback in held:
            callback()

    def _after_tick(self, callback: Callable[[], None]) -> None:
        if self._held is None:
            callback()
        else:
            self._held.append(callback)
