"""Earlier versions of files that a command changes together: a folder beside the first of them.

``home.yaml`` has ``home.versions/1``, ``2``, ...: each is a copy of the files as they were, and says what
became of them.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.core.file_sets import mend
from florence_bt.core.text_files import read_bytes
from florence_bt.skills.navigation.map_server.image import MAX_IMAGE_BYTES
from florence_bt.skills.navigation.map_server.map_writer import replace_map

MOST_MAP_VERSIONS = 20
"""Of each map; then the oldest one goes."""
_LIST = "version.json"


class Versions:
    """The versions of a map and of what was changed with it.

    Args:
        file: The map's YAML file.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        self._folder = file.with_suffix(".versions")

    def write(
        self, contents: Mapping[Path, bytes], what: str, beside: Mapping[Path, bytes] | None = None
    ) -> None:
        """Write files, all or none, and keep what they were.

        Args:
            contents: File -> what it is to hold.
            what: What was done, for people.
            beside: What is written in the same step, and not kept: file -> content.

        Raises:
            OSError: A file cannot be written.
            ConfigError: One that is there cannot be read.
        """
        mend(self._file.parent)
        numbers = self._numbers()
        version = self._folder / str(max(numbers, default=0) + 1)
        kept, entries = {}, []
        for index, (file, new) in enumerate(contents.items()):
            before = read_bytes(file, MAX_IMAGE_BYTES) if file.exists() else None
            if before is not None:
                kept[version / f"{index}-{file.name}"] = before
            entries.append(
                {
                    "file": os.path.relpath(file, self._file.parent),
                    "new": before is None,
                    "became": _digest(new),
                }
            )
        kept[version / _LIST] = json.dumps({"what": what, "files": entries}, indent=1).encode()
        old = [file for number in numbers[: 1 - MOST_MAP_VERSIONS] for file in self._files_of(number)]
        try:
            everything = {**kept, **(beside or {}), **contents}
            replace_map(self._file, everything, remove=old, no_links=[self._folder])
        finally:
            self._remove_empty()

    def undo(self, *, overwrite: bool) -> tuple[str, list[Path], int]:
        """Go back to the version before the last change.

        Args:
            overwrite: Also when a file has been changed since by something else, whose change is lost.

        Returns:
            What was undone, the files that were put back, and how many more changes can be undone.

        Raises:
            ConfigError: There is nothing to undo, a file was changed since, or something cannot be written.
        """
        try:
            mend(self._file.parent)
        except OSError as error:
            raise ConfigError(f"it cannot be mended: {error.strerror}", file=self._file) from error
        numbers = self._numbers()
        if not numbers:
            raise ConfigError("there is no earlier version of this map", file=self._file)
        version = self._folder / str(numbers[-1])
        try:
            record = json.loads(read_bytes(version / _LIST))
            entries = [
                (index, self._file.parent / entry["file"], entry)
                for index, entry in enumerate(record["files"])
            ]
            back: dict[Path, bytes] = {}
            for index, file, entry in entries:
                if not overwrite and not (
                    file.exists() and _digest(read_bytes(file, MAX_IMAGE_BYTES)) == entry["became"]
                ):
                    raise ConfigError(
                        f"the file was changed since by something else than {record['what']!r}",
                        file=file,
                        valid=["--overwrite, which loses that change"],
                    )
                if not entry["new"]:
                    back[file] = read_bytes(version / f"{index}-{file.name}", MAX_IMAGE_BYTES)
            gone = [file for _, file, entry in entries if entry["new"]]
            gone += self._files_of(numbers[-1])
            replace_map(self._file, back, remove=gone, no_links=[self._folder])
            self._remove_empty()
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise ConfigError(f"the earlier version cannot be put back: {error}", file=version) from error
        return record["what"], list(back), len(numbers) - 1

    def _numbers(self) -> list[int]:
        """Return the numbers of the versions that are whole."""
        return sorted(
            int(each.parent.name) for each in self._folder.glob(f"*/{_LIST}") if each.parent.name.isdigit()
        )

    def _files_of(self, number: int) -> list[Path]:
        return [file for file in (self._folder / str(number)).iterdir() if file.is_file()]

    def _remove_empty(self) -> None:
        """Remove the folders of versions that are gone, or were never written."""
        for folder in (*self._folder.glob("*"), self._folder):
            if folder.is_dir() and not any(folder.iterdir()):
                folder.rmdir()


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
