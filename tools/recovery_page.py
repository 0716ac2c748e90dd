"""The recovery of drives in ``docs/navigation.md``: diagram and table, written from the code's own table.

``python tools/recovery_page.py docs/navigation.md`` writes them.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from florence_bt.skills.navigation.navigate.recovery import as_mermaid, as_table

BEGIN, END = "<!-- recovery -->", "<!-- end of recovery -->"


def with_recovery(page: str) -> str:
    """The page with the part between its markers written anew."""
    before, rest = page.split(BEGIN)
    after = rest.split(END)[1]
    return f"{before}{BEGIN}\n\n```mermaid\n{as_mermaid()}\n```\n\n{as_table()}\n\n{END}{after}"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("page", type=Path, help="where to, e.g. docs/navigation.md")
    page = parser.parse_args().page
    page.write_text(with_recovery(page.read_text(encoding="utf-8")), encoding="utf-8")
