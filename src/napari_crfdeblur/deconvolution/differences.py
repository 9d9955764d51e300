"""Forward differences of periodic planes and volumes, and their adjoint, block by block."""

from typing import Any

from .. import arrays
from .._typing import FloatArray


def difference(part: FloatArray, axis: int, behind: FloatArray | None = None) -> FloatArray:
    """Forward differences along an axis; behind the last comes `behind`, or the first again."""
    ahead, here, last = (
        _along(axis, each) for each in (slice(1, None), slice(-1), slice(-1, None))
    )
    following = part[_along(axis, slice(1))] if behind is None else behind
    differences: FloatArray = arrays.empty_like(part)
    arrays.subtract(part[ahead], part[here], out=differences[here])
    arrays.subtract(following, part[last], out=differences[last])
    return differences


def subtract_behind(part: FloatArray, down: FloatArray, above: FloatArray) -> None:
    """Replace `part` by the values of `down` one row before, less those of the row.

    The adjoint of the differences along the first axis; `above` is the row before the first.
    """
    arrays.subtract(down[:-1, ...], down[1:, ...], out=part[1:, ...])
    arrays.subtract(above, down[:1, ...], out=part[:1, ...])


def add_adjoint(part: FloatArray, across: FloatArray, axis: int) -> None:
    """Add to `part` the adjoint of the differences along another axis, periodic."""
    part -= across
    part[_along(axis, slice(1, None))] += across[_along(axis, slice(-1))]
    part[_along(axis, slice(1))] += across[_along(axis, slice(-1, None))]


def _along(axis: int, rows: slice) -> tuple[Any, ...]:
    return (*(slice(None),) * axis, rows, ...)
