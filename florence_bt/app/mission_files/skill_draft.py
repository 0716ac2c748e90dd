"""The draft of a skill without code, from the type of an action, service or topic; a person edits it."""

from __future__ import annotations

import keyword
import re
import textwrap
from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from florence_bt.app.mission_files.draft_fields import Fields, choices_of, fields_of, port_name
from florence_bt.app.mission_files.output import write_output
from florence_bt.core.answer_shape import AnswerShape, shape_of, written
from florence_bt.core.declaration import REQUIRED, Kind, Port
from florence_bt.core.errors import ConfigError
from florence_bt.core.interfaces import (
    load_interface,
    part_of,
)
from florence_bt.core.ros_names import check_ros_name
from florence_bt.trees.kinds.words import RESERVED
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.declared_skills import ENDING, TO_BE_SAID, port_document, read_skills_file
from florence_bt.trees.language.message_mappings import WAYS, MessageMapping
from florence_bt.trees.language.vocabulary import IDENTIFIER

_TRANSITION = "lifecycle_msgs/srv/ChangeState"
_MOST_SHOWN = 3
"""A draft tells no more fields of the feedback."""
LONGEST_NAME = 60
"""Characters of a skill's name. Chosen."""
DEADLINES = {"action": "1 min", "service": "5 s", "wait_for": "1 min"}


@dataclass(frozen=True, slots=True)
class Draft:
    """A drafted skill.

    Attributes:
        skill: Its name.
        entry: Its entry for a file of skills, as text; what it leaves out is a comment in it.
        left_out: The same for people: fields of the interface that the draft does not use, each with its type
            and why.
    """

    skill: str
    entry: str
    left_out: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Offer:
    """Something of a running system that a skill can be made of.

    Attributes:
        way: One of :data:`WAYS`.
        name: The whole name of the action, service or topic.
        interface: Its type.
        latched: Whether a topic gives its last message to who comes later.
    """

    way: str
    name: str
    interface: str
    latched: bool = False

    def __str__(self) -> str:
        """Return it as ``florence skills add`` takes it."""
        return f"{self.way} {self.name} {self.interface}"


def draft_skill(way: str, name: str, interface: str, skill: str = "", *, latched: bool = False) -> Draft:
    """Draft a skill.

    Args:
        way: One of :data:`WAYS`.
        name: The name of the action, service or topic.
        interface: Its type, such as ``nav2_msgs/action/Spin``.
        skill: The name of the skill; made of the other name when empty.
        latched: Whether the topic gives its last message to who comes later.

    Raises:
        ConfigError: The name is none of ROS, the type is not installed, or is of another kind, or the skill
            cannot be called that.
    """
    check_ros_name(name)
    loaded = load_interface(interface)
    skill = skill or _skill_name(name)
    _check_name(skill)
    sent, answered = (
        fields_of(part_of(loaded, part), lists=part == WAYS[way].answered) if part is not None else Fields()
        for part in (WAYS[way].sent, WAYS[way].answered)
    )
    entry: dict[str, Any] = {"summary": f"{TO_BE_SAID.capitalize()} what {skill.replace('_', ' ')} does."}
    names = {path: port_name(path) for path in sent.kinds}
    choices = choices_of(part_of(loaded, WAYS[way].sent or ""), sent.kinds) if sent.kinds else {}
    if sent.kinds:
        entry["inputs"] = {
            names[path]: _choice(choices[path]) if path in choices else _input(kind)
            for path, kind in sent.kinds.items()
        }
    left_out = [f"not sent: {each}" for each in sent.not_sent]
    if way == "condition":
        left_out += _judge(entry, answered)
    else:
        left_out += [f"no output: {each}" for each in answered.not_read]
    words = _take_answer(entry, loaded, way, answered)
    if way in DEADLINES:
        entry["deadline"] = DEADLINES[way]
    entry |= {way: name, "type": interface}
    if sent.kinds or sent.times:
        entry["send"] = {path: f"${names[path]}" for path in sent.kinds} | dict.fromkeys(sent.times, "now")
    if way == "action" and (shown := _shown(loaded.Feedback)):
        entry["feedback"] = shown
    if words:
        entry["reason"] = words
    if latched and way == "condition":
        entry["latched"] = True
    return Draft(skill, _entry(skill, entry, left_out), tuple(left_out))


