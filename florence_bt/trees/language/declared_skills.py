"""Files that declare skills: ``NAME.skills.yaml`` beside missions.

A file can say how a skill is served, by any action, service or topic (:mod:`.message_mappings`). A skill of
which it does not say that can be checked, drawn and tested with mocks; an import of other people's trees
declares such. ``florence check`` says which skills this installation lacks.

A skill can be ``like`` another one: it has all that the other one has, but for the keys that it has itself.
The other one stands above it, among the ``templates`` of the file, or in the file that comes with Florence
(:data:`STOCK`). What failure codes and groups of them mean to several skills the file says once, in
``failures`` and ``groups`` of its own; the skills only name them.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from florence_bt.core.declaration import CodeGroup, Kind, Port, SkillDeclaration
from florence_bt.core.errors import ConfigError, close_matches, closest_first
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import COMMON_CODES
from florence_bt.core.plain_yaml import (
    Position,
    YamlMapping,
    YamlNode,
    YamlScalar,
    YamlSequence,
    parse_yaml,
    read_yaml,
)
from florence_bt.core.text_files import decode_utf8, read_bytes
from florence_bt.trees.kinds.words import RESERVED
from florence_bt.trees.language.findings import Finding
from florence_bt.trees.language.message_mappings import MAPPING_KEYS, WAYS, MessageMapping, read_mapping
from florence_bt.trees.language.ports import read_ports
from florence_bt.trees.language.quantities import format_value
from florence_bt.trees.language.reader import Reader
from florence_bt.trees.language.third_party import installed
from florence_bt.trees.language.vocabulary import IDENTIFIER, SKILL_INPUT_KEYS, SKILL_OUTPUT_KEYS

ENDING = ".skills.yaml"
"""The end of the names of these files."""
SKILL_KEYS = (
    *("like", "summary", "inputs", "outputs", "failures", "groups", "resources", "deadline"),
    *("instant", "reports_changes"),
    *MAPPING_KEYS,
)
"""The keys of a skill."""
_OTHER_KEYS: Mapping[str, tuple[str, ...]] = {
    "topic": (
        "condition, for what it said last",
        "wait_for, for what it says next",
        "publish, to say something",
    ),
    "subscribe": ("condition, for what it said last", "wait_for, for what it says next"),
    "description": ("summary",),
    "timeout": ("deadline",),
    "goal": ("send",),
    "request": ("send",),
    "result": ("outputs",),
}
"""People's words for the keys of a skill."""
FAILURE_KEYS = ("meaning", "when")
GROUP_KEYS = ("meaning", "codes")
FILE_KEYS = ("skills", "templates", "failures", "groups")
TO_BE_SAID = "say here"
"""The beginning of the texts of a draft; who edits it puts others in their place."""
STOCK = Path(__file__).with_name(f"stock{ENDING}")
"""The skills and templates that come with Florence."""


@dataclass(frozen=True, slots=True)
class DeclaredSkills:
    """The skills of a file.

    Attributes:
        declarations: The skills by name.
        findings: What was wrong with the file.
        mappings: How skills are served, by name, where the file says it.
        positions: Where the skills stand, by name.
        text: The text of the file.
    """

    declarations: dict[str, SkillDeclaration]
    findings: tuple[Finding, ...] = ()
    mappings: dict[str, MessageMapping] = field(default_factory=dict)
    positions: dict[str, Position] = field(default_factory=dict)
    text: str = field(default="", repr=False)


def is_skills_file(path: Path) -> bool:
    """Tell whether a file declares skills, by its name."""
    return path.name.endswith(ENDING)


def read_skills_file(path: Path) -> DeclaredSkills:
    """Read a file of skills; one that has not changed gives the skills of the last time.

    Returns:
        The skills; what is wrong with the file's form is in the findings.

    Raises:
        ConfigError: The file cannot be read or is not YAML of the plain kind.
    """
    return _skills_of(read_bytes(path), path, installed())


