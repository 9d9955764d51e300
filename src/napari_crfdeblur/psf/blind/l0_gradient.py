"""Blind estimation of a PSF from the picture of fewest steps, on all of the photo."""

from dataclasses import dataclass
from typing import ClassVar

from ..._typing import FloatArray
from ...progress import Job, Progress
from .blurred import Blurred
from .estimation import SingleSearch
from .pyramid import level_sizes
from .turns import Schedule, coarse_to_fine

# The strongest steps alone at first: on six drawn-out shakes of photos and nine real photos, .015
# led further than .004. Below a coupling of 100 nothing changes that the PSF would see.
SCHEDULE = Schedule(
    first=0.015, decay=1 / 0.9, last=1e-3, smoothness=2.0, noise=0.05, strongest=100.0
)


@dataclass(frozen=True, slots=True)
class L0Gradient(SingleSearch):
    """The PSF and the picture of fewest steps in turns, from 5 pixels up.

    Xu, Zheng & Jia (2013, Unnatural L0 sparse representation for natural image deblurring, CVPR)
    and Pan, Hu, Su & Yang (2014, Deblurring text images via L0-regularized intensity and gradient
    prior, CVPR), without the intensity: ``|k * x - y|^2 + w |D x|_0`` for the picture, ::

        k = argmin |k * D x - D y|^2 + g |k|^2

    for the PSF, with all of the picture's steps. Coarse levels see all of the photo, so that large
    blur is found, too; finer ones see the square of `region` pixels that tells most.

    Parameters
    ----------
    size : int, optional
        Largest extent of the PSF in pixels, odd, at least 3; half as much again does no harm.
        Found by itself if not given.
    region : int
        Longest side in pixels of what is seen on each level, or three PSF sizes if that is more.
    """

    sees_whole: ClassVar[bool] = True

    def searching(self, blurred: Blurred, size: int) -> Job[FloatArray]:
        """Long job: a PSF of `size` x `size` pixels."""
        return searching(blurred, size, SCHEDULE, self.region)


def searching(blurred: Blurred, size: int, schedule: Schedule, widest: int) -> Job[FloatArray]:
    """Long job: a PSF of `size` x `size` pixels, looked for in at most so many pixels squared."""
    at = Progress("blind PSF", 0, len(level_sizes(size)) * schedule.steps)
    psf = yield from coarse_to_fine(blurred, size, schedule, at, widest)
    yield Progress(at.stage, at.total, at.total)
    return psf
