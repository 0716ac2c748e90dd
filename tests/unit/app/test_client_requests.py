"""What the verbs of the command line ask the mission server, and what they print of its answers."""

from __future__ import annotations

import io
from dataclasses import replace
from types import SimpleNamespace

import pytest

pytest.importorskip("rclpy")

from builtin_interfaces.msg import Time
from florence_interfaces.msg import RunTree as RunTreeMsg
from py_trees.common import Status
from rich.console import Console
from typer.testing import CliRunner

import florence_bt
from florence_bt.app.runs import remote
from florence_bt.app.runs.client import LOCATOR, RELOAD_BUDGET_S, MissionClient
from florence_bt.app.runs.run_trees import run_tree_from_ros
from florence_bt.cli.application import app
from florence_bt.core.errors import FlorenceError
from florence_bt.runtime.node._convert import run_tree_to_ros
from florence_bt.runtime.viewers.run_tree import RunTree
from florence_bt.trees.drawings.ascii import TreeRow


class Recording(MissionClient):
    """A client that records its calls instead of making them, and gives an answer in their place."""

    def __init__(self, answer=None):
        self.calls = []
        self.answer = answer
        self.closed = False
        self.nodes = set()

    def sees(self, node):
        return node in self.nodes

    def expect(self, service_type, name):
        self.expected = name

    def call(self, service_type, name, request, **options):
        fields = {field: getattr(request, field) for field in request.get_fields_and_field_types()}
        self.calls.append((service_type.__name__, name, fields, options))
        return self.answer

    def close(self):
        self.closed = True


CALLS = {
    "run": (
        lambda c: c.run("goto_room", {"room": "hall"}, caller="me", policy="queue", priority=2),
        "RunMission",
        "florence_bt/run_mission",
        {
            "mission": "goto_room",
            "input_names": ["room"],
            "input_values": ["hall"],
            "caller": "me",
            "policy": "queue",
            "priority": 2,
            "valid_until": Time(),
        },
        {},
    ),
    "stop": (
        lambda c: c.stop("enough", "R-1"),
        "StopMission",
        "florence_bt/stop",
        {"run_id": "R-1", "reason": "enough"},
        {},
    ),
    "pause": (
        lambda c: c.pause("a visitor", "R-1"),
        "PauseMission",
        "florence_bt/pause",
        {"run_id": "R-1", "reason": "a visitor"},
        {},
    ),
    "resume": (
        lambda c: c.resume("R-1"),
        "ResumeMission",
        "florence_bt/resume",
        {"run_id": "R-1", "valid_until": Time()},
        {},
    ),
    "step": (
        lambda c: c.step("R-1"),
        "ResumeMission",
        "florence_bt/step",
        {"run_id": "R-1", "valid_until": Time()},
        {},
    ),
    "breakpoints": (
        lambda c: c.breakpoints(["look"], ["drive"], clear=True),
        "SetBreakpoints",
        "florence_bt/breakpoints",
        {"add": ["look"], "remove": ["drive"], "clear": True},
        {},
    ),
    "reload": (
        lambda c: c.reload(),
        "ReloadMissions",
        "florence_bt/reload_missions",
        {},
        {"budget_s": RELOAD_BUDGET_S},
    ),
    "missions": (
        lambda c: c.missions(),
        "ListMissions",
        "florence_bt/list_missions",
        {},
        {"repeat": True},
    ),
}


@pytest.mark.parametrize("verb", CALLS)
def test_each_verb_calls_its_service(verb):
    act, kind, name, fields, options = CALLS[verb]
    client = Recording("the answer")
    assert act(client) == "the answer"
    ((called, at, sent, given),) = client.calls
    assert (called, at, given) == (kind, name, options)
    assert {field: list(v) if isinstance(v, list) else v for field, v in sent.items()} == fields


def test_only_a_question_is_repeated():
    client = Recording()
    client.status("R-1")
    ((kind, name, sent, options),) = client.calls
    assert (kind, name, options) == ("MissionStatus", "florence_bt/status", {"repeat": True})
    assert sent["run_id"] == "R-1"


@pytest.fixture
def answering(monkeypatch):
    def install(**answer):
        client = Recording(SimpleNamespace(**answer))
        monkeypatch.setattr(remote, "MissionClient", lambda: client)
        return client

    return install


TREE = RunTree(mission="m", state="RUNNING", run_id="R-1", caller="me", seconds=2.0)
STATUS = {
    "found": True,
    "tree": "no run 'R-9' is known here",
    "run_tree": run_tree_to_ros(replace(TREE, nodes=(TreeRow(0, Status.SUCCESS, "m", ""),))),
    "blocked_by": "",
    "unowned_goals": [],
    "waiting": [],
}


def shown(run_id, answering, **changed):
    answering(**{**STATUS, **changed})
    out = io.StringIO()
    found = remote.show_status(run_id, Console(file=out, width=200), watch=False)
    return found, out.getvalue()


