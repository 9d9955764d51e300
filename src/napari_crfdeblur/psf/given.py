"""A PSF that the user already has."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .._typing import FloatArray
from ..errors import CrfDeblurError
from ..progress import Job, Progress
from .base import Evidence, PsfEstimate, PsfEstimator, PsfStatus, as_psf


@dataclass(frozen=True, slots=True, eq=False)
class GivenPsf(PsfEstimator):
    """The PSF that was given, whatever the image shows.

    Parameters
    ----------
    psf : ndarray, shape (H, W), or (D, H, W) for volumes
        Non-negative; scaled to sum 1 and padded to odd sides.
    """

    needs_picture: ClassVar[bool] = False

    psf: FloatArray

    def __post_init__(self) -> None:
        psf = as_psf(self.psf)
        psf.setflags(write=False)
        object.__setattr__(self, "psf", psf)

    def run(self, evidence: Evidence) -> Job[PsfEstimate]:
        """Long job: hand out the PSF; an image that is smaller than it is refused."""
        linear = evidence.linear
        if linear is not None and any(np.less(linear.shape[:2], self.psf.shape[-2:])):
            raise CrfDeblurError(
                f"the PSF, {self.psf.shape[-1]} x {self.psf.shape[-2]} pixels, is larger than "
                f"the image, {linear.shape[1]} x {linear.shape[0]}; give a smaller PSF"
            )
        yield Progress("given PSF", 1, 1)
        return PsfEstimate(self.psf, PsfStatus.GIVEN)
