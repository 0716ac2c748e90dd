"""Mission files that are edited while the executor runs."""

from __future__ import annotations

import os
import re
from functools import partial

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.missions import READINGS, MissionFolders, ReloadReport
from florence_bt.runtime.run import MissionRequest, RunIds, RunStatus, TriggerPolicy
from florence_bt.trees.language.loader import MissionLibrary
from tests.scripted_skill import ScriptedSkill

SPEAK = SkillDeclaration("speak", "Say something", inputs={"text": Port(Kind.TEXT, "what to say")})


class Home:
    """A folder of missions and an executor that looks at it."""

    def __init__(self, folder):
        self.folder = folder
        self.write("greet", "speak: {text: hello}")
        self.write("visit", "sequence:\n    - run: greet\n    - speak: {text: bye}")
        self.clock = ManualClock()
        self.speak = ScriptedSkill(SPEAK, self.clock, [Step(after=1.0)])
        self.missions = MissionFolders.of([folder], {"speak": SPEAK}, built_in=False)
        self.executor = Executor(
            self.missions, {"speak": self.speak}, {"speak": SPEAK}, self.clock, RunIds("T")
        )

    def write(self, name, tree, *, inputs=""):
        file = self.folder / f"{name}.yaml"
        text = f"mission: {name}\ndescription: A test.\n{inputs}tree:\n  {tree}\n"
        file.write_text(text)

    def run(self, mission="greet", **options):
        run = self.executor.trigger(MissionRequest(mission, **options))
        self.clock.advance(30.0)
        return run

    @property
    def said(self):
        return [call["text"] for call in self.speak.calls]


@pytest.fixture
def home(tmp_path):
    return Home(tmp_path)


def test_a_good_edit_counts_from_the_next_trigger_on(home):
    home.run()
    home.write("greet", "speak: {text: good morning}")
    home.run("visit")
    assert home.said == ["hello", "good morning", "bye"]


def test_what_the_check_says_about_a_mission_in_force(home):
    home.write("greet", "sequence:\n    - speak: {text: hello}\n    - set: {unused: 1}")
    home.executor.reload()
    library = MissionLibrary.load([home.folder], built_in=False)
    alone = Executor(library, {"speak": home.speak}, {"speak": SPEAK}, home.clock, RunIds("T"))
    for executor in (home.executor, alone):
        (finding,) = executor.findings_of(executor.library.get("greet"))
        assert finding.message == "nothing reads the key 'unused'"
        assert executor.findings_of(executor.library.get("visit")) == []


def test_a_running_run_keeps_its_version(home):
    run = home.executor.trigger(MissionRequest("visit"))
    home.clock.advance(0.5)
    home.write("visit", "speak: {text: never}")
    home.executor.reload()
    home.clock.advance(10.0)
    assert run.status is RunStatus.SUCCEEDED and home.said == ["hello", "bye"]


@pytest.mark.parametrize(
    ("tree", "told"),
    [
        ("speek: {text: hello}", r"greet\.yaml:4:3: .*speek.*speak"),
        ("speak: {text: hello", r"greet\.yaml:"),
        ("speak: {}", "text"),
        ("run: visit", "itself"),
    ],
)
def test_a_broken_edit_keeps_the_version_of_before_and_says_so(home, tree, told):
    home.write("greet", tree)
    run = home.run()
    assert run.status is RunStatus.SUCCEEDED and home.said == ["hello"]
    assert "greet: its edit is not used, the previous version stays in force" in run.note
    assert re.search(told, run.note), run.note
    report = home.executor.reload()
    assert not report.ok and "greet" in report.held and "stays in force" in report.text()
    (warning,) = home.executor.warnings()
    assert "greet" in warning and "stays in force" in warning
    # The mission that calls it says so too; once the file is right again, nobody says anything.
    assert home.executor.note_about("visit")
    home.write("greet", "speak: {text: hi}")
    assert home.run().note == "" and home.said[-1] == "hi"
    assert home.executor.warnings() == []