class _Dumper(yaml.SafeDumper):
    """Writes the keys of a skill below one another, and what they have in one line."""


class _Block(dict[str, Any]):
    """A mapping whose keys stand below one another."""


_Dumper.add_representer(
    _Block, lambda dumper, data: dumper.represent_mapping("tag:yaml.org,2002:map", data, flow_style=False)
)


def _entry(skill: str, entry: Mapping[str, Any], left_out: Iterable[str] = ()) -> str:
    """Write the entry of a skill for a file of skills."""
    document = _Block({skill: _Block(entry)})
    text = yaml.dump(document, Dumper=_Dumper, sort_keys=False, default_flow_style=None, width=110)
    head, *rest = text.splitlines()
    comments = [f"  # {line}" for each in left_out for line in textwrap.wrap(each, 104)]
    return "".join(f"  {line}\n" for line in (head, *comments, *rest))


def _take_answer(entry: dict[str, Any], loaded: Any, way: str, answered: Fields) -> str:
    """Draft the outputs, and the failures of an answer that can say no; return the field with its words."""
    shape = AnswerShape()
    if way in ("action", "service"):
        shape = shape_of(part_of(loaded, str(WAYS[way].answered)))
    code = "" if shape.guessed else shape.code
    used = {shape.flag, code, shape.words if shape.words_only else ""}
    outputs = {path: kind for path, kind in answered.kinds.items() if path not in used}
    if outputs and way != "condition":
        entry["outputs"] = {port_name(path): _output(path, kind) for path, kind in outputs.items()}
    if failures := _failures(shape):
        entry["failures"] = failures
    return shape.words


def _judge(entry: dict[str, Any], answered: Fields) -> list[str]:
    """Draft what a condition asks for; return what it does not ask for."""
    plain = [path for path, kind in answered.kinds.items() if "." not in path and kind in _EXAMPLES]
    if plain:
        when = _example(plain[0], answered.kinds[plain[0]])
        entry["failures"] = {"not_so": {"meaning": f"{TO_BE_SAID} what fails", "when": when}}
    others = ", ".join(path for path in answered.kinds if path not in plain[:1])
    return [f"not judged: {each}" for each in (others, *answered.not_read) if each]


def draft_all(
    offers: Iterable[Offer], namespace: str, taken: Iterable[str] = ()
) -> tuple[list[Draft], list[str]]:
    """Draft a skill for everything that a robot offers.

    Args:
        offers: What there is.
        namespace: That of the robot, as ``/cart``; what lies outside is no part of it.
        taken: Names of skills that cannot be used.

    Returns:
        The drafts; and what has none, each with the reason.

    Raises:
        ConfigError: The namespace has nothing; with those that there are.
    """
    below = f"{namespace.rstrip('/')}/" if namespace.startswith("/") else f"/{namespace.strip('/')}/"
    known = list(offers)
    ours = [offer for offer in known if offer.name.startswith(below)]
    if not ours:
        others = dict.fromkeys(f"/{offer.name.split('/')[1]}" for offer in known if offer.name.count("/") > 1)
        raise ConfigError(f"nothing is below {below.rstrip('/') or '/'} now", valid=[*others])
    drafts: list[Draft] = []
    without: list[str] = []
    names = {*taken, *collect_declarations()}
    for offer in ours:
        try:
            problem = _unfit(offer)
        except ConfigError as error:
            problem = str(error)
        if problem:
            without.append(f"{offer}: {problem}")
            continue
        skill = _free_name(offer, names)
        names.add(skill)
        drafts.append(_draft_of(offer, skill))
    return drafts, without


def _draft_of(offer: Offer, skill: str) -> Draft:
    if offer.interface == _TRANSITION:
        what = offer.name.rpartition("/")[0]
        entry = {"like": "set_lifecycle", "summary": f"Change the lifecycle state of the node {what}."}
        return Draft(skill, _entry(skill, {**entry, "service": offer.name}))
    return draft_skill(offer.way, offer.name, offer.interface, skill, latched=offer.latched)


def _unfit(offer: Offer) -> str:
    """Return why no skill is drafted for something; empty when one is.

    Raises:
        ConfigError: The type is not installed.
    """
    loaded = load_interface(offer.interface)
    if offer.interface.startswith("lifecycle_msgs/") and offer.interface != _TRANSITION:
        return "every managed node has it"
    if offer.way != "condition":
        return ""
    written = part_of(loaded, "").get_fields_and_field_types().values()
    return "a picture, or other data that no condition judges" if "sequence<uint8>" in written else ""


