"""Which words fit at a place in a mission that is being written, and where a node of the palette is put.

The text is mostly broken at this moment, so it is not parsed: what stands above, by its indentation, and to
the left says what is meant.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from florence_page.editor.words import Words

MOST_OPTIONS = 200
_DURATIONS = frozenset(("wait", "timeout", "every", "within"))
_CODE_KEYS = frozenset(("on", "go_on_over", "code"))
_FLAGS = {"true": "", "false": ""}
_PORTS = frozenset(("inputs", "outputs", "keys"))
_KEY = re.compile(r"([A-Za-z_]\w*)\s*:(?:\s+(.*))?$")
_NUMBER = re.compile(r"[+-]?[0-9.]+\s*[a-z/°]*$")
_WORD = re.compile(r"[a-z][a-z0-9_]*")
_DASHES = re.compile(r" *(?:- +)*")
_NEW_KEY = re.compile(r"\b(?:as|index|attempt):\s*(\w+)|\$\{?\s*\$?(\w+)|->\s*(\w+)")
_OUT = re.compile(r"\bout:\s*\{([^{}]*)")
_OUT_KEY = re.compile(r":\s*\$?(\w+)")
_MOST_LINES = 2000
"""How far around a place is looked for what belongs to it."""
_LONGEST_LINE = 1000
"""Characters before a place; nothing is offered behind more: the page answers others meanwhile."""


@dataclass(frozen=True, slots=True)
class Place:
    """A place in a text.

    Attributes:
        owners: The keys above, the innermost first.
        siblings: The keys beside the innermost owner, with their values: that owner's own block.
        beside: The keys of the block that is being written.
        key: The key whose value is being written; None while a key is.
        written: What stands there already, up to the place.
    """

    owners: tuple[str, ...]
    siblings: Mapping[str, str]
    beside: Mapping[str, str]
    key: str | None
    written: str


@dataclass(slots=True)
class _WrittenLine:
    column: int
    """0-based, of what stands behind the dashes."""
    dash: int | None
    """0-based, of the first dash; None without one."""
    key: str | None
    value: str = field(default="")


def place_in(text: str, line: int, column: int) -> Place:
    """Say what stands above and beside a place.

    Args:
        text: The mission.
        line: 1-based.
        column: 1-based, in characters.
    """
    lines = text.split("\n")
    line = min(line, len(lines))
    before = lines[line - 1][: column - 1]
    dashes = _DASHES.match(before)
    start = dashes.end() if dashes else 0
    rest = before[start:]
    flow = _flow(rest)
    current = _WrittenLine(start, _dash(before), None)
    if flow is not None:
        owner, content, outer = flow
        above = list(_owners(lines, line, current))
        owners = (*([owner] if owner else []), *(each.key or "" for each, _ in above))
        key, written = _key_of(content.rpartition(",")[2].lstrip())
        pairs = dict(_KEY_VALUE.findall(content.rpartition(",")[0]))
        return Place(
            owners, dict(_KEY_VALUE.findall(outer)) | _beside(lines, line, current), pairs, key, written
        )
    key, written = _key_of(rest)
    above = list(_owners(lines, line, current))
    siblings = _beside(lines, above[0][1], above[0][0]) if above else {}
    return Place(
        tuple(each.key or "" for each, _ in above), siblings, _beside(lines, line, current), key, written
    )


_KEY_VALUE = re.compile(r"\b(\w+)\s*:\s*([^,{}]*)")


def _key_of(text: str) -> tuple[str | None, str]:
    """Split what is being written into a key and its value so far."""
    found = re.match(r"([A-Za-z_]\w*)\s*:\s+(.*)$", text)
    return (found[1], found[2]) if found else (None, text)


def _flow(rest: str) -> tuple[str, str, str] | None:
    """Return the key before the innermost open brace, what follows the brace, and what stands around it."""
    opened: list[int] = []
    quote = ""
    for place, char in enumerate(rest):
        if quote:
            quote = "" if char == quote else quote
        elif char in "\"'":
            quote = char
        elif char == "{" and rest[place - 1 : place] != "$":
            opened.append(place)
        elif char == "}" and opened:
            opened.pop()
    if not opened:
        return None
    brace = opened[-1]
    owner = re.search(r"\b(\w+)\s*:\s*$", rest[:brace])
    around = rest[opened[-2] + 1 : brace] if len(opened) > 1 else rest[:brace]
    return owner[1] if owner else "", rest[brace + 1 :], around


def _dash(text: str) -> int | None:
    indent = len(text) - len(text.lstrip(" "))
    return indent if text[indent : indent + 1] == "-" else None


def _read(text: str) -> _WrittenLine | None:
    """Read one line; None when there is nothing in it."""
    dashes = _DASHES.match(text)
    start = dashes.end() if dashes else 0
    rest = text[start:]
    if not rest.strip() or rest.startswith("#"):
        return None
    found = _KEY.match(rest)
    return _WrittenLine(start, _dash(text), found[1] if found else None, (found[2] or "") if found else "")


def _owners(lines: Sequence[str], line: int, current: _WrittenLine) -> Iterator[tuple[_WrittenLine, int]]:
    """Yield the keys above a line, the innermost first, each with its line."""
    column, dashed = current.column, current.dash
    for number in range(line - 1, max(0, line - _MOST_LINES), -1):
        above = _read(lines[number - 1])
        if above is None:
            continue
        limit = column if dashed is None else dashed
        inside = above.column < limit or (dashed is not None and above.column == limit and above.dash is None)
        if not inside:
            # The beginning of the item that this line belongs to.
            if dashed is None and above.dash is not None and above.column == column:
                dashed = above.dash
            continue
        if above.key is not None:
            yield above, number
        column, dashed = above.column, above.dash


def _beside(lines: Sequence[str], line: int, current: _WrittenLine) -> dict[str, str]:
    """Return the other keys of the block that a line is in, with their values."""
    found: dict[str, str] = {}
    for step in (-1, 1):
        if step == -1 and current.dash is not None:
            continue
        number = line + step
        while max(1, line - _MOST_LINES) <= number <= min(len(lines), line + _MOST_LINES):
            other = _read(lines[number - 1])
            number += step
            if other is None or other.column > current.column:
                continue
            if other.column < current.column or (step == 1 and other.dash is not None):
                break
            if other.key is not None:
                found[other.key] = other.value
            if other.dash is not None:
                break
    if current.key is not None:
        found[current.key] = current.value
    return found


def complete(text: str, line: int, column: int, words: Words) -> dict[str, Any]:
    """Offer words for a place.

    Args:
        text: The mission.
        line: 1-based.
        column: 1-based, in characters.
        words: What can be written.

    Returns:
        ``from``: the column where what is replaced begins; ``options``: for each its ``label``, ``about`` and
        what is put there (``apply``).
    """
    if column > _LONGEST_LINE:
        return {"from": column, "options": []}
    place = place_in(text, line, column)
    if place.written.lstrip().startswith("#"):
        return {"from": column, "options": []}
    if place.key is None:
        options, typed = _keys(text, place, words), place.written
        shown = [
            _option(word, about, f"{word}: " if _has_value(word, words) else f"{word}:")
            for word, about in options
        ]
    else:
        choices, typed = _values(text, place, words)
        shown = [_option(word, about, word) for word, about in choices]
    wanted = typed.lower()
    fitting = [each for each in shown if wanted in each["label"].lower()]
    fitting.sort(key=lambda each: not each["label"].lower().startswith(wanted))
    return {"from": column - len(typed), "options": fitting[:MOST_OPTIONS]}


def _option(word: str, about: str, apply: str) -> dict[str, str]:
    return {"label": word, "about": about, "apply": apply}


def _has_value(word: str, words: Words) -> bool:
    """Tell whether a value stands behind a key in its line."""
    blocks = {"sequence", "selector", "parallel", "once", "invert", "succeed", "do", "then", "else", "cases"}
    blocks |= {"default", "finally", "between", "on_failure", "with", "inputs", "outputs", "keys", "tree"}
    blocks |= {"properties"}
    return word not in blocks and word not in words["skills"]


def _keys(text: str, place: Place, words: Words) -> Iterable[tuple[str, str]]:
    """Return the keys that can stand at a place, with what they mean."""
    owner = place.owners[0] if place.owners else ""
    above = place.owners[1] if len(place.owners) > 1 else ""
    written = set(place.beside)
    if not place.owners:
        options: Mapping[str, str] = words["top"]
    elif owner == "properties":
        options = _property_keys(place, words)
    elif above == "properties":
        options = _names_in(text, words)
    elif owner in _PORTS and not above:
        return ()
    elif above in _PORTS and len(place.owners) == 2:
        options = words["ports"]
    elif owner in words["skills"]:
        options = {name: each["about"] for name, each in words["skills"][owner]["inputs"].items()}
    elif owner in ("with", "out"):
        called = _called(place.siblings, words)
        ports = called.get("inputs" if owner == "with" else "outputs", {})
        options = {name: each["about"] if isinstance(each, dict) else each for name, each in ports.items()}
    elif owner == "on_failure":
        options = {"any": "every other failure", **words["codes"]}
    elif owner == "because":
        options = words["codes"]
    elif owner == "policy":
        options = {"succeed": "how many must succeed", "fail": "how many may fail"}
    elif owner in ("set", "add", "append", "cases"):
        return ()
    else:
        options = _node_keys(place, words)
    return [(word, about) for word, about in options.items() if word not in written]


def _property_keys(place: Place, words: Words) -> dict[str, str]:
    """Return the keys of a property: its words while it has none, and what belongs to the one that it has."""
    texts, belong = words["properties"], words["beside_property"]
    others = {"because", *(each for beside in belong.values() for each in beside)}
    begun = next((word for word in place.beside if word in texts and word not in others), None)
    if begun is None:
        return {word: about for word, about in texts.items() if word not in others}
    return {word: texts[word] for word in (*belong.get(begun, ()), "because")}


def _names_in(text: str, words: Words) -> dict[str, str]:
    """Return the skills and missions that a text names: a property is about those."""
    named = set(_WORD.findall(text))
    known = {**words["missions"], **words["skills"]}
    return {name: known[name].get("summary") or known[name]["about"] for name in sorted(named & known.keys())}


def _called(keys: Mapping[str, str], words: Words) -> Mapping[str, Any]:
    """Return the skill or the mission that a node starts."""
    if "run" in keys:
        mission: Mapping[str, Any] = words["missions"].get(keys["run"].strip(), {})
        return mission
    return next((words["skills"][key] for key in keys if key in words["skills"]), {})


def _node_keys(place: Place, words: Words) -> dict[str, str]:
    """Return the keys of a node: kinds and skills while it has none, and what may stand beside its kind."""
    kind = next((key for key in place.beside if key in words["node_kinds"] or key in words["skills"]), None)
    nodes: Mapping[str, str] = words["nodes"]
    if kind is None:
        return {
            **{word: nodes[word] for word in nodes if word not in words["modifiers"]},
            "name": nodes["name"],
        }
    group = "a skill" if kind in words["skills"] else kind
    return {
        word: nodes[word]
        for word, owners in words["modifiers"].items()
        if word in nodes and (owners is None or group in owners)
    }


def _values(text: str, place: Place, words: Words) -> tuple[Iterable[tuple[str, str]], str]:
    """Return the values that can stand at a place, and what of them is typed already."""
    key, owner = place.key or "", place.owners[0] if place.owners else ""
    typed = place.written
    if "$" in typed:
        typed = typed[typed.rindex("$") :]
        braced = typed.startswith("${")
        names = keys_in(text)
        return [(f"${'{' if braced else ''}{name}", "a key of this mission") for name in names], typed
    if "properties" in place.owners[:2] and key not in ("because", "within", "at_most"):
        typed = typed.rpartition(" ")[2]
        return {"it": "the mission itself, such as it ends", **_names_in(text, words)}.items(), typed
    if _NUMBER.match(typed):
        number = re.match(r"[+-]?[0-9.]+", typed)
        kind = _kind_of(key, place, words)
        digits = number[0] if number else ""
        return [
            (f"{digits} {unit}", each)
            for each, units in words["units"].items()
            if kind in (each, "")
            for unit in units
        ], typed
    if key == "run":
        return [(name, each["about"]) for name, each in words["missions"].items()], typed
    if key in _CODE_KEYS:
        typed = re.split(r"[\[,]\s*", typed)[-1]
        return words["codes"].items(), typed
    fixed = {
        "type": words["kinds"],
        "policy": words["policies"],
        "on_restart": words["restarts"],
        "memory": _FLAGS,
    }
    if key in fixed and (key != "type" or len(place.owners) >= 1):
        return fixed[key].items(), typed
    port = _port_of(key, owner, place, words)
    offered = [(label, "a place of this home") for label in port.get("labels", ())]
    if port.get("kind") == "boolean":
        offered += list(_FLAGS.items())
    typed = re.split(r"[\[,]\s*", typed)[-1]
    return [*offered, *((f"${name}", "a key of this mission") for name in keys_in(text))], typed


def _port_of(key: str, owner: str, place: Place, words: Words) -> Mapping[str, Any]:
    inputs: Mapping[str, Any] = {}
    if owner in words["skills"]:
        inputs = words["skills"][owner]["inputs"]
    elif owner == "with":
        inputs = _called(place.siblings, words).get("inputs", {})
    port: Mapping[str, Any] = inputs.get(key, {})
    return port


def _kind_of(key: str, place: Place, words: Words) -> str:
    """Return the kind of value that a key takes; empty when that is not known."""
    if key in _DURATIONS:
        return "duration"
    if key in ("default", "min", "max"):
        return place.beside.get("type", "").strip()
    kind: str = _port_of(key, place.owners[0] if place.owners else "", place, words).get("kind", "")
    return kind


def keys_in(text: str) -> list[str]:
    """Return the keys that a mission names, sorted."""
    found = {name for names in _NEW_KEY.findall(text) for name in names if name}
    for table in _OUT.findall(text):
        found |= set(_OUT_KEY.findall(table))
    section = ""
    for line in text.split("\n"):
        if line[:1].strip():
            section = line.partition(":")[0]
        elif section in ("inputs", "keys") and (name := re.match(r" {1,4}(\w+)\s*:", line)):
            found.add(name[1])
    return sorted(found - {"type", "default", "min", "max", "description"})


def insertion(text: str, line: int, snippet: str) -> tuple[int, str]:
    """Say where a node of the palette goes: behind the item of a list that the cursor is in.

    Args:
        text: The mission.
        line: Where the cursor is, 1-based.
        snippet: The node, as an item of a list.

    Returns:
        The line that it follows, and its lines with their indentation.
    """
    lines = text.split("\n")
    line = max(1, min(line, len(lines)))
    indent, after = _item_at(lines, line)
    for number, below in enumerate(lines[after:], start=after + 1):
        if below.strip() and _indent(below) <= indent:
            break
        after = number if below.strip() else after
    return after, "\n".join(" " * indent + each for each in snippet.split("\n"))


def _indent(text: str) -> int:
    return len(text) - len(text.lstrip(" "))


def _item_at(lines: Sequence[str], line: int) -> tuple[int, int]:
    """Return the indentation of the list that a line is in, and the line to go on behind."""
    for number in range(line, 0, -1):
        text = lines[number - 1]
        read = _read(text)
        if read is None:
            continue
        if read.key in ("sequence", "selector", "parallel") and not read.value:
            below = next((each for each in lines[number:] if each.strip()), "")
            if number == line or _dash(below) is None:
                return (_indent(below) if _dash(below) is not None else read.column + 2), number
        if read.dash is not None:
            return read.dash, number
    return 0, line