def test_an_edit_that_breaks_a_caller_does_not_count(home):
    home.write("greet", "speak: {text: $name}", inputs="inputs:\n  name: {type: text}\n")
    report = home.executor.reload()
    assert "it breaks visit" in report.held["greet"]
    assert home.run("visit").status is RunStatus.SUCCEEDED
    assert home.said == ["hello", "bye"]
    # With the caller edited to fit, both count.
    home.write("visit", "sequence:\n    - run: greet\n      with: {name: Anna}")
    report = home.executor.reload()
    assert report.ok and set(report.changed) == {"greet", "visit"}
    home.run("visit")
    assert home.said[-1] == "Anna"


def test_new_files_appear_and_deleted_ones_go(home):
    home.write("sing", "speak: {text: la}")
    assert home.run("sing").status is RunStatus.SUCCEEDED
    (home.folder / "sing.yaml").unlink()
    assert home.executor.reload() == ReloadReport(removed=("sing",))
    with pytest.raises(ConfigError, match="no mission 'sing'"):
        home.executor.trigger(MissionRequest("sing"))


def test_a_deleted_file_that_somebody_calls_stays_in_force(home):
    (home.folder / "greet.yaml").unlink()
    assert home.run("visit").status is RunStatus.SUCCEEDED and home.said == ["hello", "bye"]
    assert "visit" in home.executor.reload().text() and "greet" in home.missions.held
    (home.folder / "visit.yaml").unlink()
    home.executor.reload()
    with pytest.raises(ConfigError, match="no mission 'visit'"):
        home.executor.trigger(MissionRequest("visit"))


@pytest.mark.parametrize(
    ("tree", "told"), [("speek: {text: x}", "speek"), ("speak: {text: x", r"wrong\.yaml:")]
)
def test_a_new_file_with_errors_is_refused_and_disturbs_nobody(home, tree, told):
    home.write("wrong", tree)
    report = home.executor.reload()
    assert not report.ok and re.search(told, report.broken["wrong"]) and "cannot run" in report.text()
    assert report.changed == report.removed == () and report.held == {}
    with pytest.raises(ConfigError, match=told):
        home.executor.trigger(MissionRequest("wrong"))
    assert home.run().status is RunStatus.SUCCEEDED


def test_a_queued_run_whose_mission_goes_meanwhile_fails_and_lets_the_next_one_start(home):
    home.write("sing", "speak: {text: la}")
    home.executor.trigger(MissionRequest("greet"))
    gone = home.executor.trigger(MissionRequest("sing", policy=TriggerPolicy.QUEUE))
    after = home.executor.trigger(MissionRequest("greet", policy=TriggerPolicy.QUEUE))
    (home.folder / "sing.yaml").unlink()
    home.executor.reload()
    home.clock.advance(30.0)
    assert (
        gone.status is RunStatus.FAILED and gone.code == "bad_mission" and "no mission 'sing'" in gone.reason
    )
    assert after.status is RunStatus.SUCCEEDED


def test_nothing_is_read_again_when_nothing_was_edited(home, monkeypatch):
    home.run()
    loads = []
    monkeypatch.setattr(home.missions, "_load", lambda: loads.append(1))
    home.run("visit")
    assert home.executor.reload().text() == "nothing has changed" and not loads


def test_the_version_is_that_of_the_texts_of_all_missions_concerned(home):
    before = {name: home.missions.version_of(name) for name in ("greet", "visit")}
    home.write("visit", "sequence:\n    - run: greet\n    - speak: {text: ciao}")
    home.executor.reload()
    assert home.missions.version_of("greet") == before["greet"]
    assert home.missions.version_of("visit") != before["visit"]
    between = home.missions.version_of("visit")
    home.write("greet", "speak: {text: hey}")
    home.executor.reload()
    assert home.missions.version_of("visit") != between
    again = MissionFolders.of([home.folder], {"speak": SPEAK}, built_in=False)
    assert again.version_of("visit") == home.missions.version_of("visit")


def test_a_folder_that_is_gone_changes_nothing_and_is_said(home):
    home.folder.rename(home.folder.with_name("elsewhere"))
    report = home.executor.reload()
    assert home.run().status is RunStatus.SUCCEEDED
    home.folder.with_name("elsewhere").rename(home.folder)
    assert not report.ok


