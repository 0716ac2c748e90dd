"""The recovery of drives in ``docs/notes/navigation.md``: diagram and table, from the code's own table.

``python tools/recovery_page.py docs/notes/navigation.md`` writes them.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from florence_bt.skills.navigation.navigate.recovery import as_mermaid, as_table
from tools.tables import write_between_marks

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("page", type=Path, help="where to, e.g. docs/notes/navigation.md")
    text = f"```mermaid\n{as_mermaid()}\n```\n\n{as_table()}"
    write_between_marks(parser.parse_args().page, "recovery", text)
