"""XML files as a set of trees: includes followed, the rules of the format checked, old names renewed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from florence_bt.btcpp.node_models import NodeModel, category_of, known_nodes, ports_of, read_models
from florence_bt.btcpp.notes import LossNotes
from florence_bt.btcpp.vocabulary import CATEGORIES, MARK, POST_CONDITIONS, PRE_CONDITIONS, V3_NAMES
from florence_bt.btcpp.xml_source import MAX_ELEMENTS, Element, read_xml
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.plain_yaml import Position

MAX_FILES = 100
"""Most files that one import reads."""
_CONDITIONS = (*PRE_CONDITIONS, *POST_CONDITIONS)
_ROOT_CHILDREN = ("BehaviorTree", "TreeNodesModel", "include", "Metadata", "metadata")
_GROOT = ("_fullpath", "_uid", "_collapsed", "_position", "project_name")
"""Attributes that Groot writes for itself."""


@dataclass(frozen=True, slots=True)
class Tree:
    """A ``<BehaviorTree>``.

    Attributes:
        name: Its ID.
        file: Where it stands.
        element: The element itself.
        root: The node below.
    """

    name: str
    file: Path
    element: Element
    root: Element


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


def load_document(path: Path, notes: LossNotes) -> Document:
    """Read a file with everything that it includes, or all XML files of a folder as one project.

    Args:
        path: The file or the folder.
        notes: Receives what breaks the rules of the format, as errors, and what is left out.

    Raises:
        ConfigError: The file, or one that it includes, cannot be read or is not XML.
    """
    if path.is_dir():
        return _load_folder(path, notes)
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


def _load_folder(folder: Path, notes: LossNotes) -> Document:
    """All XML files of a folder and of those below it; none of its trees is the main one."""
    files = sorted(folder.rglob("*.xml"))
    if not 0 < len(files) <= MAX_FILES:
        problem = f"the folder has {len(files)} XML files" if files else "the folder has no XML file"
        raise ConfigError(problem, file=folder, valid=[f"1 to {MAX_FILES} XML files"])
    roots = {file: read_xml(file) for file in files}
    ids = Counter(name for root in roots.values() for name in {tree.get("ID") for tree in _trees_in(root)})
    loader, document = _Loader(notes), Document(folder)
    for file, root in roots.items():
        if root.tag != "root":
            notes.notice(file, root.position, f"a file that begins with <{root.tag}> is left out")
        elif not loader.has_seen(file):
            _check_version(root, file)
            _name_by_file(root, file, {name for name, count in ids.items() if name and count > 1})
            loader.add(root, file, document)
    if not document.trees:
        raise ConfigError("the folder has no tree", file=folder, valid=['<BehaviorTree ID="...">'])
    _finish(document, notes)
    return document


def _trees_in(root: Element) -> list[Element]:
    return [element for element in root.children if element.tag == "BehaviorTree"]


def _name_by_file(root: Element, file: Path, shared: set[str]) -> None:
    """Put the name of a file before those of its trees that other files have too, and in its calls."""
    new = {
        tree.get("ID"): f"{file.stem}_{tree.get('ID')}"
        for tree in _trees_in(root)
        if tree.get("ID") in shared
    }
    for element in root.walk():
        if element.tag in ("BehaviorTree", "SubTree", "SubTreePlus") and element.get("ID") in new:
            element.attributes["ID"] = new[element.get("ID")]
        element.tag = new.get(element.tag, element.tag)


def _name_compact_calls(document: Document) -> None:
    """``<MyTree/>``, which version 3 allows, is a call as ``<SubTree ID="MyTree"/>`` is."""
    for tree in document.trees.values():
        for node in tree.root.walk():
            if node.tag in document.trees and category_of(node.tag) is None and not node.children:
                node.tag, node.attributes = "SubTree", {"ID": node.tag, **node.attributes}


def _renew_remaps(call: Element) -> None:
    """``<remap internal="a" external="b"/>`` below a call, as the first files of version 3 have it."""
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
    """The attributes of a node that nothing here reads: they are named, for nothing is dropped in silence."""
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
    def __init__(self, notes: LossNotes) -> None:
        self._notes = notes
        self._seen: set[Path] = set()
        self._elements = 0

    def add(self, root: Element, path: Path, document: Document) -> None:
        """Add the trees of a file."""
        self._seen.add(path.resolve())
        self._elements += sum(1 for _ in root.walk())
        if self._elements > MAX_ELEMENTS:
            problem = f"all files together have more than {MAX_ELEMENTS} elements"
            raise ConfigError(problem, file=path, valid=["several imports"])
        self._groot(root, path)
        for name, model in read_models(root).items():
            document.models.setdefault(name, model)
        for element in root.children:
            match element.tag:
                case "include":
                    self._include(element, path, document)
                case "BehaviorTree":
                    self._tree(element, path, document)
                case tag if tag not in _ROOT_CHILDREN:
                    self._notes.error(
                        path, element.position, f"<{tag}> has no place in <root>", _ROOT_CHILDREN[:3]
                    )

    def has_seen(self, path: Path) -> bool:
        """Whether a file was read, included by another one."""
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
        if not written or Path(written).is_absolute() or "\0" in written:
            message = f"the path {written!r} of the include is not followed"
            self._notes.error(path, element.position, message, ["a path relative to this file"])
            return
        target = path.parent / written
        if target.resolve() in self._seen:
            return
        if len(self._seen) >= MAX_FILES:
            self._notes.error(path, element.position, f"more than {MAX_FILES} files are included")
            return
        if not target.is_file():
            self._notes.error(path, element.position, f"there is no file {str(target)!r} to include")
            return
        root = read_xml(target)
        if root.tag != "root":
            self._notes.error(target, root.position, f"the file begins with <{root.tag}>", ["<root>"])
            return
        self.add(root, target, document)

    def _tree(self, element: Element, path: Path, document: Document) -> None:
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
        document.trees[name] = Tree(name, path, element, element.children[0])
        for node in element.children[0].walk():
            self._renew(node, path)

    def _renew(self, node: Element, path: Path) -> None:
        """Give names of version 3 those of version 4, and check what an element needs."""
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
