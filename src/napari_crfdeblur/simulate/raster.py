"""Anti-aliased drawing: polygons painted by the exact area that they cover of each pixel."""

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._typing import FloatArray

Slices: TypeAlias = tuple[slice, slice]
IndexArray: TypeAlias = NDArray[np.integer[Any]]


def paint(
    canvas: FloatArray,
    outlines: Sequence[ArrayLike],
    value: ArrayLike,
    *,
    opacity: float = 1.0,
) -> None:
    """Paint a shape over a canvas, in place.

    Parameters
    ----------
    canvas : ndarray, shape (M, N) or (M, N, C)
        Linear irradiance, modified in place.
    outlines : sequence of array_like, shape (V, 2)
        Closed polygons, (row, column) pixels, pixel centers at whole numbers; a hole is an
        outline that runs the other way round than the outline that it lies in.
    value : array_like, shape () or (C,)
        Irradiance of the shape.
    opacity : float
        Share of the shape that hides the canvas, in [0, 1].
    """
    polygons = [np.asarray(outline, dtype=np.float64) + 0.5 for outline in outlines]
    box = _bounding_box(polygons, canvas.shape)
    if box is None:
        return
    corner = np.array([side.start for side in box])
    region = canvas[box]
    share = opacity * coverage([p - corner for p in polygons], region.shape[:2])
    if canvas.ndim == 3:
        share = share[..., np.newaxis]
    region += share * (np.asarray(value, dtype=np.float32) - region)


def coverage(polygons: Sequence[FloatArray], shape: tuple[int, ...]) -> FloatArray:
    """Share of each pixel inside the polygons, exact for straight outlines.

    By Green's theorem a piece of outline inside one pixel adds its height times the part of
    the pixel to its right, and its whole height to all pixels further right.

    Parameters
    ----------
    polygons : sequence of ndarray, shape (V, 2)
        (row, column), pixel (0, 0) being the square from (0, 0) to (1, 1).
    shape : (int, int)
        Rows and columns of the result.

    Returns
    -------
    ndarray, shape `shape`
        float32 in [0, 1].
    """
    rows, columns = shape
    starts = np.concatenate(polygons)
    ends = np.concatenate([np.roll(polygon, -1, axis=0) for polygon in polygons])
    middle, height = _pieces(starts, ends)
    row = np.floor(middle[:, 0]).astype(int)
    column = np.clip(np.floor(middle[:, 1]).astype(int), 0, columns)
    passed = np.clip(middle[:, 1] - column, 0, 1)  # left of the image: all pixels are passed
    inside = (row >= 0) & (row < rows) & (column < columns)
    cell = (row * (columns + 1) + column)[inside]
    height, passed = height[inside], passed[inside]
    size = rows * (columns + 1)
    total = np.bincount(cell, height * (1 - passed), minlength=size)
    total += np.bincount(cell + 1, height * passed, minlength=size)
    area = np.cumsum(total.reshape(rows, columns + 1), axis=1)[:, :-1]
    return np.minimum(np.abs(area), 1).astype(np.float32)


def _pieces(starts: FloatArray, ends: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Cut sides, shape (S, 2), at all grid lines: middles (P, 2) and heights (P,) of the pieces."""
    sides = np.arange(len(starts))
    crossings = [_crossings(starts[:, axis], ends[:, axis]) for axis in (0, 1)]
    side = np.concatenate([sides, sides, *(side for side, _ in crossings)])
    t = np.concatenate([0.0 * sides, 0.0 * sides + 1, *(t for _, t in crossings)])
    order = np.lexsort((t, side))
    side, t = side[order], t[order, np.newaxis]
    points = starts[side] + t * (ends - starts)[side]
    together = side[1:] == side[:-1]
    middle, height = (points[1:] + points[:-1]) / 2, np.diff(points[:, 0])
    return middle[together], height[together]


def _crossings(start: FloatArray, end: FloatArray) -> tuple[IndexArray, FloatArray]:
    """Sides that pass whole numbers, and where on the way from `start` to `end`, as a share."""
    first = np.floor(np.minimum(start, end)) + 1
    count = np.maximum(np.ceil(np.maximum(start, end)) - first, 0).astype(int)
    side = np.repeat(np.arange(start.size), count)
    number = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return side, (first[side] + number - start[side]) / (end - start)[side]


def _bounding_box(polygons: Sequence[FloatArray], shape: tuple[int, ...]) -> Slices | None:
    corners = np.concatenate(polygons)
    low = np.maximum(np.floor(corners.min(axis=0)), 0).astype(int)
    high = np.minimum(np.ceil(corners.max(axis=0)), shape[:2]).astype(int)
    if np.any(low >= high):
        return None
    return slice(low[0], high[0]), slice(low[1], high[1])
