"""Blind estimation of a PSF from the distribution of sharp gradients, coarse to fine."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...._typing import FloatArray
from ....progress import Job, Progress, reporting
from ...base import cleared
from ..blurred import Blurred
from ..estimation import SingleSearch
from ..gradient_noise import noise_of_gradients
from ..pyramid import FIRST_GUESS, cleaned, level_sizes, resized
from ..two_phases import searching as searching_edges
from .extent import off_middle, roomy, shifted, trimmed
from .gradients import BlurredGradient, GradientPosterior

ROOM = 1.4  # side of the array in which the PSF is found, in sizes: a faint end is found late
STEPS = 6  # on each level
CONTEST_STEPS = 3  # on the finest, for either of the PSFs that are compared, and
FURTHER_STEPS = 3  # for the one that is taken
OPENING = 2  # rounds that find the sharp gradient before the PSF is touched
FIRST_MISFIT = 0.06  # of contrast: the error of the model on the coarsest level
MISFIT = 0.0085  # on the finest, besides noise
NOISE_SHARE = 0.5  # of the noise of gradients that is counted
# Pixels, standard deviation of the blur that a sharp picture has anyway. What it takes, the PSF
# lacks. Real photos have .6 or more, but a crisp edge between two pixels has .4 and less.
SEARCHED_SOFTNESS = 0.5  # on all levels: thinner PSFs are found more safely
SOFTNESS = 0.35  # at the end: the photo may have been crisp
FAINT = 0.02  # of the peak: what is cleared from step to step
NOISE = 0.03  # of the peak: what is cleared at the end of a level
MOVES = 4  # steps between two moves of the PSF to the middle


@dataclass(frozen=True, slots=True)
class Variational(SingleSearch):
    """The PSF that is likely for all sharp pictures with sparse gradients, not for a single one.

    Levin, Weiss, Durand & Freeman (2011, Efficient marginal likelihood optimization in blind
    deconvolution, CVPR), with the prior of Wipf & Zhang (2014, Revisiting Bayesian blind
    deconvolution, JMLR 15). In turns, from coarse to fine, mean and variance of the sharp gradient
    `s` are found for the PSF so far, and ::

        k = argmin E |k * h * s - D B|^2,  k >= 0

    A single picture, the most likely one, favors PSFs that are too large, and its steps are
    sharper than those of any photo; so `s` is a distribution, and `h` the softness of a sharp
    photo (:class:`~.gradients.BlurredGradient`). Against the papers, noise is not learned: it is
    measured in the picture, and the model is taken as rough on coarse levels.

    Of `h` the picture says nothing, since only ``k * h`` matters. Too much of it makes the PSF too
    thin for a crisp picture, too little makes it too thick for a soft one. More is assumed
    while the PSF is searched, which is safer, and less at the end.

    Either search can be led astray: this one, that starts from nothing, and that of
    :class:`~..xu_jia.XuJia`, from strong edges. So both are made, both PSFs are continued alike on
    the finest level, and the one that makes the picture likelier is taken, by the cost of Wipf &
    Zhang.

    Parameters
    ----------
    size : int, optional
        Largest extent of the PSF in pixels, odd, at least 3; too small cuts the PSF, up to
        twice too large does little harm. Found by itself if not given.
    region : int
        Longest side in pixels of the part of the picture that is used, or three PSF sizes if
        that is more (:class:`~..overview.Overview`).
    """

    def searching(self, blurred: Blurred, size: int) -> Job[FloatArray]:
        """Long job: a PSF of `size` x `size` pixels."""
        return searching(blurred, size)


def searching(blurred: Blurred, size: int) -> Job[FloatArray]:
    """Long job: a PSF of at least `size` x `size` pixels, more if its faint ends need them."""
    sizes = level_sizes(roomy_size(size))
    at = Progress("blind PSF", 0, len(sizes) * STEPS + 2 * CONTEST_STEPS + FURTHER_STEPS + 1)
    errors = _errors(blurred, sizes)
    found, model = yield from _climbing(blurred, sizes, errors, FIRST_GUESS, at)
    at = replace(at, done=len(sizes) * STEPS)
    edges = yield from reporting(searching_edges(blurred, size), at)
    model, contenders, error = model.assuming(SOFTNESS), [], errors[-1]
    for start in (found.psf, roomy(edges, sizes[-1])):
        found = yield from opening(model, start, error, at)
        contenders.append((yield from alternating(model, found, error, CONTEST_STEPS, at)))
        at = replace(at, done=at.done + CONTEST_STEPS)
    likelier = yield from choosing_likeliest(model, contenders, error, at)
    found = yield from alternating(model, likelier.in_the_middle(), error, FURTHER_STEPS, at)
    yield replace(at, done=at.total)
    return trimmed(found.cleaned().psf, size)


def refining(blurred: Blurred, psf: FloatArray, size: int) -> Job[FloatArray]:
    """Long job: a PSF of at least `size` x `size` pixels, from one that was found at less detail.

    Parameters
    ----------
    blurred : Blurred
        At full detail.
    psf : ndarray, shape (S, S)
        Of that extent or coarser; taken up where the levels are as large.
    size : int
        Odd.
    """
    sizes = level_sizes(roomy_size(size))
    rest = [level for level in sizes if level >= len(psf)] or sizes[-1:]
    at = Progress("finer PSF", 0, (len(rest) + 1) * STEPS + 1)
    errors = _errors(blurred, sizes)[-len(rest) :]
    start, model = yield from _climbing(blurred, rest, errors, psf, at)
    model, error = model.assuming(SOFTNESS), errors[-1]
    at = replace(at, done=len(rest) * STEPS)
    found = yield from opening(model, start.psf, error, at)
    found = yield from alternating(model, found, error, STEPS, at)
    yield replace(at, done=at.total)
    return trimmed(found.cleaned().psf, size)


def roomy_size(size: int) -> int:
    """Sides of the array in which a PSF of some pixels is found."""
    return int(ROOM * size) // 2 * 2 + 1


def _climbing(
    blurred: Blurred,
    sizes: Sequence[int],
    errors: Sequence[float],
    psf: FloatArray,
    at: Progress,
) -> Job[tuple["Candidate", BlurredGradient]]:
    """Long job: the PSF of the last of these levels, from a coarser one, and the model there."""
    for level, error in zip(sizes, errors, strict=True):
        small = blurred.scaled(level / sizes[-1])
        model = BlurredGradient.of(small, level, SEARCHED_SOFTNESS)
        found = yield from opening(model, psf, error, at)
        found = (yield from alternating(model, found, error, STEPS, at)).cleaned()
        psf, at = found.psf, replace(at, done=at.done + STEPS)
    return found, model


def _errors(blurred: Blurred, sizes: Sequence[int]) -> list[float]:
    """Error of the model and half of the noise on each level."""
    noise, finest = NOISE_SHARE * noise_of_gradients(blurred), sizes[-1]
    misfits = misfits_of(len(sizes))
    return [
        float(np.hypot(misfit, level / finest * noise))
        for level, misfit in zip(sizes, misfits, strict=True)
    ]


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A PSF, and the sharp gradient that goes with it."""

    psf: FloatArray
    sharp: GradientPosterior

    def cleaned(self) -> "Candidate":
        """Without what is faint, in the middle."""
        return Candidate(cleaned(self.psf, NOISE), self.sharp).in_the_middle()

    def in_the_middle(self) -> "Candidate":
        """The extent of the PSF moved to the middle of its array, the gradient against it."""
        rows, columns = off_middle(self.psf)
        return Candidate(shifted(self.psf, -rows, -columns), self.sharp.shifted(rows, columns))


