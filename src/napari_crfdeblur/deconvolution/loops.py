"""The elementwise steps of the methods as single loops, compiled where numba is installed.

numpy takes a pass over a block for every operation; compiled, all of them are one pass. The
results are the same but for rounding. Every function here is plain Python that numba can
compile, for planes (M, N) of numpy.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

from .. import arrays
from .._typing import FloatArray

LEAST_SIZE = 1 << 21  # elements; for less, loading the compiler takes longer than it saves


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
    options: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
    try:
        return numba.njit(loop, cache=True, **options)  # type: ignore[no-any-return]
    except RuntimeError:  # no folder in which to keep what is compiled
        return numba.njit(loop, **options)  # type: ignore[no-any-return]


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
    rows: FloatArray,
    columns: FloatArray,
    coupling: Any,
) -> None:
    """Eq. 4 of Krishnan & Fergus (2009), in place; spectra as pairs of real numbers."""
    for row in range(rows.size):
        for column in range(columns.size):
            whole = coupling * (rows[row] + columns[column]) + gain[row, column]
            for part in (2 * column, 2 * column + 1):
                value = spectrum[row, part] * coupling + correlated[row, part]
                spectrum[row, part] = value / whole


def divide(plane: FloatArray, predicted: FloatArray, least: Any, zero: Any) -> None:
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
