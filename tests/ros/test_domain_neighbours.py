"""Whether another process may be in our ROS domain, by the sockets of the kernel."""

from __future__ import annotations

import pytest

pytest.importorskip("rclpy")

from florence_bt.ros.domain_neighbours import DomainNeighbours
from florence_bt.ros.environment import Reach
from florence_bt.ros.node import FlorenceNode
from tests.ros.conftest import FIRST_PORT, PORTS_OF_DOMAIN

pytestmark = pytest.mark.ros
HERE = Reach("this machine only", this_machine=True)


def test_who_is_in_the_domain_or_comes_into_it_is_noticed(ros):
    alone, reached = DomainNeighbours(), DomainNeighbours()
    alone.started(HERE)
    reached.started(Reach("the network"))
    assert alone.certainly_none()
    assert not reached.certainly_none(), "somebody on another machine may be there"
    ros.add(FlorenceNode("newcomer"))
    assert not alone.certainly_none()
    late = DomainNeighbours()
    late.started(HERE)
    assert not late.certainly_none()


def test_who_came_while_ros_started_is_not_taken_for_ourselves(ros_domain, start_process):
    ours = DomainNeighbours()
    port = FIRST_PORT + PORTS_OF_DOMAIN * ros_domain
    program = f"port = socket(type=SOCK_DGRAM)\nport.bind(('127.0.0.1', {port}))\nprint('bound')\npause()"
    other = start_process("-c", f"from signal import pause\nfrom socket import *\n{program}")
    other.wait_for("bound")
    ours.started(HERE)
    assert not ours.certainly_none()


def test_a_domain_that_is_no_number_tells_nothing(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "seven")
    unknown = DomainNeighbours()
    unknown.started(HERE)
    assert not unknown.certainly_none()
