"""Verifies one mission, as a process: a request comes as a line of JSON, and the answer goes out as one.

``python -m florence_page.editor.verification``. Whoever does not want to wait any longer ends it.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from florence_bt.app.mission_files.verifying import verify_text
from florence_bt.assurance.problems import BROKEN, Problem, place_of
from florence_bt.assurance.report import Verdict, facts_of, headline_of, way_to
from florence_bt.assurance.scenario import write_scenario
from florence_bt.core.errors import FlorenceError
from florence_bt.core.text_files import MAX_MISSION_BYTES, decode, read_bytes
from florence_page.editor.worker import MEMORY_BYTES, NICENESS

MISSION_LIMIT_S = 30.0
"""How long each mission may be explored, in seconds of the processor: as for ``florence verify``."""


def answer(request: Mapping[str, Any]) -> dict[str, Any]:
    """Verify a mission.

    Args:
        request: ``text``: the mission; ``file``: where it stands, or will; ``folders`` of missions.

    Returns:
        ``problem``: why it cannot be verified; else ``holds``, ``headline``, ``facts`` (lines) and
        ``problems``. Each of these has ``severity``, ``text``, ``kind``, ``way`` (lines), ``line`` and
        ``column`` of the mission (0: nowhere in it), ``file`` (another one in which the property stands, else
        empty) and ``scenario``: the text of a file that shows it; empty when none does, or when the mission
        is not saved.
    """
    text, file = str(request["text"]), Path(request["file"])
    try:
        verdict = verify_text(text, file, [Path(each) for each in request["folders"]], MISSION_LIMIT_S)
    except FlorenceError as error:
        return {"problem": str(error)}
    saved = file.is_file() and _written(file).rstrip("\n") == text.rstrip("\n")
    return {
        "holds": verdict.holds,
        "headline": headline_of(verdict),
        "facts": facts_of(verdict),
        "problems": [_problem(verdict, each, saved=saved) for each in verdict.problems],
    }


def _written(file: Path) -> str:
    return decode(read_bytes(file, MAX_MISSION_BYTES), file, MAX_MISSION_BYTES)


def _problem(verdict: Verdict, problem: Problem, *, saved: bool) -> dict[str, Any]:
    place = place_of(verdict.explored, problem)
    elsewhere = problem.file is not None and problem.file != verdict.mission.file
    return {
        "severity": "error" if problem.severity == BROKEN else "warning",
        "text": problem.text,
        "kind": problem.kind,
        "way": way_to(verdict, problem) if problem.path else [],
        "line": place.line if place is not None else 0,
        "column": place.column if place is not None else 0,
        "file": problem.file.name if elsewhere and problem.file is not None else "",
        "scenario": _scenario(verdict, problem) if saved and problem.severity == BROKEN else "",
    }


def _scenario(verdict: Verdict, problem: Problem) -> str:
    """Return a scenario that shows a problem; empty when there is none."""
    with tempfile.TemporaryDirectory(prefix="florence_verified_") as folder:
        file = Path(folder) / f"{verdict.mission.name}.yaml"
        return file.read_text(encoding="utf-8") if write_scenario(verdict.explored, problem, file) else ""


def main() -> None:
    """Answer the first line of the input."""
    os.nice(NICENESS)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    print(json.dumps(answer(json.loads(sys.stdin.readline()))), flush=True)


if __name__ == "__main__":
    main()
