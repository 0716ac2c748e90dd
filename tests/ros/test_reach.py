"""Who gets in: programs of others on this machine, nobody from another network."""

import itertools
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from sensor_msgs.msg import Image

from florence_bt.ros.environment import IGNORE_FOLDER, LOCALHOST_ONLY, NETWORK, PROFILES, RANGE, THIS_MACHINE
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import SENSOR

pytestmark = pytest.mark.ros

PLAIN = """
import sys
import rclpy
from std_msgs.msg import String

rclpy.init()
node = rclpy.create_node("plain")
publisher = node.create_publisher(String, "question", 10)
heard = []
node.create_subscription(String, "answer", lambda message: heard.append(message.data), 10)
print("plain is there", flush=True)
end = node.get_clock().now().nanoseconds + float(sys.argv[1]) * 1e9
while not heard and node.get_clock().now().nanoseconds < end:
    publisher.publish(String(data="who are you?"))
    rclpy.spin_once(node, timeout_sec=0.1)
print("plain heard", heard, "and sees", sorted(node.get_node_names()), flush=True)
"""
"""A program with nothing of ours: asks until somebody answers."""


ANSWERING = """
from std_msgs.msg import String
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.process import run_nodes
from florence_bt.ros.qos import RELIABLE

class Answering(FlorenceNode):
    def __init__(self):
        super().__init__("answering")
        publisher = self.create_publisher(String, "answer", RELIABLE)

        def answer(question):
            print("asked", question.data, flush=True)
            publisher.publish(String(data="a robot"))

        self.create_subscription(String, "question", answer, RELIABLE)
        self.call_soon(lambda: print("answering is there", flush=True))

run_nodes([Answering])
"""
"""A process of ours that answers every question."""


@pytest.fixture
def answering(start_process):
    """Start it. Fast DDS reads its profiles once in a process: each choice needs a process of its own."""

    def start():
        child = start_process("-c", ANSWERING)
        child.wait_for("answering is there")
        return child

    return start


def variables_of_a_stranger(**variables):
    ours = (PROFILES, RANGE, LOCALHOST_ONLY, IGNORE_FOLDER)
    return {name: value for name, value in os.environ.items() if name not in ours} | variables


@pytest.mark.parametrize("chosen", ["", "SUBNET", "LOCALHOST"])
def test_a_plain_program_on_this_machine_is_answered(answering, start_process, monkeypatch, chosen):
    answering()
    monkeypatch.delenv(PROFILES)
    monkeypatch.setenv(RANGE, chosen)
    child = start_process("-c", PLAIN, "100")
    assert child.process.wait() == 0
    assert "plain heard ['a robot']" in child.output


def test_our_sockets_are_on_the_loopback_and_there_is_no_shared_memory(answering, monkeypatch, tmp_path):
    """Also in a folder with the profiles of somebody else, which Fast DDS would take."""
    shutil.copy(NETWORK, tmp_path / "DEFAULT_FASTRTPS_PROFILES.xml")
    monkeypatch.chdir(tmp_path)
    child = answering()
    inodes = sockets_of(child.process.pid)
    addresses = [
        fields[1].partition(":")[0]
        for line in Path("/proc/net/udp").read_text().splitlines()[1:]
        if (fields := line.split())[9] in inodes
    ]
    assert len(addresses) >= 3
    assert set(addresses) == {"0100007F"}  # 127.0.0.1
    assert "/dev/shm/fastrtps" not in Path(f"/proc/{child.process.pid}/maps").read_text()


def sockets_of(pid):
    """The inodes of the sockets that a process holds."""
    targets = (os.readlink(file) for file in Path(f"/proc/{pid}/fd").iterdir() if file.is_symlink())
    return {target[8:-1] for target in targets if target.startswith("socket:[")}


_namespaces = itertools.count()


