"""Writes what the rig draws people by (``simulation/rig``) from the rows of ``tools/detection.py``.

``python tools/drawn_people.py``
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from florence_bt.simulation.rig.drawn_people import DISTANCES, FILE, SHOWN
from tools.detection import NOBODY, PERSON, PICTURE, TABLE, Line
from tools.tables import read_rows

PAGE = Path(__file__).resolve().parents[1] / "docs" / "notes" / "people.md"
STEPS = 11
HEAD = """\
# What simulation/rig/drawn_people.py draws by; python tools/drawn_people.py writes it from the rows of
# docs/notes/people.md. found: by share that is shown and by distance, [people, found]; errors: metres at even
# steps from 0 to 100 %; mistaken: of a picture, the chance that nobody is taken for somebody.
"""


def shares_of(lines: Sequence[Line]) -> dict[str, Any]:
    """Count who was found."""
    people = [line for line in lines if line.what == PERSON]
    kinds = sorted({line.kind for line in people})
    return {
        "kinds": {kind: _of_kind([line for line in people if line.kind == kind]) for kind in kinds},
        "mistaken": {"nobody_there": _mistaken(lines, True), "somebody_there": _mistaken(lines, False)},
    }


def _of_kind(people: Sequence[Line]) -> dict[str, Any]:
    found = [[[0, 0] for _ in DISTANCES] for _ in SHOWN]
    for line in people:
        assert line.shown is not None and line.distance is not None, "of a person"
        row, column = (
            int(np.searchsorted(edges, value, side="right")) - 1
            for edges, value in ((SHOWN, min(1.0, line.shown)), (DISTANCES, line.distance))
        )
        found[row][column][0] += 1
        found[row][column][1] += line.error is not None
    errors = [line.error for line in people if line.error is not None]
    steps = np.quantile(errors, np.linspace(0.0, 1.0, STEPS))
    return {"found": found, "errors": [round(float(each), 3) for each in steps]}


def _mistaken(lines: Sequence[Line], empty: bool) -> float:
    pictures, nobody = (
        sum((line.what, line.empty) == (what, empty) for line in lines) for what in (PICTURE, NOBODY)
    )
    return round(nobody / pictures, 5)


def text_of(lines: Sequence[Line]) -> str:
    """Write the file."""
    return HEAD + str(yaml.safe_dump(shares_of(lines), default_flow_style=None, width=110))


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the file."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "").parse_args(arguments)
    FILE.write_text(text_of(read_rows(TABLE.file_beside(PAGE), Line)), encoding="utf-8")
    print(f"{FILE} is written")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
