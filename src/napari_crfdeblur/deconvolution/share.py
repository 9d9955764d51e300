"""The share of a scene pixel's light that the camera recorded: all, but near the frame."""

import numpy as np
from numpy.typing import NDArray

from .. import arrays
from .._typing import FloatArray
from ..boundary import frame, periodic_shape
from ..fourier import ComplexArray, correlating
from ..progress import Job, Progress

LEAST_SEEN = 1e-3  # share of a scene pixel's light that must reach the frame


def share_inside(psf: FloatArray, plane: FloatArray) -> FloatArray:
    """One over the share of each scene pixel's light that falls into the frame, or 0.

    Pixels with the same taps of the PSF inside the frame have the same share: few differ.
    """
    seen, taps = np.asarray(psf, np.float64), []
    period = periodic_shape(plane.shape, psf.shape)
    for axis, sides in enumerate(zip(plane.shape, psf.shape, period, strict=True)):
        ends, own = np.unique(_taps_inside(*sides), axis=1, return_inverse=True)
        sums = np.insert(np.cumsum(seen, axis), 0, 0, axis)
        seen = np.take(sums, ends[1], axis) - np.take(sums, ends[0], axis)
        taps.append(own.reshape(-1))
    share = _one_over(seen).astype(arrays.dtype_name(plane))
    whole: FloatArray = arrays.like(share[np.ix_(*taps)], plane)
    return whole


def _taps_inside(known: int, side: int, period: int) -> NDArray[np.intp]:
    """First and last + 1 tap that takes light of a scene pixel into the frame, (2, period)."""
    pixel, middle = np.arange(period), side // 2
    first = np.where(pixel < known + middle, middle - pixel, period + middle - pixel)
    last = np.where(pixel < known + middle, known + middle - pixel, side)
    return np.stack([first, last]).clip(0, side)


def _one_over(seen: FloatArray) -> FloatArray:
    """One over the share of light that is seen; 0 for pixels that are hardly seen."""
    xp = arrays.namespace(seen)
    part: FloatArray = xp.where(seen < LEAST_SEEN, 0.0, 1 / arrays.raised(seen, LEAST_SEEN))
    return part


def share_of(
    mask: FloatArray, transfer: ComplexArray, shape: tuple[int, ...], at: Progress
) -> Job[FloatArray]:
    """Job: :func:`share_inside` of that `shape`, of a frame whose pixels count by a mask."""
    recorded = arrays.zeros(shape, mask)
    recorded[frame(mask.shape)] = mask
    seen = yield from correlating(recorded, transfer, at)
    for block in arrays.blocks(seen):
        seen[block, ...] = _one_over(seen[block, ...])
    return seen