def _free_name(offer: Offer, taken: Container[str]) -> str:
    """Return a name for the skill of an offer: of its last word, of its last two, or with what it is."""
    parts = offer.name.strip("/").split("/")
    last, two = _skill_name(offer.name), _skill_name("_".join(parts[-2:]))
    if offer.interface == _TRANSITION:
        last = _skill_name("_".join(["change", *parts[-2:-1]]))
    for name in (last, two, f"{last}_{offer.way}", f"{two}_{offer.way}"):
        if name not in taken and name not in RESERVED and not keyword.iskeyword(name):
            return name[:LONGEST_NAME]
    raise ConfigError(f"no name is left for a skill of {offer}", valid=["--skill NAME, one at a time"])


def add_to_file(file: Path, draft: Draft) -> None:
    """Add a drafted skill to a file of skills, which is made when there is none.

    Raises:
        ConfigError: The file is no file of skills, has the skill already, or cannot be written.
    """
    if not file.name.endswith(ENDING):
        raise ConfigError(f"{file} does not end with {ENDING}", valid=[f"{file.stem}{ENDING}"])
    before = "skills:\n"
    if file.exists():
        if draft.skill in skills_of(file):
            raise ConfigError(f"{file} has a skill {draft.skill!r} already", valid=["--skill OTHER_NAME"])
        before = file.read_text(encoding="utf-8").rstrip("\n") + "\n\n"
    write_output(file, before + draft.entry, make_folder=True)


def skills_of(file: Path) -> Mapping[str, MessageMapping | None]:
    """Return the skills of a file by name, each with what serves it; none when there is no such file.

    Raises:
        ConfigError: The file cannot be read.
    """
    if not file.exists():
        return {}
    found = read_skills_file(file)
    return {name: found.mappings.get(name) for name in found.declarations}


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


def _failures(shape: AnswerShape) -> dict[str, Any]:
    """Draft a failure for each code that the type names, for those it does not, and for a refusal."""
    found: dict[str, Any] = {
        name.lower(): {"when": f"${shape.code} == {written(value)}"} for name, value in shape.failures.items()
    }
    if shape.mishap:
        meaning = "it failed for another reason" if found else f"{TO_BE_SAID} what fails"
        if shape.guessed:
            meaning = f"{TO_BE_SAID} which values of {shape.code} are a no"
        found["gave_up"] = {"meaning": meaning, "when": shape.mishap}
    if shape.refusal:
        found["refused"] = {"when": shape.refusal.replace(shape.many, port_name(shape.many))}
    return found


def _choice(numbers: Mapping[str, int]) -> dict[str, Any]:
    """Draft an input that takes the names of numbers; the one of zero, which is sent otherwise, by itself."""
    default = next((name for name, number in numbers.items() if number == 0), None)
    return port_document(
        Port(Kind.TEXT, "", REQUIRED if default is None else default, choices=tuple(numbers))
    )


def _shown(feedback: Any) -> str:
    """Draft what is told of a running goal."""
    kinds = {path: kind for path, kind in fields_of(feedback, lists=False).kinds.items() if "." not in path}
    plain = [path for path, kind in kinds.items() if kind.item is None and kind is not Kind.POSE]
    return ", ".join(f"{path.replace('_', ' ')} ${path}" for path in plain[:_MOST_SHOWN])


def _input(kind: Kind) -> dict[str, Any]:
    """Return an input of a kind; a text may be left out, as fields of texts mostly may."""
    return {"type": "text", "default": ""} if kind is Kind.TEXT else port_document(Port(kind, ""))


def _output(path: str, kind: Kind) -> dict[str, Any]:
    port = port_document(Port(kind, ""))
    return port if path == port_name(path) else {**port, "from": path}


_EXAMPLES = {
    Kind.BOOLEAN: "not ${path}",
    Kind.TEXT: '${path} != "something"',
    Kind.NUMBER: "${path} < 1",
    Kind.INTEGER: "${path} < 1",
}
"""Examples of a condition about a field."""


def _example(path: str, kind: Kind) -> str:
    return _EXAMPLES[kind].replace("{path}", path)
