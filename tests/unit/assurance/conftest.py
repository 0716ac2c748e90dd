"""Verifies missions that are given as text."""

from collections.abc import Callable
from pathlib import Path

import pytest

from florence_bt.assurance.explorer import Limits
from florence_bt.assurance.report import Verdict, verdict_on
from florence_bt.assurance.verifier import Verifier
from florence_bt.mission_testing.paths import all_declarations
from florence_bt.trees.language.loader import MissionLibrary

Verify = Callable[..., Verdict]


@pytest.fixture
def verify(tmp_path: Path) -> Verify:
    """Return what verifies the tree of a mission, which may call others by name."""

    def run(tree: str, head: str = "", limits: Limits | None = None, **others: str) -> Verdict:
        for name, text in {"tried": f"{head}\ntree:\n{tree}", **others}.items():
            text = f"mission: {name}\n{text}"
            (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
        library = MissionLibrary.load([tmp_path])
        assert not library.findings
        return verdict_on("tried", Verifier(library, all_declarations(), limits))

    return run
