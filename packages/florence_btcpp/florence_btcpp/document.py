"""XML files as a set of trees: includes followed, the rules of the format checked, old names renewed."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.plain_yaml import Position
from florence_bt.trees.language.findings import has_errors
from florence_btcpp.names import unique
from florence_btcpp.node_models import NodeModel, category_of, known_nodes, ports_of, read_models
from florence_btcpp.notes import LossNotes
from florence_btcpp.vocabulary import CATEGORIES, MARK, POST_CONDITIONS, PRE_CONDITIONS, V3_NAMES
from florence_btcpp.xml_source import MAX_ELEMENTS, Element, read_xml

MAX_FILES = 100
"""Most files that one import reads."""
_CONDITIONS = (*PRE_CONDITIONS, *POST_CONDITIONS)
_ROOT_CHILDREN = ("BehaviorTree", "TreeNodesModel", "include", "Metadata", "metadata")
_GROOT = ("_fullpath", "_uid", "_collapsed", "_position", "project_name")
"""Attributes that Groot writes for itself."""
_SINCE_V4 = frozenset({"Script", "ScriptCondition", "Precondition"})
"""Nodes that version 3 does not have."""
_ENTRY = re.compile(r"[^\W\d]\w*")
"""The name of an entry of the blackboard where version 3 wants one."""


@dataclass(frozen=True, slots=True)
class Tree:
    """A ``<BehaviorTree>``.

    Attributes:
        name: Its ID.
        file: Where it stands.
        element: The element itself.
        root: The node below.
        is_v3: Whether its file is of version 3.
    """

    name: str
    file: Path
    element: Element
    root: Element
    is_v3: bool


@dataclass
class Document:
    """All trees of a file and of the files that it includes.

    Attributes:
        file: The file, or the folder of all files.
        main: The name of the tree that is executed, None when the file does not say.
        trees: The trees by name, in the order of the files.
        models: What nodes declare.
    """

    file: Path
    main: str | None = None
    trees: dict[str, Tree] = field(default_factory=dict)
    models: dict[str, NodeModel] = field(default_factory=dict)


def load_document(path: Path, notes: LossNotes, left_out: Collection[str] = ()) -> Document:
    """Read a file with everything that it includes, or all XML files of a folder as one project.

    Args:
        path: The file or the folder.
        notes: Receives what breaks the rules of the format, as errors, and what is left out. A file of a
            folder that cannot be read is an error there.
        left_out: Files of the folder that are not read.

    Raises:
        ConfigError: The file, or one that it includes, cannot be read or is not XML; the folder has no tree.
    """
    if path.is_dir():
        return _load_folder(path, notes, left_out)
    loader = _Loader(notes)
    root = read_xml(path)
    if root.tag != "root":
        raise ConfigError(
            f"the file begins with <{root.tag}>",
            file=path,
            line=root.position.line,
            column=root.position.column,
            valid=["<root>"],
        )
    _check_version(root, path)
    document = Document(path)
    loader.add(root, path, document)
    loader.check_main(root, document)
    _finish(document, notes)
    return document


def _finish(document: Document, notes: LossNotes) -> None:
    _name_compact_calls(document)
    _note_left_over(document, notes)


def _load_folder(folder: Path, notes: LossNotes, left_out: Collection[str]) -> Document:
    """Load all XML files of a folder and of those below it; none of its trees is the main one."""
    files = sorted(folder.rglob("*.xml"))
    if not 0 < len(files) <= MAX_FILES:
        problem = f"the folder has {len(files)} XML files" if files else "the folder has no XML file"
        raise ConfigError(problem, file=folder, valid=[f"1 to {MAX_FILES} XML files"])
    roots = _read_all([file for file in files if str(file) not in left_out], notes)
    _name_by_file(roots, folder)
    loader, document = _Loader(notes, folder, left_out), Document(folder)
    for file, root in roots.items():
        try:
            if not loader.has_seen(file):
                _check_version(root, file)
                loader.add(root, file, document)
        except ConfigError as error:
            notes.failed(file, error)
    if not document.trees and left_out:
        notes.error(folder, Position(1, 1), "no file of the folder can be imported")
    elif not document.trees and not has_errors(notes.findings):
        raise ConfigError("the folder has no tree", file=folder, valid=['<BehaviorTree ID="...">'])
    _finish(document, notes)
    return document


def _read_all(files: Iterable[Path], notes: LossNotes) -> dict[Path, Element]:
    """Read the files that can be read and hold trees."""
    roots = {}
    for file in files:
        try:
            root = read_xml(file)
        except ConfigError as error:
            notes.failed(file, error)
            continue
        if root.tag == "root":
            roots[file] = root
        else:
            notes.notice(file, root.position, f"a file that begins with <{root.tag}> is left out")
    return roots


def _trees_in(root: Element) -> list[Element]:
    return [element for element in root.children if element.tag == "BehaviorTree"]


def _name_by_file(roots: Mapping[Path, Element], folder: Path) -> None:
    """Put the name of a file before those of its trees that other files have too, and in its calls.

    Files of one name are told apart by their folders.
    """
    ids = Counter(name for root in roots.values() for name in {tree.get("ID") for tree in _trees_in(root)})
    stems = Counter(file.stem for file in roots)
    taken = set(ids)
    for file, root in roots.items():
        path = file.relative_to(folder).with_suffix("")
        prefix = file.stem if stems[file.stem] == 1 else "_".join(path.parts)
        new = {}
        for tree in _trees_in(root):
            name = tree.get("ID")
            if name and ids[name] > 1 and name not in new:
                new[name] = unique(f"{prefix}_{name}", taken)
                taken.add(new[name])
            elif not name and stems[file.stem] > 1:
                tree.attributes["ID"] = unique(prefix, taken)
                taken.add(tree.attributes["ID"])
        for element in root.walk():
            if element.tag in ("BehaviorTree", "SubTree", "SubTreePlus") and element.get("ID") in new:
                element.attributes["ID"] = new[element.get("ID")]
            element.tag = new.get(element.tag, element.tag)


def _name_compact_calls(document: Document) -> None:
    """Rewrite ``<MyTree/>``, which version 3 allows, as the call ``<SubTree ID="MyTree"/>``."""
    for tree in document.trees.values():
        for node in tree.root.walk():
            if node.tag in document.trees and category_of(node.tag) is None and not node.children:
                node.tag, node.attributes = "SubTree", {"ID": node.tag, **node.attributes}
                if tree.is_v3:
                    _renew_entries(node)


def _is_version_3(root: Element) -> bool:
    """Tell whether a file is of version 3: it says so, or it says nothing and has no word of version 4."""
    written = root.get("BTCPP_format")
    return written == "3" or (not written and not any(map(_is_of_version_4, root.walk())))


def _is_of_version_4(element: Element) -> bool:
    if element.tag in _SINCE_V4 or any(name in element.attributes for name in (*_CONDITIONS, "_autoremap")):
        return True
    return element.tag == "SubTree" and any(value.startswith("{") for value in element.attributes.values())


def _renew_entries(call: Element) -> list[str]:
    """Write the entries that a ``<SubTree>`` of version 3 names as version 4 does; gives the other ports.

    There each attribute maps a port of the tree to an entry of the caller, which is named without braces.
    """
    others = []
    for name, value in call.attributes.items():
        if name in ("ID", "name") or name.startswith("_") or value.startswith("{"):
            continue
        if _ENTRY.fullmatch(value):
            call.attributes[name] = f"{{{value}}}"
        else:
            others.append(name)
    return others


def _renew_remaps(call: Element) -> None:
    """Renew ``<remap internal="a" external="b"/>`` below a call, as the first files of version 3 have it."""
    for child in [child for child in call.children if child.tag == "remap"]:
        if child.get("internal") and child.get("external"):
            call.attributes.setdefault(child.get("internal"), f"{{{child.get('external')}}}")
            call.children.remove(child)


def _note_left_over(document: Document, notes: LossNotes) -> None:
    for tree in document.trees.values():
        for name in tree.element.attributes:
            if name not in ("ID", "_description") and not name.startswith(MARK):
                message = f"<BehaviorTree> has no attribute {name!r}; it is left out"
                notes.notice(tree.file, tree.element.position, message)
        for node in tree.root.walk():
            for name in _left_over(node):
                message = f"<{node.tag}> has no attribute {name!r}; {node.get(name)!r} is left out"
                known = _CONDITIONS if name.startswith("_") else ports_of(node.tag)
                notes.lost(tree.file, node.position, message, closest_first(name, known))
            if node.text:
                message = f"the text in <{node.tag}> is left out: {node.text[:40]!r}"
                notes.notice(tree.file, node.position, message)


def _left_over(element: Element) -> Iterator[str]:
    """Yield the attributes of a node that nothing here reads, so that nothing is dropped in silence."""
    for name in element.attributes:
        if name in ("ID", "name"):
            continue
        if name.startswith("_"):
            autoremap = name == "_autoremap" and element.tag == "SubTree"
            if name not in (*_CONDITIONS, "_description") and not name.startswith(MARK) and not autoremap:
                yield name
        elif element.tag in known_nodes() and name not in ports_of(element.tag):
            yield name


def _check_version(root: Element, path: Path) -> None:
    written = root.attributes.get("BTCPP_format")
    if written not in (None, "3", "4"):
        raise ConfigError(
            f"the format {written!r} is not known",
            file=path,
            line=root.position.line,
            column=root.position.column,
            valid=['BTCPP_format="4"', 'BTCPP_format="3"'],
        )


class _Loader:
    def __init__(self, notes: LossNotes, folder: Path | None = None, left_out: Collection[str] = ()) -> None:
        self._notes = notes
        self._folder = folder
        self._seen = {Path(file).resolve() for file in left_out}
        self._elements = 0

    def add(self, root: Element, path: Path, document: Document) -> None:
        """Add the trees of a file."""
        self._seen.add(path.resolve())
        self._elements += sum(1 for _ in root.walk())
        if self._elements > MAX_ELEMENTS:
            problem = f"all files together have more than {MAX_ELEMENTS} elements"
            raise ConfigError(problem, file=path, valid=["several imports"])
        self._groot(root, path)
        is_v3 = _is_version_3(root)
        for name, model in read_models(root).items():
            document.models.setdefault(name, model)
        for element in root.children:
            match element.tag:
                case "include":
                    self._include(element, path, document)
                case "BehaviorTree":
                    self._tree(element, path, document, is_v3=is_v3)
                case tag if tag not in _ROOT_CHILDREN:
                    self._notes.error(
                        path, element.position, f"<{tag}> has no place in <root>", _ROOT_CHILDREN[:3]
                    )

    def has_seen(self, path: Path) -> bool:
        """Tell whether a file was read, included by another one."""
        return path.resolve() in self._seen

    def check_main(self, root: Element, document: Document) -> None:
        """Find the main tree."""
        named = root.attributes.get("main_tree_to_execute")
        if named is not None and named not in document.trees:
            message = f"there is no tree {named!r} to execute"
            self._notes.error(document.file, root.position, message, closest_first(named, document.trees))
        elif named is None and len(document.trees) == 1:
            named = next(iter(document.trees))
        document.main = named if named in document.trees else None
        if not document.trees:
            self._notes.error(
                document.file, root.position, "the file has no tree", ['<BehaviorTree ID="...">']
            )

    def _include(self, element: Element, path: Path, document: Document) -> None:
        written = element.get("path")
        if element.get("ros_pkg"):
            message = f"the package {element.get('ros_pkg')!r} is not looked for; its trees are missing here"
            self._notes.lost(
                path, element.position, message, ["a path relative to this file, without ros_pkg"]
            )
            return
        # In a folder the other files are imported all the same.
        refuse = self._notes.error if self._folder is None else self._notes.lost
        if not written or Path(written).is_absolute() or "\0" in written:
            message = f"the path {written!r} of the include is not followed"
            refuse(path, element.position, message, ["a path relative to this file"])
            return
        target = path.parent / written
        if target.resolve() in self._seen:
            return
        if len(self._seen) >= MAX_FILES:
            refuse(path, element.position, f"more than {MAX_FILES} files are included")
        elif not target.is_file():
            refuse(path, element.position, f"there is no file {str(target)!r} to include")
        else:
            self._add_included(target, element, path, document)

    def _add_included(self, target: Path, element: Element, path: Path, document: Document) -> None:
        try:
            root = read_xml(target)
            if root.tag != "root":
                self._notes.error(target, root.position, f"the file begins with <{root.tag}>", ["<root>"])
                return
            self.add(root, target, document)
        except ConfigError as error:
            if self._folder is None:
                raise
            self._notes.lost(path, element.position, f"what is included is left out: {error}")

    def _tree(self, element: Element, path: Path, document: Document, *, is_v3: bool) -> None:
        name = element.get("ID")
        if not name:
            same = sum(tree.file == path for tree in document.trees.values())
            name = f"{path.stem}_{same + 1}" if same else path.stem
            self._notes.notice(path, element.position, f"a <BehaviorTree> without ID is called {name!r} here")
        if name in document.trees:
            first = document.trees[name]
            message = f"the tree {name!r} is duplicated (first in {first.file}:{first.element.position.line})"
            self._notes.error(path, element.position, message)
            return
        if len(element.children) != 1:
            message = f"the tree {name!r} must have exactly one node below it, not {len(element.children)}"
            self._notes.error(path, element.position, message, ["<Sequence> around the nodes"])
            return
        document.trees[name] = Tree(name, path, element, element.children[0], is_v3)
        for node in element.children[0].walk():
            self._renew(node, path, is_v3=is_v3)

    def _renew(self, node: Element, path: Path, *, is_v3: bool) -> None:
        """Give names of version 3 those of version 4, and check what an element needs."""
        if is_v3 and node.tag == "SubTree":
            for name in _renew_entries(node):
                message = f"{name}={node.get(name)!r} is taken as a value; version 3 wants an entry there"
                self._notes.lost(path, node.position, message, [f'{name}="an_entry"', "<SubTreePlus>"])
        node.tag = V3_NAMES.get(node.tag, node.tag)
        for old in ("__autoremap", "__shared_blackboard"):
            if old in node.attributes:
                node.attributes["_autoremap"] = node.attributes.pop(old)
        if node.tag == "SubTree":
            _renew_remaps(node)
        if node.tag in CATEGORIES and not node.get("ID"):
            self._notes.error(path, node.position, f"<{node.tag}> needs an ID", [f'<{node.tag} ID="..."/>'])
        elif node.tag in CATEGORIES and node.tag != "SubTree":
            known = V3_NAMES.get(node.get("ID"), node.get("ID"))
            if category_of(known) is not None:
                node.tag = known
                del node.attributes["ID"]
        self._check_children(node, path)

    def _check_children(self, node: Element, path: Path) -> None:
        category = category_of(node.tag) or node.tag
        count = len(node.children)
        if category in ("Action", "Condition", "SubTree") and count:
            self._notes.error(path, node.position, f"<{node.tag}> cannot have nodes below it")
        elif category == "Decorator" and count != 1:
            message = f"<{node.tag}> must have exactly one node below it, not {count}"
            self._notes.error(path, node.position, message, ["<Sequence> around the nodes"])
        elif category == "Control" and not count:
            self._notes.error(path, node.position, f"<{node.tag}> needs nodes below it")

    def _groot(self, root: Element, path: Path) -> None:
        found: list[Position] = []
        for element in root.walk():
            for name in _GROOT:
                if element.attributes.pop(name, None) is not None:
                    found.append(element.position)
        found += [child.position for child in root.children if child.tag.lower() == "metadata"]
        if found:
            self._notes.notice(
                path, min(found), f"what Groot keeps for itself is left out ({len(found)} places)"
            )
