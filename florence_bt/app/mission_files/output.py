"""Writes what the verbs about mission files make."""

from __future__ import annotations

from pathlib import Path

from florence_bt.core.errors import ConfigError


def write_output(out: Path, data: str | bytes, *, make_folder: bool = False) -> None:
    """Write a file.

    Raises:
        ConfigError: It cannot be written.
    """
    try:
        if make_folder:
            out.parent.mkdir(parents=True, exist_ok=True)
        out.write_bytes(data.encode() if isinstance(data, str) else data)
    except OSError as error:
        raise ConfigError(
            f"cannot be written: {error.strerror}", file=out, valid=["a file in a folder that exists"]
        ) from error
