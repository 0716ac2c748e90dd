"""A world of scripted skills on a manual clock, in which missions and their round trips are compared."""

import random
from pathlib import Path

import pytest
from florence_btcpp.exporter import export_mission
from florence_btcpp.importer import import_trees
from py_trees.common import Status

from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import REQUIRED, Kind
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import COMMON_CODES, failure, success
from florence_bt.core.skill import BaseRun, Event
from florence_bt.trees.language.compile import compile_mission
from florence_bt.trees.language.loader import MissionLibrary
from tests.ticking import Wake, drain, make_context

SAMPLES = {
    Kind.TEXT: ["kitchen", "bedroom", "fast"],
    Kind.BOOLEAN: [True, False],
    Kind.INTEGER: [0, 1, 2, 7],
    Kind.NUMBER: [0.5, 2.0],
    Kind.LENGTH: [0.4, 3.0],
    Kind.ANGLE: [0.1, 1.5],
    Kind.DURATION: [0.5, 4.0],
    Kind.SPEED: [0.1, 0.3],
    Kind.POSE: [Pose2(1.0, 2.0, 0.5), Pose2(0.0, 0.0, 0.0)],
    Kind.LIST_OF_TEXT: [(), ("kitchen",), ("kitchen", "hall")],
    Kind.LIST_OF_POSE: [(), (Pose2(1.0, 2.0, 0.5),), (Pose2(0.0, 0.0, 0.0), Pose2(3.0, 1.0, 1.5))],
}


class ScriptedRun(BaseRun):
    """A run that ends when the clock says so."""

    def __init__(self, clock, seconds, result):
        super().__init__()
        self.handle(Event.ACCEPTED)
        if seconds:
            clock.call_at(clock.now() + seconds, lambda: self.handle(Event.FINISHED, result))
        else:
            self.handle(Event.FINISHED, result)

    def cancel(self):
        if self.handle(Event.CANCEL):
            self.handle(Event.FINISHED, failure("cancelled", "stopped"))


class ScriptedSkill:
    """A skill whose ends depend on a seed, its name and how often it was started."""

    def __init__(self, declaration, clock, seed, calls):
        self._declaration, self._clock, self._seed, self._calls = declaration, clock, seed, calls
        self._count = 0

    def start(self, inputs):
        self._count += 1
        name = self._declaration.name
        self._calls.append((round(self._clock.now(), 6), name, dict(inputs)))
        dice = random.Random(f"{self._seed} {name} {self._count}")
        if dice.random() < 0.6:
            ports = self._declaration.outputs.items()
            result = success(**{port: dice.choice(SAMPLES[about.kind]) for port, about in ports})
        else:
            result = failure(dice.choice([*self._declaration.failures, *COMMON_CODES]), "scripted")
        seconds = 0 if self._declaration.instant else dice.choice([0, 0.25, 1.0, 7.5])
        return ScriptedRun(self._clock, seconds, result)


def ticks_of(name, library, declarations, seed, stop_after=None):
    """What happens when a mission runs: the statuses after each tick, the calls of skills, the keys."""
    mission, clock, calls = library.get(name), ManualClock(), []
    declarations = dict(library.with_declared(declarations))
    skills = {each: ScriptedSkill(about, clock, seed, calls) for each, about in declarations.items()}
    context = make_context(clock, skills, declarations)
    dice = random.Random(f"inputs {seed}")
    inputs = {
        key: dice.choice(SAMPLES[port.kind]) if port.default is REQUIRED else port.default
        for key, port in mission.inputs.items()
    }
    tree = compile_mission(mission, library, inputs, context)
    trace, wake = [], context.wake
    assert isinstance(wake, Wake)
    for tick in range(300):
        wake.take()
        context.tick_beside()
        tree.root.tick_once()
        statuses = "".join(node.status.value[0] for node in tree.root.iterate())
        trace.append((round(clock.now(), 6), statuses))
        if tree.root.status.value != "RUNNING":
            break
        if tick == stop_after:
            tree.root.stop(Status.INVALID)
            drain(clock, context)
            break
        while not wake.asked and clock.run_next():
            pass
        if not wake.asked:
            break
    return trace, calls, tree.keys.as_dict()