@lru_cache(maxsize=64)
def _skills_of(data: bytes, path: Path, interfaces: object) -> DeclaredSkills:
    reader, source = Reader(path), parse_yaml(data, path)
    skills = source.get("skills") if isinstance(source, YamlMapping) else None
    if not isinstance(source, YamlMapping) or not isinstance(skills, YamlMapping):
        reader.error(
            source.position, "a file of skills needs a mapping of them", ["skills: {a_skill: {...}}"]
        )
        return DeclaredSkills({}, tuple(reader.findings))
    _know_keys(reader, source, "a file of skills", FILE_KEYS)
    declared: dict[str, SkillDeclaration] = {}
    mappings: dict[str, MessageMapping] = {}
    positions: dict[str, Position] = {}
    above: dict[str, YamlMapping] = {}
    templates = reader.mapping(source.get("templates"), "templates")
    for key, item in templates.entries if templates is not None else ():
        _extended(reader, key.text, item, above)
    for key, item in skills.entries:
        item = _extended(reader, key.text, item, above)
        name = reader.identifier(key, "a skill")
        if name is not None and name.text in RESERVED:
            message = f"a skill cannot be called {name.text!r}: that is a word of the language"
            reader.error(name.position, message, [f"my_{name.text}"])
        elif name is not None:
            positions[name.text] = name.position
            declared[name.text], mapping = _skill(reader, name.text, item, source, stock=path == STOCK)
            if mapping is not None:
                declared[name.text] = mapping.declaration
                mappings[name.text] = mapping
    _check_groups(reader, source, skills, declared)
    # What several skills have of one place of the file is read for each of them.
    findings = tuple(dict.fromkeys(reader.findings))
    return DeclaredSkills(declared, findings, mappings, positions, data.decode())


def _extended(reader: Reader, name: str, source: YamlNode, above: dict[str, YamlMapping]) -> YamlNode:
    """Return what the file says about a skill with what it takes from the one that it is like.

    Args:
        reader: Receives what is wrong.
        name: The skill.
        source: What the file says.
        above: What it says about those above it; this one is added.
    """
    if not isinstance(source, YamlMapping):
        return source
    like = source.get("like")
    other = reader.text(like, "like") if like is not None else None
    if like is not None and other is not None:
        base = above.get(other)
        if base is None and other in _stock():
            base = _placed(_stock()[other], like.position)
        if base is None:
            known = {**_stock(), **above}
            message = f"there is no skill or template {other!r} above this one, and none comes with Florence"
            reader.error(like.position, message, closest_first(other, known))
            # What serves it would lack all that the other one says.
            own_words = tuple(entry for entry in source.entries if entry[0].text not in MAPPING_KEYS)
            source = YamlMapping(own_words, source.position)
        own = {key.text for key, _ in source.entries}
        own |= WAYS.keys() if own & WAYS.keys() else set()
        taken = [entry for entry in base.entries if entry[0].text not in own] if base is not None else []
        source = YamlMapping((*source.entries, *taken), source.position)
    above[name] = source
    return source


def templates_in(path: Path) -> dict[str, str]:
    """Return the templates of a file of skills: name -> what it says of each, as it stands there.

    Raises:
        ConfigError: The file cannot be read or is not YAML of the plain kind.
    """
    source = read_yaml(path)
    table = source.get("templates") if isinstance(source, YamlMapping) else None
    if not isinstance(source, YamlMapping) or not isinstance(table, YamlMapping):
        return {}
    lines = decode_utf8(read_bytes(path), path).splitlines()
    begins = sorted({key.position.line for where in (source, table) for key, _ in where.entries})
    after = dict(zip(begins, [*begins[1:], len(lines) + 1], strict=True))
    texts = {}
    for key, _ in table.entries:
        first = key.position.line
        text = textwrap.dedent("\n".join(lines[first - 1 : after[first] - 1]))
        # What stands before the next entry, comments of it, is not of this one.
        texts[key.text] = "\n".join(text.splitlines()[: _last_of(text)])
    return texts


