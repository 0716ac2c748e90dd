"""Groot2 and its like see the mission that runs: btview, another people's client, against our port."""

from __future__ import annotations

import contextlib
import socket
import threading

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.mission_testing.mocks.mocks import Step
from tests.script_process import free_port

zmq = pytest.importorskip("zmq", reason="pyzmq is not here (extra groot of florence-btcpp)")
pytest.importorskip("msgpack", reason="msgpack is not here (extra groot of florence-btcpp)")
pytest.importorskip("rclpy")

from florence_btcpp.groot.node import GrootNode  # noqa: E402

pytestmark = pytest.mark.ros

SHOWN = (
    "mission: shown\ninputs:\n  way: {type: length, default: 1 m}\n"
    "tree:\n  sequence:\n    - set: {far: $way}\n    - drive: {way: $far}\n"
)


def asked(bench, question):
    """Ask from another thread, as the client's calls wait, and serve the nodes meanwhile."""
    answers = []
    thread = threading.Thread(target=lambda: answers.append(question()), daemon=True)
    thread.start()
    bench.ros.spin_until(lambda: answers or not thread.is_alive(), what="the answer")
    assert answers, "the client failed"
    return answers[0]


def test_btview_shows_the_mission_that_runs(bench_of):
    client_module = pytest.importorskip("btview.client", reason="btview is not here")
    bench = bench_of(Step(None))
    (bench.missions / "shown.yaml").write_text(SHOWN)
    port = free_port()
    bench.ros.add(GrootNode(port))
    client = client_module.Groot2Client(port=port, timeout_ms=30_000)
    try:
        bench.run("shown", way="2 m")
        bench.ros.spin_until(lambda: bench.drive.runs, what="the drive")

        def status_of(name):
            statuses = asked(bench, client.poll).statuses
            tree = asked(bench, client.fetch_tree)
            number = next(each.uid for each in tree.walk() if each.name == name)
            return statuses[number].status.name

        bench.ros.spin_until(
            lambda: bench.node.count_subscribers("florence_bt/snapshots"), what="the watcher"
        )
        assert (status_of("shown"), status_of("set far"), status_of("drive")) == (
            "RUNNING",
            "SUCCESS",
            "RUNNING",
        )
        assert asked(bench, lambda: client.fetch_blackboard(["shown"]))["shown"]["far"] == "2 m"
    finally:
        client.close()


def test_a_request_that_is_none_harms_nobody_and_a_port_that_is_taken_is_told(ros):
    port = free_port()
    ros.add(GrootNode(port))
    with pytest.raises(ConfigError, match="another one, with --port"):
        GrootNode(port)
    with zmq.Context() as context, context.socket(zmq.REQ) as client:
        client.setsockopt(zmq.LINGER, 0)
        client.connect(f"tcp://127.0.0.1:{port}")
        for request in ([b"nonsense"], [b""], [b"\x02T\0\0\0\0", b"more"] * 3):
            client.send_multipart(request)
            ros.spin_until(lambda: client.poll(0), what="the answer")
            assert client.recv_multipart()[0] == b"error"


def test_what_a_web_site_sends_is_no_message(ros):
    """A form of any site can post these bytes: for ZMTP 1 they were messages, and were answered."""
    port = free_port()
    node = GrootNode(port)
    ros.add(node)
    body = b"\x01\x00" + b"\x03\x00AB" * 50
    with socket.create_connection(("127.0.0.1", port), timeout=30) as site:
        site.sendall(b"POST / HTTP/1.1\r\nHost: localhost\r\nOrigin: http://evil.example\r\n\r\n" + body)
        with contextlib.suppress(ConnectionResetError):
            while site.recv(1000):
                pass
    assert not node._socket.poll(200)
