"""The way from the root of a clean tree to what was touched: where a tick may begin instead of there."""

from __future__ import annotations

from florence_bt.runtime.ticking._leaves import INVALID, RUNNING
from florence_bt.runtime.ticking._records import CLEAN, TOUCHED, Record


def only_way(touched: Record, root: Record) -> Record | None:
    """Open the way to the only node that was touched, as far down from the root as it has to be.

    Args:
        touched: The node.
        root: The root; clean.

    Returns:
        The node itself, or the highest one above it that has to be ticked as a whole; None when the node
        would not be ticked now.
    """
    top = below = touched
    while (above := below.parent) is not None:
        asked = above.opaque or above.low <= below.index <= above.high
        if above.state != CLEAN or not asked:
            # The node would not be ticked now; whenever it is, it will be looked at.
            touched.open_way(None if asked else above)
            return None
        if above.opaque:
            top = above
        below = above
    if below is not root:
        touched.open_way()
        return None  # it belonged to the tree before that was rebuilt
    touched.open_way(top.parent)
    return top


def common_way(root: Record) -> Record | None:
    """Close the part of the opened ways that all of them share.

    Args:
        root: The root, which was clean before the ways were opened.

    Returns:
        The last node that they share, or the highest above it that has to be ticked as a whole; None when
        no way leads from the root.
    """
    record = root
    while record.state == TOUCHED and not record.opaque and not record.touched:
        pending = record.pending
        assert pending is not None  # it is a composite
        if len(pending) != 1 or not record.low <= pending[0] <= record.high or record.node.status is INVALID:
            break
        kid: Record = record.keeper.kids[pending.pop()]
        record.state = CLEAN
        record = kid
    return None if record.state == CLEAN else record


def starts_anew(record: Record | None) -> bool:
    """Whether a full tick would reset the children of a composite before it ticks them."""
    while record is not None and record.node.status is not RUNNING:
        if record.keeper.resets:
            return True
        record = record.parent
    return False
