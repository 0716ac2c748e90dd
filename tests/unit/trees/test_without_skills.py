"""The executor of missions is a thing of its own: it runs without our skills, drivers and simulation."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]
ALONE = """
import importlib, pkgutil, sys
from pathlib import Path

LAYERS = ("skills", "drivers", "simulation", "mission_testing", "app", "cli")
GONE = tuple(f"florence_bt.{layer}" for layer in LAYERS)


class Missing:
    def find_spec(self, name, path=None, target=None):
        if name in GONE or name.startswith(tuple(f"{layer}." for layer in GONE)):
            raise ModuleNotFoundError(f"{name} is not there", name=name)


sys.meta_path.insert(0, Missing())
for layer in ("core", "behaviours", "trees", "runtime"):
    package = importlib.import_module(f"florence_bt.{layer}")
    for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        if not module.name.startswith("florence_bt.runtime.node"):  # which knows ROS
            importlib.import_module(module.name)

from florence_bt.behaviours.context import TreeContext
from florence_bt.core.clock import ManualClock
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.compile import compile_mission
from florence_bt.trees.language.loader import MissionLibrary

folder = Path(sys.argv[1])
library = MissionLibrary.load([folder], built_in=False)
mission = library.get("count")
assert check(mission, library, {}) == []
tree = compile_mission(mission, library, {}, TreeContext(ManualClock(), lambda: None, {}, {}))
while tree.root.status.name not in ("SUCCESS", "FAILURE"):
    tree.root.tick_once()
print(tree.root.status.name, tree.outputs())
"""
MISSION = """\
mission: count
description: Adds what is in a list.
keys: {sum: {type: integer, default: 0}}
outputs: {sum: {type: integer}}
tree: {for_each: [1, 2, 4], as: number, do: {add: {sum: $number}}}
"""


def test_a_mission_is_checked_and_run_by_the_executor_alone(tmp_path):
    (tmp_path / "count.yaml").write_text(MISSION)
    ended = subprocess.run(
        [sys.executable, "-c", ALONE, str(tmp_path)],
        env={"PYTHONPATH": str(ROOT), "PATH": ""},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.stdout == "SUCCESS {'sum': 7}\n", ended.stderr
