"""Suggestions for what is not a node, and the keys that a broken node would write."""

from __future__ import annotations

import re
from collections.abc import Iterator

from florence_bt.core.errors import close_matches, closest_first, spelling
from florence_bt.core.plain_yaml import YamlMapping, YamlNode, YamlScalar, YamlSequence
from florence_bt.trees.kinds import BY_WORD
from florence_bt.trees.kinds.parallel import POLICIES
from florence_bt.trees.kinds.words import KEY_WORDS, NODE_KINDS, OWNERS
from florence_bt.trees.language.model import FAILURE_KEYS
from florence_bt.trees.language.quantities import is_duration
from florence_bt.trees.language.vocabulary import ANYWHERE, IDENTIFIER, MISSION_KEYS, by_spelling

_FIRST_WORD = re.compile(r"-?(?P<word>[A-Za-z_]+)(?::\s*|\s+|$)(?P<rest>.*)", re.DOTALL)
_BESIDE_A_KIND = (
    "finally",
    "because",
    "when",
    "while",
    "until",
    "on_failure",
    "ensure",
    "out",
    "with",
    "then",
    "else",
    "do",
    "policy",
    "between",
)
_NO_NODES = ("nothing", "none", "pass", "skip", "true", "false", "yes", "no")
_OTHER_WORDS = {"otherwise": "else", "case": "cases", "inputs": "with"}
_ELSE_IF = ("elif", "elseif", "else if", "else_if", "elsif")
_OTHER_MODIFIERS = by_spelling(
    {
        "on_failure": ("on_error", "onerror", "on_fail", "catch", "except", "if_fails"),
        "finally": ("always", "cleanup", "clean_up", "at_the_end"),
        "ensure": ("post_condition", "postcondition", "success_condition", "expect", "verify"),
        "name": ("comment", "title"),
    }
)
"""Other languages' and people's words for the modifiers that every node may have."""
_AT_A_TIME = 'tree: a sequence that begins with wait_until: "08:00"'
_OTHER_SECTIONS = by_spelling(
    {
        "mission": ("name", "title", "id"),
        "tree": ("steps", "step", "actions", "nodes", "root", "behaviour", "behavior", "main", "run"),
        "inputs": ("parameters", "params", "args", "arguments"),
        "keys": ("variables", "vars", "blackboard"),
        _AT_A_TIME: ("schedule", "at", "time", "cron", "daily", "start", "starts", "trigger"),
        "tree: {repeat: forever, do: a sequence that begins with wait: 5 min}": ("every", "interval"),
    }
)
"""People's words for the sections of a mission, and the place for a section that there is not."""
OTHER_KINDS = by_spelling(
    {
        **{word: node.kind.others for word, node in BY_WORD.items()},
        "sequence: [the node, {fail: the reason}]": ("force_failure", "forcefailure"),
        "succeed: the node, or a sequence that ends with fail": ("force",),
        "sequence: [{wait: 2 s}, the node]": ("delay",),
        "sequence: [the node, {wait: 30 s}], in a repeat": ("cooldown",),
        "on_failure: {any: a node}, at the node that may fail": (
            *("try", "catch", "try_catch", "trycatch", "except", "recovery", "recovery_node", "recoverynode"),
        ),
        "repeat: forever": ("loop_forever", "keep_running_until_failure", "forever"),
        "add: {key: 1}": ("increment", "increase", "inc", "count", "count_up", "plus"),
        "add: {key: -1}": ("decrement", "decrease", "dec", "count_down", "subtract", "minus"),
        "$near and not $done, as the expression itself": ("and", "or", "all", "any"),
        "wait: 0 s, which does nothing": ("success", "done", "noop", "nothing", "always_success"),
        "parallel: with policy: any": ("race", "first_of"),
    }
)
"""Other languages' and people's words for the kinds of nodes."""
OTHER_SKILLS = by_spelling(
    {
        "say": ("speak", "tell", "talk", "announce", "speech", "print", "echo", "log"),
        "say: {text: ...}, then wait_for_answer": ("ask", "question"),
        "run: goto_room, with: {room: ...}": ("go_to", "goto", "go", "drive_to", "drive", "move_to", "move"),
        "look_for_user": ("look", "look_for", "search", "find"),
        "call_for_help": ("notify", "alarm", "alert"),
        "until: a node, at the loop": ("break",),
        "fail: done, with code: done; at the top on_failure: {done: a node} makes it good": (
            *("return", "exit", "stop", "end", "quit", "finish"),
        ),
    }
)
"""People's words for some skills; whoever has a skill of that name means it."""
_BELOW = ("do", "then", "cases")
"""Modifiers with nodes below them, which no skill has."""


def meant_kind(word: str) -> tuple[str, ...]:
    """Return the kinds of nodes that somebody may mean who writes a word that is none, most likely first."""
    return _other_word(word) or tuple(close_matches(word.lower(), NODE_KINDS))


