"""Blind estimation of a PSF from the strong edges of a blurred picture, coarse to fine."""

from dataclasses import dataclass
from itertools import product
from typing import TypeAlias

import numpy as np

from ..._typing import FloatArray
from ...errors import CrfDeblurError
from ...progress import Job, Progress
from ..base import PsfEstimate, PsfEstimator, centered
from .confidence import diagnose, judge
from .edge_prediction import EdgePredictor, gradient
from .kernel_fit import KernelFit
from .pyramid import FIRST_GUESS, cleaned, contrast, level_sizes, recentered, resized, scaled
from .region import informative_region

STEPS = 5  # alternations on each level
REFINEMENTS = 3  # alternations of the second phase
FIRST, DECAY, LAST = 0.014, 1.07, 9e-4  # weight of a step's existence, and how it is relaxed
SMOOTHNESS = 3.5  # g of the first phase, for contrast 1
SPARSITY = 1.8  # g of the second phase
NOISE = 0.03, 0.02  # of the PSF's peak, below which it is cleared, in either phase
Figures: TypeAlias = dict[str, float]


@dataclass(frozen=True, slots=True)
class XuJia(PsfEstimator):
    """Two phases: edges and PSF in turns from coarse to fine, then a sparse refinement.

    Xu & Jia (2010, Two-phase kernel estimation for robust motion deblurring, ECCV). Phase
    one alternates between the gradient `s` of the sharp picture, where it is strong, and ::

        k = argmin |k * s - D y|^2 + g |k|^2

    while weaker and weaker edges are let in; phase two lets pixels outside the support of the
    PSF pay for ``|k|`` instead. The edges come from :class:`~.edge_prediction.EdgePredictor`
    in place of the paper's shock filter and its selection by usefulness: it takes the PSF so
    far into account, and halves the median error ratio on the photos of Levin et al. (2009).

    Where the sharp picture lies cannot be known: the PSF is shifted so that its center of
    mass falls on the center pixel, to half a pixel, and padded with zeros for that if need be.
    The status follows from whether parts of the picture agree on the PSF
    (:func:`~.confidence.diagnose`).

    Parameters
    ----------
    size : int
        Largest extent of the PSF in pixels, odd, at least 3; too small cuts the PSF, up to
        twice too large does little harm.
    region : int
        Longest side in pixels of the part of the picture that is used, or three PSF sizes if
        that is more; of larger pictures the most informative square is taken
        (:func:`~.region.informative_region`).
    """

    size: int = 31
    region: int = 512

    def __post_init__(self) -> None:
        if self.size < 3 or self.size % 2 == 0:
            raise ValueError(f"expected an odd PSF size of at least 3, got {self.size}")
        if self.region < 1:
            raise ValueError(f"expected a region of at least 1 pixel, got {self.region}")

    def run(self, linear: FloatArray) -> Job[PsfEstimate]:
        """Long job: estimate the PSF of a linear image of shape (M, N) in [0, 1]."""
        if min(linear.shape) < 3 * self.size:
            raise CrfDeblurError(
                f"the image, {linear.shape[1]} x {linear.shape[0]} pixels, is too small to "
                f"find a PSF of {self.size} pixels in it: three times the PSF is needed; "
                "choose a smaller PSF size or a larger image"
            )
        yield Progress("blind PSF", 0, self._steps)
        plane = np.asarray(
            informative_region(linear, max(self.region, 3 * self.size), self.size), np.float32
        )
        plane = plane / np.float32(contrast(plane))
        psf = yield from self._initialized(plane)
        psf, figures = yield from self._refined(plane, psf)
        return PsfEstimate(centered(psf), judge(figures), figures)

    def _initialized(self, plane: FloatArray) -> Job[FloatArray]:
        """Phase one: a PSF of `size` x `size` pixels, coarse to fine."""
        steps = product(level_sizes(self.size), range(STEPS))
        psf = FIRST_GUESS
        for done, (size, step) in enumerate(steps):
            yield Progress("blind PSF", done, self._steps)
            if step == 0:
                psf = cleaned(resized(psf, (size, size)), NOISE[0])
                small = scaled(plane, size / self.size)
                predictor, measured = EdgePredictor.of(small, size), gradient(small)
            edges = predictor.predict(psf, max(FIRST / DECAY**done, LAST))
            psf = KernelFit.of(edges, measured, size).solve(SMOOTHNESS)
            psf = recentered(cleaned(psf, NOISE[0]))
        return psf

    def _refined(self, plane: FloatArray, psf: FloatArray) -> Job[tuple[FloatArray, Figures]]:
        """Phase two: a sparse PSF, and the figures that tell how far to trust it."""
        predictor, measured = EdgePredictor.of(plane, self.size), gradient(plane)
        for done in range(self._steps - REFINEMENTS, self._steps):
            yield Progress("blind PSF", done, self._steps)
            edges = predictor.predict(psf, LAST)
            fit = KernelFit.of(edges, measured, self.size)
            psf = recentered(cleaned(fit.refine(psf, SPARSITY), NOISE[1]))
        yield Progress("blind PSF", self._steps, self._steps)
        return psf, diagnose(predictor.predict(psf, LAST), measured, psf, SMOOTHNESS)

    @property
    def _steps(self) -> int:
        return len(level_sizes(self.size)) * STEPS + REFINEMENTS
