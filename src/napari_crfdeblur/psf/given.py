"""A PSF that the user already has."""

from dataclasses import dataclass

from .._typing import BoolArray, FloatArray
from ..errors import CrfDeblurError
from ..progress import Job, Progress
from .base import PsfEstimate, PsfEstimator, PsfStatus, as_psf


@dataclass(frozen=True, slots=True, eq=False)
class GivenPsf(PsfEstimator):
    """The PSF that was given, whatever the image shows.

    Parameters
    ----------
    psf : ndarray, shape (H, W)
        Non-negative; scaled to sum 1 and padded to odd sides.
    """

    psf: FloatArray

    def __post_init__(self) -> None:
        psf = as_psf(self.psf)
        psf.setflags(write=False)
        object.__setattr__(self, "psf", psf)

    def run(self, linear: FloatArray, *, clipped: BoolArray | None = None) -> Job[PsfEstimate]:
        """Long job: hand out the PSF; an image that is smaller than it is refused."""
        del clipped  # what is given does not come from the picture
        if self.psf.shape[0] > linear.shape[0] or self.psf.shape[1] > linear.shape[1]:
            raise CrfDeblurError(
                f"the PSF, {self.psf.shape[1]} x {self.psf.shape[0]} pixels, is larger than "
                f"the image, {linear.shape[1]} x {linear.shape[0]}; give a smaller PSF"
            )
        yield Progress("given PSF", 1, 1)
        return PsfEstimate(self.psf, PsfStatus.GIVEN)
