"""The node ``groot``: listens to the running tree, and answers Groot2 at a port of this machine."""

from __future__ import annotations

import time

import zmq
from py_trees_ros_interfaces.msg import Behaviour, BehaviourTree
from zmq.auth.thread import ThreadAuthenticator

from florence_bt.core.clock import call_every
from florence_bt.core.errors import ConfigError
from florence_bt.core.topic_names import SNAPSHOTS
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.process import run_nodes
from florence_bt.ros.qos import LATCHED
from florence_btcpp.groot.protocol import Monitor
from florence_btcpp.groot.tree import FAILURE, IDLE, RUNNING, SUCCESS, WatchedNode

LOOK_S = 0.02
"""Seconds between two looks for requests; clients ask some ten times a second."""
LARGEST_REQUEST = 65_536
HANDSHAKE_MS = 2_000
"""Milliseconds for the handshake of ZeroMQ: who does not finish it is sent away."""
_STATUSES = {Behaviour.RUNNING: RUNNING, Behaviour.SUCCESS: SUCCESS, Behaviour.FAILURE: FAILURE}
_CATEGORIES = {Behaviour.BEHAVIOUR: "Action", Behaviour.DECORATOR: "Decorator"}


class GrootNode(FlorenceNode):
    """Shows Groot2 what the mission server tells the watchers of the py_trees ecosystem.

    Args:
        port: The TCP port of 127.0.0.1.

    Raises:
        ConfigError: The port is taken.
    """

    def __init__(self, port: int) -> None:
        sockets, guard, self._socket = _bound(port)
        super().__init__("groot")
        self._monitor = Monitor(lambda: time.time_ns() // 1000, lambda: time.monotonic_ns() // 1000)
        self.on_close(sockets.destroy)
        self.on_close(guard.stop)
        self.create_subscription(BehaviourTree, SNAPSHOTS, self._on_tree, LATCHED)
        self.on_close(call_every(self.steady, LOOK_S, self._answer_all).cancel)

    def _on_tree(self, message: BehaviourTree) -> None:
        nodes = [_watched(each) for each in message.behaviours]
        if nodes:
            keys = {each.key: each.value for each in message.blackboard_on_visited_path}
            self._monitor.show(nodes, keys)

    def _answer_all(self) -> None:
        while self._socket.poll(0):
            self._socket.send_multipart(self._monitor.answer(self._socket.recv_multipart()))


def _bound(port: int) -> tuple[zmq.Context[zmq.Socket[bytes]], ThreadAuthenticator, zmq.Socket[bytes]]:
    """Take the port, behind what ZeroMQ has of a guard.

    With an authenticator it speaks with nobody who does not finish the handshake of ZMTP 3. Without one it
    takes the bytes of an HTTP request, which any web site can have sent here, for ZMTP 1 and a message.
    """
    context = zmq.Context()
    guard = ThreadAuthenticator(context)
    guard.start()
    guard.allow("127.0.0.1")
    answers = context.socket(zmq.REP)
    answers.setsockopt(zmq.LINGER, 0)
    answers.setsockopt(zmq.MAXMSGSIZE, LARGEST_REQUEST)
    answers.setsockopt(zmq.HANDSHAKE_IVL, HANDSHAKE_MS)
    answers.setsockopt(zmq.ZAP_DOMAIN, b"groot")
    try:
        answers.bind(f"tcp://127.0.0.1:{port}")
    except zmq.ZMQError as error:
        guard.stop()
        context.destroy()
        raise ConfigError(
            f"the port {port} cannot be used: {error}", valid=["another one, with --port"]
        ) from error
    return context, guard, answers


def _watched(node: Behaviour) -> WatchedNode:
    return WatchedNode(
        bytes(node.own_id.uuid),
        node.name,
        node.class_name.rpartition(".")[2],
        _CATEGORIES.get(node.type, "Control"),
        node.additional_detail == "WithMemory",
        tuple(bytes(each.uuid) for each in node.child_ids),
        _STATUSES.get(node.status, IDLE),
    )


def serve_groot(port: int) -> int:
    """Answer Groot2 until Ctrl-C.

    Args:
        port: The TCP port of 127.0.0.1.

    Returns:
        The exit code.
    """

    def make() -> GrootNode:
        node = GrootNode(port)
        print(f"connect Groot2 to localhost, port {port}; Ctrl-C ends it", flush=True)
        return node

    return run_nodes([make])
