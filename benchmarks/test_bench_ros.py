"""Reaction over ROS between two processes, side by side with plain rclpy in one run; and the idle server.

Measured from the message that ends one skill to the arrival of what the next one sends, here, where the
other side of the skills is. The plain echoes take turns with the mission, hop by hop, so that whatever else
the machine does meets all of them. One echo is served by the very loop that serves the mission (the events
executor, which is the fastest that rclpy has), the other by ``rclpy.spin`` in a process of its own.
"""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from nav2_msgs.action import Spin
from py_trees.common import Status
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from benchmarks.measure import size
from florence_bt.app.runs.client import MissionClient
from florence_bt.app.runs.journal_view import read_run
from florence_bt.core.clock import call_every
from florence_bt.core.outcome import Outcome
from florence_bt.ros.action_server import SingleGoalServer
from florence_bt.ros.qos import RELIABLE

HOPS, ACTION_HOPS = size((1500, 300), (5, 3))
PAUSE_S = 0.002
"""Between two hops: a skill that ends while the tick that started it is still being recorded is no skill."""
IDLE_S = size(20.0, 0.5)
REST_S = size(10.0, 0.0)
"""From the start-up on, before the idle load is measured: a server may look around for some seconds."""
PATIENCE_S = 60.0
CLOCK_PERIOD_S = 0.01


