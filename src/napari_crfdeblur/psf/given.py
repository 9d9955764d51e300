"""A PSF that the user already has."""

from dataclasses import dataclass
from types import NoneType
from typing import ClassVar

import numpy as np

from .. import arguments
from .._typing import FloatArray
from ..errors import CrfDeblurError
from ..progress import Job, Progress
from .base import Evidence, PsfEstimate, PsfEstimator, as_psf
from .field import PsfField
from .status import PsfStatus


@dataclass(frozen=True, slots=True, eq=False)
class GivenPsf(PsfEstimator):
    """The PSF that was given, whatever the image shows.

    Parameters
    ----------
    psf : ndarray, shape (H, W), or (D, H, W) for volumes
        Non-negative; scaled to sum 1 and padded to odd sides. That of the whole photo.
    parts : PsfField, optional
        The PSFs of all parts of the photo, if they differ.
    """

    needs_picture: ClassVar[bool] = False

    psf: FloatArray
    parts: PsfField | None = None

    def __post_init__(self) -> None:
        arguments.instance(self.parts, (PsfField, NoneType), "the PSFs of all parts or None")
        psf = as_psf(self.psf)
        psf.setflags(write=False)
        object.__setattr__(self, "psf", psf)

    @property
    def field(self) -> PsfField | None:
        """The PSFs of all parts, as given."""
        return self.parts

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
