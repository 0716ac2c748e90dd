"""The doctor: every check on a made-up machine, good and bad, and the table."""

from __future__ import annotations

import importlib.metadata
import io
import json
import os
from datetime import UTC, datetime

import pytest
from rich.console import Console

from florence_bt.app.bringup.topology import DEVICE_NODES, NODES
from florence_bt.app.doctor import examination
from florence_bt.app.doctor.finding import (
    HealthFinding,
    HealthLevel,
    as_json,
    good,
    healthy,
    note,
    print_table,
    problem,
    summary,
    warning,
)
from florence_bt.app.doctor.graph import GraphView, check_graph, check_settings, is_partial, missing_nodes
from florence_bt.app.doctor.libraries import LIBRARIES, check_libraries
from florence_bt.app.doctor.machine import NOT_SYNCHRONISED, check_machine
from florence_bt.app.doctor.ports import check_ports, users_of
from florence_bt.app.doctor.usb import check_usb

TODAY = datetime(2026, 5, 4, 12, 0, tzinfo=UTC)


def by_item(findings) -> dict[str, HealthFinding]:
    return {finding.item: finding for finding in findings}


def newest(name: str) -> str:
    return ".".join(str(part) for part in next(x for x in LIBRARIES if x.name == name).least)


def test_libraries_that_are_all_there():
    findings = by_item(check_libraries(newest, lambda name: "libfreenect.so.0.5"))
    assert all(f.level is HealthLevel.OK for name, f in findings.items() if name != "Python")
    assert set(findings) == {"Python", "libfreenect", *(library.name for library in LIBRARIES)}


def test_missing_and_old_libraries(monkeypatch):
    def version(name: str) -> str:
        if name in ("numba", "PyYAML"):
            raise importlib.metadata.PackageNotFoundError(name)
        return "1.25.9" if name == "numpy" else newest(name)

    findings = by_item(check_libraries(version, lambda name: None))
    assert findings["PyYAML"].level is HealthLevel.PROBLEM
    assert findings["numba"].level is HealthLevel.WARNING
    assert findings["numba"].advice == "make setup"
    monkeypatch.setattr("florence_bt.app.doctor.libraries.in_checkout", lambda: False)
    findings_of_wheel = by_item(check_libraries(version, lambda name: None))
    assert findings_of_wheel["numba"].advice == "pip install 'numba>=0.60'"
    assert "1.25.9 is too old" in findings["numpy"].found
    assert "apt install libfreenect0.5" in findings["libfreenect"].advice


@pytest.mark.parametrize(
    ("free", "level"),
    [(5 << 30, HealthLevel.OK), (500 << 20, HealthLevel.WARNING), (1 << 20, HealthLevel.PROBLEM)],
)
def test_room_on_the_disk(tmp_path, free, level):
    findings = by_item(check_machine(tmp_path / "not" / "yet", lambda path: free, lambda: TODAY, lambda: 0))
    assert findings["disk"].level is level and str(tmp_path) in findings["disk"].found


@pytest.mark.parametrize(
    ("now", "state", "level"),
    [
        (TODAY, 0, HealthLevel.OK),
        (TODAY, None, HealthLevel.OK),
        (TODAY, NOT_SYNCHRONISED, HealthLevel.NOTE),
        (datetime(1970, 1, 1, tzinfo=UTC), NOT_SYNCHRONISED, HealthLevel.PROBLEM),
    ],
)
def test_clock(tmp_path, now, state, level):
    findings = by_item(check_machine(tmp_path, lambda path: 5 << 30, lambda: now, lambda: state))
    assert findings["clock"].level is level


def test_the_real_machine_can_be_asked(tmp_path):
    findings = by_item(check_machine(tmp_path))
    assert findings["disk"].level is not HealthLevel.PROBLEM
    assert "clock" in findings and "compiled code" in findings


@pytest.fixture
def terminal():
    """A real serial device: one end of a pseudo-terminal."""
    ours, theirs = os.openpty()
    yield os.ttyname(theirs)
    os.close(ours)
    os.close(theirs)


def process_with(proc, pid, name, *files):
    folder = proc / str(pid)
    (folder / "fd").mkdir(parents=True)
    (folder / "comm").write_text(f"{name}\n")
    for number, file in enumerate(files):
        (folder / "fd" / str(number)).symlink_to(file)


def test_a_port_that_is_fine(tmp_path, terminal):
    (tmp_path / "base").symlink_to(terminal)
    findings = list(check_ports({"turtlebot_node": str(tmp_path / "base")}, processes=tmp_path))
    assert [f.level for f in findings] == [HealthLevel.OK] and terminal in findings[0].found


