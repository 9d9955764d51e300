"""The right amount by eye: one number for users, with the same meaning for every method."""

from dataclasses import dataclass, replace

from .. import arguments, arrays
from .._typing import BoolArray, FloatArray
from ..methods import MOST_STRENGTH
from ..progress import Job
from .base import Deconvolver, check_method
from .noise import PlaneStatistics, measure

# Of the errors that are reckoned with, at the most strength. On a picture of known truth it brings
# two to eight times the grain and costs 2 to 6 dB, with a third 5 to 10 times: nobody wants that.
LEAST_RECKONED = 0.6
REACH = 1.2  # sides of the PSF that a method with so much less restraint reaches farther


@dataclass(frozen=True, slots=True)
class Strengthened(Deconvolver):
    """Another method, more or less of it.

    From 0, the blurred picture as it was, to 1, what the method finds right, the two are mixed.
    Beyond, the method reckons with smaller errors, ``.6^(strength - 1)`` of those that
    were measured: a weight falls by the square of it, and Richardson-Lucy takes so many more steps.

    Parameters
    ----------
    method : Deconvolver
        What restores the plane.
    strength : float
        0 to 2.
    """

    method: Deconvolver
    strength: float = 1.0

    def __post_init__(self) -> None:
        check_method(self.method)
        if isinstance(self.method, Strengthened):
            raise ValueError("expected a method to be strengthened, got one that is so already")
        arguments.number(self.strength, "a strength", least=0, most=MOST_STRENGTH)

    @property
    def reach(self) -> float:
        """Sides of the PSF around a tile beyond which it changes it by less than noise."""
        return self.method.reach * (REACH if self.strength > 1 else 1.0)

    def run(
        self,
        plane: FloatArray,
        psf: FloatArray,
        *,
        clipped: BoolArray | None = None,
        weights: FloatArray | None = None,
        statistics: PlaneStatistics | None = None,
    ) -> Job[FloatArray]:
        """Long job: deconvolve a plane or volume with a checked PSF."""
        if self.strength == 0:
            yield from ()
            unchanged: FloatArray = arrays.copy(plane)
            return unchanged
        found = statistics or measure(plane, psf, clipped)
        if self.strength > 1:
            found = replace(found, reckoned=found.reckoned * LEAST_RECKONED ** (self.strength - 1))
        sharp = yield from self.method.run(
            plane, psf, clipped=clipped, weights=weights, statistics=found
        )
        if self.strength < 1:
            sharp = plane + self.strength * (sharp - plane)
        return sharp
