"""A picture in cells of some pixels: what is known of it coarsely, and spread over it again."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import prod

import numpy as np
from numpy.typing import NDArray

from .._typing import FloatArray

BAND = 1 << 17  # pixels that are worked on at a time: few enough to stay in the cache


@dataclass(frozen=True, slots=True)
class Cells:
    """Cells of equal sides; what remains at the end of an axis goes to the last ones.

    Parameters
    ----------
    shape : tuple of int
        Of the picture, without colors.
    sides : tuple of int
        Of a cell, in pixels.
    """

    shape: tuple[int, ...]
    sides: tuple[int, ...]

    @property
    def counts(self) -> tuple[int, ...]:
        """Cells along each axis."""
        return tuple(max(n // own, 1) for n, own in zip(self.shape, self.sides, strict=True))

    def bands(self) -> Iterator[tuple[slice, slice, "Cells"]]:
        """The picture in bands: their pixels and their cells along the first axis."""
        count, side = self.counts[0], self.sides[0]
        step = max(1, BAND // (side * prod(self.shape[1:])))
        for first in range(0, count, step):
            last = min(first + step, count)
            rows = slice(first * side, self.shape[0] if last == count else last * side)
            own = (rows.stop - rows.start, *self.shape[1:])
            yield rows, slice(first, last), replace(self, shape=own)

    def reduced(self, values: FloatArray, how: np.ufunc = np.add) -> FloatArray:
        """Sums over the cells, or what else a function of two values makes of all of them."""
        for axis, starts in enumerate(self._starts()):
            values = how.reduceat(values, starts, axis=axis)
        return values

    def means(self, values: FloatArray) -> FloatArray:
        """Means over the cells."""
        means = self.reduced(values).astype(np.float64)
        for axis, lengths in enumerate(self._lengths()):
            means = means / lengths.reshape(self._along(axis))
        return means

    def energies(self, values: FloatArray) -> FloatArray:
        """Mean squares over the cells, of values that are overwritten."""
        values *= values
        return self.means(values)

    def held(self, values: FloatArray) -> FloatArray:
        """For each pixel the value of its cell."""
        for axis, lengths in enumerate(self._lengths()):
            values = np.repeat(values, lengths, axis=axis)
        return values

    def spread(self, values: FloatArray) -> FloatArray:
        """Values of cells linearly between their middles, and constant beyond the outer ones."""
        for axis in reversed(range(len(self.shape))):  # the first one last: rows are together
            length, side = self.shape[axis], self.sides[axis]
            place = (np.arange(length) + 0.5) / side - 0.5
            place = place.clip(0, values.shape[axis] - 1)
            first = np.minimum(place.astype(int), max(values.shape[axis] - 2, 0))
            second = np.minimum(first + 1, values.shape[axis] - 1)
            share = (place - first).reshape(self._along(axis)).astype(values.dtype)
            spread = values.take(first, axis)
            step = values.take(second, axis)
            step -= spread
            step *= share
            values = np.add(spread, step, out=spread)
        return values

    def _starts(self) -> list[NDArray[np.intp]]:
        return [
            np.arange(count) * side for count, side in zip(self.counts, self.sides, strict=True)
        ]

    def _lengths(self) -> list[NDArray[np.intp]]:
        return [
            np.diff([*starts, side])
            for starts, side in zip(self._starts(), self.shape, strict=True)
        ]

    def _along(self, axis: int) -> list[int]:
        return [-1 if each == axis else 1 for each in range(len(self.shape))]
