"""Blind estimation of a PSF as the most probable picture and PSF, coarse to fine."""

from dataclasses import dataclass

from ...._typing import FloatArray
from ....progress import Job, Progress
from ..blurred import Blurred
from ..estimation import SingleSearch
from ..pyramid import FIRST_GUESS, cleaned, level_sizes, recentered, resized
from .kernel import sparse_kernel
from .latent import Latent

STEPS = 8  # alternations on each level
SHARPNESS, LOCALITY = 0.2, 15.0  # l1 and l2 of the first step of each level
RELAXED = 1.2, 1.5  # what both are divided by from step to step
SPARSITY = 0.005  # of the PSF
NOISE = 0.03  # of the PSF's peak, below which it is cleared


@dataclass(frozen=True, slots=True)
class Shan(SingleSearch):
    """The picture and the PSF that are most probable together, in turns.

    Shan, Jia & Agarwala (2008, High-quality motion deblurring from a single image, SIGGRAPH),
    Sec. 3 and 4: noise is Gaussian in the picture and its derivatives, gradients follow a density
    of two pieces, what is smooth in the blurred picture is so in the sharp one, and the PSF is not
    negative and sparse. The picture is found by splitting (:class:`~.latent.Latent`), the PSF by
    descent (:func:`~.kernel.sparse_kernel`), from coarse to fine; the weights of both priors
    of the picture fall from step to step.

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
    sizes, psf = level_sizes(size), FIRST_GUESS
    total = len(sizes) * STEPS
    for number, level in enumerate(sizes):
        small = blurred if level == size else blurred.scaled(level / size)
        latent, psf = Latent.of(small, level), cleaned(resized(psf, (level, level)), NOISE)
        sharpness, locality = SHARPNESS, LOCALITY
        for step in range(STEPS):
            yield Progress("blind PSF", number * STEPS + step, total)
            picture = latent.predict(psf, sharpness, locality)
            psf = recentered(cleaned(sparse_kernel(picture, small, psf, SPARSITY), NOISE))
            sharpness, locality = sharpness / RELAXED[0], locality / RELAXED[1]
    yield Progress("blind PSF", total, total)
    return psf
