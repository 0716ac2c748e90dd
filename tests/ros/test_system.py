"""The whole system as its users meet it: the command line, and a plain rclpy client of the services."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections import Counter
from contextlib import nullcontext
from pathlib import Path

import pytest
from typer.testing import CliRunner

from florence_bt.app.bringup.options import BringUp
from florence_bt.app.demo.demo import DemoResult
from florence_bt.cli.application import app
from florence_bt.cli.exit_codes import FAILED
from florence_bt.runtime.journal import JournalReader
from florence_bt.runtime.viewers.run_tree import RunTree
from tests.ros.heard_topics import HeardTopics, recorded_in

pytestmark = [pytest.mark.ros, pytest.mark.slow, pytest.mark.timeout(1800)]

FLORENCE = [sys.executable, "-m", "florence_bt.cli"]
PATIENCE_S = 600.0
"""For what takes half a minute."""


def florence(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*FLORENCE, *arguments], capture_output=True, text=True, timeout=PATIENCE_S, stdin=subprocess.DEVNULL
    )


def processes_of(folder: Path) -> list[int]:
    """Processes of a bring-up that are still there."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                command = (entry / "cmdline").read_bytes().decode(errors="replace")
            except OSError:
                continue  # it ended while we looked
            if str(folder) in command and "florence_bt.app" in command:
                found.append(int(entry.name))
    return found


def test_the_demo_finds_and_approaches_the_person(ros_domain, tmp_path):
    done = florence("demo", "--headless", "--person", "hall", "--seed", "27", "--out", str(tmp_path))
    assert done.returncode == 0, done.stdout + done.stderr
    assert "The mission succeeded" in done.stdout and "The robot touched nothing" in done.stdout
    assert [path for path in tmp_path.rglob("*") if path.stat().st_mode & 0o077] == []
    distance = float(done.stdout.split("The robot stands ")[1].split(" m")[0])
    facing = float(done.stdout.split("facing them within ")[1].split(" degrees")[0])
    assert distance == pytest.approx(0.5, abs=0.1) and facing <= 15
    (run,) = (folder for folder in (tmp_path / "runs").iterdir() if folder.is_dir())
    assert str(run) in done.stdout.replace("\n", "")
    assert {"tree.txt", "result.json"} <= {file.name for file in run.iterdir()}
    assert "goto_user: SUCCEEDED" in (run / "tree.txt").read_text()
    assert json.loads((run / "result.json").read_text())["looks"]
    assert (run / "flat.png").read_bytes().startswith(b"\x89PNG")
    assert processes_of(tmp_path) == [] and not any((tmp_path / "ports").iterdir())


def test_a_demo_whose_mission_fails_ends_with_its_reason(tmp_path, monkeypatch):
    """That nobody is met when nobody is at home is a test of the rig."""
    tree = RunTree(mission="goto_user", state="FAILED")
    ended = DemoResult(False, "nobody was met", 88.0, tree, tmp_path, None, ())
    monkeypatch.setattr("florence_bt.app.bringup.fork_server.ForkServer", nullcontext)
    monkeypatch.setattr("florence_bt.app.demo.demo.run_demo", lambda *arguments, **options: ended)
    done = CliRunner().invoke(app, ["demo", "--headless", "--out", str(tmp_path)])
    assert done.exit_code == FAILED
    for said in ("goto_user: FAILED", "The mission failed after 88 s.", "Reason: nobody was met"):
        assert said in done.stdout
    assert "Nobody is at home." in done.stdout and "The robot touched nothing." in done.stdout
    assert "Reason: nobody was met" in done.stdout.splitlines()[-1], "the verdict is not scrolled away"


def test_an_unknown_room_is_named_before_anything_starts(ros_domain, tmp_path):
    done = florence("demo", "--headless", "--person", "kitchn", "--out", str(tmp_path))
    assert done.returncode == 2 and "kitchen" in done.stderr
    assert not (tmp_path / "logs").exists()


def test_without_a_system_every_client_verb_says_what_to_do(ros_domain, start_process):
    children = [start_process(*FLORENCE, *verb) for verb in (["status"], ["stop"], ["run", "goto_user"])]
    for child in children:
        assert child.process.wait(PATIENCE_S) == 3 and "florence up --sim" in child.output, child.output


