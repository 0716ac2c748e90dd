"""A person has stopped the robot, or drives it by hand, and something hangs or dies."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from typing import Any

import pytest

from tests.ros.conftest import own_domain

pytestmark = [
    pytest.mark.ros,
    pytest.mark.slow,
    pytest.mark.timeout(1800),
    pytest.mark.xdist_group("taken over"),
]

PATIENCE_S = 300.0
WATCH_S = 5.0
"""Longer than navigation needs to drive off once it has a goal: 1 s."""


class Person:
    """Somebody beside the robot."""

    def __init__(self, system: Any) -> None:
        from florence_interfaces.srv import PauseMission, ResumeMission
        from geometry_msgs.msg import Twist, Vector3

        from florence_bt.ros.qos import RELIABLE

        self._system = system
        self._pause, self._resume = PauseMission, ResumeMission
        self._by_hand = system.node.create_publisher(Twist, "manual_cmd_vel", RELIABLE)
        self._turn = Twist(angular=Vector3(z=0.5))

    def asks(self, name: str, **fields: Any) -> None:
        kind = {"pause": self._pause, "resume": self._resume}[name]
        client = self._system.node.create_client(kind, f"florence_bt/{name}")
        self._system.wait(client.service_is_ready, name)
        future = client.call_async(kind.Request(**fields))
        self._system.wait(future.done, name)
        assert future.result().success, future.result().message

    def switches_override(self, on: bool) -> None:
        self._system.forget()
        self._system.switch.publish(_bool(on))
        self._system.wait(lambda: self._system.overridden is on, f"the override {on}")

    def lets_go(self) -> None:
        """Take the hand from the stick; some commands may be lost."""
        for _ in range(10):
            self._by_hand.publish(type(self._turn)())
            self._system.spin(0.05)

    def turns_by_hand(self, done: Any) -> list[bool]:
        """Command a turn 20 times a second until something is so; whether the wheels turned, at each look."""
        system, turned = self._system, []
        for _ in range(int(PATIENCE_S * 20)):
            self._by_hand.publish(self._turn)
            system.spin(0.05)
            turned.append(any(system.truth["wheels"]))
            if done():
                return turned
        raise AssertionError(f"it never came:\n{system.output}")


def looks(number: int) -> Any:
    """True after so many looks, which take a second together."""
    return iter([False] * number + [True]).__next__


def mostly(turned: list[bool]) -> bool:
    """Whether the wheels turned; on a busy machine commands come late now and then, and the base stops."""
    return sum(turned) > len(turned) / 2


def _bool(on: bool) -> Any:
    from std_msgs.msg import Bool

    return Bool(data=on)


def stands(system: Any) -> None:
    """Nobody moves the robot."""
    system.spin_until(lambda: not system.truth["moving"], PATIENCE_S)
    system.forget()
    system.spin(WATCH_S)
    assert not any(truth["moving"] for truth in system.truths), system.output


def after_the_death_of_the_mission_server(system: Any, action: Any = lambda: None) -> None:
    count = system.output.count("is up again")
    system.send("missions", signal.SIGKILL)
    action()
    system.wait(lambda: system.output.count("is up again") > count, "the mission server", PATIENCE_S)
    system.wait(lambda: not system.status().blocked_by, "the end of the recovery", PATIENCE_S)


@pytest.fixture(scope="module")
def system() -> Iterator[Any]:
    """The system that the tests here share, in their order."""
    pytest.importorskip("rclpy")
    from tools.safety_campaign.running_system import RunningSystem

    with own_domain(), RunningSystem(5) as running:
        yield running


def test_nothing_drives_off_after_a_crash_that_a_person_had_stopped(system: Any) -> None:
    person = Person(system)
    system.drive_by_mission()  # its on_restart says restart
    system.wait(lambda: system.truth["moving"], "the drive", PATIENCE_S)
    person.asks("pause", reason="a visitor")
    after_the_death_of_the_mission_server(system)
    stands(system)
    assert (system.status().state, system.status().reason) == ("PAUSED", "a visitor")
    person.asks("resume")
    system.wait(lambda: system.truth["moving"], "the drive", PATIENCE_S)

    def override_comes_and_goes() -> None:
        person.switches_override(True)
        person.switches_override(False)

    after_the_death_of_the_mission_server(system, override_comes_and_goes)
    stands(system)
    assert "manual override" in system.status().reason


def test_a_person_drives_by_hand_while_something_hangs(system: Any) -> None:
    person = Person(system)
    system.drive_by_mission()
    system.wait(lambda: system.truth["moving"], "the drive", PATIENCE_S)
    person.switches_override(True)
    turning = lambda: any(system.truth["wheels"])  # noqa: E731
    person.turns_by_hand(turning)
    system.send("navigation", signal.SIGSTOP)
    person.turns_by_hand(lambda: "the process 'navigation' has not answered" in system.output)
    back = system.output.count("the robot may drive again")
    assert mostly(person.turns_by_hand(looks(20)))
    system.send("navigation", signal.SIGCONT)
    person.turns_by_hand(lambda: system.output.count("the robot may drive again") > back)
    ups = system.output.count("'missions' is up again")
    system.send("missions", signal.SIGSTOP)  # until it is killed, and started again
    assert mostly(person.turns_by_hand(lambda: system.output.count("'missions' is up again") > ups))

    system.wait(lambda: not system.status().blocked_by.startswith("the robot"), "the recovery", PATIENCE_S)
    system.send("people", signal.SIGSTOP)
    hangs = system.output.count("'people' has not answered")
    person.turns_by_hand(lambda: system.output.count("'people' has not answered") > hangs)
    person.switches_override(False)
    system.spin_until(lambda: not any(system.truth["wheels"]), PATIENCE_S)
    turned = person.turns_by_hand(looks(20))
    assert not any(turned[1:]), "nobody drives after the release as long as the robot is held"
    person.switches_override(True)
    person.lets_go()  # who pushes while somebody stops the robot does not drive on
    person.turns_by_hand(turning)
    # Killed after 5 s, and started again; the hand drives meanwhile.
    assert mostly(person.turns_by_hand(lambda: "'people' is up again" in system.output))