def is_no_skill(key: YamlScalar, value: YamlNode, source: YamlMapping) -> bool:
    """Tell whether a node is written like a kind of node and not like a skill: with nodes below it.

    Args:
        key: What should be its kind.
        value: The value of this key.
        source: The whole node.
    """
    if isinstance(value, YamlSequence):
        nodes = not value.items or any(isinstance(item, YamlMapping) for item in value.items)
        return nodes or bool(_other_word(key.text))
    if any(source.get(word) is not None for word in _BELOW):
        return bool(meant_kind(key.text))
    if not isinstance(value, YamlMapping) or len(value.entries) != 1:
        return False
    below = value.entries[0][1]
    given = isinstance(below, YamlScalar) and not below.empty
    return not given and bool(_other_word(key.text))


def _other_word(word: str) -> tuple[str, ...]:
    """Return the kind of node that a word certainly means."""
    alike = [kind for kind in NODE_KINDS if spelling(kind) == spelling(word)]
    others = [kind for name, kind in OTHER_KINDS.items() if spelling(name) == spelling(word)]
    return tuple(dict.fromkeys((*alike, *others)))


def for_not_a_node(source: YamlNode) -> tuple[str, tuple[str, ...]]:
    """Say what is wrong with something that is not a node, and what would have worked.

    Args:
        source: A text or a list where a node is needed.
    """
    if isinstance(source, YamlSequence):
        return "one node is needed here, not a list", ("sequence: with the list below it",)
    if not isinstance(source, YamlScalar) or source.empty:
        return "a node is missing here", ("wait: 1 s", "the name of a skill and a colon")
    if is_duration(source.text):
        return f"{source.text!r} is not a node", (f"{{wait: {source.text.strip()}}}",)
    match = _FIRST_WORD.fullmatch(source.text.strip())
    message = f"{source.text!r} is not a node: a node is a name, a colon and a space"
    if match is None:
        return message, ("wait: 1 s",)
    word, rest = match["word"], match["rest"].strip()
    if not rest and word.lower() in _NO_NODES:
        return f"{source.text!r} is not a node", (
            "wait: 0 s, which does nothing",
            "the name of a skill and a colon",
        )
    return message, (f"{word}: {rest}" if rest else f"{word}:",)


def for_no_kind(keys: list[str]) -> tuple[str, tuple[str, ...]]:
    """Say what is wrong with a table of modifiers alone, and what would have worked."""
    if keys[:1] == ["while"] and "do" in keys:
        return "'while' is no loop: it belongs to a node", ("repeat: forever, beside it",)
    if keys[:1] == ["every"] and "do" in keys:
        return "'every' is no loop", ("repeat: forever, with a wait at the end of what is under do",)
    if keys and keys[0] in _BESIDE_A_KIND:
        message = f"{keys[0]!r} is not a node: it belongs to a node"
        return message, (f"{keys[0]} without a dash, indented like the node that it belongs to",)
    return "this node has no kind", (*NODE_KINDS, "the name of a skill")


def for_children(kind: YamlScalar, source: YamlNode) -> tuple[str, ...]:
    """Suggest what would have worked where a composite has something else than a list of nodes below it."""
    if isinstance(source, YamlMapping) and source.entries:
        first = source.entries[0][0].text
        where = "a space after the dash" if first.startswith("-") else "a dash before each node"
        return (f"{where}: - {first.lstrip('-')}: ...",)
    if kind.text == "parallel" and isinstance(source, YamlScalar) and source.text in POLICIES:
        return (f"parallel: a list of nodes, with policy: {source.text} beside it",)
    if isinstance(source, YamlScalar) and source.text.startswith("-"):
        return (f"a space after the dash: - {source.text.lstrip('-')}",)
    return (f"{kind.text}: [node, node]",)


