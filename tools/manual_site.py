"""Hooks for the site of the manual (``make manual``), where it differs from GitHub; mkdocs calls them.

Links to files of the repository that are not below ``docs/`` name the file instead, and a file that is not
there is a warning, which ends a strict build. Words behind the language of a block of code become its title.
A diagram would need a script from another site and is left out: its table stands beside it. The search finds
the manual before the other pages.
"""

from __future__ import annotations

import logging
import os
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
OUTSIDE = re.compile(r"(?<!!)\[([^\]]*)\]\(((?:\.\./)+)([^)\s#]*)(?:#[^)\s]*)?\)")
FENCE = re.compile(r"^( *```)(\w+) +(\S.*)$", re.MULTILINE)
DIAGRAM = re.compile(r"^```mermaid\n.*?^```\n", re.DOTALL | re.MULTILINE)
BOOSTS = {"manual": 2.0, "notes": 0.5}
"""Folder -> how much more than others its pages count for the search."""


SHIM = "https://unpkg.com/iframe-worker/shim"
"""The script that the theme would fetch for the search in pages opened from the disk; we have our own
copy."""


def on_post_page(output: str, *, page: Any, **_: Any) -> str:
    """Take the script of the search from the site itself."""
    return output.replace(SHIM, f"{'../' * page.file.src_uri.count('/')}site/iframe-worker.js")


def on_post_template(output: str, **_: Any) -> str:
    """Do so for the page that tells of an unknown address, which links from the top."""
    return output.replace(SHIM, "/site/iframe-worker.js")


def on_page_markdown(markdown: str, *, page: Any, **_: Any) -> str:
    """Name files of the repository that are not on the site, in place of a link."""
    source = Path("docs") / page.file.src_uri
    page.meta.setdefault("search", {"boost": BOOSTS.get(source.parent.name, 1.0)})

    def named(link: re.Match[str]) -> str:
        text, target = link[1], os.path.normpath(source.parent / (link[2] + link[3]))
        if Path(target).parts[0] == "docs":
            return link[0]
        if not (ROOT / target).exists():
            logging.getLogger("mkdocs.hooks").warning("%s links to %s, which is not there", source, target)
        return text if target in text else f"{text} (`{target}`)"

    return OUTSIDE.sub(named, FENCE.sub(_titled, DIAGRAM.sub("", markdown)))


def _titled(fence: re.Match[str]) -> str:
    """Name the file that a block shows, or the terminal that it is typed in; other words are for tools."""
    word = fence[3].split()[0]
    if "=" in word or ("/" not in word and fence[2] != "console"):
        return fence[1] + fence[2]
    return f'{fence[1]}{fence[2]} title="{word if "/" in word else f"in the terminal of the {word}"}"'
