"""Writes what the verbs of the command line make."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.core.file_sets import replace_files
from florence_bt.core.text_files import read_bytes, refuse_to_replace

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
    content = data.encode() if isinstance(data, str) else data
    write_outputs({out: content}, make_folders=make_folder, mark=mark)


def write_outputs(
    contents: Mapping[Path, bytes],
    *,
    make_folders: bool = True,
    mark: bytes = b"",
    remove: Iterable[Path] = (),
    no_links: Iterable[Path] = (),
) -> None:
    """Write files, all of them or none.

    Args:
        contents: File -> content.
        make_folders: As of :func:`replace_files`, like ``remove`` and ``no_links``.
        mark: As of :func:`write_output`.
        remove: See there.
        no_links: See there.

    Raises:
        ConfigError: As :func:`write_output`.
    """
    try:
        for out in contents:
            refuse_to_replace(out)
            if mark and out.exists() and mark not in read_bytes(out, LARGEST):
                problem = "there is another file, which is left as it is"
                raise ConfigError(problem, file=out, valid=["a new name"])
        replace_files(contents, remove=remove, make_folders=make_folders, no_links=no_links)
    except OSError as error:
        raise ConfigError(
            f"cannot be written: {error.strerror}",
            file=error.filename,
            valid=["a file in a folder that exists" if not make_folders else "a folder you may write to"],
        ) from error
