"""In every file that people write a misspelt key is told with its place and the word that was meant."""

from __future__ import annotations

from pathlib import Path

import pytest

from florence_bt.app.bringup.robot_folder import FILE, read_robot_folder
from florence_bt.core.errors import ConfigError
from florence_bt.core.paths import find_data
from florence_bt.mission_testing.scenarios.scenario_file import Libraries, read_scenarios
from florence_bt.simulation.home.flat import load_flat
from florence_bt.skills.home_sensors.settings import load_home
from florence_bt.skills.locator.hotspots import load_hotspots
from florence_bt.skills.navigation.map_server.map_file import read_description
from florence_bt.trees.language.declared_skills import read_skills_file
from florence_bt.trees.language.findings import raise_first_error
from florence_bt.trees.language.parse import read_mission

MAP = (
    "image: a.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
)
FLAT = find_data("maps", "flat.source.yaml").read_text(encoding="utf-8")
HOTSPOTS = load_hotspots(find_data("hotspots", "flat.yaml"))

KINDS = {
    "a mission": (
        "mission: tea\ndescripton: hot\ntree:\n  wait: 1 s\n",
        "description",
        lambda file: raise_first_error(read_mission(file).findings),
    ),
    "skills": (
        "skills:\n  pour:\n    summary: pours\n    intputs: {}\n",
        "inputs",
        lambda file: raise_first_error(read_skills_file(file).findings),
    ),
    "scenarios": (
        "mission: explore\nscenarios:\n- name: it works\n  givn: {}\n  then: {status: SUCCEEDED}\n",
        "given",
        lambda file: raise_first_error(read_scenarios(file, Libraries()).findings),
    ),
    "the settings of a robot's folder": (
        "robot: robot.yaml\nmisions: [missions]\n",
        "missions",
        lambda file: read_robot_folder(file.parent),
    ),
    "a home": (
        "mqtt: {host: h}\nsensors:\n  pir: {rom: kitchen}\n",
        "room",
        lambda file: load_home(file, HOTSPOTS),
    ),
    "hotspots": ("hotspots:\n- {labl: hall, x: 1, y: 1}\n", "label", load_hotspots),
    "a map": (MAP.replace("negate", "negatte"), "negate", read_description),
    "a part of a flat": (FLAT.replace("phi_deg:", "phy_deg:", 1), "phi_deg", load_flat),
    "a flat": (FLAT.replace("\nseats:", "\nseets:"), "seats", load_flat),
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_misspelt_key(kind, tmp_path: Path) -> None:
    text, meant, read = KINDS[kind]
    names = {"skills": "tea.skills.yaml", "the settings of a robot's folder": FILE}
    file = tmp_path / names.get(kind, "tea.yaml")
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as error:
        read(file)
    lines = text.splitlines()
    told = error.value
    assert told.file == str(file) and told.line and told.column
    word = lines[told.line - 1][told.column - 1 :].split(":")[0]
    assert word != meant and word[:2] == meant[:2], f"it points at {word!r}"
    assert any(meant in each for each in told.valid), told
