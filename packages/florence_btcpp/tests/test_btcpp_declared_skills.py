"""Files of declared skills that an import writes: what they say comes back."""

import pytest
from florence_btcpp.mission_text import write_yaml

from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.trees.language.declarations import own_declarations
from florence_bt.trees.language.declared_skills import read_skills_file, skills_document


@pytest.fixture
def written(tmp_path):
    def write(text, name="mine.skills.yaml"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_declarations_come_back(written):
    skill = SkillDeclaration(
        "grab",
        "Grab: a thing.",
        {"force": Port(Kind.NUMBER, "how hard", 0.5, 0.0, 1.0), "what": Port(Kind.TEXT, "", "")},
        {"weight": Port(Kind.NUMBER, "in kilograms")},
        {"slipped": "it fell"},
        frozenset({"arm", "base"}),
        12.5,
        True,
    )
    read = read_skills_file(written(write_yaml(skills_document([skill, SkillDeclaration("wave", "")]))))
    assert read.findings == ()
    assert read.declarations == {"grab": skill, "wave": SkillDeclaration("wave", "")}


def test_our_own_skills_come_back(written):
    own = own_declarations()
    read = read_skills_file(written(write_yaml(skills_document(own.values()))))
    assert read.findings == ()
    assert read.declarations == own
