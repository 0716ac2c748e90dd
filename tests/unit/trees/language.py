"""Ticks missions with scripted skills on a manual clock, one tick at a time."""

from pathlib import Path

from py_trees.common import Status

from florence_bt.behaviours.why import explain
from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.trees.language.compile import compile_mission
from florence_bt.trees.language.inputs import parse_inputs
from florence_bt.trees.language.loader import MissionLibrary
from tests.scripted_skill import ScriptedSkill
from tests.ticking import drain, make_context, tick_until

DECLARATIONS = {
    skill.name: skill
    for skill in (
        SkillDeclaration("work", "Work", failures={"broken": "it broke"}),
        SkillDeclaration("other", "Work too", failures={"broken": "it broke"}),
        SkillDeclaration("clean", "Clean up"),
        SkillDeclaration(
            "measure",
            "Measure",
            outputs={"distance": Port(Kind.LENGTH, "how far"), "label": Port(Kind.TEXT, "what")},
            failures={"blind": "nothing is seen"},
        ),
        SkillDeclaration(
            "move", "Move", inputs={"by": Port(Kind.LENGTH, "how far", minimum=-2.0, maximum=2.0)}
        ),
        SkillDeclaration("is_home", "Ask", failures={"away": "it is not"}, instant=True),
    )
}
BROKEN = failure("broken", "it broke")
ENDLESS = Step(success(), after=1e6)
"""A skill that is stopped before it is done."""


def takes(seconds, result=None):
    """A step of a script: this many seconds, then success or the given result."""
    return Step(result or success(), after=seconds)


def measured(distance, after=0.0, label="wall"):
    """A step of ``measure``."""
    return Step(success(distance=distance, label=label), after=after)


class Play:
    """A mission that is ticked by hand.

    Args:
        folder: Where its file is written.
        text: The file, without its first line.
        inputs: Its inputs.
        scripts: Steps by skill; a skill without a script succeeds at once.
        others: Further missions by name, without their first lines.
    """

    def __init__(self, folder: Path, text: str, inputs=None, others=None, **scripts):
        for name, content in {**(others or {}), "m": text}.items():
            (folder / f"{name}.yaml").write_text(f"mission: {name}\n{content}")
        self.library = MissionLibrary.load([folder], built_in=False)
        self.clock = ManualClock()
        self.started = []
        self.ended = []
        self.skills = {
            name: ScriptedSkill(declaration, self.clock, scripts.get(name, [takes(0.0)]))
            for name, declaration in DECLARATIONS.items()
            if name != "measure" or name in scripts
        }
        self._held = None
        self.context = make_context(
            self.clock,
            self.skills,
            DECLARATIONS,
            later=self._after_tick,
            on_skill_started=lambda path, skill, inputs: self.started.append((self.clock.now(), skill)),
            on_skill_ended=lambda path, skill, result: self.ended.append(
                (self.clock.now(), skill, result.code)
            ),
        )
        mission = self.library.get("m")
        self.tree = compile_mission(mission, self.library, parse_inputs(mission, inputs or {}), self.context)
        self.root = self.tree.root
        self.keys = self.context.keys

    def run(self):
        """Tick until the mission and its skills are done; returns its status, "success" or the code."""
        tick_until(self.root, self.clock, self.context)
        drain(self.clock, self.context)
        return self.status

    def at(self, seconds):
        """Go on to a time, ticking whenever a tick is asked for, and return the status then."""
        self.tick()
        while (due := self.clock.next_time()) is not None and due <= seconds:
            self.clock.run_next()
            if self.context.wake.take():
                self.tick()
        self.clock.advance_to(seconds)
        return self.status

    def tick(self):
        """Tick, and again as long as that is asked for at this moment."""
        for _ in range(100):
            if self.root.status in (Status.SUCCESS, Status.FAILURE):
                return
            self._held = []
            self.context.tick_beside()
            self.root.tick_once()
            held, self._held = self._held, None
            for callback in held:
                callback()
            if not self.context.wake.take():
                return
        raise AssertionError("the tree wakes itself for ever")

    def _after_tick(self, callback):
        if self._held is None:
            callback()
        else:
            self._held.append(callback)

    @property
    def why(self):
        return explain(self.root)

    @property
    def status(self):
        if self.root.status is Status.FAILURE:
            return self.why.code
        return self.root.status.name.lower()