@pytest.fixture
def other_network():
    """A network namespace that reaches this one over a cable of its own: (command prefix, our address)."""
    if shutil.which("ip") is None or os.geteuid() != 0:
        pytest.skip("needs root and ip (Debian: iproute2)")
    number = f"{os.getpid() % 100_000}{next(_namespaces)}"
    name, ours, theirs = f"florence-{number}", f"fa{number}", f"fb{number}"
    # 198.18.0.0/15 is for tests of networks (RFC 2544).
    net = f"198.18.{os.getpid() % 250}"
    steps = (
        f"ip netns add {name}",
        f"ip link add {ours} type veth peer name {theirs} netns {name}",
        f"ip addr add {net}.1/24 dev {ours}",
        f"ip link set {ours} up",
        f"ip -n {name} addr add {net}.2/24 dev {theirs}",
        f"ip -n {name} link set {theirs} up",
        f"ip -n {name} link set lo up",
    )
    try:
        for step in steps:
            done = subprocess.run(step.split(), capture_output=True, text=True)
            if done.returncode:
                pytest.skip(f"no network namespaces here: {step}: {done.stderr.strip()}")
        yield ("ip", "netns", "exec", name), f"{net}.1"
    finally:
        subprocess.run(["ip", "netns", "del", name], capture_output=True)


def ask_from(other_network, seconds, **variables):
    """Let a stranger in another network, who knows our address, ask; give what it printed."""
    prefix, address = other_network
    stranger = subprocess.run(
        [*prefix, sys.executable, "-c", PLAIN, str(seconds)],
        env=variables_of_a_stranger(ROS_STATIC_PEERS=address, **variables),
        capture_output=True,
        text=True,
    )
    return stranger.stdout


@pytest.mark.slow
@pytest.mark.parametrize("chosen", ["SUBNET", "LOCALHOST"])
def test_nobody_gets_in_from_another_network(other_network, answering, monkeypatch, chosen):
    monkeypatch.delenv(PROFILES)
    monkeypatch.delenv(RANGE)
    child = answering()
    assert "plain heard [] and sees ['plain']" in ask_from(other_network, 4.0, **{RANGE: chosen})
    assert "asked" not in child.output
    child.wait_for("open to this machine only")


@pytest.mark.slow
def test_the_network_gets_in_when_asked_for(other_network, answering, monkeypatch):
    monkeypatch.setenv(RANGE, "SUBNET")
    child = answering()
    assert "plain heard ['a robot']" in ask_from(other_network, 100.0, **{RANGE: "SUBNET"})
    child.wait_for("open to the network (ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET)")


CAMERA = """
import time
import rclpy
from sensor_msgs.msg import Image
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import SENSOR
from florence_bt.ros.process import run_nodes
from florence_bt.core.clock import call_every

class Camera(FlorenceNode):
    def __init__(self):
        super().__init__("camera")
        publisher = self.create_publisher(Image, "picture", SENSOR)
        picture = Image(width=640, height=480, encoding="32FC1", step=2560, data=bytes(640 * 480 * 4))

        def publish():
            picture.header.stamp = self.get_clock().now().to_msg()
            publisher.publish(picture)

        call_every(self.timebase, 0.05, publish)

run_nodes([Camera])
"""


def test_a_picture_of_640_by_480_floats_gets_through(ros, start_process):
    """1.2 MB, best effort, in 19 datagrams, none of which may be lost."""
    received = []
    node = ros.add(FlorenceNode("viewer"))
    node.create_subscription(Image, "picture", received.append, SENSOR)
    start_process("-c", CAMERA)
    ros.spin_until(lambda: len(received) >= 5, what="five pictures")
    assert len(received[-1].data) == 640 * 480 * 4


def test_security_of_ros_is_handed_on_and_never_left_out(start_process, monkeypatch, tmp_path):
    """The middleware of the Python packages has no security; it must not run without."""
    enclave = tmp_path / "enclaves" / "florence"
    enclave.mkdir(parents=True)
    for variable, value in {
        "ENABLE": "true",
        "STRATEGY": "Enforce",
        "KEYSTORE": str(tmp_path),
        "ENCLAVE_OVERRIDE": "/florence",
    }.items():
        monkeypatch.setenv(f"ROS_SECURITY_{variable}", value)
    child = start_process("-c", ANSWERING)
    child.process.wait()
    assert "security" in child.output.lower()
    assert "answering is there" not in child.output


def test_a_process_tells_who_can_reach_it(start_process, monkeypatch):
    child = start_process("-c", CAMERA)
    child.wait_for("open to this machine only")
    monkeypatch.setenv(PROFILES, str(Path(THIS_MACHINE).parent / ".." / "ros" / "this_machine.xml"))
    other = start_process("-c", CAMERA)
    other.wait_for("open to what the Fast DDS profiles in")
