"""Loading and checking missions needs none of the heavy libraries."""

import subprocess
import sys
from importlib.metadata import version

import pytest
from packaging.version import Version

PROGRAM = """
import sys
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.drawings.draw import draw
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.checks.report import report_text
library = MissionLibrary.load()
check(library, library, collect_declarations())
heavy = {"numpy", "numba", "scipy", "cv2", "onnxruntime"}
heavy |= {"mujoco", "matplotlib", "rclpy", "pydantic", "asyncio"}
print(sorted(heavy & set(sys.modules)))
"""


def test_loading_and_checking_is_light():
    result = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True, timeout=300
    )
    assert result.stdout.strip() == "[]"


COMMAND = """
import sys
from florence_bt.cli.application import app
try:
    app(["check", sys.argv[1]], prog_name="florence")
except SystemExit as end:
    assert end.code == 0, end.code
heavy = {"numpy", "numba", "scipy", "cv2", "onnxruntime"}
heavy |= {"mujoco", "matplotlib", "rclpy", "pydantic", "asyncio", "rich"}
print(sorted(heavy & set(sys.modules)))
"""


@pytest.mark.skipif(
    Version(version("typer")) >= Version("0.29"), reason="this typer loads pydantic at every start"
)
def test_the_command_is_light_too(tmp_path):
    file = tmp_path / "small.yaml"
    file.write_text("mission: small\ntree: {wait: 1 s}\n")
    result = subprocess.run(
        [sys.executable, "-c", COMMAND, str(file)], capture_output=True, text=True, check=True, timeout=300
    )
    assert result.stdout.splitlines()[-1] == "[]"