def rewrite_in_place(file, old, new):
    """Change a text within one step of the file system's clock: size and date stay."""
    stat = file.stat()
    text = file.read_text()
    assert len(old) == len(new) and old in text
    file.write_text(text.replace(old, new))
    os.utime(file, ns=(stat.st_mtime_ns, stat.st_mtime_ns))


def folders_that_are_edited_while_they_are_read(folder, edits):
    """Missions of a folder; the next edit is made right after each reading, while there are edits left."""

    def load():
        library = MissionLibrary.load([folder], built_in=False)
        if edits:
            edits.pop(0)()
        return library

    return MissionFolders(load, {"speak": SPEAK})


def test_a_broken_text_that_is_written_while_the_file_is_read_does_not_pass_as_no_edit(home):
    file, edits = home.folder / "greet.yaml", []
    missions = folders_that_are_edited_while_they_are_read(home.folder, edits)
    home.write("greet", "speak: {text: good}")
    edits.append(lambda: home.write("greet", "speek: {text: good}"))
    assert "stays in force" in missions.refresh().held["greet"]
    assert not missions.library.get("greet").findings and missions.note_about("greet")
    file.write_text(file.read_text().replace("speek", "speak"))
    assert missions.refresh().changed == ("greet",) and missions.note_about("greet") == ""


def test_a_text_that_is_written_while_the_folder_is_read_for_the_first_time_counts(home):
    edits = [lambda: home.write("greet", "speak: {text: later}")]
    missions = folders_that_are_edited_while_they_are_read(home.folder, edits)
    assert "later" in repr(missions.library.get("greet"))
    assert missions.refresh().text() == "nothing has changed"


def test_files_that_never_hold_still_keep_the_versions_of_before_and_say_so(home):
    edits = []
    missions = folders_that_are_edited_while_they_are_read(home.folder, edits)
    home.write("greet", "speak: {text: one}")
    edits += [partial(home.write, "greet", f"speak: {{text: more {n}}}") for n in range(READINGS)]
    report = missions.refresh()
    assert not report.ok and "being written" in report.text()
    assert missions.refresh().changed == ("greet",)


def test_an_edit_that_leaves_date_and_size_as_they_were_is_seen(home):
    rewrite_in_place(home.folder / "greet.yaml", "hello", "howdy")
    assert home.missions.refresh().changed == ("greet",)
    assert home.missions.refresh().text() == "nothing has changed"


def test_hidden_files_and_links_that_lead_nowhere_disturb_nobody(home):
    # What Emacs leaves beside a file that is being edited.
    (home.folder / ".#greet.yaml").symlink_to("anna@home.4711:1700000000")
    (home.folder / "._visit.yaml").write_bytes(bytes(100))
    home.write("greet", "speak: {text: good day}")
    home.run()
    assert home.said == ["good day"] and home.executor.reload().ok
    (home.folder / "lost.yaml").symlink_to("nowhere")
    again = MissionFolders.of([home.folder], {"speak": SPEAK}, built_in=False)
    assert again.library.names() == ["greet", "visit"] and "lost" in again.library.unreadable()
    report = home.executor.reload()
    assert "lost" in report.text() and home.run().status is RunStatus.SUCCEEDED


SKILLS = "skills:\n  grip:\n    service: grip\n    type: std_srvs/srv/Trigger\n"


def test_an_edited_file_of_skills_waits_for_the_next_start_and_says_so(tmp_path):
    file = tmp_path / "robot.skills.yaml"
    file.write_text(SKILLS)
    home = Home(tmp_path)
    assert home.executor.reload().text() == "nothing has changed"
    file.write_text(SKILLS + "    deadline: 5 s\n")
    report = home.executor.reload()
    assert not report.ok and "florence up" in report.held["robot.skills.yaml"]
    assert home.run().status is RunStatus.SUCCEEDED
    assert any("robot.skills.yaml" in line for line in home.executor.warnings())
    file.write_text("skills:\n  grip: {servce: grip}\n")
    assert "robot.skills.yaml:2:10" in home.executor.reload().text()
    file.write_text(SKILLS)
    assert home.executor.reload().ok
    file.unlink()
    assert "robot.skills.yaml" in home.executor.reload().held
