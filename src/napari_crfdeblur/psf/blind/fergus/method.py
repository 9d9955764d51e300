"""Blind estimation of a PSF from all pictures that explain the blurred one, coarse to fine."""

from dataclasses import dataclass, replace
from typing import TypeAlias

from ...._typing import FloatArray
from ....progress import Job, Progress
from ..blurred import Blurred
from ..estimation import SingleSearch
from ..pyramid import FIRST_GUESS, cleaned, level_sizes, recentered, resized
from .ensemble import Ensemble, MeasuredGradient
from .priors import ExponentialMixture, GaussianMixture

GIVEN = 8  # updates of each level with the PSF of the one before
STEPS = 40  # updates of all factors that follow
WARM = 10.0  # times the noise of the level before, with which a level begins
COOLING = 0.85  # of the variance of the noise, which an update leaves at least
FIRST_NOISE = 0.3  # share of the gradient's energy that may be noise at first
BARS = FIRST_GUESS, FIRST_GUESS.T  # the paper's starts: a short horizontal or vertical blur
CONTESTED = 2  # levels on which both are followed
NOISE = 1 / 15  # of the PSF's peak, below which it is cleared: Sec. 4.2
GRADIENTS = GaussianMixture()
Start: TypeAlias = tuple[FloatArray, float | None]
"""A PSF to start with, and the variance of the noise, if it is known by then."""


@dataclass(frozen=True, slots=True)
class Fergus(SingleSearch):
    """Ensemble learning: the PSF that is likely for all sharp pictures together.

    Fergus, Singh, Hertzmann, Roweis & Freeman (2006, Removing camera shake from a single
    photograph, SIGGRAPH), Sec. 4. The most probable pair of picture and PSF is the blurred picture
    and no blur; so the posterior of both is approached instead, by a product over pixels of
    Gaussians and rectified Gaussians (:class:`~.ensemble.Ensemble`), and the mean PSF taken. From
    coarse to fine; on the coarsest levels both of the paper's starts are followed, and the one of
    lower free energy is kept, where the paper asks the user.

    Against the paper, the PSF's prior has two exponentials in place of four, and the gradients'
    four Gaussians are the same at all scales (:mod:`~.priors`); and each level begins with more
    noise than is expected, which falls slowly, so that large gradients are explained before small
    ones. Without that, the search ends in local minima of higher free energy. The updates are
    minima for one factor each or steps towards it, so that within a level the free energy never
    rises.

    Parameters
    ----------
    size : int, optional
        Largest extent of the PSF in pixels, odd, at least 3; found by itself if not given.
    region : int
        Longest side in pixels of the part of the picture that is used, or three PSF sizes if
        that is more (:class:`~..overview.Overview`).
    """

    def searching(self, blurred: Blurred, size: int) -> Job[FloatArray]:
        """Long job: a PSF of `size` x `size` pixels."""
        return searching(blurred, size)


def searching(blurred: Blurred, size: int) -> Job[FloatArray]:
    """Long job: a PSF of `size` x `size` pixels."""
    sizes = level_sizes(size)
    starts: list[Start] = [(bar, None) for bar in BARS]
    runs = [len(BARS) if number < CONTESTED else 1 for number in range(len(sizes))]
    at = Progress("blind PSF", 0, sum(runs) * (GIVEN + STEPS))
    for level, wanted in zip(sizes, [*runs[1:], 1], strict=True):
        small = blurred if level == size else blurred.scaled(level / size)
        measured, prior = MeasuredGradient.of(small, level), ExponentialMixture.for_size(level)
        ends: list[Ensemble] = []
        for start in starts:
            ends.append((yield from learning(first(measured, start, level), measured, prior, at)))
            at = replace(at, done=at.done + GIVEN + STEPS)
        ends.sort(key=lambda end: end.free_energy(measured, GRADIENTS, prior))
        starts = [(end.kernel.mean, end.noise) for end in ends[:wanted]]
    yield at
    return recentered(cleaned(starts[0][0], NOISE))


def first(measured: MeasuredGradient, start: Start, level: int) -> Ensemble:
    """The ensemble of a level before its first update."""
    psf, noise = start
    shown = recentered(cleaned(resized(psf, (level, level)), 0))
    return Ensemble.start(measured, shown, WARM * noise if noise else FIRST_NOISE * measured.energy)


def learning(
    ensemble: Ensemble, measured: MeasuredGradient, prior: ExponentialMixture, at: Progress
) -> Job[Ensemble]:
    """Long job: the sharp gradient alone, then all factors in turns; progress goes on from `at`."""
    for step in range(GIVEN + STEPS):
        yield replace(at, done=at.done + step)
        if step >= GIVEN:
            ensemble = ensemble.fitted(prior)
        ensemble = ensemble.sharpened(measured, GRADIENTS)
        if step >= GIVEN:
            ensemble = ensemble.with_noise(measured, COOLING)
    return ensemble
