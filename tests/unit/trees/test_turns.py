"""Two skills that need one resource never run at once, whatever was stopped in between."""

from __future__ import annotations

from pathlib import Path

import pytest
from py_trees.common import Status

from florence_bt.behaviours.why import explain
from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.trees.language.compile import compile_mission
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.parse import parse_mission
from tests.scripted_skill import ScriptedSkill
from tests.ticking import drain, make_context, tick_until

BASE = frozenset({"base"})
DECLARATIONS = {
    "drive": SkillDeclaration("drive", "Drive", resources=BASE, deadline_s=60.0),
    "spin": SkillDeclaration("spin", "Spin", resources=BASE, deadline_s=10.0),
    "talk": SkillDeclaration("talk", "Talk", resources=frozenset({"voice"})),
    "is_home": SkillDeclaration("is_home", "Ask", failures={"away": "it is not"}, instant=True),
}


class World:
    """A mission whose skills tell when each of them had its resource."""

    def __init__(self, tree: str, **steps: list[Step]) -> None:
        self.clock = ManualClock()
        self.log: list[tuple[float, str, str]] = []
        self.holders: list[str] = []
        self.clashes: list[str] = []
        skills = {
            name: ScriptedSkill(skill, self.clock, steps.get(name, [Step(success(), after=1.0)]))
            for name, skill in DECLARATIONS.items()
        }
        self.context = make_context(
            self.clock,
            skills,
            DECLARATIONS,
            on_skill_started=lambda path, skill, inputs: self._start(skill),
            on_skill_ended=lambda path, skill, result: self._end(skill),
        )
        body = "".join(f"  {line}\n" for line in tree.strip().splitlines())
        mission = parse_mission(f"mission: m\ntree:\n{body}", Path("m.yaml"))
        self.root = compile_mission(mission, MissionLibrary(), {}, self.context).root

    def run(self) -> Status:
        tick_until(self.root, self.clock, self.context)
        drain(self.clock, self.context)
        assert self.clashes == []
        assert self.context.waiting == []
        return self.root.status

    def _start(self, skill: str) -> None:
        self.log.append((self.clock.now(), skill, "starts"))
        if "base" in DECLARATIONS.get(skill, DECLARATIONS["talk"]).resources:
            self.clashes += [f"{skill} while {other}" for other in self.holders]
            self.holders.append(skill)

    def _end(self, skill: str) -> None:
        self.log.append((self.clock.now(), skill, "ends"))
        if skill in self.holders:
            self.holders.remove(skill)


SLOW_TO_STOP = [Step(success(), after=50.0, cancel_takes=3.0)]


def test_the_next_skill_waits_until_the_one_before_has_really_stopped():
    world = World("selector:\n  - {timeout: 5 s, do: {drive: }}\n  - spin:\n", drive=SLOW_TO_STOP)
    assert world.run() is Status.SUCCESS
    assert world.log == [
        (0.0, "drive", "starts"),
        (8.0, "drive", "ends"),
        (8.0, "spin", "starts"),
        (9.0, "spin", "ends"),
    ]


def test_while_it_waits_it_says_for_what():
    world = World("selector:\n  - {timeout: 5 s, do: {drive: }}\n  - spin:\n", drive=SLOW_TO_STOP)
    tick_until(world.root, world.clock, world.context, lambda: world.clock.now() == 5.0)
    world.root.tick_once()
    waiting = world.root.tip()
    assert waiting.name == "spin"
    assert waiting.feedback_message.startswith("waits for the base, which drive at m/")


def test_what_needs_something_else_does_not_wait():
    world = World("selector:\n  - {timeout: 5 s, do: {drive: }}\n  - talk:\n", drive=SLOW_TO_STOP)
    assert world.run() is Status.SUCCESS
    assert (5.0, "talk", "starts") in world.log


def test_a_clean_up_beside_the_tree_and_the_tree_take_turns():
    world = World(
        "selector:\n  - timeout: 5 s\n    do:\n      wait: 10 s\n      finally: {spin: }\n  - drive:\n",
        spin=[Step(success(), after=4.0)],
    )
    assert world.run() is Status.SUCCESS
    assert [entry for entry in world.log if entry[1] != "finally"] == [
        (5.0, "spin", "starts"),
        (9.0, "spin", "ends"),
        (9.0, "drive", "starts"),
        (10.0, "drive", "ends"),
    ]


def test_a_branch_that_takes_over_waits_for_the_one_that_it_stops():
    # Without memory the first branch begins before the second one is told to stop.
    world = World(
        "parallel:\n"
        "  - selector:\n"
        "      - sequence: [{condition: $go}, {spin: }]\n"
        "      - drive:\n"
        "    memory: false\n"
        "  - sequence: [{wait: 2 s}, {set: {go: true}}]\n",
        drive=SLOW_TO_STOP,
    )
    world.context.keys.write("go", False)
    assert world.run() is Status.SUCCESS
    assert world.log == [
        (0.0, "drive", "starts"),
        (5.0, "drive", "ends"),
        (5.0, "spin", "starts"),
        (6.0, "spin", "ends"),
    ]


def test_who_waits_too_long_fails_and_names_who_has_it():
    stuck = [Step(success(), after=50.0, cancel_takes=30.0)]
    world = World("selector:\n  - {timeout: 5 s, do: {drive: }}\n  - spin:\n", drive=stuck)
    assert world.run() is Status.FAILURE
    why = explain(world.root)
    assert (why.path, why.code) == ("m/spin", "timed_out")
    assert why.reason.startswith("spin could not start within 10 s: it waits for the base, which drive at")
    assert [entry[1] for entry in world.log] == ["drive", "drive"]


def test_who_is_stopped_while_it_waits_starts_nothing():
    stuck = [Step(success(), after=50.0, cancel_takes=8.0)]
    world = World(
        "selector:\n  - {timeout: 5 s, do: {drive: }}\n  - {timeout: 2 s, do: {spin: }}\n", drive=stuck
    )
    assert world.run() is Status.FAILURE
    assert [entry[1] for entry in world.log] == ["drive", "drive"]


@pytest.mark.parametrize("seconds", range(1, 9))
def test_a_tick_for_another_reason_does_not_disturb_who_waits(seconds):
    world = World("selector:\n  - {timeout: 5 s, do: {drive: }}\n  - spin:\n", drive=SLOW_TO_STOP)
    world.clock.call_at(float(seconds), world.context.wake)
    assert world.run() is Status.SUCCESS
    assert (8.0, "spin", "starts") in world.log