def _last_of(text: str) -> int:
    """Return the number of the last line that says something."""
    said = [n for n, line in enumerate(text.splitlines(), 1) if line.strip() and line.strip()[0] != "#"]
    return said[-1]


@cache
def _stock() -> Mapping[str, YamlMapping]:
    """Return what the file that comes with Florence says about its skills and templates."""
    source = read_yaml(STOCK)
    assert isinstance(source, YamlMapping)
    tables = [table for _, table in source.entries if isinstance(table, YamlMapping)]
    entries = [entry for table in tables for entry in table.entries]
    return {key.text: item for key, item in entries if isinstance(item, YamlMapping)}


def _placed(node: YamlNode, position: Position) -> Any:
    """Return a part of another file as if it stood at a place of this one."""
    if isinstance(node, YamlMapping):
        entries = ((_placed(key, position), _placed(item, position)) for key, item in node.entries)
        return YamlMapping(tuple(entries), position)
    if isinstance(node, YamlSequence):
        return YamlSequence(tuple(_placed(item, position) for item in node.items), position)
    return replace(node, position=position, first_column=None)


def mappings_in(folders: Iterable[Path]) -> dict[str, MessageMapping]:
    """Return how the skills of the files in some folders are served; unreadable files are left out."""
    found: dict[str, MessageMapping] = {}
    for folder in folders:
        for path in sorted(folder.glob(f"[!.]*{ENDING}")):
            with suppress(ConfigError):  # a finding of the mission library
                found.update(read_skills_file(path).mappings)
    return found


def _skill(
    reader: Reader, name: str, source: YamlNode, file: YamlMapping, *, stock: bool
) -> tuple[SkillDeclaration, MessageMapping | None]:
    table = reader.mapping(source, f"the skill {name!r}") or YamlMapping((), source.position)
    _know_keys(reader, table, f"the skill {name!r}", SKILL_KEYS)
    summary, deadline, resources = (table.get(key) for key in ("summary", "deadline", "resources"))
    inputs, _ = read_ports(reader, table.get("inputs"), "an input", SKILL_INPUT_KEYS)
    outputs, _ = read_ports(reader, table.get("outputs"), "an output", (*SKILL_OUTPUT_KEYS, "from"))
    told, groups = (_with_shared(reader, table, file, title) for title in ("failures", "groups"))
    failures, conditions = _failures(reader, told)
    _note_draft(reader, summary, *(each for _, each in _meanings(told)))
    declaration = SkillDeclaration(
        name,
        (reader.text(summary, "summary") or "") if summary is not None else "",
        inputs,
        outputs,
        failures,
        frozenset(each.text for each in reader.identifiers(resources, "a resource"))
        if resources
        else frozenset(),
        _deadline(reader, deadline),
        reader.flag(table.get("instant"), "instant"),
        reader.flag(table.get("reports_changes"), "reports_changes"),
        groups=_groups(reader, groups),
    )
    paths = _paths(table.get("outputs"))
    return declaration, read_mapping(reader, declaration, table, paths, conditions, stock=stock)


def _know_keys(reader: Reader, table: YamlMapping, what: str, known: tuple[str, ...]) -> None:
    for key, _ in table.entries:
        if key.text not in known:
            message = f"unknown key of {what} {key.text!r}"
            others = _OTHER_KEYS.get(key.text.lower(), ()) if known is SKILL_KEYS else ()
            if others:
                reader.error(key.position, message, others)
            else:
                reader.unknown(key.position, message, key.text, known)


