"""Edges and PSF in turns, from coarse to fine, and a sparse PSF at the end: Xu & Jia (2010)."""

from ..._typing import FloatArray
from ...progress import Job, Progress
from .blurred import Blurred
from .edge_prediction import EdgePredictor
from .kernel_fit import KernelFit
from .pyramid import cleaned, level_sizes, recentered
from .turns import Schedule, coarse_to_fine

REFINEMENTS = 3  # alternations of the second phase
FIRST_PHASE = Schedule(first=0.014, decay=1.07, last=9e-4, smoothness=3.5, noise=0.03)
SPARSITY = 1.8  # g of the second phase
NOISE = 0.02  # of the PSF's peak, below which it is cleared in the second phase


def searching(blurred: Blurred, size: int) -> Job[FloatArray]:
    """Long job: a PSF of `size` x `size` pixels."""
    at = Progress("blind PSF", 0, len(level_sizes(size)) * FIRST_PHASE.steps + REFINEMENTS)
    psf = yield from coarse_to_fine(blurred, size, FIRST_PHASE, at)
    return (yield from _refined(blurred, psf, at.total))


def _refined(blurred: Blurred, psf: FloatArray, total: int) -> Job[FloatArray]:
    """Phase two: a sparse PSF."""
    size = len(psf)
    predictor, measured = EdgePredictor.of(blurred.plane, size), blurred.gradient()
    for done in range(total - REFINEMENTS, total):
        yield Progress("blind PSF", done, total)
        edges = blurred.kept(predictor.predict(psf, FIRST_PHASE.last))
        fit = KernelFit.of(edges, measured, size)
        psf = recentered(cleaned(fit.refine(psf, SPARSITY), NOISE))
    yield Progress("blind PSF", total, total)
    return psf
