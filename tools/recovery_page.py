"""The recovery of drives in ``docs/notes/navigation.md``: diagram and table, from the code's own table.

``python tools/recovery_page.py docs/notes/navigation.md`` writes them.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from florence_bt.skills.navigation.navigate.recovery import RECOVERY_BEHAVIOURS, TRANSITIONS, DriveState
from tools.tables import write_between_marks


def as_mermaid() -> str:
    """Draw the table as a state diagram in Mermaid."""
    lines = ["stateDiagram-v2", "    [*] --> planning"]
    names = {state: state.value.replace(" ", "_") for state in DriveState}
    for (state, event), after in TRANSITIONS.items():
        lines.append(f"    {names[state]} --> {names[after]}: {event.value}")
    for state in (DriveState.SUCCEEDED, DriveState.ABORTED):
        lines.append(f"    {names[state]} --> [*]")
    return "\n".join(lines)


def as_table() -> str:
    """Write the table and the order of the recovery behaviours in Markdown."""
    rows = [
        f"| {state.value} | {event.value} | {after.value} |" for (state, event), after in TRANSITIONS.items()
    ]
    order = ", ".join(behaviour.value for behaviour in RECOVERY_BEHAVIOURS)
    return "\n".join(
        [
            "| state | event | next |",
            "|---|---|---|",
            *rows,
            "",
            f"Recovery behaviours in order: {order}.",
        ]
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("page", type=Path, help="where to, e.g. docs/notes/navigation.md")
    text = f"```mermaid\n{as_mermaid()}\n```\n\n{as_table()}"
    write_between_marks(parser.parse_args().page, "recovery", text)
