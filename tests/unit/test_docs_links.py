"""Every link of a page leads to a file, and to a heading of it; every page that is named exists."""

import re
from collections import Counter
from functools import cache
from pathlib import Path
from urllib.parse import unquote

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("docs", "florence_bt", "packages", "examples", "tests", "tools", "benchmarks", "config", "maps")
PAGES = sorted([*ROOT.glob("*.md"), *(page for folder in FOLDERS for page in (ROOT / folder).rglob("*.md"))])
LINK = re.compile(r"\]\(([^)\s#]*)(?:#([^)\s]+))?\)")
NAMED = re.compile(r"(?<![\w/.])docs/[\w/]+\.\w+")
BLOCK = re.compile(r"^( *)```.*?^\1```", re.DOTALL | re.MULTILINE)


def prose(page: Path) -> str:
    """A page without its blocks of code."""
    return BLOCK.sub("", page.read_text(encoding="utf-8"))


@cache
def anchors(page: Path) -> frozenset[str]:
    """What can stand behind ``#``, as GitHub and the site make it of headings."""
    seen: Counter[str] = Counter()
    found = set()
    for title in re.findall(r"^#+ (.*)$", prose(page), re.MULTILINE):
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", title)
        anchor = re.sub(r"[^\w\- ]", "", plain.strip().lower()).replace(" ", "-")
        found.add(f"{anchor}-{seen[anchor]}" if seen[anchor] else anchor)
        seen[anchor] += 1
    return frozenset(found)


def dead_links(page: Path) -> list[str]:
    dead = []
    for target, anchor in LINK.findall(re.sub(r"`[^`\n]*`(?!\])", "", prose(page))):
        if re.match(r"\w+:", target):
            continue
        path = page.parent / unquote(target) if target else page
        if not path.exists() or (anchor and path.suffix == ".md" and anchor not in anchors(path)):
            dead.append(f"{target}#{anchor}")
    return dead


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_the_links_of_a_page_lead_somewhere(page):
    assert dead_links(page) == []


def test_dead_links_are_found(tmp_path):
    (tmp_path / "other.md").write_text("# One, two\n```sh\n# no heading\n```\n")
    page = tmp_path / "page.md"
    page.write_text(
        "[a](other.md#one-two) [b](other.md#no-heading) [c](gone.md) `[d](code.md)` [e](https://f.org)"
    )
    assert dead_links(page) == ["other.md#no-heading", "gone.md#"]


@pytest.mark.parametrize("folder", (".", *FOLDERS))
def test_the_pages_that_are_named_exist(folder):
    files = ROOT.glob("*") if folder == "." else (ROOT / folder).rglob("*")
    gone = []
    for file in files:
        if file.suffix in {".py", ".md", ".yaml", ".toml", ".xml"} or file.name == "Makefile":
            text = file.read_text(encoding="utf-8")
            gone += [(str(file), name) for name in NAMED.findall(text) if not (ROOT / name).exists()]
    assert gone == []
