"""The virtual environment, the pinned dependencies, and Florence itself as an editable install."""

from __future__ import annotations

import itertools
import json
import re
import subprocess
import sys
import tempfile
import tomllib
import venv
from collections.abc import Iterable, Mapping
from pathlib import Path

from florence_bt.app.interfaces.building import content_hash

from . import machine
from .progress import Log, Step, StepFailed, stamped

LOCK = machine.ROOT / "requirements.lock"
PROJECT = machine.ROOT / "pyproject.toml"
PACKAGES = sorted((machine.ROOT / "packages").iterdir())
"""The distributions beside Florence's own: the exchange with BehaviorTree.CPP, the page."""
EDITABLE = [
    PROJECT,
    machine.ROOT / "setup.py",
    machine.ROOT / "florence_bt" / "__init__.py",
    *(package / PROJECT.name for package in PACKAGES),
]
"""The files that the editable installs are made from."""

PIP = ("-m", "pip", "install", "--no-input", "--disable-pip-version-check", "--progress-bar", "off")
INSTALL = (*PIP, "--no-deps", "--no-build-isolation", "--use-pep517")
"""Everything is pinned: nothing is resolved. Pip writes the byte code too: where PYTHONDONTWRITEBYTECODE is
set nobody else does, and each of the five processes would compile a thousand modules at every start."""

LAYOUT = "2"
"""Raise it when a .venv of before must be made again from nothing."""
LOCK_HEADER = """\
# Every package that .venv gets, in the versions that were tested (Python 3.11 and 3.12).
# Written by `make lock` from pyproject.toml; do not edit.
"""
BASE, BUILD, RUN, TEST = "base", "build", "run", "test"
SECTIONS = {
    BASE: "what both of the next two need, which are installed side by side",
    BUILD: "ROS 2, and what building the interface packages needs",
    RUN: "what florence needs besides",
    TEST: "what only tests and checks need",
}
EXTRAS = {BUILD: ("ros", "build"), RUN: ("robot", "sim", "draw", "mapping")}
"""Extras of pyproject.toml whose packages belong to a section; all others belong to the last one."""


def python_step() -> Step:
    """Make the step that makes an empty environment."""
    return stamped(
        f"Python {sys.version_info.major}.{sys.version_info.minor} in {machine.VENV.name}",
        machine.STATE / "python.stamp",
        lambda: _python() if machine.PYTHON.exists() else "missing",
        _make_venv,
    )


def packages_step(log: Log, section: str) -> Step:
    """Make the step that installs a section of the lock."""
    pins = read_lock(LOCK.read_text())[section]
    return stamped(
        f"{len(pins)} packages: {SECTIONS[section]}",
        machine.STATE / f"packages-{section}.stamp",
        lambda: content_hash([_python(), *pins]),
        lambda: log.call([machine.PYTHON, *INSTALL, *pins]),
    )


def florence_step(log: Log) -> Step:
    """Make the step that installs Florence and the packages beside it, in place."""
    places = [word for folder in (machine.ROOT, *PACKAGES) for word in ("-e", folder)]
    return stamped(
        "florence-bt, " + ", ".join(package.name.replace("_", "-") for package in PACKAGES),
        machine.STATE / "florence.stamp",
        lambda: content_hash([_python(), *(file for file in EDITABLE if file.exists())]),
        lambda: log.call([machine.PYTHON, *INSTALL, *places]),
    )


def read_lock(text: str) -> dict[str, list[str]]:
    """Read the pins of each section of the lock, ``name==version``.

    Raises:
        StepFailed: A section is missing.
    """
    pins: dict[str, list[str]] = {}
    headings = {f"# {text}": section for section, text in SECTIONS.items()}
    for line in text.splitlines():
        if line in headings:
            section = pins.setdefault(headings[line], [])
        elif line and not line.startswith("#"):
            section.append(line)
    if missing := SECTIONS.keys() - pins:
        raise StepFailed(f"{LOCK.name} has no section {', '.join(sorted(missing))}: make lock")
    return pins


def write_lock(everything: Iterable[str], parts: Mapping[str, Iterable[str]]) -> str:
    """Write the text of the lock.

    Args:
        everything: All pins.
        parts: For all sections but the last the pins that it needs; what an earlier section has is left out.
    """
    left = set(everything)
    lines = [LOCK_HEADER]
    for section, text in SECTIONS.items():
        here = left & set(parts.get(section, left))
        left -= here
        lines += [f"# {text}", *sorted(here), ""]
    return "\n".join(lines)


def lock() -> None:
    """Resolve every requirement of the distributions and write the exact versions to the lock.

    The oldest Python decides: what it can have, the newer one can have too, but not the other way round.

    Raises:
        StepFailed: This is not the oldest Python, or the requirements cannot be met together.
    """
    if sys.version_info[:2] != machine.PYTHONS[0]:
        raise StepFailed("the lock is made with Python 3.11, the oldest one: make lock PYTHON=python3.11")
    project = tomllib.loads(PROJECT.read_text())
    extras = project["project"]["optional-dependencies"]
    beside = _join(_needs_of(package / PROJECT.name) for package in PACKAGES)
    base = project["build-system"]["requires"]
    needs = {section: _join(extras[extra] for extra in names) for section, names in EXTRAS.items()}
    needs[RUN] += project["project"]["dependencies"]
    with tempfile.TemporaryDirectory() as folder:
        venv.create(Path(folder) / "venv", with_pip=True)
        everything = _resolve(Path(folder), [*base, *needs[RUN], *_join(extras.values()), *beside])
        chosen = Path(folder) / "chosen.txt"
        chosen.write_text("\n".join(everything))
        parts = {
            section: _resolve(Path(folder), ["-c", chosen, *requirements])
            for section, requirements in needs.items()
        }
        both = set(parts[BUILD]).intersection(parts[RUN])
        parts[BASE] = [*both, *_resolve(Path(folder), ["-c", chosen, *base])]
    LOCK.write_text(write_lock(everything, parts))
    print(f"{LOCK.name}: {len(everything)} packages")


def _needs_of(project: Path) -> list[str]:
    """Return what a distribution beside Florence's own needs but that."""
    needs: list[str] = tomllib.loads(project.read_text())["project"]["dependencies"]
    return [need for need in needs if need != "florence-bt"]


def _resolve(folder: Path, requirements: Iterable[str | Path]) -> list[str]:
    """Return the pins that pip chooses for requirements."""
    report = folder / "report.json"
    Log(folder / "lock.log").call(
        [
            *(folder / "venv" / "bin" / "python", *PIP, "--dry-run", "--ignore-installed"),
            *("--report", report, *requirements),
        ]
    )
    chosen = [package["metadata"] for package in json.loads(report.read_text())["install"]]
    return sorted(f"{_normal(package['name'])}=={package['version']}" for package in chosen)


def _python() -> str:
    return f"{LAYOUT} {sys.version_info[:2]} {Path(sys.base_prefix).resolve()}"


def _make_venv() -> None:
    # Not from a virtual environment's own interpreter: .venv must not depend on another one.
    python = getattr(sys, "_base_executable", sys.executable)
    done = subprocess.run(
        [python, "-m", "venv", "--clear", str(machine.VENV)], capture_output=True, text=True, errors="replace"
    )
    if done.returncode != 0:
        raise StepFailed(f"cannot make {machine.VENV}:\n{done.stdout}{done.stderr}")


def _join(lists: Iterable[list[str]]) -> list[str]:
    return list(itertools.chain.from_iterable(lists))


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()
