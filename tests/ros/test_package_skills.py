"""Skills of installed packages on the robot: they join ours, and a broken package takes nothing away."""

import sys

import pytest

SKILLS = """
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import success
from florence_bt.core.skill import InstantSkill

ACT = SkillDeclaration("act", "Act")


def make_skills(node):
    return {"act": InstantSkill(lambda inputs: success()), "turn": None}
"""


BAD = """
from florence_bt.core.declaration import SkillDeclaration

SPEAK = SkillDeclaration("speak", "Speak")


def make_skills(node):
    raise ValueError('no voice')
"""
HALF = """
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import success
from florence_bt.core.skill import InstantSkill

WAVE, DANCE, SING = (SkillDeclaration(name, name) for name in ("wave_hand", "dance", "sing"))


def dance():
    import no_such_library


def make_skills(node):
    return {"wave_hand": lambda: InstantSkill(lambda inputs: success()), "dance": dance}
"""


@pytest.mark.ros
def test_skills_of_packages_join_ours(ros, tmp_path, monkeypatch, capfd):
    from florence_bt.app.bringup.skills_ros import make_skills
    from florence_bt.ros.node import FlorenceNode

    sources = {"good_pkg": SKILLS, "bad_pkg": BAD, "half_pkg": HALF}
    for name, text in sources.items():
        (tmp_path / f"{name}.py").write_text(text)
        info = tmp_path / f"{name}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(f"[florence_bt.skills]\n{name} = {name}\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    try:
        skills = make_skills(ros.add(FlorenceNode("package_skills")))
    finally:
        for name in sources:
            sys.modules.pop(name, None)
    assert skills["act"].start({}).poll().succeeded
    assert skills["turn"] is not None
    said = capfd.readouterr().err
    assert "package bad_pkg: the skill 'speak' is missing: make_skills of bad_pkg failed: ValueError" in said
    assert skills["wave_hand"].start({}).poll().succeeded
    for name, reason in (
        ("speak", "make_skills of bad_pkg failed: ValueError: no voice"),
        ("dance", "its factory in half_pkg failed: ModuleNotFoundError: No module named 'no_such_library'"),
        ("sing", "make_skills of half_pkg does not make it"),
    ):
        result = skills[name].start({}).poll()
        assert (result.code, result.reason) == ("no_skill", reason)
    assert "package good_pkg: its skill 'turn' is ignored: the name is taken" in said
