"""Every section of docs/REFERENCE.md that the code, the tests or the docs cite exists."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PLACES = ("florence_bt", "tests", "tools", "benchmarks", "docs", "examples", "urdf", "config", "maps")
CITATION = re.compile(
    r"REFERENCE(?:\.md)?[,:\s]*(?:sections?\s+|§\s*)?(\d+(?:\.\d+)?(?:(?:,|\s+and|\s+to)\s+\d+(?:\.\d+)?(?!\s*[A-Za-z]))*)"
)


def sections() -> set[str]:
    text = (ROOT / "docs" / "REFERENCE.md").read_text(encoding="utf-8")
    return set(re.findall(r"^#{2,3} (\d+(?:\.\d+)?)[. ]", text, re.M))


def cited(text: str) -> list[str]:
    return [number for found in CITATION.findall(text) for number in re.findall(r"\d+(?:\.\d+)?", found)]


def test_citations_are_read_as_people_write_them():
    assert cited("(REFERENCE 4.6, 4.7)") == ["4.6", "4.7"]
    assert cited("REFERENCE 1.3\nREFERENCE 2.4, row 9; REFERENCE section 12.8") == ["1.3", "2.4", "12.8"]


@pytest.mark.parametrize("place", PLACES)
def test_cited_sections_exist(place):
    there, missing = sections(), []
    for file in (ROOT / place).rglob("*"):
        if file.suffix in {".py", ".md", ".yaml", ".xacro"} and file.name != "REFERENCE.md":
            missing += [
                (str(file), number)
                for number in cited(file.read_text(encoding="utf-8"))
                if number not in there
            ]
    assert not missing


def test_there_are_sections_and_citations():
    assert {"1.1", "13"} <= sections()
    assert len(cited("".join(file.read_text() for file in (ROOT / "florence_bt").rglob("*.py")))) > 100