def for_two_kinds(first: YamlScalar, second: YamlScalar, value: YamlNode) -> tuple[str, ...]:
    """Suggest what would have worked where a table has two kind keys."""
    word = _OTHER_WORDS.get(second.text)
    if word is not None and first.text in OWNERS.get(word, ()):
        return (word,)
    if second.text in _ELSE_IF and first.text == "if":
        asked = value.text if isinstance(value, YamlScalar) and not value.empty else "..."
        return (f"else: {{if: {asked}, then: ...}}",)
    if second.text in MISSION_KEYS:
        return (f"{second.text} at the left edge of the file",)
    if second.text in ("on_success", "next", "after"):
        return ("sequence: [the node, what follows when it succeeds]",)
    if second.text not in NODE_KINDS and first.text == "run" and isinstance(value, YamlScalar):
        return (f"with: {{{second.text}: {value.text}}}",)
    if (
        not {first.text, second.text} & NODE_KINDS.keys()
        and isinstance(value, YamlScalar)
        and not value.empty
    ):
        # An input that is indented like the skill whose input it is.
        return (f"{first.text}: {{{second.text}: {value.text}}}", f"{second.text} indented further")
    if second.text == "wait" and first.text in ("repeat", "retry") and isinstance(value, YamlScalar):
        pause = f"wait: {value.text}"
        if first.text == "retry":
            return (f"between: {{{pause}}}",)
        return (f"do: {{sequence: [the node, {{{pause}}}]}}",)
    if first.text in OWNERS["do"]:
        return (f"do: with {second.text} below it", "sequence: [a node for each]")
    if first.text == "switch":
        return (f"cases: with {second.text} below it",)
    if first.text == "if":
        return (f"then: with {second.text} below it", "sequence: [a node for each]")
    if second.text in OWNERS["do"]:
        return (f"do: with {first.text} below it, beside {second.text}", "sequence: [a node for each]")
    return ("a dash before each of them in a list", "sequence: [a node for each]")


def for_section(name: str, names: tuple[str, ...]) -> tuple[str, ...]:
    """Suggest what would have worked where a mission has a section of an unknown name."""
    if name in NODE_KINDS and name != "run":
        return (f"tree: with {name} below it",)
    other = _OTHER_SECTIONS.get(name.lower())
    if other is not None:
        return (other,)
    if name in ANYWHERE:
        return (f"{name} below tree, indented like the node that it belongs to",)
    return closest_first(name.lower(), names)


def other_modifier(name: str, source: YamlMapping) -> str | None:
    """Return the modifier that somebody certainly means by a word that is none, if the node lacks it."""
    other = _OTHER_MODIFIERS.get(name.lower())
    return other if other is not None and source.get(other) is None else None


def is_else_if(word: str) -> bool:
    """Tell whether a word means another ``if`` under an ``else``."""
    return word in _ELSE_IF


def for_duration(what: str, text: str) -> str:
    """Suggest what would have worked where a time that passes stands in place of an expression.

    Args:
        what: The modifier or kind that has it.
        text: The time.
    """
    instead = {
        "wait_until": f"wait: {text}",
        "condition": f"wait: {text}",
        "when": f"sequence: [{{wait: {text}}}, the node]",
        "if": f"sequence: [{{wait: {text}}}, what is under then]",
    }
    return instead.get(what, f"until: {{wait: {text}}}")


def for_condition(what: str, source: YamlNode) -> tuple[str, ...]:
    """Suggest what would have worked where a node stands in place of an expression.

    Args:
        what: The modifier or kind that has it.
        source: Its value.
    """
    if isinstance(source, YamlSequence) and any(isinstance(item, YamlMapping) for item in source.items):
        return ("sequence: with the list below it", "parallel: with the list below it, and policy: any")
    if not isinstance(source, YamlMapping) or not source.entries:
        return ()
    skill = source.entries[0][0].text
    instead = {
        "condition": f"{skill} itself, in place of condition",
        "while": f"memory: false, with sequence: [{{{skill}: ...}}, the node]",
    }
    return (instead.get(what, f"if: {{{skill}: ...}}, with the node under then"),)


def named_in(source: YamlNode) -> Iterator[str]:
    """Yield the names that a table gives, also one that is written as a list or as a text."""
    if isinstance(source, YamlScalar):
        match = IDENTIFIER.match(source.text.removeprefix("$"))
        yield from (match[0],) if match else ()
    elif isinstance(source, YamlSequence):
        for item in source.items:
            yield from named_in(item)
    else:
        yield from (name.text for name, _ in source.entries if IDENTIFIER.fullmatch(name.text))
        yield from (
            value.text
            for name, value in source.entries
            if name.text == "name" and isinstance(value, YamlScalar) and IDENTIFIER.fullmatch(value.text)
        )


def written_keys(source: YamlNode | None) -> Iterator[str]:
    """Yield the keys that nodes would write, whether the nodes can be read or not."""
    if isinstance(source, YamlSequence):
        for item in source.items:
            yield from written_keys(item)
    elif isinstance(source, YamlMapping):
        for key, value in source.entries:
            if key.text == "out" and isinstance(value, YamlMapping):
                targets = [
                    item.text.removeprefix("$") for _, item in value.entries if isinstance(item, YamlScalar)
                ]
                yield from filter(IDENTIFIER.fullmatch, targets)
            elif key.text in NODE_KINDS and key.text in KEY_WORDS:
                yield from named_in(value)
            elif key.text in KEY_WORDS and isinstance(value, YamlScalar) and IDENTIFIER.fullmatch(value.text):
                yield value.text
            else:
                yield from FAILURE_KEYS if key.text == "on_failure" else ()
                yield from written_keys(value)
