"""Whether a photo has steeper edges than its PSF permits, so that this cannot have blurred it."""

import numpy as np

from .. import arrays
from .._typing import FloatArray

# An edge between no light and the brightest that was recorded rises by the heaviest row or column
# of the PSF at most, from one pixel to the next; lamps are brighter than what was recorded, and
# beside them it is steeper. So much steeper an edge is taken for impossible,
BEYOND = 1.5
# and in so many of all pixels. Of twelve real photos eleven have at most .3 %, one with a PSF that
# is far too large 6 %; a screenshot 12 %.
MOST_STEEP = 0.03
# Median light, over the brightest: what is darker can be points on dark ground, stars or beads, far
# brighter than what is recorded of them, and then no step is too steep.
BRIGHT = 0.25
PLANE = 2  # axes


def contradicts(linear: FloatArray, psf: FloatArray) -> bool:
    """Whether a photo cannot have been blurred by a PSF.

    Nothing is said of volumes and of dark pictures.

    Parameters
    ----------
    linear : ndarray, shape (M, N) or (M, N, C); with one axis more for volumes
        In linear light.
    psf : ndarray, shape (H, W) or (D, H, W)
        Made by :func:`~napari_crfdeblur.psf.as_psf`.
    """
    if psf.ndim != PLANE:
        return False
    axes = tuple(range(PLANE))
    for channel in np.ndindex(tuple(linear.shape[psf.ndim :])):
        plane = np.asarray(arrays.to_numpy(linear[(..., *channel)]))
        white = float(plane.max()) - min(float(plane.min()), 0.0)
        if float(np.median(plane)) < BRIGHT * white:
            continue
        for axis in axes:
            across = tuple(other for other in axes if other != axis)
            most = BEYOND * white * float(psf.sum(axis=across).max())
            if most < white and np.mean(np.abs(np.diff(plane, axis=axis)) > most) > MOST_STEEP:
                return True
    return False
