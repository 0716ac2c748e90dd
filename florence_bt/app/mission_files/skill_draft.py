"""The draft of a skill without code, from the type of an action, service or topic; a person edits it."""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from florence_bt.app.mission_files.output import write_output
from florence_bt.core.declaration import Kind, Port
from florence_bt.core.errors import ConfigError
from florence_bt.core.interfaces import holds, load_interface, part_of
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.declared_skills import ENDING, TO_BE_SAID, port_document, read_skills_file
from florence_bt.trees.language.message_mappings import WAYS
from florence_bt.trees.language.vocabulary import IDENTIFIER, RESERVED

_KINDS = (
    *(Kind.TEXT, Kind.BOOLEAN, Kind.NUMBER, Kind.INTEGER, Kind.POSE, Kind.DURATION, Kind.ANGLE),
    *(Kind.LIST_OF_TEXT, Kind.LIST_OF_BOOLEAN, Kind.LIST_OF_NUMBER, Kind.LIST_OF_INTEGER, Kind.LIST_OF_POSE),
)
"""What a field is drafted as: the first of these that it holds."""
_NO_POSES = ("geometry_msgs/Point", "geometry_msgs/Point[]", "sequence<geometry_msgs/Point>")
"""They hold the place of a pose, and mostly are something else: a way, or the corner of a box."""
_WORDS = ("error_msg", "error_message", "message", "status_message", "reason", "note", "why")
"""Fields that have the server's own words."""
_FINE = ("OK", "NONE", "SUCCESS", "SUCCEEDED", "NO_ERROR")
"""Constants that name no failure."""
_MOST_FIELDS = 20
"""A draft takes no more fields of a part; a picture has more."""
LONGEST_NAME = 60
DEADLINES = {"action": "1 min", "service": "5 s", "wait_for": "1 min"}


def draft_skill(
    way: str, name: str, interface: str, skill: str = "", *, latched: bool = False
) -> tuple[str, str]:
    """Draft a skill.

    Args:
        way: One of :data:`WAYS`.
        name: The name of the action, service or topic.
        interface: Its type, such as ``nav2_msgs/action/Spin``.
        skill: The name of the skill; made of the other name when empty.
        latched: Whether the topic gives its last message to who comes later.

    Returns:
        The name of the skill, and its entry for a file of skills, as text.

    Raises:
        ConfigError: The type is not installed, or is of another kind, or the skill cannot be called that.
    """
    loaded = load_interface(interface)
    parts = WAYS[way]
    skill = skill or _skill_name(name)
    _check_name(skill)
    entry: dict[str, Any] = {"summary": f"{TO_BE_SAID.capitalize()} what {skill.replace('_', ' ')} does."}
    sent = dict(_fields(part_of(loaded, parts.sent))) if parts.sent is not None else {}
    answered = dict(_fields(part_of(loaded, parts.answered))) if parts.answered is not None else {}
    names = {path: path.replace(".", "_") for path in sent}
    if sent:
        entry["inputs"] = {names[path]: _input(kind) for path, kind in sent.items()}
    words = next((path for path in _WORDS if answered.get(path) is Kind.TEXT), "")
    failures = _failures(part_of(loaded, parts.answered), answered) if parts.answered is not None else {}
    code = _code_field(part_of(loaded, parts.answered), answered) if parts.answered is not None else ""
    used = {words, "success", *([code] if failures else [])}
    outputs = {path: kind for path, kind in answered.items() if path not in used}
    if outputs and way != "condition":
        entry["outputs"] = {path.replace(".", "_"): _output(path, kind) for path, kind in outputs.items()}
    plain = {path: kind for path, kind in outputs.items() if "." not in path and kind in _EXAMPLES}
    if way == "condition" and plain:
        path, kind = next(iter(plain.items()))
        entry["failures"] = {"not_so": {"meaning": f"{TO_BE_SAID} what fails", "when": _example(path, kind)}}
    elif failures:
        entry["failures"] = failures
    if way in DEADLINES:
        entry["deadline"] = DEADLINES[way]
    entry |= {way: name, "type": interface}
    if sent:
        entry["send"] = {path: f"${names[path]}" for path in sent}
    if words:
        entry["reason"] = words
    if latched and way == "condition":
        entry["latched"] = True
    text = yaml.safe_dump({skill: entry}, sort_keys=False, default_flow_style=None, width=110)
    return skill, "".join(f"  {line}\n" for line in text.splitlines())


