"""Loading and checking missions needs none of the heavy libraries."""

import subprocess
import sys

PROGRAM = """
import sys
from florence_bt.trees.declarations import collect_declarations
from florence_bt.trees.draw import draw
from florence_bt.trees.lint import check
from florence_bt.trees.loader import MissionLibrary
from florence_bt.trees.report import report_text
library = MissionLibrary.load()
check(library, library, collect_declarations())
heavy = {"numpy", "numba", "scipy", "cv2", "mujoco", "matplotlib", "rclpy", "pydantic", "asyncio"}
print(sorted(heavy & set(sys.modules)))
"""


def test_loading_and_checking_is_light():
    result = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True, timeout=60
    )
    assert result.stdout.strip() == "[]"
