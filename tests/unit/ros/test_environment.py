"""Who can reach our nodes, by what the environment of the process says."""

import os
import xml.etree.ElementTree as ElementTree

import pytest

from florence_bt.ros.environment import (
    IGNORE_FOLDER,
    LOCALHOST_ONLY,
    NETWORK,
    PROFILES,
    RANGE,
    THIS_MACHINE,
    reach_of,
    stay_on_this_machine,
)

LOCAL = {RANGE: "SYSTEM_DEFAULT", PROFILES: THIS_MACHINE, IGNORE_FOLDER: "1"}


def environment_after(environment):
    """The environment with what is set and removed for its reach."""
    changed = {**environment, **reach_of(environment).variables}
    return {name: value for name, value in changed.items() if value is not None}


@pytest.mark.parametrize(
    "environment",
    [{}, {RANGE: ""}, {RANGE: "LOCALHOST"}, {LOCALHOST_ONLY: "1", RANGE: "SUBNET"}, LOCAL],
    ids=["nothing", "empty", "localhost", "deprecated", "inherited"],
)
def test_nobody_else_gets_in_unless_asked_for(environment):
    assert environment_after(environment) == LOCAL
    assert reach_of(environment).this_machine


@pytest.mark.parametrize("profiles", [{}, {PROFILES: THIS_MACHINE}], ids=["fresh", "inherited"])
def test_the_network_has_a_profile_too(profiles):
    environment = {RANGE: "SUBNET", **profiles}
    assert environment_after(environment) == {RANGE: "SUBNET", PROFILES: NETWORK, IGNORE_FOLDER: "1"}
    assert reach_of(environment).text == "the network (ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET)"
    assert environment_after(environment_after(environment)) == environment_after(environment)


@pytest.mark.parametrize("chosen", ["OFF", "SYSTEM_DEFAULT"])
def test_other_ranges_are_left_as_they_are(chosen):
    assert environment_after({RANGE: chosen}) == {RANGE: chosen}
    assert not reach_of({RANGE: chosen}).this_machine


def test_a_profile_of_the_user_is_left_and_named():
    environment = {PROFILES: "/home/me/fast.xml"}
    assert environment_after(environment) == {PROFILES: "/home/me/fast.xml", RANGE: "LOCALHOST"}
    reach = reach_of({**environment, RANGE: "SUBNET"})
    assert "/home/me/fast.xml" in reach.text and not reach.this_machine


def test_another_middleware_gets_the_range_and_no_claim():
    environment = {"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}
    assert environment_after(environment)[RANGE] == "LOCALHOST"
    assert "rmw_cyclonedds_cpp" in reach_of(environment).text
    assert not reach_of(environment).this_machine


def test_the_process_gets_it(monkeypatch):
    monkeypatch.setenv(RANGE, "LOCALHOST")
    monkeypatch.setenv(PROFILES, "")
    monkeypatch.setenv(LOCALHOST_ONLY, "1")
    monkeypatch.setenv(IGNORE_FOLDER, "0")
    assert stay_on_this_machine().this_machine
    assert os.environ[RANGE] == "SYSTEM_DEFAULT"
    assert os.environ[PROFILES] == THIS_MACHINE
    assert LOCALHOST_ONLY not in os.environ


@pytest.mark.parametrize("file", [THIS_MACHINE, NETWORK])
def test_the_profiles_use_no_shared_memory(file):
    kinds = [element.text for element in ElementTree.parse(file).iter() if element.tag.endswith("}type")]
    assert kinds == ["UDPv4"]
