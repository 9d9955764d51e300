"""Pixels between pixels: a picture interpolated on grids that are turned against it."""

from dataclasses import dataclass

import numpy as np

from .._typing import BoolArray, FloatArray, Image
from .picture import Picture

AT_ONCE = 16000  # points that are interpolated at once: all of their numbers fit into the caches


@dataclass(frozen=True, slots=True, eq=False)
class Grids:
    """Turned grids of points, all with as many, each in a frame of its own.

    Parameters
    ----------
    center : ndarray, shape (K, 2)
        Middle of each grid, (row, column) pixels.
    normal : ndarray, shape (K, 2)
        Unit vector of its second axis, (row, column); its first is ``(-column, row)``.
    along : ndarray, shape (K, T)
        Places on the first axis, pixels from the middle, ascending.
    across : ndarray, shape (D,)
        Places on the second axis, the same for all grids.
    """

    center: FloatArray
    normal: FloatArray
    along: FloatArray
    across: FloatArray

    def part(self, chosen: slice) -> "Grids":
        """Some of the grids."""
        return Grids(self.center[chosen], self.normal[chosen], self.along[chosen], self.across)

    def bounds(self, axis: int) -> tuple[FloatArray, FloatArray]:
        """Least and largest row (axis 0) or column (axis 1) of each grid, (K,) each."""
        t = self.tangent(axis)[:, None] * self.along[:, [0, -1]]
        d = self.normal[:, axis, None] * self.across[[0, -1]]
        middle = self.center[:, axis]
        return middle + t.min(axis=1) + d.min(axis=1), middle + t.max(axis=1) + d.max(axis=1)

    def places(self, axis: int, origin: Image) -> FloatArray:
        """Rows or columns of all points, from an origin near them, (K, T, D), float32."""
        t = (self.center[:, axis] - origin)[:, None] + self.tangent(axis)[:, None] * self.along
        d = self.normal[:, axis, None] * self.across
        return t.astype(np.float32)[:, :, None] + d.astype(np.float32)[:, None, :]

    def tangent(self, axis: int) -> FloatArray:
        """Row or column of the unit vectors along the first axis, shape (K,)."""
        return self.normal[:, 0] if axis else -self.normal[:, 1]


def interpolated(picture: Picture, grids: Grids) -> FloatArray:
    """Intensity in [0, 1] at the points of grids, bilinear, shape (C, K, T, D), float32.

    NaN outside the picture.
    """
    size = grids.along.shape[1] * len(grids.across)
    values = np.empty(
        (picture.channels, len(grids.center), grids.along.shape[1], len(grids.across)),
        dtype=np.float32,
    )
    number = max(1, AT_ONCE // size)
    for first in range(0, len(grids.center), number):
        chosen = slice(first, first + number)
        interpolate(picture, grids.part(chosen), values[:, chosen])
    values *= np.float32(picture.unit)
    return values


def interpolate(picture: Picture, grids: Grids, values: FloatArray) -> None:
    """Write the values of a picture, in its own units, at the points of grids (C, K, T, D)."""
    rows, columns, stride = picture.pixels.shape
    row, y, above = pixel_before(grids, 0, rows)
    column, x, beside = pixel_before(grids, 1, columns)
    index = row * columns + column
    index *= stride
    right, down = stride * (columns > 1), stride * columns * (rows > 1)
    flat = picture.pixels.reshape(-1)
    for channel, found in enumerate(values):
        before, after, below, beyond = (
            flat[channel + shift :].take(index).astype(np.float32, copy=False)
            for shift in (0, right, down, down + right)
        )
        mix(before, after, x)
        mix(below, beyond, x)
        mix(before, below, y)
        found[...] = before
    for outside in (above, beside):
        if outside is not None:
            values[:, outside] = np.nan


def pixel_before(grids: Grids, axis: int, size: int) -> tuple[Image, FloatArray, BoolArray | None]:
    """Rows (axis 0) or columns (axis 1) of the pixels before the points of grids.

    Also how far beyond them the points are, in [0, 1], and which points lie outside the
    picture; None if none does. All of shape (K, T, D).
    """
    low, high = grids.bounds(axis)
    origin = np.floor(low).astype(np.intp)[:, None, None]
    place = grids.places(axis, origin[:, 0, 0])
    before = place.astype(np.int32)
    outside: BoolArray | None = None
    if low.min() < 0 or high.max() >= size - 1:
        absolute = place + origin
        outside = (absolute < 0) | (absolute > size - 1)
        before = (np.clip(before + origin, 0, max(size - 2, 0)) - origin).astype(np.int32)
    place -= before.astype(np.float32)
    return before + origin, place, outside


def mix(first: FloatArray, second: FloatArray, share: FloatArray) -> None:
    """Turn the first values into those between them and the second, which are used up."""
    second -= first
    second *= share
    first += second
