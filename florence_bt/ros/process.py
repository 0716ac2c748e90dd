"""A process of ROS nodes, from start to an orderly end."""

from __future__ import annotations

import gc
import inspect
import math
import signal
import socket
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Protocol

import rclpy
import rclpy.logging

from florence_bt.core.clock import call_every
from florence_bt.core.errors import FlorenceError
from florence_bt.ros.arguments import start_ros
from florence_bt.ros.executor import SpinLoop
from florence_bt.ros.node import FlorenceNode

NodeFactory = Callable[[], FlorenceNode]


class Beat(Protocol):
    """Says that this process answers; with ``long_work`` that it will not for up to a minute."""

    def __call__(self, *, long_work: bool = False) -> None:
        """Say it."""


def _no_beat(*, long_work: bool = False) -> None:
    """Do nothing: nobody watches this process."""


LEAVE_BUDGET_S = 2.0
"""Seconds to wait for the last answers when the nodes are closed, e.g. that a goal will end."""
READY_PERIOD_S, READY_LATE_SHARE, LONGEST_READY_PERIOD_S = 0.05, 0.05, 1.0
"""Period of looking whether every node has found what it needs: it is noticed at most this share of the time
late that it took, and costs next to nothing where something stays missing."""
BEAT_PERIOD_S = 0.25
"""Steady seconds between two heartbeats."""


def run_nodes(
    factories: Sequence[NodeFactory],
    *,
    remappings: Sequence[str] = (),
    on_ready: Callable[[], None] = lambda: None,
    beat: Beat = _no_beat,
) -> int:
    """Build nodes and serve them until SIGINT or SIGTERM; close every one of them in the end.

    Talks to this machine only, unless the environment asks for more (:mod:`florence_bt.ros.environment`).

    Args:
        factories: Make the nodes, in this order, when ROS is ready. They are closed in the opposite order.
        remappings: Rules such as ``node:from:=to``, for every node of the process, before those of its ROS
            arguments.
        on_ready: Called once, when all nodes are there and none of them misses anything any more.
        beat: Called every :data:`BEAT_PERIOD_S` or more often from then on, until the nodes are gone, on the
            thread that serves the callbacks: without it the process counts as one that does not answer. A
            callback that takes long says so before (``FlorenceNode.before_long_work``).

    Returns:
        The exit code: 0 after an end that was asked for, 1 when a node could not be made, was of no use any
        more or failed while it was closed. What went wrong is on the standard error. A callback that fails
        ends nothing: see :meth:`FlorenceNode.fail`.
    """
    reach = start_ros(first=remappings)
    rclpy.logging.get_logger("florence_bt").info(f"open to {reach.text}")
    loop = SpinLoop(keep_going=True)
    nodes: list[FlorenceNode] = []
    heartbeat = _Heartbeat(beat)
    failed = False

    with _asked_to_end(loop) as asked:
        try:
            for make in factories:
                nodes.append(make())
                nodes[-1].before_long_work = partial(beat, long_work=True)
                loop.add(nodes[-1])
                problem = nodes[-1].unknown_parameters()
                if problem is not None:
                    raise problem
            # The first log line of rclpy finds the file of every module: 55 ms that must not come in a drive.
            inspect.getmodule(run_nodes.__code__)
            # What lives as long as the process is not looked at by the garbage collector any more.
            gc.collect()
            gc.freeze()
            if nodes:
                when_ready(nodes, partial(_ready, nodes[0], on_ready, heartbeat), asked)
            heartbeat.keep()
            while not asked():
                loop.spin_once()
                heartbeat.keep()
        except Exception as error:
            failed = True
            _report(error)
        failed |= not _close(loop, nodes, beat)
    return 1 if failed else 0


class _Heartbeat:
    """Beats while events are handled: between two of them, and from a timer while there are none.

    The timer alone would not do: on a busy machine its turn comes after everything that waits already.
    """

    def __init__(self, beat: Beat) -> None:
        self._beat = beat
        self._due = math.inf

    def start(self, node: FlorenceNode) -> None:
        """Beat from now on."""
        self._due = -math.inf
        call_every(node.steady, BEAT_PERIOD_S, self.keep, start=node.steady.now())

    def keep(self) -> None:
        """Beat, unless the last beat was a moment ago."""
        now = time.monotonic()
        if now >= self._due:
            self._due = now + BEAT_PERIOD_S / 2
            self._beat()


def _ready(node: FlorenceNode, on_ready: Callable[[], None], heartbeat: _Heartbeat) -> None:
    on_ready()
    heartbeat.start(node)


def when_ready(
    nodes: Sequence[FlorenceNode], ready: Callable[[], None], asked_to_end: Callable[[], bool]
) -> None:
    """Call ``ready`` once no node misses anything; looks now and then, on the loop of the first node.

    Discovery reports nothing by itself.

    Args:
        nodes: At least one.
        ready: What to call, unless the process is asked to end before.
        asked_to_end: Whether it is.
    """
    steady = nodes[0].steady
    began = steady.now()

    def look() -> None:
        if asked_to_end():
            return
        if any(node.missing() for node in nodes):
            now = steady.now()
            late = READY_LATE_SHARE * (now - began)
            steady.call_at(now + min(max(READY_PERIOD_S, late), LONGEST_READY_PERIOD_S), look)
        else:
            ready()

    steady.call_at(steady.now(), look)


def _close(loop: SpinLoop, nodes: Sequence[FlorenceNode], beat: Beat) -> bool:
    """Close every node, the latest first; whether all of it went well."""
    went_well = True
    for node in reversed(nodes):
        beat()
        try:
            node.shut_down()
        except Exception as error:
            went_well = False
            _report(error)
    try:
        # Last commands and results leave before the nodes go.
        end = time.monotonic() + LEAVE_BUDGET_S
        while not all(node.may_leave() for node in nodes) and time.monotonic() < end:
            loop.spin_once(0.02)
        loop.drain()
    except Exception as error:
        went_well = False
        _report(error)
    loop.close()
    for node in reversed(nodes):
        beat()
        node.destroy_node()
    beat()
    rclpy.try_shutdown()
    return went_well


def _report(error: Exception) -> None:
    if isinstance(error, FlorenceError):
        print(f"error: {error}", file=sys.stderr, flush=True)
    else:
        traceback.print_exception(error)


@contextmanager
def _asked_to_end(loop: SpinLoop) -> Iterator[Callable[[], bool]]:
    """Catch SIGINT and SIGTERM while the block runs; gives a function that says whether one came.

    The executor waits in C++, where Python's handlers do not run. The wake-up socket is written at once
    anyway, and a thread that reads it interrupts the wait.
    """
    asked = threading.Event()
    reader, writer = socket.socketpair()
    writer.setblocking(False)

    def watch() -> None:
        while reader.recv(1):
            loop.interrupt()

    thread = threading.Thread(target=watch, name="signals", daemon=True)
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    before_fd = signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
    for number in before:
        signal.signal(number, lambda *_: asked.set())
    thread.start()
    try:
        yield asked.is_set
    finally:
        signal.set_wakeup_fd(before_fd)
        for number, handler in before.items():
            signal.signal(number, handler)
        writer.close()
        thread.join()
        reader.close()
