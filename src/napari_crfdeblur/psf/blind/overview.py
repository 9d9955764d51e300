"""The part of a large photo that says most about its blur."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ..._typing import BoolArray, FloatArray
from ...fourier import Shape
from .edge_prediction import gradient

SATURATED = 0.99  # of full scale: clipped light is not a convolution any more
FINEST = 1024  # pixels of the shorter side that are looked at, at most


@dataclass(frozen=True, slots=True, eq=False)
class Overview:
    """A large photo made small, in which its most useful regions are looked for.

    Parameters
    ----------
    shape : (M, N)
        Of the photo, pixels.
    every : int
        Pixels of the photo to a side of a pixel here.
    coarse : ndarray, shape (M // every, N // every)
        Means of the photo.
    clipped : ndarray of bool, the shape of `coarse`
        Where any pixel is saturated.
    """

    shape: Shape
    every: int
    coarse: FloatArray
    clipped: BoolArray

    @classmethod
    def of(cls, linear: FloatArray, clipped: BoolArray | None = None) -> "Overview":
        """Make a photo small, by means of its squares.

        Parameters
        ----------
        linear : ndarray, shape (M, N)
            Relative irradiance.
        clipped : ndarray of bool, shape (M, N), optional
            Pixels that the camera saturated; by default those near full scale.
        """
        shape = linear.shape[0], linear.shape[1]
        every = -(-min(shape) // FINEST)
        coarse = _squares(linear, every).mean(axis=(1, 3))
        if clipped is None:
            return cls(shape, every, coarse, np.asarray(coarse >= SATURATED))
        lost = np.any(_squares(clipped, every), axis=(1, 3))
        return cls(shape, every, coarse, np.asarray(lost, dtype=bool))

    def informative_region(self, side: int, size: int) -> tuple[slice, slice]:
        """Square of at most `side` pixels whose edges are most useful to find a PSF.

        Every gradient counts by its magnitude times its :func:`usefulness`, and not at all next to
        saturated pixels; the square with the greatest sum is taken.

        Parameters
        ----------
        side : int
            Longest side of the region in pixels; a photo that is smaller is taken whole.
        size : int
            Extent of the PSF in pixels.

        Returns
        -------
        tuple of slice
            Rows and columns, of ``min(M, side)`` and ``min(N, side)`` pixels.
        """
        shape = min(self.shape[0], side), min(self.shape[1], side)
        if shape == self.shape:
            return slice(0, shape[0]), slice(0, shape[1])
        differences = gradient(self.coarse)
        reach = max(size // self.every, 1)
        worth = usefulness(differences, reach) * np.hypot(*differences)
        worth[ndimage.maximum_filter(self.clipped, reach | 1)] = 0
        top, left = _richest(worth, (shape[0] // self.every, shape[1] // self.every))
        return (
            _slice(top * self.every, shape[0], self.shape[0]),
            _slice(left * self.every, shape[1], self.shape[1]),
        )


def usefulness(differences: FloatArray, size: int) -> FloatArray:
    """How far the gradients around a pixel agree: `r` of Xu & Jia (2010), Sec. 3.1.

    ``|sum grad B| / (sum |grad B| + 0.5)`` over windows as large as the PSF: near 1 at a step
    that is longer than the PSF, near 0 in texture and at lines thinner than it, which the
    blur moves and so mislead.

    Parameters
    ----------
    differences : ndarray, shape (2, M, N)
        Gradient of the blurred picture, of contrast about 1.
    size : int
        Extent of the PSF in pixels.
    """
    window = size * size
    down, across = (ndimage.uniform_filter(d, size) * window for d in differences)
    total = ndimage.uniform_filter(np.hypot(*differences), size) * window
    return np.asarray(np.hypot(down, across) / (total + 0.5))


def _squares(plane: FloatArray | BoolArray, every: int) -> NDArray[Any]:
    """A plane as squares of `every` pixels, shape (M, every, N, every)."""
    rows, columns = (side // every for side in plane.shape)
    whole = plane[: rows * every, : columns * every]
    return whole.reshape(rows, every, columns, every)


def _richest(worth: FloatArray, shape: Shape) -> Shape:
    """First row and column of the rectangle of this shape with the greatest sum."""
    sums = np.pad(worth.astype(np.float64), [(1, 0), (1, 0)]).cumsum(axis=0).cumsum(axis=1)
    rows, columns = (max(side, 1) for side in shape)
    inside = sums[rows:, columns:] - sums[:-rows, columns:]
    inside -= sums[rows:, :-columns] - sums[:-rows, :-columns]
    top, left = np.unravel_index(int(np.argmax(inside)), inside.shape)
    return int(top), int(left)


def _slice(start: int, length: int, available: int) -> slice:
    start = min(start, available - length)
    return slice(start, start + length)
