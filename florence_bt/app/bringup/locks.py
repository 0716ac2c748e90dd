"""One bring-up at a time: in a folder, and in a namespace of a ROS domain.

In one folder a second one would take the ports and logs of the first; in one namespace the two would drive
each other's robot.
"""

from __future__ import annotations

import errno
import fcntl
import os
import stat
import tempfile
from contextlib import suppress
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.ros.arguments import namespace


class Lock:
    """The right to use something; gone with the last process that holds it, however that ends.

    Args:
        file: Stands for the thing; its folder is made when needed.
        place: The thing in words, e.g. ``the folder 'runs'``.
        instead: What the user can do when it is taken or cannot be used.
        note: A line for :func:`running_folder`, kept in the file.

    Raises:
        ConfigError: It is in use, or the file cannot be written.
    """

    def __init__(self, file: Path, place: str, instead: str, note: str = "") -> None:
        try:
            file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            # Without O_NOFOLLOW, anybody who may write to the folder could have any file of ours overwritten.
            flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW
            self._descriptor = os.open(file, flags, 0o600)
        except OSError as error:
            what = f"{file} is a symbolic link" if error.errno == errno.ELOOP else error.strerror
            raise ConfigError(f"{place} cannot be used: {what}", valid=[instead]) from error
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            users = _users(self._descriptor)
            os.close(self._descriptor)
            raise ConfigError(
                f"a bring-up ({users}), or what is left of it, uses {place}",
                valid=[instead, "ending that one first"],
            ) from None
        os.truncate(self._descriptor, 0)
        os.write(self._descriptor, f"{os.getpid()}\n{note}".encode(errors="surrogateescape"))

    def fileno(self) -> int:
        """Return the descriptor; a process that inherits it holds the lock too."""
        return self._descriptor

    def close(self) -> None:
        """Let go; harmless when that was done already."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1


def _users(descriptor: int) -> str:
    """Return who holds a lock, for people: the process that took it, or those that have outlived it."""
    owner = os.read(descriptor, 20).decode(errors="replace").partition("\n")[0]
    if owner.isdecimal() and Path(f"/proc/{owner}").exists():
        return f"process {owner}"
    left = " and ".join(map(str, _processes_with(os.fstat(descriptor))))
    return f"process {left or 'unknown'}, left by {owner or 'one'} that has ended"


def _processes_with(file: os.stat_result) -> list[int]:
    """Return the other processes of this user that have a file open."""
    found = set()
    for link in Path("/proc").glob("[0-9]*/fd/*"):
        with suppress(OSError):  # it has been closed, or is another user's
            if os.path.samestat(link.stat(), file):
                found.add(int(link.parts[2]))
    return sorted(found - {os.getpid()})


def lock_folder(folder: Path) -> Lock:
    """Take a folder; it is made when needed.

    Raises:
        ConfigError: As :class:`Lock`.
    """
    return Lock(
        folder / "lock", f"the folder {str(folder)!r}", "another folder that can be written to, with --out"
    )


def bring_up_here() -> bool:
    """Tell whether this user runs a bring-up on this machine in the ROS domain and namespace of this process.

    Taking the lock to find out could refuse a bring-up that begins this very moment, so the kernel is asked.
    """
    try:
        inode = _domain_file(namespace()).stat().st_ino
        locks = Path("/proc/locks").read_text(encoding="ascii")
    except OSError:
        return False
    # 12: FLOCK  ADVISORY  WRITE 4711 00:35:98765 0 EOF
    held = (line.split() for line in locks.splitlines() if " FLOCK " in line)
    return any(parts[5].rpartition(":")[2] == str(inode) for parts in held if len(parts) > 5)


def running_folder() -> Path | None:
    """Return the folder of the bring-up that :func:`bring_up_here` sees; None without one."""
    return last_folder() if bring_up_here() else None


def last_folder() -> Path | None:
    """Return the folder of the bring-up that runs, or ran last, in our ROS domain and namespace."""
    try:
        _, _, folder = os.fsdecode(_domain_file(namespace()).read_bytes()).partition("\n")
    except OSError:
        return None
    return Path(folder) if folder else None


def lock_domain(folder: Path, robot: str = "") -> Lock:
    """Take a namespace in the ROS domain of this process on this machine, for this user.

    Discovery is too slow to find another system before it is disturbed: it takes seconds on a busy machine.

    Args:
        folder: The folder of the bring-up, for :func:`running_folder`.
        robot: The namespace, as ``/robot1``; empty for the root.

    Raises:
        ConfigError: As :class:`Lock`; or another user has made, or may write to, the folder of the locks.
    """
    file = _domain_file(robot)
    _own(file.parent)
    place = f"the ROS domain {_domain()}{f', namespace {robot}' if robot else ''}"
    instead = "another domain, e.g. ROS_DOMAIN_ID=7, or --namespace /robot2"
    return Lock(file, place, instead, str(folder))


def _own(folder: Path) -> None:
    """Make a folder in the temporary folder, where everybody may write, that only this user may write to.

    Not in XDG_RUNTIME_DIR: a service and a login of the same user would have different locks.
    """
    with suppress(FileExistsError):  # of whatever kind
        folder.mkdir(mode=0o700)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or found.st_mode & 0o022:
        raise ConfigError(
            f"{folder} is not a folder that only this user may write to",
            valid=["removing it", "another temporary folder, with the environment variable TMPDIR"],
        )


def _domain() -> str:
    return os.environ.get("ROS_DOMAIN_ID") or "0"


def _domain_file(robot: str) -> Path:
    name = f"domain-{_domain()}{robot.replace('/', '.')}"
    return Path(tempfile.gettempdir()) / f"florence-{os.getuid()}" / name