def test_a_reload_also_reads_the_hotspots_where_there_is_a_locator(answering):
    client = answering(success=True, report="m: reloaded", message="hotspots: 3, zones: 0")
    client.nodes = {LOCATOR}
    assert remote.reload_files() == (True, "m: reloaded\nhotspots: 3, zones: 0")
    assert [name for _, name, _, _ in client.calls] == [
        "florence_bt/reload_missions",
        "florenceLocator/reloadHotspots",
    ]


def test_the_status_is_the_tree_and_what_keeps_missions_from_starting(answering):
    assert shown("", answering) == (True, f"{TREE.head}\n[+] m\n")
    found, text = shown(
        "R-1",
        answering,
        blocked_by="the override is on",
        unowned_goals=["spin (goal 1)"],
        waiting=["R-2", "R-3"],
    )
    assert found and text == (
        f"{TREE.head}\n"
        "[+] m\n"
        "no mission may start: the override is on\n"
        "no mission owns the goal of spin (goal 1); florence stop ends it\n"
        "waiting: R-2, R-3\n"
    )


def test_an_unknown_run_is_not_found_but_no_run_at_all_is_no_error(answering):
    assert shown("R-9", answering, found=False) == (False, "no run 'R-9' is known here\n")
    assert shown("", answering, found=False, run_tree=RunTreeMsg()) == (True, "no mission has run yet\n")


def test_a_run_of_an_earlier_process_is_shown_as_it_was_written_down(answering):
    written = run_tree_to_ros(replace(TREE, text="[+] m\n    [-] wait 1 s"))
    assert shown("R-1", answering, run_tree=written)[1] == f"{TREE.head}\n[+] m\n    [-] wait 1 s\n"


def test_a_run_with_its_tree_comes_as_it_was_sent():
    nodes = (
        TreeRow(0, Status.RUNNING, "m (sequence)", "", 2.0),
        TreeRow(1, Status.FAILURE, "drive", "too far", 0.0, left=True),
        TreeRow(1, Status.RUNNING, "run go", "", None, left=True, call=True),
        TreeRow(2, Status.INVALID, "wait 1 s", ""),
        TreeRow(1, Status.SUCCESS, "rest", ""),
    )
    whole = replace(TREE, nodes=nodes, notes=("a", "b"), outputs={"x": "1 m"}, why="w", warnings=("v",))
    for tree in (whole, RunTree(), RunTree(text="[+] m", mission="m")):
        assert run_tree_from_ros(run_tree_to_ros(tree)) == tree
    told = run_tree_to_ros(whole)
    told.nodes[1].status = 77
    with pytest.raises(FlorenceError, match="status is 77"):
        run_tree_from_ros(told)


@pytest.mark.parametrize(
    ("verb", "answer"),
    [
        (lambda: remote.stop_mission("R-1"), {"success": True, "message": "R-1 stops"}),
        (lambda: remote.pause_mission("R-1", ""), {"success": False, "message": "not running"}),
        (lambda: remote.resume_mission("R-1"), {"success": True, "message": "goes on"}),
        (lambda: remote.reload_files(), {"success": False, "report": "m: it breaks n"}),
    ],
)
def test_a_verb_gives_what_was_answered_and_leaves_ros(answering, verb, answer):
    client = answering(**answer)
    assert verb() == tuple(answer.values())
    assert client.closed and len(client.calls) == 1


@pytest.mark.parametrize(("given", "told"), [("a visitor", "a visitor"), ("", "florence stop")])
def test_the_reason_of_a_stop_is_told(answering, given, told):
    client = answering(success=True, message="R-1 stops")
    remote.stop_mission("R-1", given)
    ((_, _, fields, _),) = client.calls
    assert fields["reason"] == told


def test_the_version_is_told():
    told = CliRunner().invoke(app, ["--version"])
    assert (told.exit_code, told.output) == (0, f"florence {florence_bt.__version__}\n")


def test_the_missions_of_the_running_system_have_their_inputs_and_what_is_wrong(answering):
    port = SimpleNamespace(
        name="room", type="text", required=True, minimum="", maximum="", default_value="", description="where"
    )
    pause = SimpleNamespace(
        name="pause", type="duration", required=False, minimum="1 s", maximum="9 s", default_value="3 s",
        description="",
    )  # fmt: skip
    broken = SimpleNamespace(name="b", description="", inputs=[], problem="3:1: no kind\nand more")
    good = SimpleNamespace(name="goto_room", description="Drive.", inputs=[port, pause], problem="")
    answering(missions=[good, broken], findings=["a package is ignored"])
    text = remote.live_missions()
    assert "goto_room        Drive." in text
    assert "room: text" in text and "-- where" in text
    assert "from 1 s" in text and "to 9 s" in text and "default 3 s" in text
    assert "cannot run: 3:1: no kind" in text and text.endswith("a package is ignored")
