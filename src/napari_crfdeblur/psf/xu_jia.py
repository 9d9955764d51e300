"""Blind estimation of a PSF from the strong edges of a blurred picture, coarse to fine."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from skimage.transform import resize

from .._typing import FloatArray
from ..errors import CrfDeblurError
from ..progress import Job, Progress
from .base import PsfEstimate, PsfEstimator, PsfStatus, centered
from .edge_prediction import EdgePredictor, gradient
from .kernel_fit import KernelFit
from .region import informative_region

SMALLEST = 5  # pixels of the PSF on the coarsest level
RATIO = 0.5**0.5  # between levels
STEPS = 5  # alternations on each level
REFINEMENTS = 3  # alternations of the second phase
FIRST, DECAY, LAST = 0.014, 1.07, 9e-4  # weight of a step's existence, and how it is relaxed
SMOOTHNESS = 3.5  # g of the first phase, for contrast 1
SPARSITY = 1.8  # g of the second phase
NOISE = 0.03, 0.02  # of the PSF's peak, below which it is cleared, in either phase
ISLAND = 0.1  # of the PSF's mass: what a part that stands alone must hold to be kept
LEAST_CONTRAST = 0.01  # of full scale: less is noise and rounding


@dataclass(frozen=True, slots=True)
class XuJia(PsfEstimator):
    """Two phases: edges and PSF in turns from coarse to fine, then a sparse refinement.

    Xu & Jia (2010, Two-phase kernel estimation for robust motion deblurring, ECCV). Phase
    one alternates between the gradient `s` of the sharp picture, where it is strong, and ::

        k = argmin |k * s - D y|^2 + g |k|^2

    while weaker and weaker edges are let in; phase two lets pixels outside the support of the
    PSF pay for ``|k|`` instead. The edges come from :class:`~.edge_prediction.EdgePredictor`
    in place of the paper's shock filter: it takes the PSF so far into account, and halves the
    error on the pictures of Levin et al. (2009).

    Parameters
    ----------
    size : int
        Largest extent of the PSF in pixels, odd, at least 3; too small cuts the PSF, up to
        twice too large does little harm.
    region : int
        Longest side in pixels of the part of the picture that is used; of larger ones the
        most informative square is taken (:func:`~.region.informative_region`).
    """

    size: int = 31
    region: int = 512

    def __post_init__(self) -> None:
        if self.size < 3 or self.size % 2 == 0:
            raise ValueError(f"expected an odd PSF size of at least 3, got {self.size}")
        if self.region < 3 * self.size:
            raise ValueError(
                f"expected a region of at least three PSF sizes, {3 * self.size}, got {self.region}"
            )

    def run(self, linear: FloatArray) -> Job[PsfEstimate]:
        """Long job: estimate the PSF of a linear image of shape (M, N) in [0, 1]."""
        if min(linear.shape) < 3 * self.size:
            raise CrfDeblurError(
                f"the image, {linear.shape[1]} x {linear.shape[0]} pixels, is too small to "
                f"find a PSF of {self.size} pixels in it: three times the PSF is needed; "
                "choose a smaller PSF size or a larger image"
            )
        plane = informative_region(linear, self.region, self.size)
        plane = np.ascontiguousarray(plane, dtype=np.float32) / np.float32(_contrast(plane))
        sizes = list(level_sizes(self.size))
        total = len(sizes) * STEPS + REFINEMENTS
        psf = np.pad(np.full((1, 3), 1 / 3), [(2, 2), (1, 1)])  # no more than a guess
        for level, size in enumerate(sizes):
            psf = cleaned(_resized(psf, size), NOISE[0])
            small = _scaled(plane, size / self.size)
            predictor, measured = EdgePredictor.of(small, size), gradient(small)
            for step in range(level * STEPS, level * STEPS + STEPS):
                yield Progress("blind PSF", step, total)
                edges = predictor.predict(psf, max(FIRST / DECAY**step, LAST))
                psf = KernelFit.of(edges, measured, size).solve(SMOOTHNESS)
                psf = recentered(cleaned(psf, NOISE[0]))
        for step in range(total - REFINEMENTS, total):
            yield Progress("blind PSF", step, total)
            edges = predictor.predict(psf, LAST)
            fit = KernelFit.of(edges, measured, self.size)
            psf = recentered(cleaned(fit.refine(psf, SPARSITY), NOISE[1]))
        return PsfEstimate(centered(psf), PsfStatus.GOOD)


def level_sizes(size: int) -> Iterator[int]:
    """PSF sizes of the levels, from coarse to fine, all odd."""
    sizes = [size]
    while sizes[-1] > SMALLEST:
        smaller = int(np.ceil(sizes[-1] * RATIO)) // 2 * 2 + 1
        sizes.append(min(smaller, sizes[-1] - 2))
    return reversed(sizes)


def cleaned(psf: FloatArray, least: float) -> FloatArray:
    """Clear values below `least` of the peak, and small islands; scale to sum 1."""
    psf = np.where(psf < least * psf.max(), 0, psf)
    islands, count = ndimage.label(psf, np.ones((3, 3)))
    mass = ndimage.sum_labels(psf, islands, np.arange(count + 1))
    kept = mass >= ISLAND * psf.sum()
    psf = psf * kept[islands]
    return np.asarray(psf / psf.sum())


def recentered(psf: FloatArray) -> FloatArray:
    """Shift a PSF by whole pixels within its array so that its centroid is at the centre."""
    shift = [side // 2 - round(at) for side, at in zip(psf.shape, _centroid(psf), strict=True)]
    moved = ndimage.shift(psf, shift, order=0)
    return np.asarray(moved / moved.sum())


def _centroid(psf: FloatArray) -> tuple[float, ...]:
    return tuple(ndimage.center_of_mass(psf))


def _contrast(plane: FloatArray) -> float:
    """Range between the darkest and the brightest half percent, at a typical 3/4 of it."""
    dark, bright = np.quantile(plane, [0.005, 0.995])
    if bright - dark < LEAST_CONTRAST:
        raise CrfDeblurError(
            "the image is almost uniform and shows no blur; choose a region with edges, or "
            "give the PSF"
        )
    return float(bright - dark)


def _resized(psf: FloatArray, size: int) -> FloatArray:
    return np.asarray(resize(psf, (size, size), order=1, anti_aliasing=False))


def _scaled(plane: FloatArray, scale: float) -> FloatArray:
    if scale == 1:
        return plane
    shape = tuple(round(side * scale) for side in plane.shape)
    return np.asarray(resize(plane, shape, order=1, anti_aliasing=True), dtype=np.float32)
