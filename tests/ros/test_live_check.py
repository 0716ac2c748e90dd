"""``florence check --live`` against a mission server, a locator and servers of skills that really run."""

from __future__ import annotations

import threading

import pytest

from florence_bt.cli.exit_codes import NOT_THERE
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.outcome import success
from florence_bt.trees.checks import lint
from florence_bt.trees.checks.report import report_text
from florence_bt.trees.language.loader import MissionLibrary

pytestmark = pytest.mark.ros

RING = SkillDeclaration("ring_bell", "Ring the bell")
GREET = SkillDeclaration("greet", "Say hello")
FIND = SkillDeclaration(
    "get_hotspot",
    "Find a place",
    inputs={"label": Port(Kind.TEXT, "which", names="hotspot")},
    outputs={"pose": Port(Kind.POSE, "where")},
)
DECLARATIONS = {skill.name: skill for skill in (RING, GREET, FIND)}
RING_TWICE = (
    "mission: ring_twice\ndescription: Rings.\ntree:\n  sequence:\n    - ring_bell:\n    - ring_bell:\n"
)
VISIT = """\
mission: visit
description: Goes and rings.
tree:
  sequence:
    - get_hotspot: {label: kitchen}
    - run: ring_twice
    - greet:
"""


class System:
    """A mission server with its missions, and beside it what it needs; spun in a thread of its own."""

    def __init__(self, ros, folder):
        from florence_bt.runtime.node import MissionNode

        self.ros = ros
        self.missions = folder / "missions"
        self.missions.mkdir()
        self.write("ring_twice", RING_TWICE)
        self.write("visit", VISIT)
        ros.add(
            MissionNode(
                make_skills,
                DECLARATIONS,
                parameters={"runs_folder": str(folder / "runs"), "mission_folders": (str(self.missions),)},
            )
        )
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._spin)

    def write(self, name, text):
        (self.missions / f"{name}.yaml").write_text(text)

    def serve(self, name, service_type, answer):
        from florence_bt.ros.node import FlorenceNode

        node = self.ros.add(FlorenceNode(f"server_of_{name.replace('/', '_')}"))
        node.create_service(service_type, name, answer)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._over.set()
        self._thread.join()

    def _spin(self):
        while not self._over.is_set():
            self.ros.loop.spin_once(0.02)

    def compare(self, *names):
        from florence_bt.app.mission_files.live_check import compare_with_system

        library = MissionLibrary.load([self.missions], built_in=False)
        findings = compare_with_system(
            [library.get(name) for name in names],
            library,
            lambda mission: lint.written_labels(mission, library, DECLARATIONS),
            make_skills,
        )
        return report_text(lint.limit_findings(findings)).replace(f"{self.missions}/", "").splitlines()


def make_skills(node):
    from florence_interfaces.srv import GetHotspot
    from std_srvs.srv import Trigger

    from florence_bt.ros.service_skill import ServiceSkill

    def bell(name):
        return ServiceSkill(
            node, Trigger, name, to_request=lambda i: Trigger.Request(), to_result=lambda m: success()
        )

    find = ServiceSkill(
        node,
        GetHotspot,
        "florenceLocator/getHotspot",
        to_request=lambda inputs: GetHotspot.Request(label=inputs["label"]),
        to_result=lambda message: success(),
    )
    return {"ring_bell": bell("bell/ring"), "get_hotspot": find}


def answer_hotspot(request, response):
    response.valid = request.label == "hall"
    response.message = "" if response.valid else f"there is no hotspot {request.label!r}"
    return response


@pytest.fixture
def system(ros, tmp_path):
    return System(ros, tmp_path)


def test_what_the_running_system_lacks_is_said_with_what_to_start(system):
    from florence_interfaces.srv import GetHotspot

    system.serve("florenceLocator/getHotspot", GetHotspot, answer_hotspot)
    with system:
        lines = system.compare("visit")
    assert [line.split(" (would")[0] for line in lines] == [
        "visit.yaml:5:28: error: the running locator says: there is no hotspot 'kitchen'",
        "visit.yaml:6:7: error: the skill 'ring_bell' has no server: no service /bell/ring"
        " (std_srvs/srv/Trigger) was found (in the mission ring_twice)",
        "visit.yaml:7:7: error: the robot has no skill 'greet': nothing connects it to a server",
    ]
    assert "florence up --sim" in lines[1]


def test_a_system_that_fits(system):
    from florence_interfaces.srv import GetHotspot
    from std_srvs.srv import Trigger

    system.serve("florenceLocator/getHotspot", GetHotspot, answer_hotspot)
    system.serve("bell/ring", Trigger, lambda request, response: response)
    with system:
        assert system.compare("ring_twice") == []
        # Another text with the same meaning is another version.
        system.write("ring_twice", RING_TWICE + "# changed\n")
        (line,) = system.compare("ring_twice")
        assert "ring_twice.yaml:4:3: error: the running mission server has another version" in line
        system.write("brand_new", "mission: brand_new\ntree: {run: older}\n")
        system.write("older", "mission: older\ntree: {ring_bell: }\n")
        first, second = system.compare("brand_new")
        assert "the running mission server has no mission 'brand_new'" in first
        assert "brand_new.yaml:2:13: error: the running mission server has no mission 'older'" in second


def test_the_command_line_says_that_nothing_runs(start_process, tmp_path):
    file = tmp_path / "ring.yaml"
    file.write_text("mission: ring\ntree: {wait: 1 s}\n")
    child = start_process("-m", "florence_bt.cli", "check", "--live", file)
    assert child.process.wait(300.0) == NOT_THERE
    assert "no server of /florence_bt/list_missions" in child.output and "florence up --sim" in child.output
