"""The paths that commands write to, as people type them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import click

from florence_bt.core.errors import ConfigError


class OutputPath(click.ParamType):
    """A file or a folder that is written to; ``~`` is the home folder, also where shells leave it.

    Args:
        folder: Whether it is a folder.
    """

    def __init__(self, *, folder: bool = False) -> None:
        self._folder = folder
        # Typer has a Click of its own, to which this is a function: its help shows the function's name.
        self.name = self.__name__ = "folder" if folder else "file"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Return the path.

        Raises:
            ConfigError: It is a folder in place of a file, or the other way round, or cannot be looked at.
        """
        typed = os.fspath(value)
        problem = self._problem(typed)
        if problem:
            valid = "the name of a folder" if self._folder else "the name of a file"
            raise ConfigError(f"{typed!r} cannot be written to: {problem}", valid=[valid])
        return Path(os.path.expanduser(typed))

    def _problem(self, typed: str) -> str:
        """Say why a path cannot be written to; empty when nothing is known against it."""
        path = os.path.expanduser(typed)
        if not typed:
            return "it is empty"
        if path.startswith("~"):
            return "there is no such user"
        if not self._folder and (typed.endswith(os.sep) or os.path.isdir(path)):
            return "it is a folder"
        if self._folder and os.path.isfile(path):
            return "it is a file"
        try:
            os.lstat(path)
        except FileNotFoundError:
            return ""
        except OSError as error:
            return error.strerror or str(error)
        return ""


OUTPUT_FILE = OutputPath()
OUTPUT_FOLDER = OutputPath(folder=True)
