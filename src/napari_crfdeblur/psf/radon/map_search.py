"""Steps of the picture and PSF in turns, from coarse to fine, with straight edges beside them."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

from ..._typing import FloatArray
from ...progress import Job, Progress
from ..blind.blurred import Blurred
from ..blind.edge_prediction import EdgePredictor
from ..blind.kernel_fit import KernelFit
from ..blind.pyramid import FIRST_GUESS, cleaned, level_sizes, recentered, resized
from ..blind.two_phases import DECAY, FIRST, LAST, NOISE, REFINEMENTS, SMOOTHNESS, SPARSITY, STEPS
from .edge_spreads import EdgeSpreads
from .edge_term import (
    JointFit,
    Placing,
    affordable,
    as_explained,
    as_measured,
    as_weighed,
    scaled_spreads,
)


def searching_with_edges(
    blurred: Blurred, size: int, spreads: Sequence[EdgeSpreads], weight: float
) -> Job[FloatArray]:
    """Long job: a PSF of `size` x `size` pixels.

    The search of :class:`~..blind.xu_jia.XuJia`, with the term of the edges in every fit of the
    PSF. From the second level on, edges that contradict the PSF count less than the others.
    """
    levels = level_sizes(size)
    count = len(levels) * STEPS + REFINEMENTS
    spreads, psf = affordable(spreads, size), FIRST_GUESS
    for done, (side, step) in enumerate(product(levels, range(STEPS))):
        yield Progress("PSF from picture and edges", done, count)
        if step == 0:
            psf = cleaned(resized(psf, (side, side)), NOISE[0])
            level = _Level.of(blurred, spreads, side, size)
        placing = as_weighed if done >= STEPS else as_measured  # at first the PSF is a guess
        fit = level.fit(psf, max(FIRST / DECAY**done, LAST), placing, weight)
        psf = recentered(cleaned(fit.solve(SMOOTHNESS), NOISE[0]))
    for done in range(count - REFINEMENTS, count):
        yield Progress("PSF from picture and edges", done, count)
        fit = level.fit(psf, LAST, as_explained, weight)
        psf = recentered(cleaned(fit.refine(psf, SPARSITY), NOISE[1]))
    yield Progress("PSF from picture and edges", count, count)
    return psf


@dataclass(frozen=True, slots=True, eq=False)
class _Level:
    """Picture and edges, made as small as a PSF of some pixels asks for."""

    blurred: Blurred
    predictor: EdgePredictor
    measured: FloatArray
    spreads: Sequence[EdgeSpreads]

    @classmethod
    def of(cls, blurred: Blurred, spreads: Sequence[EdgeSpreads], side: int, size: int) -> "_Level":
        """Of PSFs of `side` pixels where the photo has one of `size`."""
        small = blurred.scaled(side / size)
        predictor = EdgePredictor.of(small.plane, side)
        return cls(small, predictor, small.gradient(), scaled_spreads(spreads, side / size))

    def fit(self, psf: FloatArray, weakest: float, placing: Placing, weight: float) -> KernelFit:
        """What picture and edges say, of which each counts by what the PSF leaves of it.

        The edges' term is in units of their variance. That of the picture's gradients is what
        the PSF leaves of them, on the mean.
        """
        steps = self.blurred.kept(self.predictor.predict(psf, weakest))
        picture = KernelFit.of(steps, self.measured, len(psf))
        if not (self.spreads and weight):
            return picture
        variance = picture.residual(psf) * picture.energy / self.measured.size
        return JointFit.of_both(picture, placing(self.spreads, psf), weight * variance)
