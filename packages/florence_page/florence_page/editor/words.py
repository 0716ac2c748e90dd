"""What can be written in a mission: words of the language, skills, missions and codes, and what they mean."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from florence_bt.core.declaration import Port, SkillDeclaration
from florence_bt.core.units import UNITS
from florence_bt.skills.locator.hotspots import load_hotspots
from florence_bt.trees import kinds
from florence_bt.trees.kinds.words import OWNERS
from florence_bt.trees.language import vocabulary
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.findings import ERROR
from florence_bt.trees.language.loader import BUILT_IN, MissionLibrary
from florence_bt.trees.language.quantities import example_of
from florence_bt.trees.language.schema import make_schema

Words = Mapping[str, Any]
"""See :func:`words_of`."""

TEMPLATES: Mapping[str, tuple[str, str]] = {
    "say": (
        "say something",
        """\
mission: {name}
description: The robot says something.
tree:
  say: {{text: Good morning!}}
""",
    ),
    "go": (
        "go to a room and say something",
        """\
mission: {name}
description: The robot drives to a room and says something there.
inputs:
  room: {{type: text, default: kitchen, description: where to drive}}
tree:
  sequence:
    - run: goto_room
      with: {{room: $room}}
    - say: {{text: "I am in the $room."}}
""",
    ),
    "rooms": (
        "look for somebody in several rooms",
        """\
mission: {name}
description: The robot looks into some rooms until it sees somebody.
outputs:
  user: {{type: pose, description: where somebody was seen}}
tree:
  for_each: [kitchen, living_room, bedroom]
  as: room
  first_success: true
  do:
    sequence:
      - run: goto_room
        with: {{room: $room}}
      - run: detect_user
        out: {{user: user}}
""",
    ),
    "careful": (
        "a mission that copes with failure",
        """\
mission: {name}
description: The robot goes to a room; when it does not get there, it says so and goes home.
inputs:
  room: {{type: text, default: kitchen, description: where to drive}}
tree:
  run: goto_room
  with: {{room: $room}}
  on_failure:
    any:
      sequence:
        - say: {{text: "I could not get to the $room."}}
        - run: go_home
""",
    ),
}
"""Template -> what it is, and the text of a new mission."""


def words_of(folders: Sequence[Path], hotspots: Path | None) -> dict[str, Any]:
    """Collect what can be written, for the skills and missions of this installation.

    Args:
        folders: Folders of missions beside those that come with Florence.
        hotspots: The places of the home; None takes any label.

    Returns:
        ``top``, ``nodes``, ``codes``, ``ports``, ``kinds`` (of values), ``properties``, ``policies``,
        ``restarts``: word -> what it means; ``beside_property``: word of a property -> what belongs to it;
        ``units``: kind of value -> its units; ``node_kinds``: kind -> a node of it as text;
        ``modifiers``: modifier -> the kinds that it belongs to, None for all; ``skills`` and ``missions``:
        name -> ``about``, ``inputs``, ``outputs``, ``snippet``; for skills also ``summary``, for missions
        ``own`` and ``problem``. An input has ``about``, ``kind`` and the ``labels`` that it may name.

    Raises:
        ConfigError: A folder or the hotspots cannot be read.
    """
    labels = load_hotspots(hotspots).by_name() if hotspots is not None else {}
    library = MissionLibrary.load(folders)
    skills = dict(sorted({**library.declarations, **collect_declarations()}.items()))
    schema = make_schema(skills, library.missions(), labels)
    nodes = schema["definitions"]["node"]["properties"]
    top = schema["properties"]
    problems = {name: str(error) for name, error in library.unreadable().items()}
    return {
        "top": {name: each["description"] for name, each in top.items()},
        "nodes": {name: each["description"] for name, each in nodes.items()},
        "codes": _choices(schema["definitions"]["wanted_code"]["anyOf"][0]),
        "ports": {
            name: each.get("description", "")
            for name, each in top["inputs"]["additionalProperties"]["properties"].items()
        },
        "kinds": _choices(top["inputs"]["additionalProperties"]["properties"]["type"]),
        "properties": {
            name: each["description"] for name, each in top["properties"]["items"]["properties"].items()
        },
        "beside_property": {word: list(others) for word, others in vocabulary.BESIDE_PROPERTY.items()},
        "policies": _choices(nodes["policy"]["anyOf"][0]),
        "restarts": _choices(top["on_restart"]),
        "units": {kind.value: list(units) for kind, units in UNITS.items()},
        "node_kinds": {word: node.kind.example for word, node in kinds.BY_WORD.items()},
        "modifiers": {
            **dict.fromkeys(vocabulary.ANYWHERE, None),
            **{name: list(kinds) for name, kinds in OWNERS.items()},
        },
        "skills": {name: _skill(name, skill, nodes[name], labels) for name, skill in skills.items()},
        "missions": {
            **{
                mission.name: {
                    "about": mission.description,
                    **_ports(mission.inputs, mission.outputs, labels),
                    "snippet": _call(mission.name, mission.inputs, mission.outputs),
                    "own": not mission.file.is_relative_to(BUILT_IN),
                    "problem": next((str(f.as_error()) for f in mission.findings if f.severity == ERROR), ""),
                }
                for mission in library.missions()
            },
            **{
                name: {"about": "", **_ports({}, {}, {}), "snippet": "", "own": True, "problem": problem}
                for name, problem in problems.items()
            },
        },
    }


def _choices(schema: Mapping[str, Any]) -> dict[str, str]:
    return dict(zip(schema["enum"], schema["enumDescriptions"], strict=True))


def _skill(
    name: str, skill: SkillDeclaration, schema: Mapping[str, Any], labels: Mapping[str, Iterable[str]]
) -> dict[str, Any]:
    lines = [f"- {name}:", *(f"    {each}" for each in _required(skill.inputs))]
    return {
        "about": schema["description"],
        "summary": skill.summary,
        **_ports(skill.inputs, skill.outputs, labels),
        "snippet": "\n".join([*lines, *_out(skill.outputs)]),
    }


def _ports(
    inputs: Mapping[str, Port], outputs: Mapping[str, Port], labels: Mapping[str, Iterable[str]]
) -> dict[str, Any]:
    return {
        "inputs": {
            name: {
                "about": port.description or port.kind.value,
                "kind": port.kind.value,
                "labels": list(port.choices or labels.get(port.names, ())),
            }
            for name, port in inputs.items()
        },
        "outputs": {name: port.description or port.kind.value for name, port in outputs.items()},
    }


def _call(name: str, inputs: Mapping[str, Port], outputs: Mapping[str, Port]) -> str:
    needed = list(_required(inputs))
    table = ["  with:", *(f"    {each}" for each in needed)] if needed else []
    return "\n".join([f"- run: {name}", *table, *_out(outputs)])


def _required(ports: Mapping[str, Port]) -> Iterable[str]:
    return (f"{name}: {example_of(port.kind)}" for name, port in ports.items() if port.required)


def _out(ports: Mapping[str, Port]) -> list[str]:
    return [f"  out: {{{', '.join(f'{name}: {name}' for name in ports)}}}"] if ports else []
