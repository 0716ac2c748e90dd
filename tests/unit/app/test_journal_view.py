"""The verbs on recorded runs, as a user types them, without ROS and without a running system."""

from __future__ import annotations

import os
from contextlib import closing

import pytest
from typer.testing import CliRunner

from florence_bt.app.bringup.locks import lock_domain
from florence_bt.behaviours.why import Why
from florence_bt.cli.application import app
from florence_bt.runtime.events import EventKind, RunEvent
from florence_bt.runtime.journal import Journal
from florence_bt.runtime.run import MissionRequest, MissionRun, RunStatus


@pytest.fixture
def florence(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))  # where no system has its lock

    def call(*arguments):
        return CliRunner().invoke(app, [str(argument) for argument in arguments], catch_exceptions=False)

    return call


def record(folder, number, mission="goto_user", status=RunStatus.SUCCEEDED, why=None, outputs=None):
    journal = Journal(folder, date=lambda: f"2024-05-0{number}T10:00:00.000Z")
    run = MissionRun(f"T-{number:03d}-{mission}", MissionRequest(mission, {}, "Anna"), {})
    path = f"{mission}/navigate to"

    def happen(time, kind, **data):
        journal.write(run, RunEvent(time, run.run_id, kind, data, 1))

    run.status, run.started = RunStatus.RUNNING, 100.0
    happen(100.0, EventKind.STARTED)
    happen(
        100.0, EventKind.SKILL_STARTED, node=path, skill="navigate_to", inputs={"goal": {"x": 1.0, "y": 2.5}}
    )
    happen(100.0, EventKind.NODE, node=mission, old="INVALID", new="RUNNING", reason="")
    happen(100.0, EventKind.NODE, node=path, old="INVALID", new="RUNNING", reason="driving")
    if status is not RunStatus.RUNNING:
        run.status, run.ended, run.why, run.tree = status, 104.5, why, f"[+] {mission}"
        run.output_texts = outputs or {}
        happen(104.5, EventKind.SKILL_ENDED, node=path, skill="navigate_to", outcome="failed", code="no_path")
        happen(104.5, EventKind.ENDED, status=status.value, code=run.code, reason=run.reason)
    journal.close()
    return run.run_id


@pytest.fixture
def runs(tmp_path):
    folder = tmp_path / "runs" / "up" / "runs"
    record(folder, 1)
    record(folder, 2, "goto_room", RunStatus.FAILED, Why("goto_room/navigate to", "no_path", "no way there"))
    record(folder, 3, status=RunStatus.RUNNING)
    return folder


OUTPUTS = {"pose": "{x: 1 m, y: 2 m, yaw: 90 deg}", "way": "2.5 m"}


def test_the_outputs_of_a_run_are_told(florence, tmp_path):
    run_id = record(tmp_path, 1, outputs=OUTPUTS)
    told = "pose: {x: 1 m, y: 2 m, yaw: 90 deg}, way: 2.5 m"
    listed = florence("runs", "--folder", tmp_path).output.splitlines()
    assert listed[1] == f"2024-05-01 10:00:00  SUCCEEDED  4.5 s  {run_id}  {told}"
    for events in ([], ["--events"]):
        shown = florence("status", "--folder", tmp_path, "--run", run_id, *events).output.splitlines()
        assert f"outputs {told}" in shown


def test_the_runs_of_the_running_system_are_found_wherever_they_are(florence, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    record(tmp_path / "runs" / "up" / "runs", 1)
    elsewhere = record(tmp_path / "elsewhere" / "runs", 2, "goto_room")
    with closing(lock_domain(tmp_path / "elsewhere")):
        assert elsewhere in florence("runs").output and "goto_user" not in florence("runs").output
        assert elsewhere in florence("status", "--events").output
    assert "goto_user" in florence("runs").output
    with closing(lock_domain(tmp_path / "new")):
        assert (
            florence("runs").output == f"the running system has recorded no run yet in {tmp_path}/new/runs\n"
        )


def test_runs_are_listed_the_latest_first(florence, runs):
    result = florence("runs", "--folder", runs)
    assert result.exit_code == 0
    assert result.output.splitlines() == [
        "accepted (UTC)       state      took   run              why, or outputs",
        "2024-05-03 10:00:00  RUNNING    -      T-003-goto_user",
        "2024-05-02 10:00:00  FAILED     4.5 s  T-002-goto_room  no_path: no way there",
        "2024-05-01 10:00:00  SUCCEEDED  4.5 s  T-001-goto_user",
    ]


@pytest.mark.parametrize(
    ("options", "ids"),
    [
        (["--mission", "goto_room"], ["T-002"]),
        (["--state", "Failed"], ["T-002"]),
        (["--limit", "1"], ["T-003"]),
        (["--mission", "goto_user", "--state", "succeeded"], ["T-001"]),
        (["--state", "stopped"], []),
    ],
)
def test_runs_are_filtered(florence, runs, options, ids):
    output = florence("runs", "--folder", runs, *options).output
    assert [line.split("T-")[1][:3] for line in output.splitlines() if "T-" in line] == [i[2:] for i in ids]
    assert ids or "no run is recorded that fits" in output


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--state", "suceeded"], "succeeded"),
        (["--mission", "goto_rom"], "goto_room"),
        (["--limit", "0"], "at least 1"),
        (["--folder", "nowhere"], "journal.sqlite"),
    ],
)
def test_wrong_usage_says_what_would_have_worked(florence, runs, options, told):
    result = florence("runs", *(["--folder", runs] if "--folder" not in options else []), *options)
    assert result.exit_code == 2 and told in result.output


