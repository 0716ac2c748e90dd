"""Verdicts on mutations, each kept as soon as it is known: what was interrupted goes on where it was."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

from tools.mutants.mutations import Mutation
from tools.mutants.trying import Verdict


class Verdicts:
    """A file with a line for each verdict: a sum of the mutation and its tests, and the verdict's name.

    Args:
        file: Belongs to one state of the code and the tests.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        lines = file.read_text().splitlines() if file.exists() else []
        self._known = {key: Verdict[name] for key, _, name in (line.partition(" ") for line in lines)}

    def of(self, mutation: Mutation, tests: Sequence[str]) -> Verdict | None:
        """Return what these tests said of a mutation, None when they were not asked to the end."""
        return self._known.get(_key(mutation, tests))

    def keep(self, mutation: Mutation, tests: Sequence[str], verdict: Verdict) -> None:
        """Write down what tests said."""
        self._known[_key(mutation, tests)] = verdict
        self._file.parent.mkdir(parents=True, exist_ok=True)
        with self._file.open("a") as opened:
            opened.write(f"{_key(mutation, tests)} {verdict.name}\n")


def _key(mutation: Mutation, tests: Sequence[str]) -> str:
    text = "\0".join((mutation.path, mutation.text, *tests))
    return hashlib.sha256(text.encode()).hexdigest()[:16]
