"""Prints what the package consists of: ``python tools/code_figures.py [FOLDER]`` (default: florence_bt).

A code line holds code: no blank, no comment, no docstring. The length of a function is counted in code
lines, with its signature and without its docstring. A private module (``_name.py``) has one user when one
other module alone imports it.
"""

from __future__ import annotations

import argparse
import ast
import io
import statistics
import tokenize
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path

LAYOUT = {tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


def code_lines(source: str, tree: ast.Module) -> set[int]:
    """Return the numbers of the lines that hold code."""
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type not in LAYOUT and token.type != tokenize.COMMENT:
            lines.update(range(token.start[0], token.end[0] + 1))
    return lines - set(_docstring_lines(tree))


def _docstring_lines(tree: ast.Module) -> Iterator[int]:
    """Yield the lines of docstrings, and of the strings that follow an assignment to document it."""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        for statement in body if isinstance(body, list) else ():
            if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
                yield from range(statement.lineno, (statement.end_lineno or statement.lineno) + 1)


def imported(path: Path, root: Path, tree: ast.Module) -> set[str]:
    """Return names of modules, and of what is in them, that a module imports."""
    names: set[str] = set()
    package = path.parent.relative_to(root.parent).parts
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(package[: len(package) - node.level + 1]) if node.level else ""
            module = ".".join(part for part in (base, node.module or "") if part)
            names.add(module)
            names.update(f"{module}.{alias.name}" for alias in node.names)
    return names


def main() -> None:
    """Print the figures of a package."""
    parser = argparse.ArgumentParser(description="Print what a package consists of.")
    parser.add_argument("folder", type=Path, nargs="?", default=Path("florence_bt"), help="of the package")
    root = parser.parse_args().folder.resolve()
    per_package: Counter[str] = Counter()
    modules: Counter[str] = Counter()
    functions: list[int] = []
    classes: dict[str, list[str]] = defaultdict(list)
    users: dict[str, set[str]] = defaultdict(set)
    private: list[str] = []
    for path in sorted(root.rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        tree = ast.parse(source)
        lines = code_lines(source, tree)
        parts = path.relative_to(root).with_suffix("").parts
        package = parts[0] if len(parts) > 1 else "(top)"
        name = ".".join((root.name, *parts)).removesuffix(".__init__")
        per_package[package] += len(lines)
        modules[package] += 1
        for node in ast.walk(tree):
            if isinstance(node, FUNCTIONS):
                functions.append(len(lines & set(range(node.lineno, (node.end_lineno or 0) + 1))))
            elif isinstance(node, ast.ClassDef):
                classes[node.name].append(name)
        for used in imported(path, root, tree):
            users[used].add(name)
        if parts[-1].startswith("_") and not parts[-1].startswith("__"):
            private.append(name)
    print("| package | code lines | modules |\n|---|---|---|")
    for package, count in per_package.most_common():
        print(f"| {package} | {count} | {modules[package]} |")
    print(f"| all | {sum(per_package.values())} | {sum(modules.values())} |\n")
    percentile = statistics.quantiles(functions, n=10)[-1]
    print(f"Code lines of a function: median {statistics.median(functions):.0f}, 90 % {percentile:.0f}.")
    single = [name for name in private if len(users[name]) == 1]
    print(f"Private modules: {len(private)}, with one user: {len(single)}.")
    twice = {name: where for name, where in classes.items() if len(where) > 1}
    print(f"Class names that are defined more than once: {len(twice)}.")
    for name, where in sorted(twice.items()):
        print(f"- {name}: {', '.join(where)}")


if __name__ == "__main__":
    main()
