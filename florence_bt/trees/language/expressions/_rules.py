"""The table of kinds: what comes out of sums, products and quotients."""

from __future__ import annotations

from florence_bt.core.declaration import Kind
from florence_bt.trees.language.quantities import NUMERIC_KINDS

PLAIN = (Kind.INTEGER, Kind.NUMBER)
"""Numbers without a unit."""

_PRODUCTS: dict[frozenset[Kind], Kind] = {frozenset((Kind.SPEED, Kind.DURATION)): Kind.LENGTH}
_QUOTIENTS: dict[tuple[Kind, Kind], Kind] = {
    (Kind.LENGTH, Kind.DURATION): Kind.SPEED,
    (Kind.LENGTH, Kind.SPEED): Kind.DURATION,
}


def common_kind(left: Kind, right: Kind) -> Kind | None:
    """The kind of a sum or a comparison, None when there is none."""
    if left is right:
        return left
    return Kind.NUMBER if left in PLAIN and right in PLAIN else None


def product_kind(left: Kind, right: Kind) -> Kind | None:
    """The kind of a product of two numeric kinds, None when there is none."""
    if left in PLAIN and right in PLAIN:
        return common_kind(left, right)
    if left in PLAIN:
        return right
    if right in PLAIN:
        return left
    return _PRODUCTS.get(frozenset((left, right)))


def quotient_kind(left: Kind, right: Kind) -> Kind | None:
    """The kind of a quotient of two numeric kinds, None when there is none."""
    if right in PLAIN:
        return Kind.NUMBER if left in PLAIN else left
    if left is right and left in NUMERIC_KINDS:
        return Kind.NUMBER
    return _QUOTIENTS.get((left, right))
