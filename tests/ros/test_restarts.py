"""A process that is killed and started again is heard, and leaves nothing behind: the short form."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "tools" / "safety_campaign" / "restarts.py"


@pytest.mark.ros
@pytest.mark.slow
def test_a_restarted_process_is_never_deaf(ros_domain):
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--count", "4", "--seed", "3"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.startswith("4 restarts: 0 unreachable; reached after")
    assert done.stdout.endswith("; 0 files left in /dev/shm\n")
