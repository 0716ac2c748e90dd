"""A tree as text in one step, with nothing known of nodes that were left."""

from florence_bt.trees.drawings.ascii import draw_rows, tree_rows
from florence_bt.trees.drawings.folding import fold_calls


def ascii_tree(root, *, durations=None, **options):
    rows = tree_rows(root, durations or (lambda node: None), lambda node: None)
    return draw_rows(rows, durations=durations is not None, **options)


def run_dump(executor, run, *, whole=False, durations=False):
    """The tree of a run as the mission server draws it: folded, or with all nodes of called missions."""
    nodes = executor.nodes_of(run)
    return draw_rows(nodes if whole else fold_calls(nodes), durations=durations) or run.tree
