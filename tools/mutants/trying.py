"""Tries a mutation in a copy of the repository: do its tests notice?"""

from __future__ import annotations

import contextlib
import enum
import math
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from tools.mutants.covering import QUICK
from tools.mutants.mutations import Mutation
from tools.tables import ROOT, git

LONGEST_S, LONGEST_WAIT_S = 300, 3600.0
"""A mutant whose tests use more time of a core goes round for ever, which somebody notices; so does one whose
tests are not over after that time by the clock. On a busy machine they may wait long for a core."""
_NOTICED = (1, 2, 4)
"""Exit codes of pytest when a test fails, or a module cannot be imported."""

_LOST = "E       fixture '"
"""Message of pytest on a test whose fixture it does not find: no mutation does that (:func:`by_folder`)."""


class Verdict(enum.Enum):
    """The word of the tests on a mutation."""

    NOTICED = "noticed"
    OVER_ROS = "noticed over ROS"
    UNNOTICED = "unnoticed"
    UNTESTED = "no test runs it"

    @property
    def is_noticed(self) -> bool:
        """Tell whether any test failed."""
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
        paths = [folder, *sorted((folder / "packages").iterdir())]
        self._environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(map(str, paths)),
            "OPENBLAS_NUM_THREADS": "1",
            "PYTHONDONTWRITEBYTECODE": "1",
        }

    def judge(
        self, mutation: Mutation, tests: Sequence[str], over_ros: Sequence[str], until: float = math.inf
    ) -> Verdict | None:
        """Run tests with a mutation, until one fails; those over ROS when no other has.

        Args:
            mutation: The change.
            tests: Ids of tests.
            over_ros: Files of tests over ROS.
            until: When to give up.

        Returns:
            None when nothing is known yet at the moment ``until`` of ``time.monotonic``.
        """
        if not tests and not over_ros:
            return Verdict.UNTESTED
        file = self._folder / mutation.path
        before = file.read_text()
        file.write_text(mutation.text)
        try:
            if tests and self._fails(tests, until):
                return Verdict.NOTICED
            return Verdict.OVER_ROS if over_ros and self._fails(over_ros, until) else Verdict.UNNOTICED
        except TimeoutError:
            return None
        finally:
            file.write_text(before)

    def _fails(self, tests: Sequence[str], until: float) -> bool:
        """Tell whether a test fails, or goes round for ever.

        Raises:
            TimeoutError: The moment ``until`` came before that.
        """
        names = self._folder / "tests-of-the-mutant"
        names.write_text("\n".join(by_folder(tests)))
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-x",
            "-q",
            "-p",
            "no:cacheprovider",
            "--benchmark-disable",
            *QUICK,
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
            resource.prlimit(tests_running.pid, resource.RLIMIT_CPU, (LONGEST_S, LONGEST_S + 10))
            try:
                code = tests_running.wait(max(0.0, min(LONGEST_WAIT_S, until - time.monotonic())))
            except subprocess.TimeoutExpired:
                if time.monotonic() >= until:
                    raise TimeoutError from None
                return True
            finally:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(tests_running.pid, signal.SIGKILL)
        if code == -signal.SIGXCPU:
            return True
        if code not in (0, *_NOTICED) or _LOST in said.read_text(errors="replace"):
            raise RuntimeError(f"pytest ended with {code}: {said.read_text()[-2000:]}")
        return code != 0


def by_folder(tests: Sequence[str]) -> list[str]:
    """Return tests with those of a folder, and of a file, one after the other; else the first come first.

    pytest may lose the fixtures of a folder's ``conftest.py`` when it comes to the folder a second time.
    """
    folders = [_folders(test) for test in tests]
    first: dict[str, int] = {}
    for place, above in enumerate(folders):
        for each in above:
            first.setdefault(each, place)
    places = sorted(range(len(tests)), key=lambda place: [first[each] for each in folders[place]])
    return [tests[place] for place in places]


def _folders(test: str) -> list[str]:
    """Return the folders above a test, the outermost first, and its file."""
    file = Path(test.partition("::")[0])
    return [str(each) for each in (*reversed(file.parents), file)]
