"""Steps of the picture and PSF in turns, from coarse to fine, with straight edges beside them."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from ..._typing import FloatArray
from ...progress import Job, Progress, nth
from ..blind.blurred import Blurred
from ..blind.edge_prediction import EdgePredictor
from ..blind.kernel_fit import KernelFit
from ..blind.pyramid import FIRST_GUESS, cleaned, level_sizes, recentered, resized
from ..blind.two_phases import FIRST_PHASE, NOISE, REFINEMENTS, SPARSITY
from .edge_spreads import EdgeSpreads
from .edge_term import (
    JointFit,
    Placing,
    affordable,
    as_explained,
    as_measured,
    as_weighed,
    edge_cost,
    scaled_spreads,
)


def searching_with_edges(
    blurred: Blurred, size: int, spreads: Sequence[EdgeSpreads], weight: float
) -> Job[FloatArray]:
    """Long job: a PSF of `size` x `size` pixels.

    The search of :class:`~..blind.xu_jia.XuJia`, with the term of the edges in every fit of the
    PSF; and once more with that term at the end only, since a few edges can lead the coarse
    levels astray, and so can the picture. The more probable of both PSFs is kept.
    """
    spreads, found = affordable(spreads, size), []
    whole = _Level.of(blurred, spreads, size, size, weight)
    ways = (weight, 0.0) if spreads and weight else (0.0,)
    for number, early in enumerate(ways):
        job = _searching(blurred, size, whole, early)
        found.append((yield from nth(job, number, len(ways), "PSF, way")))
    left = [whole.left(psf) for psf in found]
    variance = min(rest for rest, _ in left) / whole.measured.size
    costs = [rest / (2 * variance) + weight * edges for rest, edges in left]
    return found[int(np.argmin(costs))]


@dataclass(frozen=True, slots=True, eq=False)
class _Level:
    """Picture and edges, made as small as a PSF of some pixels asks for."""

    blurred: Blurred
    predictor: EdgePredictor
    measured: FloatArray
    spreads: Sequence[EdgeSpreads]
    weight: float

    @classmethod
    def of(
        cls,
        blurred: Blurred,
        spreads: Sequence[EdgeSpreads],
        side: int,
        size: int,
        weight: float,
    ) -> "_Level":
        """Of PSFs of `side` pixels where the photo has one of `size`."""
        small = blurred.scaled(side / size) if side < size else blurred
        predictor = EdgePredictor.of(small.plane, side)
        spreads = scaled_spreads(spreads, side / size)
        return cls(small, predictor, small.gradient(), spreads, weight)

    def fit(self, psf: FloatArray, weakest: float, placing: Placing) -> KernelFit:
        """What picture and edges say, of which each counts by what the PSF leaves of it.

        The edges' term is in units of their variance. That of the picture's gradients is what
        the PSF leaves of them, on the mean.
        """
        picture = self._picture(psf, weakest)
        if not (self.spreads and self.weight):
            return picture
        variance = picture.residual(psf) * picture.energy / self.measured.size
        return JointFit.of_both(picture, placing(self.spreads, psf), self.weight * variance)

    def left(self, psf: FloatArray) -> tuple[float, float]:
        """What a PSF leaves: of the picture's gradients, sum of squares; of the edges, cost."""
        picture = self._picture(psf, FIRST_PHASE.last)
        edges = edge_cost(self.spreads, psf) if self.spreads else 0.0
        return picture.residual(psf) * picture.energy, edges

    def _picture(self, psf: FloatArray, weakest: float) -> KernelFit:
        steps = self.blurred.kept(self.predictor.predict(psf, weakest))
        return KernelFit.of(steps, self.measured, len(psf))


def _searching(blurred: Blurred, size: int, whole: _Level, early: float) -> Job[FloatArray]:
    """One way to a PSF: edges count `early` in the first phase, as they should in the second."""
    levels = level_sizes(size)
    count = len(levels) * FIRST_PHASE.steps + REFINEMENTS
    psf = FIRST_GUESS
    for done, (side, step) in enumerate(product(levels, range(FIRST_PHASE.steps))):
        yield Progress("PSF from picture and edges", done, count)
        if step == 0:
            psf = cleaned(resized(psf, (side, side)), FIRST_PHASE.noise)
            level = _Level.of(blurred, whole.spreads, side, size, early)
        placing = (
            as_weighed if done >= FIRST_PHASE.steps else as_measured
        )  # at first the PSF is a guess
        fit = level.fit(psf, FIRST_PHASE.weight(done), placing)
        psf = recentered(cleaned(fit.solve(FIRST_PHASE.smoothness), FIRST_PHASE.noise))
    for done in range(count - REFINEMENTS, count):
        yield Progress("PSF from picture and edges", done, count)
        fit = whole.fit(psf, FIRST_PHASE.last, as_explained)
        psf = recentered(cleaned(fit.refine(psf, SPARSITY), NOISE))
    yield Progress("PSF from picture and edges", count, count)
    return psf