def cpu_seconds(pid):
    """What the threads of a process have used so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@contextmanager
def other_process(log, *arguments, end_by=signal.SIGTERM):
    """``ros_hops`` beside us."""
    script = Path(__file__).with_name("ros_hops.py")
    process = subprocess.Popen([sys.executable, script, *arguments], stdout=log, stderr=log)
    try:
        yield process
    finally:
        process.send_signal(end_by)
        process.wait(PATIENCE_S)


@pytest.fixture
def client(request, domain, tmp_path):
    """A client with the other processes beside it."""
    with ExitStack() as stack:
        log = stack.enter_context((tmp_path / "server.log").open("w"))
        more = getattr(request, "param", ())
        server = stack.enter_context(other_process(log, tmp_path, *more))
        # ``rclpy.spin`` can miss a SIGTERM and wait on.
        stock = stack.enter_context(other_process(log, "stock", *more, end_by=signal.SIGKILL))
        made = stack.enter_context(MissionClient("bench"))
        made.other, made.stock, made.folder = server, stock, tmp_path
        yield made


def take_turns(client, hops, *sides):
    """Microseconds of each hop, by side: what ends a hop, and the list that notes the next start.

    Each round begins with another side, and the garbage of everything before is out of the way.
    """
    times = [[] for _ in sides]
    gc.collect()
    gc.freeze()
    try:
        for hop in range(hops):
            for turn in range(len(sides)):
                side = (hop + turn) % len(sides)
                end, arrivals = sides[side]
                time.sleep(PAUSE_S)
                arrivals.clear()
                begin = time.perf_counter()
                end()
                while not arrivals:
                    client._loop.spin_once(1.0)
                times[side].append(1e6 * (arrivals[0] - begin))
    finally:
        gc.unfreeze()
    return [sorted(noted) for noted in times]


def report(figures, what, floor, ours, aims="aims 1.3 / 2"):
    """Add the ratios to the figures, and give them back: of the medians, and of the 99th percentiles."""

    def at(noted, share):
        return noted[int(len(noted) * share)]

    median, late = (at(ours, share) / at(floor, share) for share in (0.5, 0.99))
    figures.add(
        f"reaction over ROS, {what}, median / 99th percentile",
        f"{median:.2f} / {late:.2f}",
        f"{at(ours, 0.5):.0f} / {at(ours, 0.99):.0f} us, plain {at(floor, 0.5):.0f} / "
        f"{at(floor, 0.99):.0f} us; {aims}",
    )
    return median, late


def test_reaction_on_topics(benchmark, figures, client):
    starts = {"stock": [], "plain": [], "hop": []}
    publishers = {}
    for side, noted in starts.items():
        publishers[side] = client.node.create_publisher(String, f"{side}/done", RELIABLE)
        client.node.create_subscription(
            String, f"{side}/start", lambda m, noted=noted: noted.append(time.perf_counter()), RELIABLE
        )
    assert client.spin_until(lambda: all(p.get_subscription_count() for p in publishers.values()), PATIENCE_S)
    assert client.run("hops", {}, caller="benchmark").accepted
    assert client.spin_until(lambda: bool(starts["hop"]), PATIENCE_S)
    sides = [
        (lambda side=side: publishers[side].publish(String(data="done")), noted)
        for side, noted in starts.items()
    ]
    client.spin_until(lambda: False, 0.5)
    stock, floor, ours = benchmark.pedantic(take_turns, args=(client, HOPS, *sides), rounds=1)
    median, _ = report(figures, "topics: times a plain echo with rclpy.spin", stock, ours)
    report(figures, "topics: times an echo in our own loop", floor, ours)
    figures.limit(median, most=1.3)


def test_reaction_on_actions(benchmark, figures, client):
    starts = {"plain": [], "hop": []}
    servers = {
        side: SingleGoalServer(
            client.node,
            Spin,
            f"{side}_action",
            on_goal=lambda goal, noted=noted: noted.append(time.perf_counter()),
            on_cancel=lambda: None,
        )
        for side, noted in starts.items()
    }
    begin = client.node.create_publisher(String, "plain/begin", RELIABLE)
    assert client.spin_until(lambda: begin.get_subscription_count() > 0, PATIENCE_S)
    assert client.run("action_hops", {}, caller="benchmark").accepted
    assert client.spin_until(lambda: bool(starts["hop"]), PATIENCE_S)
    begin.publish(String(data="go"))
    assert client.spin_until(lambda: bool(starts["plain"]), PATIENCE_S)
    client.spin_until(lambda: False, 0.5)
    sides = [
        (lambda side=side: servers[side].finish(Spin.Result(), Outcome.SUCCEEDED), noted)
        for side, noted in starts.items()
    ]
    floor, ours = benchmark.pedantic(take_turns, args=(client, ACTION_HOPS, *sides), rounds=1)
    report(figures, "actions: times a plain client in our own loop", floor, ours)


@pytest.mark.parametrize(
    ("client", "time_source"), [((), "wall clock"), (("sim",), "/clock at 100 Hz")], indirect=["client"]
)
def test_idle_server(benchmark, figures, client, time_source):
    if time_source != "wall clock":
        publisher = client.node.create_publisher(Clock, "/clock", 1)
        call_every(
            client.node.steady,
            CLOCK_PERIOD_S,
            lambda: publisher.publish(Clock(clock=client.node.get_clock().now().to_msg())),
        )
    assert client.spin_until(lambda: client.servers() == 1, PATIENCE_S)
    client.spin_until(lambda: False, REST_S)
    both = (client.other, client.stock)
    before = [cpu_seconds(process.pid) for process in both]
    benchmark.pedantic(lambda: client.spin_until(lambda: False, IDLE_S), rounds=1)
    ours, stock = (
        100 * (cpu_seconds(process.pid) - then) / IDLE_S for process, then in zip(both, before, strict=True)
    )
    figures.add(
        f"idle mission server, {time_source}",
        f"{ours:.2f} % of a core",
        f"aim 0.5 %; one rclpy node with rclpy.spin: {stock:.2f} %",
    )
    figures.limit(ours, most=0.5)


def hops(tree):
    rows = tree.nodes if tree is not None else ()
    return any("hopped" in row.title and row.status is Status.RUNNING for row in rows)


def test_ticks_while_a_skill_goes_on(benchmark, figures, client):
    client.node.create_subscription(String, "hop/start", lambda message: None, RELIABLE)
    assert client.spin_until(lambda: client.servers() == 1, PATIENCE_S)
    answer = client.run("hops", {}, caller="benchmark")
    assert answer.accepted
    assert client.spin_until(lambda: hops(client.tree_of(answer.run_id)), PATIENCE_S)
    benchmark.pedantic(lambda: client.spin_until(lambda: False, IDLE_S), rounds=1)
    client.stop("measured")
    runs = client.folder / "runs"
    assert client.spin_until(lambda: read_run(runs, answer.run_id)[0].status.final, PATIENCE_S)
    run, events = read_run(runs, answer.run_id)
    begin = next(event.tick for event in events if event.kind == "skill_started" and event.skill == "hopped")
    ticks = run.ticks - begin
    figures.add(
        "ticks while one skill goes on and nothing happens", f"{ticks * 60 / IDLE_S:.0f} a minute", "aim 0"
    )
    assert ticks == 0
