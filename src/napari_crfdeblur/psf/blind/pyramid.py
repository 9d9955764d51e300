"""Coarse to fine: pictures and PSFs at the scales of a blind estimate, and what cleans them."""

import numpy as np
from scipy import ndimage

from ..._typing import FloatArray
from ...errors import CrfDeblurError
from ...fourier import Shape

SMALLEST = 5  # pixels of the PSF on the coarsest level
RATIO = 0.5**0.5  # between levels
ISLAND = 0.1  # of the PSF's mass: what a part that stands alone must hold to be kept
LEAST_CONTRAST = 0.01  # of full scale: less is noise and rounding
FIRST_GUESS = np.pad(np.full((1, 3), 1 / 3), [(2, 2), (1, 1)])  # some blur, of little weight
NO_STRUCTURE = (
    "the image shows too little structure to find its blur; choose a region with sharp-sided "
    "objects, or give the PSF"
)


def level_sizes(size: int) -> list[int]:
    """PSF sizes of the levels, from coarse to fine, all odd."""
    sizes = [size]
    while sizes[-1] > SMALLEST:
        smaller = int(np.ceil(sizes[-1] * RATIO)) // 2 * 2 + 1
        sizes.append(min(smaller, sizes[-1] - 2))
    return sizes[::-1]


def cleaned(psf: FloatArray, least: float) -> FloatArray:
    """Clear values below `least` of the peak, and small islands; scale to sum 1."""
    if not psf.max() > 0:
        raise CrfDeblurError(NO_STRUCTURE)
    psf = np.where(psf < least * psf.max(), 0, psf)
    islands, count = ndimage.label(psf, np.ones((3, 3)))
    mass = ndimage.sum_labels(psf, islands, np.arange(count + 1))
    psf = psf * (mass >= min(ISLAND * psf.sum(), mass.max()))[islands]
    return np.asarray(psf / psf.sum())


def recentered(psf: FloatArray) -> FloatArray:
    """Shift a PSF by whole pixels within its array so that its centroid is at the center."""
    centroid = np.array(ndimage.center_of_mass(psf))
    moved = ndimage.shift(psf, np.array(psf.shape) // 2 - np.rint(centroid), order=0)
    return np.asarray(moved / moved.sum())


def step_contrast(plane: FloatArray) -> float:
    """Range between the darkest and the brightest half percent: the scale of its steps.

    White noise loses four fifths of it in means of 5 x 5 pixels, a blurred picture very
    little; where more than half is lost, there is nothing but noise.
    """
    total, smooth = (_range(p) for p in (plane, ndimage.uniform_filter(plane, 5)))
    if min(total, smooth) < max(LEAST_CONTRAST, total / 2):
        raise CrfDeblurError(NO_STRUCTURE)
    return total


def _range(plane: FloatArray) -> float:
    dark, bright = np.quantile(plane, [0.005, 0.995])
    return float(bright - dark)


def resized(plane: FloatArray, shape: Shape) -> FloatArray:
    """Resample linearly, without aliasing: the sides of pixels, not their centers, match."""
    factors = np.divide(shape, plane.shape)
    smooth = ndimage.gaussian_filter(plane, np.maximum(1 / factors - 1, 0) / 2)
    return np.asarray(ndimage.zoom(smooth, factors, order=1, grid_mode=True, mode="nearest"))


def scaled(plane: FloatArray, scale: float) -> FloatArray:
    """Resample a plane to `scale` times its sides."""
    return resized(plane, (round(plane.shape[0] * scale), round(plane.shape[1] * scale)))