class Exchange:
    """Exports missions and imports them again."""

    def __init__(self, folder: Path, declarations):
        self.folder = folder
        self.declarations = declarations

    def export(self, name, library):
        return export_mission(name, library, library.with_declared(self.declarations))

    def around(self, name, library):
        """The library of the missions after an export and an import, and the XML."""
        exported = self.export(name, library)
        return self.library_of(exported.xml), exported.xml

    def imported(self, xml, name="tree.xml", models=()):
        file = self.folder / name
        file.write_text(xml, encoding="utf-8")
        return import_trees(file, self.declarations, models)

    def library_of(self, xml):
        """The library of the missions of an XML text, written to files as a user would."""
        imported = self.imported(xml)
        assert imported.files, [finding.message for finding in imported.findings]
        target = self.folder / f"missions{len(list(self.folder.iterdir()))}"
        target.mkdir()
        for file, text in imported.files.items():
            (target / file).write_text(text, encoding="utf-8")
        return MissionLibrary.load([target], built_in=False)

    def same_ticks(self, name, library, other, seeds):
        """Both behave alike, whatever the skills do and whenever they are stopped."""
        for seed in seeds:
            stop_after = seed % 7 if seed % 3 == 0 else None
            ours = ticks_of(name, library, self.declarations, seed, stop_after)
            theirs = ticks_of(name, other, self.declarations, seed, stop_after)
            assert theirs == ours, f"seed {seed}"


@pytest.fixture
def ticks():
    return ticks_of


@pytest.fixture
def exchange_with(tmp_path):
    """Makes an exchange with some declarations."""

    def make(declarations):
        folder = tmp_path / "exchange"
        folder.mkdir(exist_ok=True)
        return Exchange(folder, declarations)

    return make


class Outcomes:
    """Skills that end as told: ``S`` and ``F`` at once, ``R`` never, a number after this many seconds."""

    def __init__(self, told):
        self.told = {name: list(ends) for name, ends in told.items()}
        self.calls = []

    def skills(self, declarations, clock):
        return {name: OutcomeSkill(about, clock, self) for name, about in declarations.items()}


class OutcomeSkill:
    def __init__(self, declaration, clock, outcomes):
        self._declaration, self._clock, self._outcomes = declaration, clock, outcomes

    def start(self, inputs):
        name = self._declaration.name
        self._outcomes.calls.append(name)
        ends = self._outcomes.told.get(name) or ["S"]
        end = ends.pop(0) if len(ends) > 1 else ends[0]
        outputs = {port: SAMPLES[about.kind][0] for port, about in self._declaration.outputs.items()}
        result = failure("no", f"{name} failed") if end == "F" else success(**outputs)
        seconds = {"S": 0, "F": 0, "R": 10**6}.get(end, end)
        return ScriptedRun(self._clock, seconds, result)


@pytest.fixture
def run_tree(exchange_with):
    """Imports the nodes of one tree and runs them: the end, the calls, the keys, and the mission's text."""

    def run(nodes, limit_s=100.0, inputs=None, attributes='BTCPP_format="4"', **told):
        exchange = exchange_with({})
        xml = f'<root {attributes}><BehaviorTree ID="T">{nodes}</BehaviorTree></root>'
        library = exchange.library_of(xml)
        clock, outcomes = ManualClock(), Outcomes(told)
        declarations = dict(library.declarations)
        context = make_context(clock, outcomes.skills(declarations, clock), declarations)
        tree = compile_mission(library.get("t"), library, inputs or {}, context)
        while True:
            context.wake.take()
            context.tick_beside()
            tree.root.tick_once()
            if tree.root.status.value in ("SUCCESS", "FAILURE"):
                break
            while not context.wake.asked and (clock.next_time() or limit_s) < limit_s and clock.run_next():
                pass
            if not context.wake.asked:
                break
        return tree.root.status.value, outcomes.calls, tree.keys.as_dict(), round(clock.now(), 3)

    return run
