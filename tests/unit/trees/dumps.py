"""A tree as text in one step, with nothing known of nodes that were left."""

from florence_bt.trees.drawings.ascii import draw_rows, tree_rows


def ascii_tree(root, *, durations=None, **options):
    rows = tree_rows(root, durations or (lambda node: None), lambda node: None)
    return draw_rows(rows, durations=durations is not None, **options)
