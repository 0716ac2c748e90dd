"""The manual as a site: it is whole, finds what is looked for, and needs nothing from outside."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from tools.manual_site import on_page_markdown

ROOT = Path(__file__).parents[3]
LOADED = re.compile(
    r"<(?:script|img|iframe)[^>]* src=\"?https?:|<link[^>]* href=\"?https?:|url\(\"?https?:|@import"
)


@pytest.mark.slow
def test_the_site_is_whole(tmp_path: Path) -> None:
    built = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--quiet", "--site-dir", str(tmp_path)],
        cwd=ROOT,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1", "PYTHONWARNINGS": "ignore"},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert built.returncode == 0, built.stdout + built.stderr
    for page in (ROOT / "docs").rglob("*.md"):
        name = page.relative_to(ROOT / "docs").with_suffix(".html")
        assert (tmp_path / name.parent / name.name.replace("README", "index")).exists()
    for file in (*tmp_path.rglob("*.html"), *tmp_path.rglob("*.css")):
        assert not LOADED.search(file.read_text(encoding="utf-8")), file
    found = json.loads((tmp_path / "search" / "search_index.json").read_text(encoding="utf-8"))["docs"]
    assert any(part["location"].startswith("manual/trouble.html#no_pose") for part in found)


def shown(text: str, page: str = "manual/first_hour.md") -> str:
    return on_page_markdown(text, page=SimpleNamespace(file=SimpleNamespace(src_uri=page), meta={}))


def test_links_to_files_that_are_not_on_the_site_name_the_file() -> None:
    assert shown("[the example](../../examples/foreign_robot/robot.py)") == (
        "the example (`examples/foreign_robot/robot.py`)"
    )
    assert shown("[missions](../reference/missions.md#wait)") == "[missions](../reference/missions.md#wait)"


def test_a_link_to_a_file_that_is_not_there_is_a_warning(caplog: pytest.LogCaptureFixture) -> None:
    shown("[gone](../../examples/gone.py)")
    assert "docs/manual/first_hour.md links to examples/gone.py" in caplog.text


@pytest.mark.parametrize(
    ("fence", "title"),
    [
        ("yaml my_missions/round.yaml", 'yaml title="my_missions/round.yaml"'),
        ("console flat until=ready", 'console title="in the terminal of the flat"'),
        ("console once=yes", "console"),
        ("yaml bad", "yaml"),
    ],
)
def test_words_for_tools_become_titles(fence: str, title: str) -> None:
    assert shown(f"```{fence}\n$ x\n```\n") == f"```{title}\n$ x\n```\n"
