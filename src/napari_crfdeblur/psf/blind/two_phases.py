"""Edges and PSF in turns, from coarse to fine, and a sparse PSF at the end: Xu & Jia (2010)."""

from itertools import product

from ..._typing import FloatArray
from ...progress import Job, Progress
from .blurred import Blurred
from .edge_prediction import EdgePredictor
from .kernel_fit import KernelFit
from .pyramid import FIRST_GUESS, cleaned, level_sizes, recentered, resized

STEPS = 5  # alternations on each level
REFINEMENTS = 3  # alternations of the second phase
FIRST, DECAY, LAST = 0.014, 1.07, 9e-4  # weight of a step's existence, and how it is relaxed
SMOOTHNESS = 3.5  # g of the first phase, for contrast 1
SPARSITY = 1.8  # g of the second phase
NOISE = 0.03, 0.02  # of the PSF's peak, below which it is cleared, in either phase


def searching(blurred: Blurred, size: int) -> Job[FloatArray]:
    """Long job: a PSF of `size` x `size` pixels."""
    psf = yield from _initialized(blurred, size)
    return (yield from _refined(blurred, psf))


def _initialized(blurred: Blurred, size: int) -> Job[FloatArray]:
    """Phase one: a PSF of `size` x `size` pixels, coarse to fine."""
    steps = product(level_sizes(size), range(STEPS))
    psf = FIRST_GUESS
    for done, (level, step) in enumerate(steps):
        yield Progress("blind PSF", done, _count(size))
        if step == 0:
            psf = cleaned(resized(psf, (level, level)), NOISE[0])
            small = blurred.scaled(level / size)
            predictor, measured = EdgePredictor.of(small.plane, level), small.gradient()
        edges = small.kept(predictor.predict(psf, max(FIRST / DECAY**done, LAST)))
        psf = KernelFit.of(edges, measured, level).solve(SMOOTHNESS)
        psf = recentered(cleaned(psf, NOISE[0]))
    return psf


def _refined(blurred: Blurred, psf: FloatArray) -> Job[FloatArray]:
    """Phase two: a sparse PSF."""
    size = len(psf)
    predictor, measured = EdgePredictor.of(blurred.plane, size), blurred.gradient()
    for done in range(_count(size) - REFINEMENTS, _count(size)):
        yield Progress("blind PSF", done, _count(size))
        edges = blurred.kept(predictor.predict(psf, LAST))
        fit = KernelFit.of(edges, measured, size)
        psf = recentered(cleaned(fit.refine(psf, SPARSITY), NOISE[1]))
    yield Progress("blind PSF", _count(size), _count(size))
    return psf


def _count(size: int) -> int:
    """Alternations of both phases."""
    return len(level_sizes(size)) * STEPS + REFINEMENTS