def wait_for(condition, what: str):
    end = time.monotonic() + PATIENCE_S
    while not (value := condition()):
        assert time.monotonic() < end, f"waited for {what}"
        time.sleep(0.02)
    return value


@pytest.fixture
def system(ros_domain, tmp_path, patrol):
    """A running ``florence up --sim`` and the file it prints to."""
    output = tmp_path / "up.txt"
    command = [*FLORENCE, "up", "--sim", "--person", "hall", "--seed", "27"]
    command += ["--missions", str(patrol), "--record"]
    with output.open("w") as file:
        process = subprocess.Popen(
            [*command, "--out", str(tmp_path / "up")],
            stdout=file,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
        )
    try:
        wait_for(lambda: "ready after" in output.read_text() or process.poll() is not None, "the system")
        assert process.poll() is None, output.read_text()
        yield process, output, tmp_path / "up"
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                process.kill()  # its processes go with it
                raise


class PlainClient:
    """A client of plain rclpy, without anything of ours."""

    def __init__(self):
        import rclpy
        from florence_interfaces.srv import GetRoom, GotoRoom, MissionStatus, RunMission
        from rclpy.executors import SingleThreadedExecutor
        from std_srvs.srv import Trigger

        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self._node = rclpy.create_node("plain_client", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        # In this order: a server that answers its last one knows the way back to the others too. Fast DDS
        # loses an answer to a client that the server has not discovered yet.
        self._clients = {
            name: self._node.create_client(service_type, name)
            for service_type, name in (
                (GotoRoom, "/florenceLocator/gotoRoom"),
                (Trigger, "/florenceLocator/gotoUser"),
                (GetRoom, "/florenceLocator/getRobotPosRoom"),
                (Trigger, "/florence_bt/missions/goto_user"),
                (Trigger, "/florence_bt/missions/patrol"),
                (RunMission, "/florence_bt/run_mission"),
                (MissionStatus, "/florence_bt/status"),
            )
        }

    def wait_until_known(self):
        """Ask what changes nothing until it is answered."""
        for name in ("/florenceLocator/getRobotPosRoom", "/florence_bt/status"):
            request = self._clients[name].srv_type.Request
            assert any(self._ask(name, request(), 3.0).done() for _ in range(100)), name

    def call(self, service_type, name, request=None):
        future = self._ask(name, request or service_type.Request(), PATIENCE_S)
        assert future.done(), f"{name} did not answer"
        return future.result()

    def _ask(self, name, request, budget_s):
        assert self._clients[name].wait_for_service(PATIENCE_S), name
        future = self._clients[name].call_async(request)
        self._executor.spin_until_future_complete(future, budget_s)
        return future

    def topics(self):
        return {name for name, _ in self._node.get_topic_names_and_types()}

    def close(self):
        import rclpy

        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)


def topics_of_layouts() -> set[str]:
    """The topics that the layout for Foxglove and the configuration of RViz show, or publish to."""
    config = Path(__file__).parents[2] / "config"
    texts = [(config / name).read_text() for name in ("foxglove.json", "florence.rviz")]
    return {topic for text in texts for topic in re.findall(r"[\" ](/[a-z][\w/]*)", text)}


