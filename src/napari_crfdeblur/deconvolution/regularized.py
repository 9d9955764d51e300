"""What the methods with a prior have in common: how strong it is."""

from dataclasses import dataclass
from typing import ClassVar

from .. import arguments
from .._typing import BoolArray, FloatArray
from .base import Deconvolver
from .noise import PlaneStatistics, measure

# Weights of a prior that tells nothing, even in double precision, and of one that leaves nothing.
FAINTEST, STRONGEST = 1e-15, 1e15


@dataclass(frozen=True, slots=True)
class Regularized(Deconvolver):
    """A method whose result depends on the weight of a prior.

    Parameters
    ----------
    weight : float, optional
        `w`, for a plane of contrast 1 (four standard deviations). By default it follows from
        the noise level and the errors of the plane, as a factor times their square.
    model_error : float, optional
        Least noise that is reckoned with, as a share of the contrast: it stands for the errors
        of the PSF and the response, rounding and compression. By default these are measured
        (:func:`~napari_crfdeblur.psf.misfit.misfit`).
    """

    FACTOR: ClassVar[float]

    weight: float | None = None
    model_error: float | None = None

    def __post_init__(self) -> None:
        if self.weight is not None:
            arguments.number(self.weight, "a weight", least=FAINTEST, most=STRONGEST)
        if self.model_error is not None:
            arguments.number(self.model_error, "a model error", least=0, below=1)

    def judge(
        self,
        plane: FloatArray,
        psf: FloatArray,
        clipped: BoolArray | None,
        statistics: PlaneStatistics | None,
    ) -> tuple[PlaneStatistics, float]:
        """Statistics of a plane, measured unless they are given, and the weight for it."""
        given = self.weight is not None or self.model_error is not None
        found = statistics or measure(plane, None if given else psf, clipped)
        if self.weight is None:
            weight = self.FACTOR * found.relative_noise(self.model_error) ** 2
        else:
            weight = self.weight * found.reckoned**2
        return found, weight