def _with_shared(reader: Reader, table: YamlMapping, file: YamlMapping, title: str) -> YamlNode | None:
    """Return a table of a skill, with what the file says about those keys that stand there alone.

    Args:
        reader: Receives what is wrong.
        table: All that the file says about the skill; its table may be a list, too, of keys alone.
        file: The file, which may have a table of the same title.
        title: Of the table.
    """
    source, shared = table.get(title), reader.mapping(file.get(title), title)
    if isinstance(source, YamlSequence):
        alone = YamlScalar("", False, source.position)
        names = [item for item in source.items if reader.identifier(item, f"an item of {title}") is not None]
        entries = [(name, alone) for name in names if isinstance(name, YamlScalar)]
        source = YamlMapping(tuple(entries), source.position)
    if not isinstance(source, YamlMapping):
        return source
    told: list[tuple[YamlScalar, YamlNode]] = []
    for key, item in source.entries:
        found = shared.get(key.text) if shared is not None else None
        if not (isinstance(item, YamlScalar) and item.empty):
            told.append((key, item))
        elif found is not None:
            told.append((key, found))
        else:
            close = closest_first(key.text, [name.text for name, _ in shared.entries]) if shared else ()
            message = f"what {key.text!r} means is said neither here nor under {title} of the file"
            reader.error(key.position, message, close or [f"{key.text}: ..."])
    return YamlMapping(tuple(told), source.position)


def _note_draft(reader: Reader, *texts: YamlNode | None) -> None:
    """Warn of texts that nobody has put in place of those of a draft."""
    for text in texts:
        if isinstance(text, YamlScalar) and text.text.lower().startswith(TO_BE_SAID):
            reader.warning(text.position, f"this is still the text of the draft: {text.text!r}")


def _meanings(source: YamlNode | None) -> Iterable[tuple[str, YamlNode | None]]:
    """Return what the file says of the meaning of each code."""
    entries = source.entries if isinstance(source, YamlMapping) else ()
    return [
        (key.text, item.get("meaning") if isinstance(item, YamlMapping) else item) for key, item in entries
    ]


def _paths(source: YamlNode | None) -> dict[str, YamlNode]:
    """Return ``from`` of each output that has it."""
    entries = source.entries if isinstance(source, YamlMapping) else ()
    found = {key.text: item.get("from") for key, item in entries if isinstance(item, YamlMapping)}
    return {name: path for name, path in found.items() if path is not None}


def _failures(reader: Reader, source: YamlNode | None) -> tuple[dict[str, str], dict[str, YamlNode]]:
    """Read the meaning of each code, and ``when`` of those that have it."""
    meanings: dict[str, str] = {}
    conditions: dict[str, YamlNode] = {}
    table = reader.mapping(source, "failures")
    for key, item in table.entries if table else ():
        code, meaning = reader.identifier(key, "a failure code"), item
        if isinstance(item, YamlMapping):
            _know_keys(reader, item, f"the failure {key.text!r}", FAILURE_KEYS)
            when = item.get("when")
            if code is not None and when is not None:
                conditions[code.text] = when
            meaning = item.get("meaning") or YamlScalar(key.text.replace("_", " "), True, item.position)
        text = reader.text(meaning, f"failure {key.text}")
        if text is not None and "$" in text:
            valid = ["reason: FIELD, for the words of the server"]
            reader.error(meaning.position, f"the meaning of {key.text!r} is told as it stands here", valid)
        if code is not None and text is not None:
            meanings[code.text] = text
    return meanings, {code: when for code, when in conditions.items() if code in meanings}


def _groups(reader: Reader, source: YamlNode | None) -> tuple[CodeGroup, ...]:
    """Read ``groups``: the words under which missions find codes of the skill, each with the codes."""
    groups = []
    table = reader.mapping(source, "groups")
    for key, item in table.entries if table else ():
        name, meaning, listed = reader.identifier(key, "a group of failure codes"), None, item
        if isinstance(item, YamlMapping):
            _know_keys(reader, item, f"the group {key.text!r}", GROUP_KEYS)
            meaning, listed = item.get("meaning"), item.get("codes") or YamlSequence((), item.position)
        codes = reader.identifiers(listed, f"a code of the group {key.text}")
        if isinstance(listed, YamlSequence) and not listed.items:
            reader.error(item.position, f"the group {key.text!r} needs its codes", ["codes: [a_code, ...]"])
        text = (reader.text(meaning, f"group {key.text}") if meaning is not None else None) or ""
        if name is not None:
            groups.append(CodeGroup(name.text, frozenset(code.text for code in codes), text))
    return tuple(groups)


