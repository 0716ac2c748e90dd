"""An installation of Florence outside of its checkout, made from the sources as they are."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

CHECKOUT = Path(__file__).parents[1]
SOURCES = (
    "florence_bt", "maps", "hotspots", "urdf", "config", "interfaces", "resource", "package.xml", "setup.py",
    "setup.cfg", "pyproject.toml", "MANIFEST.in", "README.md", "LICENSE",
)  # fmt: skip
"""What the distribution is made from."""
OURS = ("florence", "__editable__")
HOOK = "import sys; from setuptools import build_meta; print(build_meta.build_{0}(sys.argv[1]))"


def copy_sources(folder: Path) -> Path:
    """Copy what the distribution is made from; a build writes into its sources."""
    folder.mkdir()
    for name in SOURCES:
        path = CHECKOUT / name
        if path.is_dir():
            shutil.copytree(path, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(path, folder)
    return folder


def build(kind: str, sources: Path, out: Path) -> Path:
    """Build a ``wheel`` or an ``sdist`` by the hook of the build backend (PEP 517), without the network."""
    out.mkdir(exist_ok=True)
    done = run([sys.executable, "-c", HOOK.format(kind), str(out)], sources)
    assert done.returncode == 0, done.stdout + done.stderr
    return out / done.stdout.splitlines()[-1]


def install(wheel: Path, prefix: Path) -> Path:
    """Install a wheel into an environment of its own, which has the dependencies but no other Florence.

    Returns:
        The folder with its programs.
    """
    venv.create(prefix, symlinks=True)
    python = prefix / "bin" / "python"
    done = run([sys.executable, "-m", "pip", "-q", "--python", str(python), "install", "--no-deps",
                "--no-compile", "--no-index", str(wheel)], prefix)  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    dependencies = dependencies_of_florence(prefix / "dependencies")
    site = prefix / "lib" / f"python{sys.version_info[0]}.{sys.version_info[1]}" / "site-packages"
    (site / "dependencies.pth").write_text(f"{dependencies}\n")
    return prefix / "bin"


def dependencies_of_florence(folder: Path) -> Path:
    """Make a folder with links to everything that this environment has, but Florence."""
    folder.mkdir()
    for entry in Path(sysconfig.get_path("purelib")).iterdir():
        if not entry.name.startswith(OURS) or entry.name.startswith("florence_interfaces"):
            (folder / entry.name).symlink_to(entry)
    return folder


def run(command: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a program in a folder, without the path of the tests."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300)
