"""Anti-aliased drawing: polygons painted by the exact area that they cover of each pixel."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from .._typing import FloatArray

Slices = tuple[slice, slice]


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
        Closed polygons, (row, column) pixels, pixel centres at whole numbers; a hole is an
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
    total = np.zeros(rows * (columns + 1))
    for polygon in polygons:
        following = np.roll(polygon, -1, axis=0)
        for start, end in zip(polygon, following, strict=True):
            if start[0] != end[0]:
                _add_segment(total, start, end, (rows, columns))
    area = np.cumsum(total.reshape(rows, columns + 1), axis=1)[:, :-1]
    return np.minimum(np.abs(area), 1).astype(np.float32)


def _add_segment(
    total: FloatArray, start: FloatArray, end: FloatArray, shape: tuple[int, int]
) -> None:
    """Add one side of a polygon to the accumulator of rows of ``columns + 1`` cells."""
    rows, columns = shape
    cuts = np.concatenate([[0.0, 1.0], *map(_crossings, start, end)])
    t = np.sort(cuts)[:, np.newaxis]
    points = start + t * (end - start)
    middle, height = (points[1:] + points[:-1]) / 2, np.diff(points[:, 0])
    row = np.floor(middle[:, 0]).astype(int)
    column = np.clip(np.floor(middle[:, 1]).astype(int), 0, columns)
    passed = np.clip(middle[:, 1] - column, 0, 1)  # pixels left of the image count as passed
    inside = (row >= 0) & (row < rows) & (column < columns)
    cell = (row * (columns + 1) + column)[inside]
    height, passed = height[inside], passed[inside]
    np.add.at(total, cell, height * (1 - passed))
    np.add.at(total, cell + 1, height * passed)


def _crossings(start: float, end: float) -> FloatArray:
    """Where on the way from `start` to `end`, as shares of it, a whole number is passed."""
    low, high = sorted((start, end))
    if high - low < 1e-12:  # a side along a grid line crosses none
        return np.empty(0)
    whole = np.arange(np.floor(low) + 1, np.ceil(high))
    return np.asarray((whole - start) / (end - start))


def _bounding_box(polygons: Sequence[FloatArray], shape: tuple[int, ...]) -> Slices | None:
    corners = np.concatenate(polygons)
    low = np.maximum(np.floor(corners.min(axis=0)), 0).astype(int)
    high = np.minimum(np.ceil(corners.max(axis=0)), shape[:2]).astype(int)
    if np.any(low >= high):
        return None
    return slice(low[0], high[0]), slice(low[1], high[1])