def _check_groups(
    reader: Reader, file: YamlMapping, skills: YamlMapping, declared: Mapping[str, SkillDeclaration]
) -> None:
    """Report a code in a group with which no skill of the file can fail."""
    tables = [file.get("groups")]
    tables += [item.get("groups") for _, item in skills.entries if isinstance(item, YamlMapping)]
    groups = [entry for table in tables if isinstance(table, YamlMapping) for entry in table.entries]
    known = {code: meaning for skill in declared.values() for code, meaning in skill.failures.items()}
    for key, item in groups:
        for code in _codes_in(item):
            if code.text not in known and code.text not in COMMON_CODES:
                message = (
                    f"no skill of this file can fail with {code.text!r}, a code of the group {key.text!r}"
                )
                valid = [*close_matches(code.text, known), f"failures: {{{code.text}: what it means}}"]
                reader.error(code.position, message, valid)


def _codes_in(group: YamlNode) -> tuple[YamlScalar, ...]:
    """Return the codes that are written in a group, with or without a meaning beside them."""
    listed = group.get("codes") if isinstance(group, YamlMapping) else group
    items = listed.items if isinstance(listed, YamlSequence) else (listed,)
    return tuple(item for item in items if isinstance(item, YamlScalar) and IDENTIFIER.fullmatch(item.text))


def _deadline(reader: Reader, source: YamlNode | None) -> float:
    default = SkillDeclaration("", "").deadline_s
    seconds = reader.duration(source, "deadline") if source is not None else None
    if source is None or seconds is None:
        return default
    if seconds <= 0.0:
        reader.error(source.position, "the deadline must be above zero", ["60 s"])
        return default
    return seconds


def skills_document(declarations: Iterable[SkillDeclaration]) -> dict[str, Any]:
    """Write skills as the mappings of such a file; reading them gives the declarations again."""
    return {"skills": {declaration.name: _written(declaration) for declaration in declarations}}


def _written(declaration: SkillDeclaration) -> dict[str, Any]:
    written: dict[str, Any] = {"summary": declaration.summary} if declaration.summary else {}
    for title, ports in (("inputs", declaration.inputs), ("outputs", declaration.outputs)):
        if ports:
            written[title] = {name: port_document(port) for name, port in ports.items()}
    if declaration.failures:
        written["failures"] = dict(declaration.failures)
    if declaration.groups:
        written["groups"] = {group.name: _group(group) for group in declaration.groups}
    if declaration.resources:
        written["resources"] = sorted(declaration.resources)
    written["deadline"] = format_value(declaration.deadline_s, Kind.DURATION)
    for key in ("instant", "reports_changes"):
        if getattr(declaration, key):
            written[key] = "true"
    return written


def _group(group: CodeGroup) -> Any:
    codes = sorted(group.codes)
    return {"meaning": group.meaning, "codes": codes} if group.meaning else codes


def _value(value: Any, kind: Kind) -> Any:
    if kind.item is not None:
        return [_value(item, kind.item) for item in value]
    return _pose(value) if isinstance(value, Pose2) else format_value(value, kind)


def _pose(pose: Pose2) -> dict[str, str]:
    parts = {"x": (pose.x, Kind.LENGTH), "y": (pose.y, Kind.LENGTH), "yaw": (pose.yaw, Kind.ANGLE)}
    return {name: format_value(value, kind) for name, (value, kind) in parts.items()}


def port_document(port: Port) -> dict[str, Any]:
    """Write a port as a mapping of a mission file or a file of skills."""
    written: dict[str, Any] = {"type": port.kind.value}
    limits = {"default": None if port.required else port.default, "min": port.minimum, "max": port.maximum}
    for key, value in limits.items():
        if value is not None:
            written[key] = _value(value, port.kind)
    if port.choices:
        written["choices"] = list(port.choices)
    for key in ("names", "description"):
        if text := getattr(port, key):
            written[key] = text
    return written
