"""Blind estimation of a PSF from the picture of fewest steps and darkest pixels."""

from dataclasses import dataclass, replace
from typing import ClassVar

from ..._typing import FloatArray
from ...progress import Job
from .blurred import Blurred
from .estimation import SingleSearch
from .l0_gradient import SCHEDULE as STEPS_ALONE
from .l0_gradient import searching

PATCHES = 0.025  # of the sides of the picture, as in the paper
SCHEDULE = replace(STEPS_ALONE, patches=PATCHES)


@dataclass(frozen=True, slots=True)
class MinimalPixels(SingleSearch):
    """As :class:`~.l0_gradient.L0Gradient`, and the darkest pixel of each patch is black.

    Wen, Ying, Liu & Liu (2021, A simple local minimal intensity prior and an improved algorithm
    for blind image deblurring, IEEE TCSVT 31), the local form of the dark channel of Pan, Sun,
    Pfister & Yang (2016, Blind image deblurring using dark channel prior, CVPR): blur mixes dark
    pixels with brighter ones, so that of sharp and blurred picture the sharp one has more black.
    Where the light is compressed, as in a photo as recorded, this leads further than the steps
    alone; in linear light the dark pixels hardly count.

    Parameters
    ----------
    size, region : int
        As of :class:`~.l0_gradient.L0Gradient`.
    """

    sees_whole: ClassVar[bool] = True

    def searching(self, blurred: Blurred, size: int) -> Job[FloatArray]:
        """Long job: a PSF of `size` x `size` pixels."""
        return searching(blurred, size, SCHEDULE, self.region)
