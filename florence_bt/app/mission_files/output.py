"""Writes what the verbs about mission files make."""

from __future__ import annotations

from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.core.text_files import read_bytes, refuse_to_replace, replace_files

LARGEST = 100_000_000
"""Bytes of a file that is looked at before it is replaced."""


def write_output(out: Path, data: str | bytes, *, make_folder: bool = False, mark: bytes = b"") -> None:
    """Write a file, whole or not at all.

    Args:
        out: The file.
        data: Its content.
        make_folder: Whether to make its folder.
        mark: A file that is there is replaced only when it contains this: another of its kind.

    Raises:
        ConfigError: It cannot be written, is a link or irregular, or there is something of another kind.
    """
    try:
        if make_folder:
            out.parent.mkdir(parents=True, exist_ok=True)
        refuse_to_replace(out)
        if mark and out.exists() and mark not in read_bytes(out, LARGEST):
            raise ConfigError("there is another file, which is left as it is", file=out, valid=["a new name"])
        replace_files({out: data.encode() if isinstance(data, str) else data})
    except OSError as error:
        raise ConfigError(
            f"cannot be written: {error.strerror}", file=out, valid=["a file in a folder that exists"]
        ) from error