def test_a_port_that_is_not_there_names_those_that_are(tmp_path):
    (tmp_path / "usb-FTDI").touch()
    (finding,) = check_ports({"turtlebot_node": "/dev/not_there"}, by_id=tmp_path)
    assert finding.level is HealthLevel.PROBLEM and "usb-FTDI" in finding.advice


def test_a_port_that_is_a_file(tmp_path):
    (tmp_path / "base").touch()
    (finding,) = check_ports({"turtlebot_node": str(tmp_path / "base")})
    assert finding.level is HealthLevel.PROBLEM and "not a serial device" in finding.found


def test_a_port_that_is_not_allowed(terminal):
    (finding,) = check_ports({"hokuyo_node": terminal}, allowed=lambda path: False)
    assert finding.level is HealthLevel.PROBLEM
    assert "dialout" in finding.advice and "99-florence.rules" in finding.advice


def test_a_port_in_use(tmp_path, terminal):
    process_with(tmp_path, 12, "other", "/dev/null")
    process_with(tmp_path, 4711, "florence", "/dev/null", terminal)
    (tmp_path / "99" / "fd").mkdir(parents=True)  # has ended meanwhile: nothing to read
    assert list(users_of(terminal, tmp_path)) == ["florence (4711)"]
    (finding,) = check_ports({"hokuyo_node": terminal}, processes=tmp_path)
    assert finding.level is HealthLevel.NOTE and "florence (4711)" in finding.found


def plug(sysfs, name, vendor, product, bus, device):
    folder = sysfs / name
    folder.mkdir(parents=True)
    for file, text in (("idVendor", vendor), ("idProduct", product), ("busnum", bus), ("devnum", device)):
        (folder / file).write_text(f"{text}\n")


def test_usb_devices(tmp_path):
    plug(tmp_path, "1-1", "0403", "6001", "1", "4")
    plug(tmp_path, "1-2", "045e", "02ae", "1", "17")
    (tmp_path / "1-2:1.0").mkdir()
    asked = []
    findings = by_item(check_usb(tmp_path, tmp_path, lambda path: asked.append(path)))
    assert findings["cable of the Create"].level is HealthLevel.OK
    assert findings["Hokuyo laser"].level is HealthLevel.NOTE
    assert findings["Kinect camera"].level is HealthLevel.PROBLEM
    assert asked == [tmp_path / "001" / "017"]
    assert "12 V" in findings["Kinect motor"].advice


def test_a_machine_without_usb(tmp_path):
    (finding,) = check_usb(tmp_path / "none")
    assert finding.level is HealthLevel.NOTE


def everything() -> tuple[str, ...]:
    return tuple(f"/{name}" for group, names in NODES.items() if group != "simulator" for name in names)


WELL = {f"{name}: device": (0, "ok") for name in DEVICE_NODES}
"""What drivers say when all is well."""


def test_a_driver_that_is_there_and_says_nothing_is_a_problem():
    silent = {name: told for name, told in WELL.items() if not name.startswith("hokuyo")}
    (found,) = (
        finding
        for finding in check_graph(GraphView(everything(), 1, 0.8, silent))
        if finding.level is not HealthLevel.OK
    )
    assert (found.item, found.level) == ("hokuyo_node", HealthLevel.PROBLEM) and "says nothing" in found.found


def test_a_graph_where_all_is_well():
    findings = list(check_graph(GraphView(everything(), 1, 0.8, WELL)))
    assert all(f.level is HealthLevel.OK for f in findings) and len(findings) == 2 + len(WELL)


@pytest.mark.parametrize("gone", [("map_server", "localiser"), ("mapping",)])
def test_a_system_that_makes_a_map_needs_no_other(gone):
    nodes = tuple(name for name in everything() if name[1:] not in gone)
    assert not missing_nodes(GraphView(nodes, 1, 0.8, {}))
    without_place = tuple(name for name in nodes if name not in ("/localiser", "/mapping"))
    assert missing_nodes(GraphView(without_place, 1, 0.8, {}))


NAV2 = ("/amcl", "/bt_navigator", "/controller_server", "/planner_server")


def without(*groups: str) -> tuple[str, ...]:
    gone = {f"/{name}" for group in groups for name in NODES[group]}
    return tuple(name for name in everything() if name not in gone)


@pytest.mark.parametrize("absent", [("navigation",), ("navigation", "hardware")])
def test_nav2_and_a_running_base_in_place_of_florences_are_no_problem(absent):
    charge = None if "hardware" in absent else 0.8
    view = GraphView((*without(*absent), *NAV2), 0, charge, WELL)
    assert all(f.level is HealthLevel.OK for f in check_graph(view)) and not is_partial(view)
    (finding, *_) = check_graph(GraphView(without(*absent), 0, 0.8, {}))
    assert finding.level is HealthLevel.PROBLEM, "without Nav2 they are missing"