def test_the_journal_that_was_written_last_is_taken_when_none_is_named(florence, runs, tmp_path, monkeypatch):
    demo = tmp_path / "runs" / "demo"
    record(demo, 9, "detect_user")
    for file in runs.iterdir():
        os.utime(file, (1.0, 1.0))
    monkeypatch.chdir(tmp_path)
    assert "detect_user" in florence("runs").output
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "empty")
    result = florence("runs")
    assert result.exit_code == 2 and "--folder" in result.output


def test_the_journal_of_the_running_system_is_taken_when_none_is_named(florence, tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "locks"))
    (tmp_path / "locks").mkdir()
    monkeypatch.chdir(tmp_path / "locks")
    assert florence("runs").exit_code != 0
    run_id = record(tmp_path / "up" / "runs", 7)
    with closing(lock_domain(tmp_path / "up")):
        assert run_id in florence("runs").stdout
        assert run_id in florence("status", "--events").stdout


def test_the_status_of_a_recorded_run_tells_what_happened_when(florence, runs):
    result = florence("status", "--folder", runs, "--run", "T-002-goto_room", "--events")
    assert result.exit_code == 0
    assert result.output.splitlines() == [
        "goto_room: FAILED · 4.5 s · run T-002-goto_room · asked by Anna",
        "accepted 2024-05-02 10:00:00 UTC",
        "[+] goto_room",
        "failed because: no way there [no_path] at goto_room/navigate to",
        "",
        "    +0.0 s  started",
        "    +0.0 s  navigate_to goal=(x 1 m, y 2.5 m) at goto_room/navigate to: no_path after 4.5 s",
        "    +4.5 s  ended: no way there",
    ]


def test_the_status_of_a_run_without_an_end_is_drawn_from_its_events(florence, runs):
    output = florence("status", "--folder", runs, "--events").output
    assert output.splitlines() == [
        "goto_user: RUNNING · 0.0 s · run T-003-goto_user · asked by Anna",
        "accepted 2024-05-03 10:00:00 UTC",
        "[>] goto_user",
        "    [>] navigate to -- driving",
        "",
        "    +0.0 s  started",
        "    +0.0 s  navigate_to goal=(x 1 m, y 2.5 m) at goto_user/navigate to: goes on",
    ]


def test_an_unknown_run_names_those_that_are_known(florence, runs):
    result = florence("status", "--folder", runs, "--run", "T-7")
    assert result.exit_code == 2 and "T-003-goto_user" in result.output


def test_the_report_says_what_ran_how_it_ended_and_why(florence, runs, tmp_path):
    page = tmp_path / "run.html"
    result = florence("report", "T-002-goto_room", "--folder", runs, "--out", page)
    assert result.exit_code == 0 and result.output.split() == [str(page)]
    text = page.read_text()
    for part in ("goto_room", "FAILED", "no way there", "navigate_to", "+0.0 s", "no_path"):
        assert part in text
    assert "<img" not in text, "no picture was drawn of this run"


def test_the_report_has_the_picture_of_the_run_inside(florence, runs):
    folder = runs / "T-002-goto_room"
    folder.mkdir()
    (folder / "flat.png").write_bytes(b"\x89PNG and more")
    assert florence("report", "T-002-goto_room", "--folder", runs).exit_code == 0
    assert "data:image/png;base64,iVBORyBhbmQgbW9yZQ==" in (folder / "report.html").read_text()


def test_what_others_wrote_does_not_become_a_part_of_the_page(florence, runs, tmp_path):
    record(runs, 4, "greet", RunStatus.FAILED, Why("greet/<script>", "odd", "<img src=x onerror=alert(1)>"))
    florence("report", "T-004-greet", "--folder", runs, "--out", tmp_path / "run.html")
    text = (tmp_path / "run.html").read_text()
    assert "<script" not in text and "<img" not in text and "&lt;img src=x" in text


def test_a_report_of_an_unknown_run_names_those_there_are(florence, runs):
    result = florence("report", "T-999", "--folder", runs)
    assert result.exit_code == 2 and "T-003-goto_user" in result.output
