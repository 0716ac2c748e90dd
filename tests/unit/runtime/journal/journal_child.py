"""A process that runs missions as fast as it can and says what it has acknowledged, until it is killed."""

import sys
from pathlib import Path

from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.mission_testing.mocks.mocks import ScriptedRun, Step
from florence_bt.runtime.events import EventKind
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.journal import Journal, JournalParameters
from florence_bt.runtime.run import MissionRequest, RunIds, TriggerPolicy
from florence_bt.trees.language.loader import MissionLibrary


def say(*words):
    print(*words, flush=True)


class Work:
    def __init__(self, clock):
        self._clock = clock

    def start(self, inputs):
        return ScriptedRun(self._clock, Step(after=1.0), inputs)


def main(folder: Path, mode: str) -> None:
    clock = ManualClock()
    work = SkillDeclaration("work", "Work")
    library = MissionLibrary.load([folder], built_in=False)
    # What is acknowledged is safe unless that is told: this disk may take its time.
    journal = Journal(
        folder / "runs",
        JournalParameters(flush_limit_s=300.0),
        background=mode == "background",
        on_trouble=lambda text: say("trouble", text),
    )
    skills = {"work": Work(clock)}
    executor = Executor(library, skills, {"work": work}, clock, RunIds("K"), log=journal)

    def told(run, event):
        if event.kind in (EventKind.STARTED, EventKind.PAUSED, EventKind.ENDED):
            say(event.kind.value, run.run_id)

    executor.add_listener(told)
    while True:
        run = executor.trigger(MissionRequest("toil"))
        say("accepted", run.run_id)
        say("accepted", executor.trigger(MissionRequest("toil", policy=TriggerPolicy.QUEUE)).run_id)
        clock.advance(0.5)
        executor.pause("a rest")
        executor.resume()
        clock.advance(60.0)


main(Path(sys.argv[1]), sys.argv[2])
