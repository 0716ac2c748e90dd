"""What the forks of test_fork_server run."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path


def main(group: str, options_file: Path, parent: int) -> int:
    """Print what this process is, and do what the group is called after."""
    mask = os.umask(0)
    numbers = [int(number) for number in os.listdir("/proc/self/fd")]
    facts = {
        "pid": os.getpid(),
        "parents": [os.getppid(), parent],
        "session": os.getsid(0),
        "folder": os.getcwd(),
        "umask": mask,
        "variables": {name: os.environ.get(name) for name in ("CHANGED", "GONE", "TOLD", "HEART")},
        "files": [os.readlink(f"/proc/self/fd/{n}") for n in numbers if os.path.exists(f"/proc/self/fd/{n}")],
        "command": Path("/proc/self/cmdline").read_text().rstrip("\0").split("\0"),
    }
    print(json.dumps(facts), flush=True)
    os.write(int(os.environ["HEART"]), b"beat")
    if group == "waits":
        signal.pause()
    return 7
