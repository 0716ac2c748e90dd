"""The virtual environment, the pinned dependencies, and Florence itself as an editable install."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path

from . import machine
from .progress import Log, Step, StepFailed, content_hash

LOCK = machine.ROOT / "requirements.lock"
PROJECT = machine.ROOT / "pyproject.toml"
EDITABLE = [PROJECT, machine.ROOT / "setup.py", machine.ROOT / "florence_bt" / "__init__.py"]
"""The files that an editable install is made from."""

PIP = ("-m", "pip", "install", "--no-input", "--disable-pip-version-check", "--progress-bar", "off")
LOCK_HEADER = """\
# Every package that .venv gets, in the versions that were tested (Python 3.11 and 3.12).
# Written by `make lock` from pyproject.toml; do not edit.
"""


def steps(log: Log) -> list[Step]:
    """The steps up to a Python with every dependency, in order."""
    python = _python()
    return [
        Step(
            f"Python {sys.version_info.major}.{sys.version_info.minor} in {machine.VENV.name}",
            machine.STATE / "python.stamp",
            lambda: python if machine.PYTHON.exists() else "missing",
            _make_venv,
        ),
        Step(
            f"{_pins()} packages of {LOCK.name}",
            machine.STATE / "packages.stamp",
            lambda: content_hash([python, LOCK]),
            lambda: log.call([machine.PYTHON, *PIP, "--no-deps", "-r", LOCK]),
        ),
    ]


def florence_step(log: Log) -> Step:
    """The step that installs Florence itself, in place."""
    return Step(
        "florence-bt",
        machine.STATE / "florence.stamp",
        lambda: content_hash([_python(), LOCK, *(file for file in EDITABLE if file.exists())]),
        lambda: log.call([machine.PYTHON, *PIP, "--no-deps", "--no-build-isolation", "-e", machine.ROOT]),
    )


def lock() -> None:
    """Resolve every requirement of pyproject.toml and write the exact versions to the lock.

    The oldest Python decides: what it can have, the newer one can have too, but not the other way round.

    Raises:
        StepFailed: This is not the oldest Python, or the requirements cannot be met together.
    """
    if sys.version_info[:2] != machine.PYTHONS[0]:
        raise StepFailed("the lock is made with Python 3.11, the oldest one: make lock PYTHON=python3.11")
    with tempfile.TemporaryDirectory() as folder:
        log = Log(Path(folder) / "lock.log")
        report = Path(folder) / "report.json"
        venv.create(Path(folder) / "venv", with_pip=True)
        python = Path(folder) / "venv" / "bin" / "python"
        log.call([python, *PIP, "--dry-run", "--ignore-installed", "--report", report, *_requirements()])
        chosen = [package["metadata"] for package in json.loads(report.read_text())["install"]]
    pins = sorted(f"{_normal(package['name'])}=={package['version']}" for package in chosen)
    LOCK.write_text(LOCK_HEADER + "\n".join(pins) + "\n")
    print(f"{LOCK.name}: {len(pins)} packages")


def _python() -> str:
    return f"{sys.version_info[:2]} {Path(sys.base_prefix).resolve()}"


def _make_venv() -> None:
    # Not from a virtual environment's own interpreter: .venv must not depend on another one.
    python = getattr(sys, "_base_executable", sys.executable)
    done = subprocess.run(
        [python, "-m", "venv", "--clear", str(machine.VENV)], capture_output=True, text=True, errors="replace"
    )
    if done.returncode != 0:
        raise StepFailed(f"cannot make {machine.VENV}:\n{done.stdout}{done.stderr}")


def _pins() -> int:
    return sum("==" in line for line in LOCK.read_text().splitlines())


def _requirements() -> list[str]:
    project = tomllib.loads(PROJECT.read_text())
    extras = project["project"]["optional-dependencies"]
    return [
        *project["build-system"]["requires"],
        *project["project"]["dependencies"],
        *(requirement for extra in extras.values() for requirement in extra),
    ]


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()
