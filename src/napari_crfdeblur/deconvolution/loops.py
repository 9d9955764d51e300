"""The elementwise steps of the methods as single loops, compiled where numba is installed.

numpy takes a pass over a block for every operation; compiled, all of them are one pass. The
results are the same but for rounding. Every function here is plain Python that numba can
compile, for planes (M, N) of numpy.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from .. import arrays
from .._typing import FloatArray

OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
LEAST_SIZE = 1 << 19  # elements; for less, loading the compiler takes longer than it saves


def compiled(loop: Callable[..., None], plane: FloatArray) -> Callable[..., None] | None:
    """The loop compiled, if that is possible and worthwhile for this plane; else None."""
    if not arrays.is_numpy(plane) or plane.ndim != 2 or plane.size < LEAST_SIZE:
        return None
    return _compiled(loop)


@cache
def _compiled(loop: Callable[..., None]) -> Callable[..., None] | None:
    try:
        import numba
    except ImportError:
        return None
    _make_parts_known()
    try:
        return numba.njit(loop, cache=True, **OPTIONS)  # type: ignore[no-any-return]
    except RuntimeError:  # no folder in which to keep what is compiled
        return numba.njit(loop, **OPTIONS)  # type: ignore[no-any-return]


@cache
def _make_parts_known() -> None:
    """Let compiled loops call the parts of :func:`shrink_details`."""
    from numba.extending import register_jitable

    for part in (_take, _filter, _shrink, _filter_back, _add_back):
        register_jitable(**OPTIONS)(part)


def shrink_gradient(
    plane: FloatArray, shares: FloatArray, cells: Any, above: FloatArray, across: FloatArray
) -> None:
    """See :func:`.hyper_laplacian.shrink_gradient`: ``D^T v``, in place.

    `shares` is the table of shrinkage, `cells` its cells for a unit of the plane; `above` and
    `across` are rows to work with.
    """
    rows, columns = plane.shape
    last = shares.size - 1
    first = plane[0].copy()
    for column in range(columns):
        down = first[column] - plane[rows - 1, column]
        above[column] = down * shares[int(min(abs(down) * cells, last))]
    for row in range(rows):
        here = plane[row]
        below = plane[row + 1] if row + 1 < rows else first
        for column in range(columns - 1):
            right = here[column + 1] - here[column]
            across[column] = right * shares[int(min(abs(right) * cells, last))]
        right = here[0] - here[columns - 1]
        across[columns - 1] = right * shares[int(min(abs(right) * cells, last))]
        for column in range(columns):
            down = below[column] - here[column]
            down *= shares[int(min(abs(down) * cells, last))]
            here[column] = above[column] - down - across[column]
            above[column] = down
        here[0] += across[columns - 1]
        for column in range(1, columns):
            here[column] += across[column - 1]


def solve(
    spectrum: FloatArray,
    correlated: FloatArray,
    gain: FloatArray,
    power: FloatArray,
    coupling: Any,
) -> None:
    """Least squares of :func:`.splitting.solving`, in place; spectra as pairs of real numbers."""
    for row in range(power.shape[0]):
        for column in range(power.shape[1]):
            whole = coupling * power[row, column] + gain[row, column]
            for part in (2 * column, 2 * column + 1):
                value = spectrum[row, part] * coupling + correlated[row, part]
                spectrum[row, part] = value / whole


def divide_inside(plane: FloatArray, predicted: FloatArray, least: Any, zero: Any) -> None:
    """``y / prediction`` inside the frame, 0 outside, in place of the prediction."""
    rows, columns = plane.shape
    for row in range(predicted.shape[0]):
        inside = columns if row < rows else 0
        for column in range(inside):
            light = max(plane[row, column], zero)
            predicted[row, column] = light / max(predicted[row, column], least)
        for column in range(inside, predicted.shape[1]):
            predicted[row, column] = zero


def multiply(sharp: FloatArray, correction: FloatArray, share: FloatArray, zero: Any) -> None:
    """``x <- x correction share``, in place, where the share is not 0."""
    for row in range(sharp.shape[0]):
        for column in range(sharp.shape[1]):
            if share[row, column] > zero:
                factor = max(correction[row, column], zero) * share[row, column]
                sharp[row, column] *= factor


def shrink_details(
    plane: FloatArray,
    factors: FloatArray,
    threshold: Any,
    shares: FloatArray,
    nothing: Any,
    pull: FloatArray,
) -> None:
    """See :func:`.local_shrinkage.shrink`: ``sum_j D_j' v_j``, row by row into `pull`.

    Of what the filters see, five rows are kept, each in the place of the one five before.

    Parameters
    ----------
    plane : ndarray, shape (M, N)
        Periodic; not modified.
    factors : ndarray, shape (M, N) or (0, 0)
        Of the threshold; none if it is the same everywhere.
    threshold : float
        Of the sum of squares over 5 x 5 pixels.
    shares : ndarray, shape (9,)
        What remains of a detail that is not shrunk, for each filter: first the mean, then those
        along the rows.
    nothing : float
        Least sum of squares that is shrunk.
    pull : ndarray, shape (M, N)
        Result.
    """
    rows, columns = plane.shape
    seen, down = np.empty((3, columns + 8), plane.dtype), np.empty((3, columns + 8), plane.dtype)
    details = np.empty((9, 5, columns + 6), plane.dtype)
    energy = np.empty(columns + 6, plane.dtype)
    shrunk, least = np.zeros((9, columns + 2), plane.dtype), np.empty(columns + 2, plane.dtype)
    least[:] = threshold
    back, begun = np.empty((3, columns), plane.dtype), np.zeros((2, columns), plane.dtype)
    for last in range(-4, rows + 4):
        _take(plane[last % rows], 4, seen[last % 3])
        if last < -2:
            continue
        above, here, below = seen[(last - 2) % 3], seen[(last - 1) % 3], seen[last % 3]
        _filter(above, here, below, down[0], down[1], down[2])
        place = (last - 1) % 5
        for order in range(3):
            left, here, right = down[order, :-2], down[order, 1:-1], down[order, 2:]
            # one by one: compiled for rows whose elements lie side by side
            mean, slope = details[3 * order, place], details[3 * order + 1, place]
            _filter(left, here, right, mean, slope, details[3 * order + 2, place])
        if last < 2:
            continue
        row = last - 3
        if factors.size > 0:
            _take(factors[row % rows], 1, least)
            least *= threshold
        for each in range(1, 9):
            own = details[each, row % 5, 2:-2]
            _shrink(details[each], own, least, shares[each], nothing, energy, shrunk[each])
        for order in range(3):
            _filter_back(shrunk, order, back[order])
        _add_back(back, begun[0], begun[1], pull[row - 1] if row > 0 else energy[:columns])


def _take(row: FloatArray, halo: int, into: FloatArray) -> None:
    """A periodic row, with so many pixels more on each side."""
    columns = row.size
    into[halo : halo + columns] = row
    for column in range(halo):
        into[column] = row[(column - halo) % columns]
        into[halo + columns + column] = row[column % columns]


def _filter(
    before: FloatArray,
    here: FloatArray,
    after: FloatArray,
    mean: FloatArray,
    slope: FloatArray,
    bend: FloatArray,
) -> None:
    """The filters (1, 1, 1), (-1, 0, 1) and (1, -2, 1)."""
    for column in range(here.size):
        both = before[column] + after[column]
        mean[column] = both + here[column]
        slope[column] = after[column] - before[column]
        bend[column] = both - here[column] - here[column]


def _shrink(
    details: FloatArray,
    own: FloatArray,
    least: FloatArray,
    share: Any,
    nothing: Any,
    energy: FloatArray,
    shrunk: FloatArray,
) -> None:
    """``d max(0, share - t / e)`` for a row, `e` from five rows of details."""
    first, second, third = details[0], details[1], details[2]
    fourth, fifth = details[3], details[4]
    for column in range(energy.size):
        total = first[column] * first[column] + second[column] * second[column]
        total += third[column] * third[column]
        total += fourth[column] * fourth[column]
        energy[column] = total + fifth[column] * fifth[column]
    zero = share - share
    for column in range(shrunk.size):
        total = energy[column] + energy[column + 1] + energy[column + 2]
        total = max(total + energy[column + 3] + energy[column + 4], nothing)
        shrunk[column] = max(share - least[column] / total, zero) * own[column]


def _filter_back(shrunk: FloatArray, order: int, back: FloatArray) -> None:
    """The adjoints of the three filters along a row, of those of this order along the column."""
    mean, slope, bend = shrunk[3 * order], shrunk[3 * order + 1], shrunk[3 * order + 2]
    for column in range(back.size):
        total = mean[column] + slope[column] + bend[column]
        here = mean[column + 1] - bend[column + 1] - bend[column + 1]
        back[column] = total + here + (mean[column + 2] - slope[column + 2] + bend[column + 2])


def _add_back(back: FloatArray, here: FloatArray, below: FloatArray, above: FloatArray) -> None:
    """The adjoints of the filters along the columns, from one row into three.

    Parameters
    ----------
    back : ndarray, shape (3, N)
        Filtered back along the row.
    here, below : ndarray, shape (N,)
        What the rows so far have given to this one and to the next; then to the next and to the
        one after.
    above : ndarray, shape (N,)
        The row before, which has all then.
    """
    mean, slope, bend = back[0], back[1], back[2]
    for column in range(above.size):
        even = mean[column] + bend[column]
        above[column] = here[column] + even - slope[column]
        here[column] = below[column] + mean[column] - bend[column] - bend[column]
        below[column] = even + slope[column]
