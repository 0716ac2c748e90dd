"""Trees of BehaviorTree.CPP to mission files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from florence_bt.core.declaration import REQUIRED, Kind, Port, SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.core.plain_yaml import Position
from florence_bt.trees.language.declared_skills import ENDING, port_document, skills_document
from florence_bt.trees.language.findings import ERROR, Finding, has_errors
from florence_bt.trees.language.parse import parse_mission
from florence_bt.trees.language.vocabulary import ON_RESTART
from florence_btcpp.convert import Converter, Node
from florence_btcpp.custom_nodes import CustomNodes
from florence_btcpp.data_flow import DataFlow, TreeFlow
from florence_btcpp.document import Document, Tree, load_document
from florence_btcpp.key_uses import Ports, literals_of, pointer, port_of_skill, registration
from florence_btcpp.mission_text import read_flow, write_yaml
from florence_btcpp.names import Names, identifier
from florence_btcpp.node_models import PortModel, category_of, read_models
from florence_btcpp.notes import LossNotes
from florence_btcpp.values import neutral_value, text_value, written_value
from florence_btcpp.vocabulary import MARK
from florence_btcpp.xml_source import Element, read_xml

MAX_NESTING = 40
"""Deepest nesting of nodes in one tree; a mission file cannot be much deeper."""


@dataclass(frozen=True)
class Imported:
    """The result of an import.

    Attributes:
        files: The files to write: name -> text.
        missions: The names of the missions.
        main: The name of the mission of the main tree, None when the file does not say which it is.
        skills: The skills that this installation lacks.
        findings: Errors, losses (warnings) and notices, by file and place.
    """

    files: Mapping[str, str] = field(default_factory=dict)
    missions: tuple[str, ...] = ()
    main: str | None = None
    skills: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()


def import_trees(
    path: Path, declarations: Mapping[str, SkillDeclaration], models: Sequence[Path] = ()
) -> Imported:
    """Convert the trees of a file, or of all files of a folder.

    Args:
        path: The file, version 3 or 4; or a folder, whose files are one project.
        declarations: The skills of this installation.
        models: Further files whose ``TreeNodesModel`` says what the nodes' ports are.

    Returns:
        The mission files; none when there are errors among the findings.

    Raises:
        ConfigError: A file cannot be read or is not XML.
    """
    left_out: dict[str, Finding] = {}
    while True:
        imported = _import(path, declarations, models, left_out)
        wrong = {f.file: f for f in reversed(imported.findings) if f.severity == ERROR}
        if not path.is_dir() or not wrong.keys() - left_out.keys():
            return imported
        left_out |= wrong  # one file must not keep the others of a folder from being imported


def _import(
    path: Path,
    declarations: Mapping[str, SkillDeclaration],
    models: Sequence[Path],
    left_out: Mapping[str, Finding],
) -> Imported:
    notes = LossNotes()
    for file, why in left_out.items():
        message = f"the file is left out: {why.message}"
        notes.lost(Path(file), Position(why.line, why.column), message, why.valid)
    document = load_document(path, notes, left_out)
    for extra in models:
        for name, model in read_models(read_xml(extra)).items():
            document.models.setdefault(name, model)
    order = _called_first(document, notes)
    _check_nesting(document, notes)
    if has_errors(notes.findings):
        return Imported(findings=tuple(notes.findings))
    return _Import(document, declarations, notes, order).run()


class _Import:
    def __init__(
        self,
        document: Document,
        declarations: Mapping[str, SkillDeclaration],
        notes: LossNotes,
        order: list[str],
    ) -> None:
        self._document = document
        self._notes = notes
        skill_of = dict(_own_skills(document, declarations))
        self._ports = Ports(declarations, skill_of, document.models)
        self._facts = DataFlow(document, self._ports, order)
        self._custom = CustomNodes(self._ports, document.file.name)
        names = Names("mission")
        self._missions = {name: names.of(name) for name in document.trees}

    def run(self) -> Imported:
        self._note_guesses()
        files: dict[str, str] = {}
        for name, mission in self._missions.items():
            text = self._mission(self._facts.trees[name], mission)
            file = f"{mission}.yaml"
            files[file] = text
            self._check(text, file, self._document.trees[name])
        declared = self._custom.declarations(self._facts.port_kind)
        if declared:
            stem = identifier(self._document.file.stem, "trees")
            files[f"{stem}{ENDING}"] = write_yaml(skills_document(declared))
        self._note_names()
        findings = tuple(self._notes.findings)
        if has_errors(findings):
            return Imported(findings=findings)
        main = self._missions.get(self._document.main) if self._document.main else None
        skills = tuple(declaration.name for declaration in declared)
        return Imported(files, tuple(self._missions.values()), main, skills, findings)

    def _mission(self, facts: TreeFlow, mission: str) -> str:
        converter = Converter(self._facts, facts, self._ports, self._custom, self._missions, self._notes)
        tree, element = facts.tree, facts.tree.element
        root = converter.node(tree.root)
        for key in facts.unwritten:
            converter.start_empty(key)
        before = {key: facts.input_name(key, self._facts) for key in facts.all_inputs(self._facts)}
        copied = {
            facts.names.of(key): f"${name}" for key, name in before.items() if facts.names.of(key) != name
        }
        if copied:
            root = {"sequence": [{"set": copied}, root]}
        description = element.get("_description") or f"The tree {tree.name} of {tree.file.name}."
        document: dict[str, Any] = {"mission": mission, "description": " ".join(description.split())}
        document["imported_from"] = text_value(tree.file.name, Kind.TEXT)
        inputs = {name: self._input(tree, key) for key, name in before.items()}
        outputs = {facts.names.of(key): self._output(tree, key) for key in facts.all_outputs(self._facts)}
        keys = {**self._declared_keys(tree), **converter.keys}
        for title, ports in (("inputs", inputs), ("outputs", outputs), ("keys", keys)):
            if ports:
                document[title] = ports
        restart = element.get(f"{MARK}_on_restart")
        if restart in ON_RESTART:
            document["on_restart"] = restart
        return write_yaml({**document, "tree": root}, blank_before=("tree",))

    def _input(self, tree: Tree, key: str) -> Node:
        about = self._model_port(tree, key)
        kind = self._facts.kind(tree.name, key) or Kind.TEXT
        facts = self._facts.trees[tree.name]
        default = neutral_value(kind) if key in facts.soft or key in facts.missing else REQUIRED
        written = port_document(Port(kind, about.description, default))
        limits = dict(about.limits)
        if about.default is not None and pointer(about.default, key) is None:
            limits["default"] = about.default
        for name in ("default", "min", "max"):
            if name in limits:
                value, problem = written_value(limits[name], kind)
                if problem or not isinstance(value, str):
                    self._notes.lost(
                        tree.file, tree.element.position, f"the {name} of {key!r}: {limits[name]!r}"
                    )
                else:
                    written[name] = value
        order = ("type", "default", "min", "max", "description")
        return {name: written[name] for name in order if name in written}

    def _output(self, tree: Tree, key: str) -> Node:
        kind = self._facts.kind(tree.name, key) or Kind.TEXT
        return port_document(Port(kind, self._model_port(tree, key).description))

    def _model_port(self, tree: Tree, key: str) -> PortModel:
        model = self._document.models.get(tree.name)
        found = model.ports.get(key) if model is not None and model.category == "SubTree" else None
        return found or PortModel("in")

    def _declared_keys(self, tree: Tree) -> dict[str, Any]:
        text = tree.element.get(f"{MARK}_keys")
        if not text:
            return {}
        try:
            keys = read_flow(f"{{{text}}}")
        except ConfigError as error:
            self._notes.lost(tree.file, tree.element.position, f"the declared keys: {error.problem}")
            return {}
        return keys if isinstance(keys, dict) else {}

    def _check(self, text: str, file: str, tree: Tree) -> None:
        """Make sure that what was written is a mission; a value of the XML can be anything."""
        try:
            problems = parse_mission(text, Path(file)).findings
        except ConfigError as error:
            self._notes.error(tree.file, tree.element.position, f"{tree.name}: {error.problem}", error.valid)
            return
        lines = text.splitlines()
        for problem in problems:
            at = lines[problem.line - 1].strip()
            self._notes.error(tree.file, tree.element.position, f"{tree.name}: {problem.message}: {at}")

    def _note_guesses(self) -> None:
        for facts in self._facts.trees.values():
            for use in facts.guessed.values():
                written = use.key in facts.written
                message = f"no TreeNodesModel says whether {use.key!r} is read or written; taken as "
                message += "written by the first node that has it" if written else "read"
                self._notes.notice(facts.tree.file, use.element.position, message)

    def _note_names(self) -> None:
        first = next(iter(self._document.trees.values()))
        file, place = first.file, first.element.position
        renamed = {name: mission for name, mission in self._missions.items() if name != mission}
        if renamed:
            self._notes.notice(file, place, f"trees are called differently now: {_pairs(renamed)}")
        if self._custom.renamed():
            self._notes.notice(
                file, place, f"nodes are called differently now: {_pairs(self._custom.renamed())}"
            )


def _pairs(renamed: Mapping[str, str]) -> str:
    return ", ".join(f"{old} -> {new}" for old, new in sorted(renamed.items()))


def _own_skills(
    document: Document, declarations: Mapping[str, SkillDeclaration]
) -> Iterable[tuple[str, str]]:
    """Yield nodes that are skills of this installation: of the same name, or of one that fits."""
    used: dict[str, list[Element]] = {}
    for tree in document.trees.values():
        for element in tree.root.walk():
            if category_of(element.tag) is None and not element.children:
                used.setdefault(registration(element), []).append(element)
    for node, elements in used.items():
        name = identifier(node)
        if name in declarations and (node == name or _fits(declarations[name], elements)):
            yield node, name


def _fits(declaration: SkillDeclaration, elements: list[Element]) -> bool:
    """Tell whether a skill has all ports used, takes what is written out, and is given what it needs."""
    needed = {name for name, port in declaration.inputs.items() if port.required}
    for element in elements:
        names = {name for name in element.attributes if name not in ("ID", "name") and name[0] != "_"}
        if needed - names or any(port_of_skill(declaration, name)[0] is None for name in names):
            return False
        for _, name, text in literals_of(element):
            port = port_of_skill(declaration, name)[0]
            if port is not None and written_value(text, port.kind)[1]:
                return False
    return True


def _check_nesting(document: Document, notes: LossNotes) -> None:
    for tree in document.trees.values():
        waiting = [(tree.root, 1)]
        while waiting:
            element, depth = waiting.pop()
            if depth > MAX_NESTING:
                message = f"the nodes of {tree.name!r} are nested more than {MAX_NESTING} deep"
                notes.error(tree.file, element.position, message, ["a part of it in a <SubTree>"])
                break
            waiting.extend((child, depth + 1) for child in element.children)


def _called_first(document: Document, notes: LossNotes) -> list[str]:
    """Order the trees so that called ones come before their callers; a tree that calls itself is an error."""
    order: list[str] = []
    calls = {
        name: [e for e in tree.root.walk() if e.tag == "SubTree" and e.get("ID") in document.trees]
        for name, tree in document.trees.items()
    }
    for start in document.trees:
        path: list[str] = []
        waiting = [(start, False)]
        while waiting:
            name, is_done = waiting.pop()
            if is_done:
                order.append(path.pop())
                continue
            if name in order:
                continue
            path.append(name)
            waiting.append((name, True))
            for element in reversed(calls[name]):
                called = element.get("ID")
                if called in path:
                    chain = " -> ".join([*path[path.index(called) :], called])
                    message = f"the tree {called!r} calls itself: {chain}"
                    notes.error(document.trees[name].file, element.position, message)
                elif called not in order:
                    waiting.append((called, False))
    return order
