"""Where a PSF lies in its array.

By its extent: unlike the center of mass, the middle leaves room for the faint end of a long PSF.
"""

import numpy as np
from scipy import ndimage

from ...._typing import FloatArray
from ..pyramid import cleaned

BODY = 0.05  # of the peak: what must lie in the middle of the array


def off_middle(psf: FloatArray) -> tuple[int, int]:
    """Rows and columns from the center pixel to the middle of the extent."""
    body = np.argwhere(cleaned(psf, BODY))
    middle = np.rint((body.min(axis=0) + body.max(axis=0)) / 2).astype(int)
    rows, columns = (middle - len(psf) // 2).tolist()
    return rows, columns


def shifted(psf: FloatArray, rows: int, columns: int) -> FloatArray:
    """Move a PSF by whole pixels within its array; sum 1."""
    moved = ndimage.shift(psf, (rows, columns), order=0)
    return np.asarray(moved / moved.sum())


def roomy(psf: FloatArray, side: int) -> FloatArray:
    """Pad a square PSF with zeros on all sides alike, to a larger square of odd side."""
    return np.pad(psf, (side - len(psf)) // 2)


def trimmed(psf: FloatArray, size: int) -> FloatArray:
    """Cut zeros off all sides of a square array alike, as far as it stays at least `size`."""
    middle = len(psf) // 2
    reach = int(np.abs(np.argwhere(psf) - middle).max())
    half = max(min(size // 2, middle), reach)
    inside = slice(middle - half, middle + half + 1)
    return np.ascontiguousarray(psf[inside, inside])
