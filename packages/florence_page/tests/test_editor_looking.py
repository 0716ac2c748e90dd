"""What the editor shows about a text, and the process that looks at it."""

from __future__ import annotations

import asyncio

import pytest
from florence_page.editor.helpers import ScenarioRuns, Worker
from florence_page.editor.looking import look_at

from florence_bt.core.errors import DeviceTimeout, FlorenceError

GOOD = """\
mission: tea
inputs:
  room: {type: text, default: kitchen, description: where to}
  fast: {type: boolean, default: false}
tree:
  sequence:
    - name: go
      run: goto_room
      with: {room: $room}
    # a pause
    - wait: 1 s
      when: $fast
"""


def test_findings_stand_at_their_places():
    look = look_at(GOOD.replace("wait: 1 s", "wate: 1 s"), "tea", [], None)
    (finding,) = [each for each in look["findings"] if each["severity"] == "error"]
    assert (finding["line"], finding["column"]) == (11, 7) and finding["valid"] == ["wait"]
    assert not look["fits"]


def test_the_outline_knows_the_lines_of_its_nodes():
    look = look_at(GOOD, "tea", [], None)
    assert look["fits"]
    assert [(row["depth"], row["line"], row["first"]) for row in look["outline"]] == [
        (0, 6, 6),
        (1, 8, 7),
        (1, 11, 11),
    ]
    assert [(each["name"], each["type"], each["default_value"]) for each in look["inputs"]] == [
        ("room", "text", "kitchen"),
        ("fast", "boolean", "false"),
    ]


def test_a_text_that_cannot_be_read_has_no_drawing_but_says_why():
    for text in ("", "mission: {", "- a\n- b", "\0", "mission: tea\ntree:\n  sequence:\n\t- wait: 1 s\n"):
        look = look_at(text, "tea", [], None)
        assert look["findings"] and not look["fits"]


def test_missions_of_the_folder_may_be_called(tmp_path):
    (tmp_path / "brew.yaml").write_text("mission: brew\ntree:\n  wait: 1 s\n")
    text = "mission: tea\ntree:\n  run: brew\n"
    assert look_at(text, "tea", [tmp_path], None)["fits"]
    assert not look_at(text, "tea", [], None)["fits"]


def test_the_process_answers_and_a_text_that_takes_too_long_harms_no_other():
    async def ask():
        patient, hasty = Worker(), Worker(0.05)
        with pytest.raises(DeviceTimeout):
            await hasty.ask("look", [], None, text=GOOD, name="tea")
        look = await patient.ask("look", [], None, text=GOOD, name="tea")
        with pytest.raises(FlorenceError, match="no folder"):
            await patient.ask("words", ["/does/not/exist"], None)
        await patient.close()
        again = await patient.ask("look", [], None, text="mission: {", name="tea")
        await asyncio.gather(patient.close(), hasty.close())
        return look, again

    look, again = asyncio.run(ask())
    assert look["fits"] and not again["fits"]


def test_scenarios_are_played_on_the_text_that_is_not_saved(tmp_path):
    file = tmp_path / "tea.yaml"
    file.write_text(
        "mission: tea\ngiven:\n  skills: {say: SUCCESS}\nscenarios:\n"
        "  - {name: it speaks, then: {status: SUCCEEDED, called: {say: 1}}}\n"
        "  - {name: it is silent, then: {status: SUCCEEDED, called: {say: 0}}}\n"
    )
    text = "mission: tea\ntree:\n  say: {text: tea is ready}\n"
    results = asyncio.run(ScenarioRuns().run("tea", text, file, [], print))
    assert [(each["name"], bool(each["problem"])) for each in results] == [
        ("it speaks", False),
        ("it is silent", True),
    ]
