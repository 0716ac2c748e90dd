"""A display is fed with the newest that is known of a run: what the topic tells, and what is answered."""

from __future__ import annotations

import io
from types import SimpleNamespace

import pytest

pytest.importorskip("rclpy")

from rich.console import Console

from florence_bt.app.runs import watching
from florence_bt.app.runs.client import MissionClient
from florence_bt.app.runs.live import LiveDisplay, LogDisplay
from florence_bt.app.runs.watching import RunFeed
from florence_bt.runtime.node._convert import run_tree_to_ros
from florence_bt.runtime.viewers.run_tree import RunTree


class Client(MissionClient):
    """A client whose mission server is a variable."""

    def __init__(self):
        self.told_tree = None
        self.answer = None
        self.asked = []


class Shown(LiveDisplay):
    """Remembers what it was to show."""

    def __init__(self):
        self.trees = []

    def show(self, tree, where=""):
        self.trees.append(tree)


def after(seconds, run_id="R-1"):
    return run_tree_to_ros(RunTree(run_id=run_id, mission="go", state="RUNNING", seconds=seconds))


@pytest.fixture
def client(monkeypatch):
    class Question:
        def __init__(self, client):
            self.client = client

        def take(self):
            answer, self.client.answer = self.client.answer, None
            return None if answer is None else SimpleNamespace(found=True, run_tree=answer)

        def ask(self, service_type, name, request):
            self.client.asked.append(request.run_id)
            return True

    monkeypatch.setattr(watching, "OpenQuestion", Question)
    monkeypatch.setattr(watching, "Whereabouts", lambda client: SimpleNamespace(text=lambda: ""))
    return Client()


def last(feed, shown):
    feed.look()
    return shown.trees[-1].seconds if shown.trees else None


def test_what_is_newer_is_shown_whichever_way_it_came(client):
    shown = Shown()
    feed = RunFeed(client, shown, "R-1")
    assert last(feed, shown) is None and client.asked == ["R-1"]
    client.told_tree = after(9.0, "R-0")
    assert last(feed, shown) is None, "another run"
    client.told_tree = after(1.0)
    assert last(feed, shown) == 1.0
    client.answer = after(2.0)
    assert last(feed, shown) == 2.0
    client.told_tree, client.answer = after(3.0), after(2.5)
    assert last(feed, shown) == 3.0, "the answer was on its way when the tree changed"
    assert last(feed, shown) == 3.0


def test_without_a_run_whatever_runs_is_shown(client):
    shown = Shown()
    feed = RunFeed(client, shown)
    client.told_tree = after(9.0, "R-1")
    assert last(feed, shown) == 9.0
    client.told_tree = after(0.5, "R-2")
    assert last(feed, shown) == 0.5


def test_lines_ask_nobody(client):
    feed = RunFeed(client, LogDisplay(Console(file=io.StringIO())), "R-1")
    feed.look()
    assert not client.asked
