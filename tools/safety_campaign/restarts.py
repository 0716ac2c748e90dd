"""Kills a process and starts it again, many times, beside peers that live on; counts unreachable ones.

``python tools/safety_campaign/restarts.py --count 200``. A restarted process is unreachable when it does not
get what the peers say to it, or a peer does not get what it says. With the shared memory of Fast DDS
(``--shared-memory``) some are: processes that live on keep a port mapped that was deleted and made again
(Fast DDS issues 5053 and 5469).
"""

from __future__ import annotations

import argparse
import os
import random
import re
import select
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

PEERS = 3
UNREACHABLE_AFTER_S = 30.0
"""Wall seconds since ROS began in a process, on a busy machine; an unreachable process stays so."""
START_S = 300.0
"""Wall seconds for Python and ROS to start."""
LONGEST_LIFE_S = 0.5
"""A process that has heard its peers is killed within this time."""


@dataclass
class Report:
    """The outcome of the restarts.

    Attributes:
        restarts: How many.
        unreachable: Numbers of the restarts after which the process stayed unreachable.
        seconds: For each other one, from its first node to the moment when all peers had repeated its name.
        left_behind: Files of shared memory that a killed process has left.
    """

    restarts: int = 0
    unreachable: list[int] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    left_behind: set[str] = field(default_factory=set)

    def __str__(self) -> str:
        """Write one line for people."""
        text = (
            f"{self.restarts} restarts: {len(self.unreachable)} unreachable {self.unreachable or ''}".rstrip()
        )
        if self.seconds:
            median, longest = statistics.median(self.seconds), max(self.seconds)
            text += f"; reached after {median:.2f} s (median), {longest:.2f} s (longest)"
        return f"{text}; {len(self.left_behind)} files left in /dev/shm"


Start = Callable[..., "subprocess.Popen[str]"]


def restart_many(
    count: int, seed: int, *, budget_s: float = float("inf"), shared_memory: bool = False
) -> Report:
    """Kill and start a process again and again, in the ROS domain of this process.

    Args:
        count: How many restarts.
        seed: Start of the random moments of the kills; one in four comes while a process still starts.
        budget_s: Wall seconds after which no further one is begun.
        shared_memory: Use the transports of Fast DDS in place of ours.

    Raises:
        RuntimeError: A process does not start.
    """
    chance = random.Random(seed)
    end = time.monotonic() + budget_s
    report = Report()
    with _processes(shared_memory=shared_memory) as start:
        for number in range(PEERS):
            _line(start("peer", str(number)), START_S)
        while report.restarts < count and time.monotonic() < end:
            if chance.random() < 0.25:
                early = start("victim", f"early-{seed}-{report.restarts}")
                time.sleep(chance.uniform(0.2, 1.5))
                early.kill()
            report.restarts += 1
            victim = start("victim", f"{seed}-{report.restarts}")
            _line(victim, START_S)
            heard = _line(victim, UNREACHABLE_AFTER_S)
            if heard:
                report.seconds.append(float(heard))
                time.sleep(chance.uniform(0.0, LONGEST_LIFE_S))
            else:
                report.unreachable.append(report.restarts)
            shared = set(re.findall("/dev/shm/fastrtps.*", Path(f"/proc/{victim.pid}/maps").read_text()))
            victim.kill()
            victim.wait()
            report.left_behind |= {file for file in shared if Path(file).exists()}
    return report


@contextmanager
def _processes(*, shared_memory: bool) -> Iterator[Start]:
    """Start processes of this file; all are killed in the end."""
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    if shared_memory:
        environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "SYSTEM_DEFAULT"
        environment.pop("FASTRTPS_DEFAULT_PROFILES_FILE", None)
    started: list[subprocess.Popen[str]] = []

    def start(*role: str) -> subprocess.Popen[str]:
        command = [sys.executable, __file__, "--role", *role]
        started.append(
            subprocess.Popen(
                command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
            )
        )
        return started[-1]

    try:
        yield start
    finally:
        for process in started:
            process.kill()
            process.communicate()


def _line(process: subprocess.Popen[str], budget_s: float) -> str:
    """Read the next line that a process prints, empty when none comes in time."""
    assert process.stdout is not None
    if not select.select([process.stdout], [], [], budget_s)[0]:
        return ""
    line = process.stdout.readline()
    if not line:
        raise RuntimeError(f"{' '.join(map(str, process.args))} ended with code {process.wait()}")  # type: ignore[arg-type]
    return line


def _serve(role: str, name: str) -> int:
    """Be a peer, which repeats what it hears, or the victim, which waits until every peer has done so."""
    from std_msgs.msg import String

    from florence_bt.ros.node import FlorenceNode
    from florence_bt.ros.process import run_nodes
    from florence_bt.ros.qos import LATCHED, TF_STATIC_LISTENER

    class Peer(FlorenceNode):
        def __init__(self) -> None:
            super().__init__(f"peer_{name}")
            echo = self.create_publisher(String, "restarts/echo", LATCHED)

            def repeat(message: String) -> None:
                echo.publish(String(data=f"{message.data} {name}"))

            self.create_subscription(String, "restarts/hello", repeat, TF_STATIC_LISTENER)
            print("ROS has begun", flush=True)

    class Victim(FlorenceNode):
        def __init__(self) -> None:
            super().__init__("victim")
            self._peers: set[str] = set()
            self._begin = self.steady.now()
            self.create_subscription(String, "restarts/echo", self._on_echo, TF_STATIC_LISTENER)
            self.create_publisher(String, "restarts/hello", LATCHED).publish(String(data=name))
            print("ROS has begun", flush=True)

        def _on_echo(self, message: String) -> None:
            victim, peer = message.data.split()
            if victim == name and peer not in self._peers:
                self._peers.add(peer)
                if len(self._peers) == PEERS:
                    print(self.steady.now() - self._begin, flush=True)

    return run_nodes([Peer if role == "peer" else Victim])


def main() -> int:
    """Run the restarts; 1 when a process stayed unreachable or left something behind."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--minutes", type=float, default=float("inf"), help="begin no restart after this time"
    )
    parser.add_argument("--shared-memory", action="store_true", help="with the transports of Fast DDS itself")
    parser.add_argument("--role", nargs=2, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.role:
        return _serve(*chosen.role)
    report = restart_many(
        chosen.count, chosen.seed, budget_s=60.0 * chosen.minutes, shared_memory=chosen.shared_memory
    )
    print(report)
    return 1 if report.unreachable or report.left_behind else 0


if __name__ == "__main__":
    sys.exit(main())
