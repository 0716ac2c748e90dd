"""Reaction over ROS between two processes, side by side with plain rclpy in one run; and the idle server.

Measured from the message that ends one skill to the arrival of the start of the next one, here, where the
skills are. The plain echo takes turns with the mission, hop by hop, so that whatever else the machine does
meets both.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from nav2_msgs.action import Spin
from std_msgs.msg import String

from florence_bt.core.outcome import Outcome
from florence_bt.ros.action_server import SingleGoalServer
from florence_bt.ros.qos import RELIABLE
from florence_bt.wiring.client import MissionClient

HOPS, ACTION_HOPS = 1500, 300
PAUSE_S = 0.002
"""Between two hops: a skill that ends while the tick that started it is still being recorded is no skill."""
IDLE_S = 20.0
PATIENCE_S = 20.0


@pytest.fixture
def client(monkeypatch, tmp_path):
    """A client with the other process beside it."""
    monkeypatch.setenv("ROS_DOMAIN_ID", "96")
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    script = Path(__file__).with_name("ros_hops.py")
    log = (tmp_path / "server.log").open("w")
    process = subprocess.Popen([sys.executable, script, tmp_path], stdout=log, stderr=log)
    try:
        with MissionClient("bench") as made:
            made.other = process
            yield made
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(PATIENCE_S)
        log.close()


def take_turns(client, hops, *sides):
    """Microseconds of each hop, by side: what ends a hop, and the list that notes the next start."""
    times = [[] for _ in sides]
    for _ in range(hops):
        for (end, arrivals), noted in zip(sides, times, strict=True):
            time.sleep(PAUSE_S)
            arrivals.clear()
            begin = time.perf_counter()
            end()
            while not arrivals:
                client._loop.spin_once(1.0)
            noted.append(1e6 * (arrivals[0] - begin))
    return [sorted(noted) for noted in times]


def report(figures, what, floor, ours):
    def at(noted, share):
        return noted[int(len(noted) * share)]

    median, late = (at(ours, share) / at(floor, share) for share in (0.5, 0.99))
    figures.add(
        f"reaction over ROS, {what}: times plain rclpy, median / 99th percentile",
        f"{median:.2f} / {late:.2f}",
        f"{at(ours, 0.5):.0f} / {at(ours, 0.99):.0f} us, plain {at(floor, 0.5):.0f} / "
        f"{at(floor, 0.99):.0f} us; aims 1.3 / 2",
    )


def test_reaction_on_topics(benchmark, figures, client):
    starts = {"plain": [], "hop": []}
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
    floor, ours = benchmark.pedantic(take_turns, args=(client, HOPS, *sides), rounds=1)
    report(figures, "topics", floor, ours)


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
    report(figures, "actions", floor, ours)


def test_idle_server(benchmark, figures, client):
    assert client.spin_until(lambda: client.servers() == 1, PATIENCE_S)
    client.spin_until(lambda: False, 3.0)
    stat = Path(f"/proc/{client.other.pid}/stat")

    def cpu_seconds():
        fields = stat.read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    before = cpu_seconds()
    benchmark.pedantic(lambda: client.spin_until(lambda: False, IDLE_S), rounds=1)
    share = 100 * (cpu_seconds() - before) / IDLE_S
    figures.add("idle mission server, wall clock", f"{share:.2f} % of a core", "aim 0.5 %")
