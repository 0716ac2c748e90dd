"""Keeps what a bring-up writes from other users: it says where people are and what they were asked."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from florence_bt.core.errors import ConfigError

PARTS = ("lock", "logs", "runs", "ports", "up", "options.json", "hotspots.yaml")
"""Files that earlier bring-ups left in a folder. A folder that no other user may enter protects what is in
it."""


@contextmanager
def owner_only(folder: Path, runs: Path) -> Iterator[None]:
    """Take all rights from everybody but the owner, also for what is made while the block runs.

    In the folder these are the parts of a bring-up, not other files. What is made gets its rights from the
    umask of this process, which its children inherit.

    Args:
        folder: The folder of the bring-up.
        runs: The folder of its runs.

    Raises:
        ConfigError: The rights of a part cannot be changed, e.g. because it belongs to another user.
    """
    before = os.umask(0o077)
    try:
        for path in (*(folder / part for part in PARTS), runs):
            _tighten(path)
        yield
    finally:
        os.umask(before)


def _tighten(path: Path) -> None:
    try:
        if path.exists() and not path.is_symlink():
            path.chmod(path.stat().st_mode & 0o700)
    except OSError as error:
        raise ConfigError(
            f"{path} cannot be kept from other users: {error.strerror}",
            valid=["a folder of your own, with --out"],
        ) from error