def test_the_verbs_and_the_services_of_a_running_system(system):
    process, output, folder = system
    from florence_interfaces.srv import GetRoom, GotoRoom, MissionStatus, RunMission
    from std_srvs.srv import Trigger

    plain = PlainClient()
    call = plain.call

    def state():
        return call(MissionStatus, "/florence_bt/status").state

    try:
        plain.wait_until_known()
        assert "no mission has run yet" in call(MissionStatus, "/florence_bt/status").tree
        assert call(GetRoom, "/florenceLocator/getRobotPosRoom").room == "hall"
        wait_for(lambda: topics_of_layouts() <= plain.topics(), "the topics of the layouts")

        bad = call(RunMission, "/florence_bt/run_mission", RunMission.Request(mission="goto_usr"))
        assert not bad.accepted and "goto_user" in bad.message
        bad = call(
            RunMission,
            "/florence_bt/run_mission",
            RunMission.Request(mission="goto_user", input_names=["window"], input_values=["5 m"]),
        )
        assert not bad.accepted and "window" in bad.message
        bad = call(GotoRoom, "/florenceLocator/gotoRoom", GotoRoom.Request(room="kitchn"))
        assert not bad.success and "kitchen" in bad.message

        # Triggers by mission name; a second one while the first runs gets the documented answer.
        first = call(Trigger, "/florence_bt/missions/patrol")
        assert first.success, first.message
        for name in ("patrol", "goto_user"):
            second = call(Trigger, f"/florence_bt/missions/{name}")
            assert not second.success and "patrol is running" in second.message, second.message
            assert "preempt" in second.message
        assert "patrol" in florence("status").stdout
        kill_recorder(folder, output)
        assert state() == "RUNNING", "nothing depends on it"
        stopped = florence("stop")
        assert stopped.returncode == 0, stopped.stderr
        wait_for(lambda: state() == "STOPPED", "the stop")

        wait_for(lambda: len(recordings(folder)) == 2, "the next recording")
        with HeardTopics() as heard:
            done = florence("run", "goto_user", "--headless")
        assert done.returncode == 0 and "goto_user: SUCCEEDED" in done.stdout, done.stdout + done.stderr
        assert "[ ]" not in done.stdout, "what was not reached is listed only when asked for"
        assert "goto_user" in florence("runs").stdout, "the folder of the running system is found"

        # The document's own service; goto* replaces a running goto*.
        user = call(Trigger, "/florenceLocator/gotoUser")
        room = call(GotoRoom, "/florenceLocator/gotoRoom", GotoRoom.Request(room="kitchen"))
        assert user.success and room.success, (user.message, room.message)
        wait_for(lambda: state() == "SUCCEEDED", "the way to the kitchen")
        assert call(GetRoom, "/florenceLocator/getRobotPosRoom").room == "kitchen"

    finally:
        plain.close()

    # Ctrl-C while a mission runs: everything ends, ports are released, the exit code is the documented one.
    assert florence("run", "patrol", "--detach").returncode == 0
    process.send_signal(signal.SIGINT)
    assert process.wait(PATIENCE_S) == 130, output.read_text()
    assert processes_of(folder) == [] and not any((folder / "ports").iterdir())
    with JournalReader(folder / "runs") as journal:
        last = journal.runs(1, "patrol")[0]
        assert last.state == "STOPPED"
        assert "stop_asked" in [event.kind for event in journal.events(last.run_id)]
    check_recording(recordings(folder)[-1], heard)


def kill_recorder(folder: Path, output: Path) -> None:
    (victim,) = (
        pid for pid in processes_of(folder) if b"\0recorder\0" in Path(f"/proc/{pid}/cmdline").read_bytes()
    )
    os.kill(victim, signal.SIGKILL)
    said = re.compile("the process 'recorder' was killed by SIGKILL, .*")
    (told,) = wait_for(lambda: said.findall(output.read_text()), "the death of the recorder")
    assert "the robot goes on" in told


def recordings(folder: Path) -> list[Path]:
    return sorted((folder / "recordings").glob("*.mcap"))


def check_recording(file: Path, heard: HeardTopics) -> None:
    """Every message that another subscriber heard is recorded, byte for byte, and none is there twice."""
    recorded = recorded_in(file)
    topics = Counter[str]()
    for (topic, _), count in heard.messages.items():
        topics[topic] += count
    assert {"/scan", "/odom", "/tf", "/tracked_users", "/plan", "/florence_bt/tree", "/rosout"} <= set(topics)
    lost = Counter[str]()
    for (topic, _), count in (heard.messages - recorded).items():
        lost[topic] += count
    assert not {topic: lost[topic] for topic in lost if topic in heard.reliable}
    assert all(count <= 0.02 * topics[topic] for topic, count in lost.items()), (lost, topics)
    for topic in ("/odom", "/filtered_laser_scan"):  # of a time that stands still, two may be alike
        twice = [key for key, count in heard.messages.items() if key[0] == topic and recorded[key] > count]
        assert not twice, topic


def test_a_bring_up_travels_as_json(tmp_path):
    options = BringUp(folder=str(tmp_path), person="kitchen", start=(1.0, 2.0, 0.5), seed=3, speed=2.0)
    assert BringUp.read(options.write()) == options
