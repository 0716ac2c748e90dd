"""The compiled code of the numba kernels on disk: found there, or compiled.

A kernel that is not on disk is compiled by its first call, which takes seconds: a process of ``florence up``
would not answer meanwhile, and the supervisor kills a process for that. So nothing starts before they are
compiled. The check costs a few milliseconds: only the standard library may be imported here.

``warm_up`` compiles everything and leaves a stamp where numba leaves its code. The stamp says what was
compiled (the sources of all modules named ``*_kernels.py``), for what (versions of numba and Python, the
instructions of the processor), and in which files it is. As numba does, it follows ``NUMBA_CACHE_DIR``, and
when the package cannot be written it goes to the user's cache folder.

``python -m florence_bt.app.demo.kernel_cache`` compiles what is missing; ``make setup`` calls it.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from florence_bt.app.bringup.parent import child_command
from florence_bt.core.errors import FlorenceError

PACKAGE = Path(__file__).resolve().parents[2]
SUFFIX = "_kernels.py"
"""The end of the names of all modules that have functions for numba to compile."""
STAMP = "florence_bt_kernels.json"
MESSAGE = "compiling the hot loops, once: about a minute"


def ensure_compiled(report: Callable[[str], None], package: Path = PACKAGE) -> None:
    """Compile every kernel in a child process, unless that was done before.

    A computer that cannot do it (the simulation is not installed, or the disk is full) compiles each kernel
    at its first call; the report says so.

    Args:
        report: Called with a line for people before it begins, and when it fails.
        package: Folder of the package.
    """
    if is_compiled(package):
        return
    report(MESSAGE)
    done = subprocess.run(
        child_command("florence_bt.app.demo.warm_up"),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )
    if done.returncode != 0:
        why = ((done.stderr or done.stdout).strip().splitlines() or [f"code {done.returncode}"])[-1]
        report(f"they cannot be compiled now, so the first drive may stop for seconds: {why}")


def is_compiled(package: Path = PACKAGE) -> bool:
    """Tell whether every kernel was compiled as it is now, and its code is still there."""
    if os.environ.get("NUMBA_DISABLE_JIT", "0") != "0":
        return True
    made_from = _made_from(package)
    for folder in stamp_folders(package):
        try:
            stamp = json.loads((folder / STAMP).read_text(encoding="utf-8"))
            if stamp["made_from"] == made_from and all(map(os.path.exists, stamp["files"])):
                return True
        except (OSError, ValueError, KeyError, TypeError):
            continue  # not there, or damaged: as good as none
    return False


def mark_compiled(files: Iterable[str], package: Path = PACKAGE) -> None:
    """Leave the stamp in the first folder that can be written.

    Args:
        files: Paths of numba's index files, one for each compiled function.
        package: Folder of the package.

    Raises:
        FlorenceError: No folder can be written.
    """
    text = json.dumps({"made_from": _made_from(package), "files": sorted(files)}, indent=1)
    folders = list(stamp_folders(package))
    for folder in folders:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            half = folder / f"{STAMP}.{os.getpid()}"
            half.write_text(text, encoding="utf-8")
            half.replace(folder / STAMP)
            return
        except OSError:
            continue
    raise FlorenceError(f"none of these folders can be written: {', '.join(map(str, folders))}")


def kernel_modules(package: Path = PACKAGE) -> list[Path]:
    """Return the modules whose functions numba compiles."""
    return sorted(
        Path(folder, name) for folder, _, names in os.walk(package) for name in names if name.endswith(SUFFIX)
    )


def stamp_folders(package: Path = PACKAGE) -> Iterator[Path]:
    """Yield where the stamp may be, the first choice first: the places that numba chooses from."""
    # Two checkouts may share a folder.
    own = Path("florence_bt") / hashlib.sha256(str(package).encode()).hexdigest()[:16]
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        yield Path(chosen) / own
        return
    yield package / "__pycache__"
    yield Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "numba" / own


def _made_from(package: Path) -> str:
    digest = hashlib.sha256()
    try:
        digest.update(version("numba").encode())
    except PackageNotFoundError:
        digest.update(b"no numba")
    digest.update(f"{sys.implementation.cache_tag} {platform.machine()} {_instructions()}".encode())
    for module in kernel_modules(package):
        digest.update(str(module.relative_to(package)).encode() + b"\0" + module.read_bytes())
    return digest.hexdigest()


def _instructions() -> str:
    """Return what the processor can do: numba compiles for exactly that."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            return next((line for line in lines if line.startswith(("flags", "Features"))), "")
    except OSError:
        return ""


if __name__ == "__main__":
    ensure_compiled(lambda line: print(line, flush=True))
    if not is_compiled():
        raise SystemExit(1)
