"""Edits are read and checked in a process of their own; this process only looks at the dates of the files."""

from __future__ import annotations

import pickle
import queue
import threading

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.runtime import background_check
from florence_bt.runtime import missions as mission_files
from florence_bt.runtime.background_check import LIMIT_S, BackgroundCheck
from florence_bt.runtime.missions import MissionFolders, ReloadReport
from florence_bt.trees.language.loader import MissionLibrary

SPEAK = {"speak": SkillDeclaration("speak", "Say something", inputs={"text": Port(Kind.TEXT, "what to say")})}
GREET = "mission: greet\ndescription: {}\ntree:\n  speak: {{text: {}}}\n"


class Bench:
    """A background check over one mission, with the executor's thread played by the test."""

    def __init__(self, folder):
        self.file = folder / "greet.yaml"
        self.edit("Greets.")
        self.missions = MissionFolders.of([folder], SPEAK, built_in=False)
        self.clock = ManualClock()
        self.soon = queue.SimpleQueue()
        self.answers = []
        self.check = BackgroundCheck(self.missions, self.adopt, self.soon.put, self.clock)

    def edit(self, description, says="hello"):
        self.file.write_text(GREET.format(description, says))

    def adopt(self, missions):
        self.missions = missions

    def ask(self):
        self.check.when_fresh(lambda problem, report: self.answers.append((problem, report)))

    def run(self):
        while not self.answers:
            self.soon.get(timeout=300.0)()
        return self.answers.pop()

    @property
    def description(self):
        return self.missions.library.get("greet").description


@pytest.fixture
def bench(tmp_path, monkeypatch):
    bench = Bench(tmp_path)

    def here(*arguments, **options):
        raise AssertionError("missions are read or checked on the executor's thread")

    monkeypatch.setattr(MissionLibrary, "load", here)
    monkeypatch.setattr(mission_files, "check", here)
    yield bench
    bench.check.close()


def test_nothing_is_started_when_nothing_was_edited(bench, monkeypatch):
    monkeypatch.setattr(background_check.subprocess, "Popen", None)
    bench.ask()
    assert bench.answers == [("", ReloadReport())]


def test_an_edit_counts_when_it_was_checked_elsewhere(bench):
    bench.edit("Greets kindly.")
    bench.ask()
    assert bench.answers == [] and bench.description == "Greets.", "the version of before stays until then"
    problem, report = bench.run()
    assert (problem, report.changed) == ("", ("greet",)) and bench.description == "Greets kindly."
    assert bench.missions.findings_of(bench.missions.library.get("greet")) == [], "it was checked already"
    bench.ask()
    assert bench.answers.pop()[0] == "", "at once: nothing was edited since"


def test_a_broken_edit_does_not_count_for_any_later_check_either(bench):
    bench.edit("Greets.", "[")
    bench.ask()
    assert "greet" in bench.run()[1].held and bench.description == "Greets."
    (bench.file.parent / "other.yaml").write_text(GREET.format("x", "y").replace("greet", "other"))
    bench.ask()
    _, report = bench.run()
    assert report.changed == ("other",) and "greet" in report.held and bench.description == "Greets."
    bench.edit("Greets again.")
    bench.ask()
    assert not bench.run()[1].held and bench.description == "Greets again."


def test_an_edit_during_the_check_is_checked_too(bench):
    bench.edit("one")
    bench.ask()
    bench.edit("the second one")
    bench.ask()
    bench.run()
    assert bench.description == "the second one" and len(bench.answers) == 1


def test_a_check_that_takes_too_long_is_given_up(bench):
    bench.edit("Greets kindly.")
    bench.ask()
    check = bench.check._check
    bench.clock.advance(LIMIT_S)
    assert "not checked within 25 s" in bench.answers.pop()[0]
    bench.soon.get(timeout=300.0)()
    assert check._process.returncode != 0, "it was killed"
    assert bench.answers == [] and bench.description == "Greets."
    bench.ask()
    assert bench.run()[0] == "" and bench.description == "Greets kindly."


def test_a_process_that_breaks_is_told(bench):
    bench.check._pickled = b"nonsense"
    bench.edit("Greets kindly.")
    bench.ask()
    assert "ended with code 1" in bench.run()[0] and bench.description == "Greets."


def test_the_process_is_not_started_on_the_thread_of_the_executor(bench, monkeypatch):
    starters, start = [], background_check.subprocess.Popen

    def watched(*arguments, **options):
        starters.append(threading.current_thread())
        return start(*arguments, **options)

    monkeypatch.setattr(background_check.subprocess, "Popen", watched)
    bench.edit("Greets kindly.")
    bench.ask()
    assert bench.run()[0] == ""
    assert len(starters) == 1 and starters[0] is not threading.current_thread()


def test_a_folder_out_of_reach_changes_nothing(bench):
    bench.file.unlink()
    bench.file.parent.rename(bench.file.parent.with_name("elsewhere"))
    bench.ask()
    problem, report = bench.answers.pop()
    assert problem == "" and "cannot be read" in report.held["the folders"] and bench.description == "Greets."


def test_missions_are_read_in_slices(tmp_path, monkeypatch):
    bench = Bench(tmp_path)
    bench.edit("Greets.\ninputs:\n  whom: {type: text}", "$whom")
    bench.missions.refresh()
    pauses = []
    now = iter(range(10**9))
    monkeypatch.setattr(background_check.time, "perf_counter", lambda: next(now))
    monkeypatch.setattr(background_check.time, "sleep", pauses.append)
    data = pickle.dumps(bench.missions, background_check.PROTOCOL)
    source = background_check._Slices(data)
    read = pickle.Unpickler(source).load()
    assert [*read.library.get("greet").required_inputs()] == ["whom"] and source.position == len(data)
    assert len(pauses) > 100, "others may run after every part, not only at the end"
