"""A checked mission to a tree of behaviours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from py_trees.behaviour import Behaviour

from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.keys import KeyStore
from florence_bt.trees.language._build_leaves import declared_keys
from florence_bt.trees.language._build_nodes import Builder
from florence_bt.trees.language._facts import Facts
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission
from florence_bt.trees.language.origin import Origin, origin_of
from florence_bt.trees.language.quantities import format_value
from florence_bt.trees.language.size_limits import too_large

__all__ = ["CompiledTree", "Origin", "compile_mission", "origin_of"]


@dataclass(frozen=True)
class CompiledTree:
    """A mission that can be ticked.

    Attributes:
        root: The root of the tree.
        mission: What it was built from.
        keys: The keys of the mission.
    """

    root: Behaviour
    mission: Mission
    keys: KeyStore

    def outputs(self) -> dict[str, Any]:
        """The outputs that have been written so far, in SI units."""
        return {name: self.keys.read(name) for name in self.mission.outputs if name in self.keys}

    def output_texts(self) -> dict[str, str]:
        """The same as the mission language writes them, with units."""
        ports = self.mission.outputs
        return {name: format_value(value, ports[name].kind) for name, value in self.outputs().items()}


def compile_mission(
    mission: Mission, library: MissionLibrary, inputs: Mapping[str, Any], context: TreeContext
) -> CompiledTree:
    """Build the tree of a mission.

    Args:
        mission: The mission, checked (``lint.check``).
        library: Where called missions are found.
        inputs: Every input in SI units, as ``parse_inputs`` returns them.
        context: What the tree's nodes share; its keys are set to the inputs.

    Raises:
        ConfigError: The mission, or one that it calls, has an error that a check would have found.
    """
    if library.declarations:
        # A skill that is only declared fails with `no_skill` when it is started.
        context = replace(context, declarations=library.with_declared(context.declarations))
    facts = Facts(library, context.declarations)
    if not library.fits(mission):
        for error in too_large(mission, facts):
            raise error
        library.note_fitting(mission)
    context.keys.declare(declared_keys(mission))
    context.keys.reset(inputs)
    builder = Builder(mission, facts, context, (mission.name,))
    return CompiledTree(builder.root(mission.name), mission, context.keys)