@pytest.mark.parametrize(
    "nodes", [(*everything(), "/simulator"), (*without("navigation", "hardware"), *NAV2)]
)
def test_devices_that_the_running_system_does_not_use_are_not_looked_at(monkeypatch, tmp_path, nodes):
    """A rehearsal has devices of its own; a base that runs already has its own drivers."""
    monkeypatch.setattr(examination, "_ros", lambda: (GraphView(nodes, 1, 0.8), []))
    findings = [f for f in examination.examine(None, tmp_path) if f.group in ("ports", "USB", "firmware")]
    assert [(f.level, f.item) for f in findings] == [(HealthLevel.NOTE, "devices")]


ONLY_MISSIONS = GraphView(("/florence_bt", "/florenceLocator", "/drive"), 0, None, {"x": (0, "ok")})


def test_missions_alone_are_a_whole_system():
    """As with --missions-only, beside a robot of which Florence knows no node."""
    assert all(finding.level is HealthLevel.OK for finding in check_graph(ONLY_MISSIONS))


def test_no_system():
    (finding,) = check_graph(GraphView(("/somebody_else",)))
    assert finding.level is HealthLevel.NOTE and "florence up" in finding.advice


@pytest.mark.parametrize(
    ("view", "partial"),
    [
        (GraphView(), False),
        (ONLY_MISSIONS, True),
        (GraphView(("/somebody_else",)), False),
        (GraphView(everything()[:3], 1, 0.8, {"x": (0, "ok")}), True),
        (GraphView(everything(), 1, None, {"x": (0, "ok")}), True),
        (GraphView(everything(), 1, 0.8, {}), True),
        (GraphView(everything(), 1, 0.8, {"x": (0, "ok")}), True),
        (GraphView(everything(), 1, 0.8, WELL), False),
    ],
)
def test_what_is_worth_a_longer_look(view, partial):
    assert is_partial(view) is partial


def test_what_is_wrong_in_a_graph():
    nodes = (*(name for name in everything() if name != "/navigate"), "/hokuyo_node")
    view = GraphView(nodes, 2, 0.1, {"hokuyo_node: Connection": (2, "port lost")})
    findings = by_item(check_graph(view))
    assert "navigate" in findings["system"].found
    assert "2 nodes" in findings["/hokuyo_node"].found
    assert findings["/clock"].level is HealthLevel.PROBLEM
    assert findings["base"].level is HealthLevel.PROBLEM and "10%" in findings["base"].found
    assert findings["hokuyo_node: Connection"].level is HealthLevel.PROBLEM


@pytest.mark.parametrize(
    ("environment", "levels"),
    [
        ({}, [HealthLevel.OK, HealthLevel.OK]),
        (
            {"ROS_DOMAIN_ID": "7", "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"},
            [HealthLevel.OK, HealthLevel.NOTE],
        ),
        ({"ROS_DOMAIN_ID": "seven"}, [HealthLevel.PROBLEM, HealthLevel.OK]),
    ],
)
def test_settings_of_ros(environment, levels):
    assert [finding.level for finding in check_settings(environment)] == levels


def test_a_check_that_breaks_does_not_hide_the_others(monkeypatch, tmp_path):
    def broken(*_):
        raise ZeroDivisionError("no such thing")
        yield

    monkeypatch.setattr(examination, "check_usb", broken)
    monkeypatch.setattr(examination, "_ros", lambda: (GraphView(), [good("ROS", "x", "y")]))
    findings = list(examination.examine(None, tmp_path))
    assert findings[-1] == good("ROS", "x", "y")
    assert any("ZeroDivisionError: no such thing" in finding.found for finding in findings)


def test_a_wrong_configuration_is_a_finding(monkeypatch, tmp_path):
    monkeypatch.setattr(examination, "_ros", lambda: (GraphView(), []))
    file = tmp_path / "robot.yaml"
    file.write_text("hokuyo_nod: {port: x}\n")
    findings = [f for f in examination.examine(file, tmp_path, hardware=False) if f.group == "configuration"]
    assert findings[0].level is HealthLevel.PROBLEM and "hokuyo_node" in findings[0].found


def test_table_and_json():
    findings = [
        good("ports", "a", "fine"),
        note("ports", "b", "in use"),
        warning("ROS", "c", "odd", "look"),
        problem("ROS", "d", "broken", "mend it"),
    ]
    out = io.StringIO()
    print_table(findings, Console(file=out, width=60))
    text = out.getvalue()
    assert text.index("ports") < text.index("ROS") and text.count("ROS") == 1
    assert "-> mend it" in text and text.endswith("4 checks: 1 problem, 1 warning\n")
    assert summary(findings[:2]) == "2 checks: all is well"
    assert json.loads(as_json(findings))[3]["level"] == "problem"
    assert not healthy(findings) and healthy(findings[:3])