def misfits_of(levels: int) -> FloatArray:
    """Error of the model on each level, besides noise: from rough to fine in equal ratios."""
    return np.geomspace(FIRST_MISFIT, MISFIT, levels)


def opening(model: BlurredGradient, psf: FloatArray, error: float, at: Progress) -> Job[Candidate]:
    """Long job: the sharp gradient that goes with a PSF of any size."""
    psf = cleaned(resized(psf, (model.size, model.size)), FAINT)
    sharp = model.unknown()
    for _ in range(OPENING):
        yield at
        sharp = model.posterior(psf, error, sharp)
    return Candidate(psf, sharp)


def alternating(
    model: BlurredGradient, found: Candidate, error: float, steps: int, at: Progress
) -> Job[Candidate]:
    """Long job: the sharp gradient and the PSF in turns; progress goes on from `at`."""
    for step in range(steps):
        yield replace(at, done=at.done + step)
        sharp = model.posterior(found.psf, error, found.sharp)
        found = Candidate(cleared(model.refit(found.psf, sharp), FAINT), sharp)
        if step % MOVES == MOVES - 1:
            found = found.in_the_middle()
    return found


def choosing_likeliest(
    model: BlurredGradient, contenders: Sequence[Candidate], error: float, at: Progress
) -> Job[Candidate]:
    """Long job: the PSF with which the blurred picture is the least unlikely."""
    energies = []
    for found in contenders:
        yield at
        sharp = model.posterior(found.psf, error, found.sharp)
        energies.append(model.energy(found.psf, error, sharp))
    return contenders[int(np.argmin(energies))]