def add_to_file(file: Path, skill: str, entry: str) -> None:
    """Add a drafted skill to a file of skills, which is made when there is none.

    Raises:
        ConfigError: The file is no file of skills, has the skill already, or cannot be written.
    """
    if not file.name.endswith(ENDING):
        raise ConfigError(f"{file} does not end with {ENDING}", valid=[f"{file.stem}{ENDING}"])
    before = "skills:\n"
    if file.exists():
        if skill in read_skills_file(file).declarations:
            raise ConfigError(f"{file} has a skill {skill!r} already", valid=["--skill OTHER_NAME"])
        before = file.read_text(encoding="utf-8").rstrip("\n") + "\n\n"
    write_output(file, before + entry, make_folder=True)


def _check_name(skill: str) -> None:
    """Refuse a name that no mission could use, or that another skill has.

    Raises:
        ConfigError: It is one.
    """
    fine = _skill_name(skill)[:LONGEST_NAME]
    if not IDENTIFIER.fullmatch(skill) or len(skill) > LONGEST_NAME:
        what = f"a skill cannot be called {skill[:LONGEST_NAME]!r}: small letters, digits and _, at most "
        raise ConfigError(f"{what}{LONGEST_NAME}", valid=[f"--skill {fine}"])
    if skill in RESERVED or keyword.iskeyword(skill):
        raise ConfigError(f"{skill!r} means something else already", valid=[f"--skill my_{skill}"])
    if skill in collect_declarations():
        raise ConfigError(f"Florence has a skill {skill!r} itself", valid=[f"--skill my_{skill}"])


def _skill_name(name: str) -> str:
    last = re.sub(r"[^a-z0-9]+", "_", name.rstrip("/").rpartition("/")[2].lower()).strip("_")
    plain = last if re.match(r"[a-z]", last) else f"do_{last}"
    return f"{plain}_skill" if plain in RESERVED else plain


def _fields(message_type: Any, above: str = "") -> Iterator[tuple[str, Kind]]:
    """Yield the fields that values can stand for, by path; deeper ones where the message has no kind."""
    count = 0
    for name, written in message_type.get_fields_and_field_types().items():
        path = f"{above}{name}"
        kind = next((kind for kind in _KINDS if holds(kind, written)), None)
        if written in _NO_POSES:
            kind = None
        if written == "std_msgs/Header" or count >= _MOST_FIELDS:
            continue
        if kind is not None:
            count += 1
            yield path, kind
        elif "/" in written and "[" not in written and "<" not in written:
            package, last = written.split("/")
            for deeper in _fields(load_interface(f"{package}/msg/{last}"), f"{path}."):
                count += 1
                yield deeper


def _failures(message_type: Any, answered: Mapping[str, Kind]) -> dict[str, Any]:
    """Draft a failure for each error code that the type names, and for the success that it denies."""
    found: dict[str, Any] = {}
    code = _code_field(message_type, answered)
    if code:
        for name, number in sorted(_constants(message_type), key=lambda pair: pair[1]):
            if number != 0 and name not in _FINE:
                found[name.lower()] = {"when": f"${code} == {number}"}
        if not found:
            found["gave_up"] = {"meaning": f"{TO_BE_SAID} what fails", "when": "$error_code != 0"}
    if answered.get("success") is Kind.BOOLEAN:
        found["refused"] = {"when": "not $success"}
    return found


def _code_field(message_type: Any, answered: Mapping[str, Kind]) -> str:
    """Return the field that says what went wrong: ``error_code``, or the one integer beside constants."""
    integers = [path for path, kind in answered.items() if kind is Kind.INTEGER and "." not in path]
    if "error_code" in integers:
        return "error_code"
    return integers[0] if len(integers) == 1 and _constants(message_type) else ""


def _constants(message_type: Any) -> list[tuple[str, int]]:
    names = [name for name in dir(type(message_type)) if name.isupper() and not name.startswith("_")]
    values = [(name, getattr(message_type, name)) for name in names]
    return [(name, value) for name, value in values if isinstance(value, int)]


def _input(kind: Kind) -> dict[str, Any]:
    """Return an input of a kind; a text may be left out, as fields of texts mostly may."""
    return {"type": "text", "default": ""} if kind is Kind.TEXT else port_document(Port(kind, ""))


def _output(path: str, kind: Kind) -> dict[str, Any]:
    port = port_document(Port(kind, ""))
    return port if "." not in path else {**port, "from": path}


_EXAMPLES = {
    Kind.BOOLEAN: "not ${path}",
    Kind.TEXT: '${path} != "something"',
    Kind.NUMBER: "${path} < 1",
    Kind.INTEGER: "${path} < 1",
}
"""How a condition can be about a field."""


def _example(path: str, kind: Kind) -> str:
    return _EXAMPLES[kind].replace("{path}", path)
