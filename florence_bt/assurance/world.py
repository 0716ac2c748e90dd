"""One mission whose skills may do anything: the real tree, on a clock that is moved by hand, step by step.

A step is a tick, or something that happens while the mission waits: a skill ends, a timer fires, somebody
stops the mission or takes the robot over. What is open in a step is asked of :class:`Choices`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Sequence

from florence_bt.assurance.choices import Choices
from florence_bt.assurance.conditions import UnwantedConditions
from florence_bt.assurance.events import Happening
from florence_bt.assurance.lasting import Lasting, apply, effect_of, effect_of_failure
from florence_bt.assurance.open_clock import UNLIMITED_S, OpenClock
from florence_bt.assurance.plan import Plan, classes_of
from florence_bt.assurance.skills import STOPPED, AnySkill, End, OpenEnd, Outputs, ends_of
from florence_bt.assurance.snapshot import Snapshot, Unchanging
from florence_bt.assurance.states import StateKeys
from florence_bt.assurance.unknown import Facts, witness_for
from florence_bt.behaviours._wake_timer import WakeTimer
from florence_bt.behaviours.cleaning_up import Finally
from florence_bt.behaviours.context import OpenRun, TreeContext
from florence_bt.behaviours.keys import KeyStore, readable
from florence_bt.behaviours.pacing import Timeout
from florence_bt.behaviours.run_skill import RunSkill
from florence_bt.behaviours.ticking import Ticker
from florence_bt.behaviours.why import Why, explain, path_of
from florence_bt.core.clock import ManualTimer
from florence_bt.core.declaration import Port, SkillDeclaration
from florence_bt.core.outcome import Result
from florence_bt.core.skill import Skill
from florence_bt.runtime.run_environment import BASE, keep_off_the_base
from florence_bt.trees import kinds
from florence_bt.trees.checks.outcomes import MISTAKES
from florence_bt.trees.language.analysis import Analysis
from florence_bt.trees.language.code_groups import groups_of
from florence_bt.trees.language.compile import compile_mission, origin_of
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission, Node, Property

JUST_BEFORE_S = 1e-6
"""How long before a timer something happens that comes right before it."""
SUCCEEDED, FAILED, STOPPED_STATUS = "SUCCEEDED", "FAILED", "STOPPED"


class Ended(NamedTuple):
    """The end of a skill.

    Attributes:
        run: Which of the open runs ends.
        end: How it ends, one of its ends.
    """

    run: int
    end: int


class NextEvent(NamedTuple):
    """Something that may happen next.

    Attributes:
        what: ``begin``, ``tick``, ``end`` (of skills), ``stopped`` (the ends of cancelled skills), ``time``
            (to the next timer), ``expire`` (of a timer that is open), ``pause`` (which is over at once),
            ``stop`` or ``override``.
        ends: The skills that end at this moment: one, or two of them.
        late: Whether they end right before the next timer, instead of now.
        timer: Which of the open timers is due.
    """

    what: str
    ends: tuple[Ended, ...] = ()
    late: bool = False
    timer: int = 0


BEGIN, TICK, REPORT, TIME, PAUSE, STOP, OVERRIDE = map(
    NextEvent, ("begin", "tick", "stopped", "time", "pause", "stop", "override")
)


@dataclass(slots=True)
class Seen:
    """All that was seen of the nodes of a mission in any state.

    Attributes:
        started: The nodes that began.
        codes: Node -> the codes with which it failed.
    """

    started: set[Node] = field(default_factory=set)
    codes: dict[Node, set[str]] = field(default_factory=dict)


@dataclass
class WorldMoment:
    """All that changes in a world, beside its tree.

    Attributes:
        begun: Whether the inputs were chosen.
        asked: Whether a tick was asked for.
        end: How the tree ended: the status of the run and the code.
        outputs: What it gave.
        lasting: Thing -> what became of it.
        cover: The open timer that counts for the time until it ends, with the path of its node.
    """

    begun: bool = False
    asked: bool = True
    end: tuple[str, str] | None = None
    outputs: dict[str, Any] = field(default_factory=dict)
    lasting: dict[str, Lasting] = field(default_factory=dict)
    cover: tuple[ManualTimer, str] | None = None


def end_events(ways: list[list[Ended]], *, late: bool) -> Iterator[NextEvent]:
    """Yield each way in which one skill ends, or two of them at one moment.

    Args:
        ways: For each skill that runs the ways in which it can end.
        late: Whether one can also end right before the next timer.
    """
    for number, own in enumerate(ways):
        for ended in own:
            yield NextEvent("end", (ended,))
            if late:
                yield NextEvent("end", (ended,), late=True)
            for others in ways[number + 1 :]:
                yield from (NextEvent("end", (ended, other)) for other in others)


class World(Unchanging):
    """A mission whose skills may do anything.

    Args:
        mission: The mission, checked.
        library: Where called missions are found; each of them is one skill there.
        declarations: The skills.
        plan: What decides how it goes.
        given: The inputs that are known; others can be anything.
        called: Missions that are called, as skills.
        properties: What its author wants to hold.
        coarse_s: Timers that take longer may fire at any moment; None: every timer fires when it is due.
        facts: What is decided about values; None: nothing yet.
    """

    def __init__(
        self,
        mission: Mission,
        library: MissionLibrary,
        declarations: Mapping[str, SkillDeclaration],
        plan: Plan,
        given: Mapping[str, Any],
        called: Callable[[World], Mapping[str, Skill]],
        properties: Iterable[Property] = (),
        coarse_s: float | None = None,
        facts: Facts | None = None,
    ) -> None:
        self.mission = mission
        self.coarse = coarse_s is not None
        self.plan = plan
        self.clock = OpenClock(coarse_s)
        self.facts = facts or Facts(Choices())
        self.choices = self.facts.choices
        self.assumed: dict[str, None] = dict.fromkeys(plan.abstracted)
        self.happened: list[Happening] = []
        self.seen = Seen()
        self.moment = WorldMoment()
        self._held: list[Callable[[], None]] | None = None
        self._again: set[str] = set()
        declarations = library.with_declared(declarations)
        self.declarations = declarations
        self._groups = groups_of(declarations)
        outputs = self._outputs()
        self.results = outputs
        self._skills: dict[str, Skill] = {
            name: AnySkill(each, ends_of(each, self.classes), outputs, self._choose, self.note_cancel)
            for name, each in declarations.items()
        }
        self._skills.update(called(self))
        self._context = self._make_context()
        kinds_of_keys = Analysis(library, declarations).key_kinds(mission)
        self._unwanted = UnwantedConditions(properties, self._groups, kinds_of_keys, self._context.keys)
        inputs = {name: self._input(name, port, given) for name, port in mission.inputs.items()}
        self.tree = compile_mission(mission, library, inputs, self._context)
        self._ticker = Ticker(self.tree.root, record=True)
        self._keys = StateKeys(
            self.tree.root, self._context, self.clock, self.facts, plan.deciding | plan.needed
        )
        self._open_inputs = {
            name: port
            for name, port in mission.inputs.items()
            if name not in given and self._is_open(name, port)
        }
        self._look_at_tree()

    def _make_context(self) -> TreeContext:
        """Return what the nodes of the tree share."""
        return TreeContext(
            clock=self.clock,
            wake=self._wake,
            skills=self._skills,
            declarations=self.declarations,
            keys=KeyStore(),
            on_skill_started=self._on_started,
            on_skill_ended=self._on_ended,
            later=self._later,
        )

    def _look_at_tree(self) -> None:
        """Note what of the tree is asked for again and again."""
        nodes = [(path_of(node), node) for node in self.tree.root.iterate()]
        self._time_outs = [(path, node) for path, node in nodes if isinstance(node, Timeout)]
        self._wake_timers = [
            (path, value)
            for path, node in nodes
            for value in vars(node).values()
            if isinstance(value, WakeTimer)
        ]
        self.drives_in_cleanup = any(
            self.declarations[node.skill].resources & {BASE}
            for each in self.tree.root.iterate()
            if isinstance(each, Finally)
            for node in each._cleanup.iterate()
            if isinstance(node, RunSkill)
        )

    # ---- values -----------------------------------------------------------------------------------------

    def _outputs(self) -> Outputs:
        deciding: dict[str, set[str]] = {}
        needed: dict[str, set[str]] = {}
        for node in self.mission.nodes():
            if isinstance(node, (kinds.RunSkill, kinds.CallMission)):
                skill = node.skill if isinstance(node, kinds.RunSkill) else node.mission.text
                for output, key in node.outputs:
                    for keys, found in ((self.plan.deciding, deciding), (self.plan.needed, needed)):
                        if key.text in keys:
                            found.setdefault(skill, set()).add(output.text)
        frozen = [{skill: frozenset(each) for skill, each in found.items()} for found in (deciding, needed)]
        return Outputs(self.facts, frozen[0], frozen[1], self.assume)

    def _is_open(self, name: str, port: Port) -> bool:
        """Tell whether an input can be anything: it decides something, and is not needed as it stands."""
        return name in self.plan.deciding and name not in self.plan.needed and not self._listed(port)

    def _listed(self, port: Port) -> bool:
        return port.kind.item is not None and not port.required and bool(port.default)

    def _input(self, name: str, port: Port, given: Mapping[str, Any]) -> Any:
        if name in given:
            return given[name]
        value = witness_for(port)
        if name in self.plan.needed or (name in self.plan.deciding and self._listed(port)):
            self.assume(f"{name} is {readable(value, port.kind)}")
        return value

    def assume(self, what: str) -> None:
        """Note what was taken as it stands."""
        self.assumed[what] = None

    def classes(self, codes: Iterable[str]) -> Any:
        """Put codes together that nothing in the mission tells apart."""
        return classes_of(codes, self.plan.words, self._groups)

    # ---- snapshots ----------------------------------------------------------------------------------------

    def snapshot(self) -> Snapshot:
        """Write down everything, to come back to this moment."""
        facts = (self.facts.decided, self.facts.texts)
        return Snapshot((self.moment, self.tree.root, self._context, self.clock, *facts))

    def key(self) -> tuple[Any, ...]:
        """Return what decides how it goes on."""
        return self._keys.make(*self._marks())

    def _marks(self) -> tuple[Any, ...]:
        """Return what decides how it goes on beside the tree."""
        return (
            self.moment.begun,
            self.moment.asked,
            self.moment.end,
            tuple(sorted(self.moment.lasting.items())),
            self.moment.cover and self.moment.cover[1],
        )

    # ---- what may happen ----------------------------------------------------------------------------------

    @property
    def over(self) -> bool:
        """Tell whether nothing of it is left."""
        return self.moment.end is not None and not self._context.runs

    @property
    def waits(self) -> bool:
        """Tell whether it waits for something outside of the tree."""
        return not self.moment.asked

    def events(self) -> Iterator[NextEvent]:
        """Yield what may happen next."""
        if self.over:
            return
        if not self.moment.begun:
            yield BEGIN
        elif self.moment.asked:
            yield TICK
        elif any(run.asked_to_stop for run in self._all_open()):
            yield REPORT
        else:
            yield from self._while_waiting(self._open_runs())

    def _while_waiting(self, runs: list[OpenRun]) -> Iterator[NextEvent]:
        """Yield what may happen while it waits."""
        late = self._timers_beside(runs) > 0 and self._time_passes()
        ways = [
            [Ended(number, end) for end in range(len(_open(entry).ends))] for number, entry in enumerate(runs)
        ]
        yield from end_events(ways, late=late)
        for number, (timer, seconds) in enumerate(self.clock.still_open().items()):
            if self._may_expire(timer, seconds):
                yield NextEvent("expire", timer=number)
        if self._may_wait():
            yield TIME
            if len(runs) > 1 or late:
                yield from (NextEvent("time", (ended,)) for own in ways for ended in own)
        if self.moment.end is None:
            if runs:
                yield PAUSE
                if late:
                    yield PAUSE._replace(late=True)
            yield STOP
            if self.drives_in_cleanup:
                yield OVERRIDE

    def _all_open(self) -> list[OpenEnd]:
        return [entry.run for entry in self._context.runs if isinstance(entry.run, OpenEnd)]

    def _open_runs(self) -> list[OpenRun]:
        return [
            entry
            for entry in self._context.runs
            if isinstance(entry.run, OpenEnd) and entry.run.result is None and not entry.run.asked_to_stop
        ]

    def _timers_beside(self, runs: list[OpenRun]) -> int:
        """Return how many timers wait beside the limits of the skills, if there is just one skill."""
        own = 0
        if len(runs) == 1:
            own = (runs[0].deadline is not None) + (_open(runs[0]).limit is not None)
        return len(self.clock.waiting()) - own

    def _time_passes(self) -> bool:
        """Tell whether the next timer is not due at this moment."""
        due = self.clock.next_due()
        return due is not None and due - self.clock.now() > 2 * JUST_BEFORE_S

    def _may_wait(self) -> bool:
        """Tell whether time may pass up to the next timer: called missions have ended before their limits."""
        due = self.clock.next_due()
        if due is None:
            return False
        limits = {run.limit for run in self._all_open()}
        return not any(when <= due and timer in limits for when, _, timer in self.clock.waiting())

    def _may_expire(self, timer: ManualTimer, seconds: float) -> bool:
        """Tell whether an open timer may be due: it fires at all, and nothing further up before it."""
        if seconds > UNLIMITED_S or any(run.limit is timer for run in self._all_open()):
            return False
        path = self._path_of(timer)
        return path is None or seconds <= self._shortest_above(path)

    def _path_of(self, timer: ManualTimer) -> str | None:
        """Return the path of the node that a timer belongs to."""
        for entry in self._context.runs:
            if timer in (entry.deadline, getattr(entry.run, "limit", None)):
                return entry.path
        return next((path for path, own in self._wake_timers if own._timer is timer), None)

    def _shortest_above(self, path: str) -> float:
        """Return how long the shortest time-out takes that waits above a node, in seconds."""
        running = (
            node._seconds
            for above, node in self._time_outs
            if path.startswith(f"{above}/") and node.status is Status.RUNNING
        )
        return min(running, default=math.inf)

    # ---- what happens -------------------------------------------------------------------------------------

    def do(self, event: NextEvent) -> float:
        """Let something happen.

        Returns:
            How long that took at most, in seconds.
        """
        began, opened = self.clock.now(), tuple(self.clock.still_open())
        longest = 0.0
        if event.what == "begin":
            self._begin()
        elif event.what == "tick":
            self._tick()
        elif event.what == "end":
            longest = self._end_runs(event)
        elif event.what == "time":
            runs = self._open_runs()
            self._fire()
            for ended in event.ends:
                self._end_run(runs[ended.run], ended.end)
        elif event.what == "expire":
            self.clock.fire(opened[event.timer])
        elif event.what == "stopped":
            self._report_stops()
        elif event.what == "pause":
            self._pause(late=event.late)
        else:
            self._stop(event.what)
        if event.what in ("end", "time", "expire"):
            self._tick()
        self._look_at_conditions()
        covered = self.moment.cover is not None
        self.clock.tidy()
        seconds = 0.0 if covered else max(longest, round(self.clock.now() - began, 3))
        return seconds + self._cover()

    def _look_at_conditions(self) -> None:
        """Note which conditions over keys hold now that must not."""
        running = {entry.skill for entry in self._context.runs if not entry.left}
        self.happened += self._unwanted.after(running, self.moment.end if self.over else None)

    def _cover(self) -> float:
        """See to it that a timer counts for the time up to its end, if one is open; return what that adds.

        While it is open the other timers add nothing. When it ends before others, the longest of them counts
        from then on, whole.
        """
        cover = self.moment.cover
        if cover is not None and cover[0].callback is not None:
            return 0.0
        stopping = {run.limit for run in self._all_open() if run.asked_to_stop}
        timers = {
            timer: self._at_most(timer, seconds)
            for timer, seconds in self.clock.still_open().items()
            if timer not in stopping
        }
        timers = {timer: seconds for timer, seconds in timers.items() if seconds is not None}
        if not timers:
            self.moment.cover = None
            return 0.0
        longest = max(timers, key=lambda timer: timers[timer] or 0.0)
        self.moment.cover = (longest, self._path_of(longest) or "")
        return timers[longest] or 0.0

    def _at_most(self, timer: ManualTimer, seconds: float) -> float | None:
        """Return how long an open timer waits at most, with the time-outs above it; None: it never fires."""
        most = self._shortest_above(self._path_of(timer) or "")
        if seconds <= UNLIMITED_S:
            return min(seconds, most)
        of_called = next((entry for entry in self._context.runs if entry.deadline is timer), None)
        if of_called is not None and getattr(of_called.run, "limit", None) is None:
            return most  # a mission that takes as long as it takes
        return None

    def _begin(self) -> None:
        """Choose what is open of the inputs."""
        self.moment.begun = True
        keys = self._context.keys
        chosen = {name: self.results.any_of(port) for name, port in self._open_inputs.items()}
        keys.reset({**keys.as_dict(), **chosen})

    def _wake(self) -> None:
        self.moment.asked = True

    def _later(self, callback: Callable[[], None]) -> None:
        if self._held is None:
            callback()
        else:
            self._held.append(callback)

    def _tick(self) -> None:
        self.moment.asked = False
        goes_on = self.moment.end is None
        self._held = []
        try:
            beside = tuple(self._context.beside)
            self._context.tick_beside()
            for each in beside:
                self._look_for_undone(each.tree)
            if goes_on:
                self._ticker.tick()
        finally:
            held, self._held = self._held, None
            for callback in held:
                callback()
        self._look_for_rivals()
        if goes_on:
            self._look_at_changes()
            root = self.tree.root
            if root.status is Status.SUCCESS:
                self.moment.outputs = self.tree.outputs()
                self._finish(SUCCEEDED, "ok")
            elif root.status is Status.FAILURE:
                why = explain(root)
                self._finish(FAILED, why.code if why is not None else "failed")

    def _finish(self, status: str, code: str) -> None:
        self.moment.end = (status, code)
        self.tree.root.stop(Status.INVALID)
        self.moment.asked = bool(self._context.beside)

    def _end_runs(self, event: NextEvent) -> float:
        """End skills; returns how long that may have taken without a difference."""
        runs = self._open_runs()
        alone = not event.late and self._timers_beside(runs) == 0
        longest = self._longest(runs[0], _open(runs[0])) if alone else 0.0
        if event.late:
            self._wait_until_just_before()
        for ended in event.ends:
            self._end_run(runs[ended.run], ended.end)
        return longest

    def _wait_until_just_before(self) -> None:
        """Let the time pass up to right before the next timer."""
        due = self.clock.next_due()
        assert due is not None  # only then something can be late
        self.clock.advance_to(due - JUST_BEFORE_S)

    def _end_run(self, entry: OpenRun, number: int) -> None:
        run = _open(entry)
        end = run.ends[number]
        apply(end.effects, self.moment.lasting)
        run.finish(self.results.result_of(run.declaration, end))

    def _longest(self, entry: OpenRun, run: OpenEnd) -> float:
        if run.longest is not None:
            return run.longest
        return run.declaration.deadline_s if run.declaration.deadline_s < UNLIMITED_S else math.inf

    def _fire(self) -> None:
        due = self.clock.next_due()
        assert due is not None  # only then time passes
        while (each := self.clock.next_time()) is not None and each <= due + 2 * JUST_BEFORE_S:
            self.clock.run_next()

    def _report_stops(self) -> None:
        for run in self._all_open():
            if run.asked_to_stop:
                run.finish(STOPPED)
        for entry in tuple(self._context.runs):
            if entry.left:
                self._context.poll(entry)

    def _pause(self, *, late: bool) -> None:
        """Pause the run and let it go on: its time stands still, and what ran is started again.

        That a skill has ended all the same, before its cancel or at once when it is started again, is a step
        of its own: here it goes on.
        """
        if late:
            self._wait_until_just_before()
        self.happened.append(Happening("pause"))
        self._again = {entry.path for entry in self._context.runs}
        self._context.suspend()
        for run in self._all_open():
            if run.asked_to_stop:
                run.finish(STOPPED)
        self._context.resume()
        self._tick()
        self._again = set()

    def _stop(self, how: str) -> None:
        if how == "override":
            keep_off_the_base(
                self._skills, self.declarations, self._context.runs, "a person has the robot", _ignore
            )
        self.happened.append(Happening(how))
        self._finish(STOPPED_STATUS, how)

    # ---- what is noted ----------------------------------------------------------------------------------

    def _choose(self, path: str, declaration: SkillDeclaration, ends: tuple[End, ...]) -> End:
        goes_on = path in self._again and not declaration.instant
        return ends[0 if goes_on else self.choices.take(len(ends))]

    def _happens(self, happening: Happening) -> None:
        self.happened.append(happening)
        self.happened += self._unwanted.when(happening)

    def _on_started(self, path: str, skill: str, inputs: Mapping[str, Any]) -> None:
        if path in self._again:
            return
        self._happens(Happening("start", path, skill, inputs=dict(inputs)))
        apply(effect_of(skill, inputs), self.moment.lasting)

    def _on_ended(self, path: str, skill: str, result: Result) -> None:
        if path in self._again:
            return
        self._happens(Happening("end", path, skill, result))
        if result.code not in ("ok", "cancelled"):
            apply(effect_of_failure(skill), self.moment.lasting)

    def _look_for_undone(self, tree: Behaviour) -> None:
        """See whether a clean-up, or a sequence in it, has left out steps because one before has failed."""
        for node in tree.iterate():
            undone = [each for each in node.children if each.status is Status.INVALID]
            if isinstance(node, Sequence) and node.status is Status.FAILURE and undone:
                self._wrong(path_of(node), f"cleanup {undone[0].name}")

    def note_cancel(self, run: OpenEnd) -> None:
        """Note that a skill is cancelled, and what may last of a mission."""
        if run.path in self._again:
            return
        self.happened.append(Happening("cancel", run.path, run.declaration.name))
        apply(run.stops[self.choices.take(len(run.stops))], self.moment.lasting)

    def _wrong(self, path: str, text: str) -> None:
        self.happened.append(Happening("wrong", path, text=text))

    def _look_for_rivals(self) -> None:
        """See whether a skill waits for what another one of the mission has and nobody has cancelled."""
        if not self._context.waiting:
            return
        for node in self.tree.root.iterate():
            if isinstance(node, RunSkill) and node._waiting is not None and node.status is Status.RUNNING:
                holder = self._context.holder(node.skill)
                if holder is not None and not holder.left:
                    self._wrong(path_of(node), f"resource {node.skill} {holder.skill}")

    def _look_at_changes(self) -> None:
        known: dict[Behaviour, Why] = {}
        for node, _, new in self._ticker.changes:
            origin = origin_of(node)
            own = getattr(node, "result", None) if new is Status.FAILURE else None
            if own is not None and not own.succeeded and own.code in MISTAKES:
                self._wrong(path_of(node), f"{own.code} {own.reason}")
            if origin is None or origin.mission is not self.mission or new is Status.INVALID:
                continue
            self.seen.started.add(origin.node)
            if isinstance(node.parent, Finally) and node is node.parent._cleanup:
                self._look_for_undone(node)
            if new is Status.FAILURE and node.status is Status.FAILURE:
                why = explain(node, known)
                if why is not None:
                    self.seen.codes.setdefault(origin.node, set()).add(why.code)


def _open(entry: OpenRun) -> OpenEnd:
    """Return the run of a skill whose end is open."""
    assert isinstance(entry.run, OpenEnd)  # others are clean-ups
    return entry.run


def _ignore(error: Exception) -> None:
    """Do nothing: no skill here breaks."""
