"""What a client concludes from messages and answers, and from their absence."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

pytest.importorskip("rclpy")

from florence_interfaces.msg import RunTree as RunTreeMsg

from florence_bt.app.runs import client as run_watch
from florence_bt.app.runs.client import RunWatch, SystemNotThere
from florence_bt.core.errors import DeviceTimeout


class Client:
    """Answers like a mission client."""

    def __init__(self):
        self.state = SimpleNamespace(run_id="", state="IDLE", reason="")
        self.answers = []

    def status(self, run_id):
        answer = self.answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return SimpleNamespace(found=answer != "", state=answer)


@pytest.fixture
def client(monkeypatch):
    monkeypatch.setattr(run_watch, "ASK_PERIOD_S", -1.0)  # asks each time
    monkeypatch.setattr(run_watch, "bring_up_here", lambda: False)
    return Client()


def test_the_topic_tells_the_end_without_a_question(client):
    watch = RunWatch(client, "T-1")
    client.state = SimpleNamespace(run_id="T-1", state="SUCCEEDED", reason="")
    assert watch.over()


def test_when_the_topic_tells_of_the_next_run_the_server_is_asked(client):
    watch = RunWatch(client, "T-1")
    client.state = SimpleNamespace(run_id="T-2", state="ACTIVE", reason="")
    client.answers = ["QUEUED", "RUNNING", "ENDING", "FAILED"]
    assert [watch.over() for _ in range(4)] == [False, False, False, True]


def test_a_server_that_is_busy_for_a_while_is_not_gone(client):
    watch = RunWatch(client, "T-1")
    client.answers = [DeviceTimeout("late"), "RUNNING", DeviceTimeout("late"), "SUCCEEDED"]
    assert [watch.over() for _ in range(4)] == [False, False, False, True]


@pytest.mark.parametrize(
    "answers", [[DeviceTimeout("late"), DeviceTimeout("late")], [SystemNotThere("nobody")], [""]]
)
def test_a_server_that_went_away_or_was_started_anew(client, answers):
    watch = RunWatch(client, "T-1")
    client.answers = answers
    with pytest.raises(SystemNotThere, match="the mission server"):
        while not watch.over():
            pass


def test_without_a_run_only_the_server_is_watched(client):
    watch = RunWatch(client)
    client.answers = ["", "SUCCEEDED", SystemNotThere("nobody")]
    assert not watch.over() and not watch.over()
    with pytest.raises(SystemNotThere):
        watch.over()


def test_the_last_word_is_told_when_the_result_cannot_be_asked_for(client):
    client.state = SimpleNamespace(run_id="T-1", state="PREEMPTED", reason="it is shutting down")
    client.answers = [DeviceTimeout("late")]
    with pytest.raises(SystemNotThere, match=r"went away.*its last reason was: it is shutting down"):
        RunWatch(client, "T-1").result()


def test_a_bring_up_gets_time_to_start_its_mission_server_again(client, monkeypatch):
    up = [True] * 4
    monkeypatch.setattr(run_watch, "bring_up_here", lambda: up.pop(0))
    silence = [SystemNotThere("nobody"), DeviceTimeout("late"), SystemNotThere("nobody")]
    client.answers = [*silence, "RUNNING", *silence]
    watch = RunWatch(client, "T-1")
    assert [watch.over() for _ in range(4)] == [False] * 4
    up = [True, False]
    assert not watch.over()
    with pytest.raises(SystemNotThere, match="went away"):
        watch.over()


def test_that_time_is_bounded(client, monkeypatch):
    monkeypatch.setattr(run_watch, "bring_up_here", lambda: True)
    monkeypatch.setattr(run_watch, "RESTART_S", -1.0)
    client.answers = [SystemNotThere("nobody")]
    with pytest.raises(SystemNotThere, match="went away"):
        RunWatch(client, "T-1").over()


def test_the_tree_of_another_run_is_not_shown():
    """The topic keeps its last message: at the start of a run that is the end of the one before."""
    told = SimpleNamespace(told_tree=RunTreeMsg(run_id="T-002-goto", mission="goto"))
    for run_id in ("T-002-goto", "T-001-goto", "T-002-goto_user", ""):
        shown = run_watch.MissionClient.tree_of(told, run_id)
        assert (shown is not None and shown.mission == "goto") == (run_id in ("T-002-goto", ""))
    assert run_watch.MissionClient.tree_of(SimpleNamespace(told_tree=None), "") is None
