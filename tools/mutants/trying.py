"""Tries a mutation in a copy of the repository: do its tests notice?"""

from __future__ import annotations

import contextlib
import enum
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from tools.mutants.covering import over_ros
from tools.mutants.mutations import Mutation
from tools.tables import ROOT, git

LONGEST_S = 300.0
"""A mutant whose tests take longer goes round for ever, which somebody notices."""
_NOTICED = (1, 2, 4)
"""What pytest exits with when a test fails, or a module cannot be imported."""


class Verdict(enum.Enum):
    """What the tests say of a mutation."""

    NOTICED = "noticed"
    OVER_ROS = "noticed over ROS"
    UNNOTICED = "unnoticed"
    UNTESTED = "no test runs it"

    @property
    def is_noticed(self) -> bool:
        """Whether any test failed."""
        return self in (Verdict.NOTICED, Verdict.OVER_ROS)


class Copy:
    """A copy of the repository's files in which one mutation at a time is made."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        shutil.rmtree(folder, ignore_errors=True)
        for name in git("ls-files").splitlines():
            if (ROOT / name).is_file():
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, folder / name)
        for folder_name in ("build", ".venv"):
            if (ROOT / folder_name).exists() and not (folder / folder_name).exists():
                (folder / folder_name).symlink_to(ROOT / folder_name)
        paths = [folder, folder / "packages/florence_btcpp"]
        self._environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(map(str, paths)),
            "OPENBLAS_NUM_THREADS": "1",
            "PYTHONDONTWRITEBYTECODE": "1",
        }

    def judge(self, mutation: Mutation, tests: Sequence[str]) -> Verdict:
        """Run tests with a mutation, until one fails; those over ROS when no other has."""
        if not tests:
            return Verdict.UNTESTED
        file = self._folder / mutation.path
        before = file.read_text()
        file.write_text(mutation.text)
        quick, slow = [[test for test in tests if over_ros(test) is ros] for ros in (False, True)]
        try:
            if quick and self._fails(quick):
                return Verdict.NOTICED
            return Verdict.OVER_ROS if slow and self._fails(slow) else Verdict.UNNOTICED
        finally:
            file.write_text(before)

    def _fails(self, tests: Sequence[str]) -> bool:
        names = self._folder / "tests-of-the-mutant"
        names.write_text("\n".join(tests))
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-x",
            "-q",
            "-p",
            "no:cacheprovider",
            "--benchmark-disable",
        ]
        said = self._folder / "said-by-the-tests"  # no pipe: what a mutated test leaves behind would hold it
        with (
            said.open("wb") as output,
            subprocess.Popen(
                [*command, f"@{names}"],
                cwd=self._folder,
                env=self._environment,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            ) as tests_running,
        ):
            try:
                code = tests_running.wait(LONGEST_S)
            except subprocess.TimeoutExpired:
                return True
            finally:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(tests_running.pid, signal.SIGKILL)
        if code not in (0, *_NOTICED):
            raise RuntimeError(f"pytest ended with {code}: {said.read_text()[-2000:]}")
        return code != 0
