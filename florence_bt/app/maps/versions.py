"""Earlier versions of files that a command changes together: a folder beside the first of them.

``home.yaml`` has ``home.versions/1``, ``2``, ...: each is a copy of the files as they were, and says what
became of them.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Mapping
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.core.text_files import read_bytes, replace_files
from florence_bt.skills.navigation.map_server.image import MAX_IMAGE_BYTES

MOST_VERSIONS = 20
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

    def write(self, contents: Mapping[Path, bytes], what: str) -> None:
        """Write files, all or none, and keep what they were.

        Args:
            contents: File -> what it is to hold.
            what: What was done, for people.

        Raises:
            OSError: A file cannot be written.
        """
        version = self._folder / str(max(self._numbers(), default=0) + 1)
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
        record = json.dumps({"what": what, "files": entries}, indent=1)
        version.mkdir(parents=True, exist_ok=True)
        try:
            replace_files({**kept, version / _LIST: record.encode()})
            replace_files(contents)
        except OSError:
            self._remove(version)
            raise
        for old in self._numbers()[:-MOST_VERSIONS]:
            self._remove(self._folder / str(old))

    def undo(self, *, overwrite: bool) -> tuple[str, list[Path], int]:
        """Go back to the version before the last change.

        Args:
            overwrite: Also when a file has been changed since by something else, whose change is lost.

        Returns:
            What was undone, the files that were put back, and how many more changes can be undone.

        Raises:
            ConfigError: There is nothing to undo, a file was changed since, or something cannot be written.
        """
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
            replace_files(back)
            for _, file, entry in entries:
                if entry["new"]:
                    file.unlink(missing_ok=True)
            self._remove(version)
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise ConfigError(f"the earlier version cannot be put back: {error}", file=version) from error
        return record["what"], list(back), len(numbers) - 1

    def _remove(self, version: Path) -> None:
        shutil.rmtree(version)
        if not any(self._folder.iterdir()):
            self._folder.rmdir()

    def _numbers(self) -> list[int]:
        if not self._folder.is_dir():
            return []
        return sorted(int(each.name) for each in self._folder.iterdir() if each.name.isdigit())


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
