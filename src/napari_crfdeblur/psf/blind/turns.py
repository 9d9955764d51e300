"""Edges and PSF in turns, from coarse to fine: what methods of strong edges have in common."""

from dataclasses import dataclass

from ..._typing import FloatArray
from ...progress import Job, Progress
from .blurred import Blurred
from .edge_prediction import STRONGEST, EdgePredictor
from .kernel_fit import KernelFit
from .pyramid import FIRST_GUESS, cleaned, level_sizes, recentered, resized


@dataclass(frozen=True, slots=True)
class Schedule:
    """How the turns go on.

    Parameters
    ----------
    first, decay, last : float
        Weight of a step's existence at first, what it is divided by from turn to turn, and the
        least one (:meth:`~.edge_prediction.EdgePredictor.predict`).
    smoothness : float
        `g` of the fit of the PSF, for contrast 1 (:class:`~.kernel_fit.KernelFit`).
    noise : float
        Of the PSF's peak, below which it is cleared.
    steps : int
        Turns on each level.
    patches : float
        Sides of the patches of darkest pixels as a share of those of the picture; 0 for none.
    strongest : float
        Coupling at which the splitting ends.
    """

    first: float
    decay: float
    last: float
    smoothness: float
    noise: float
    steps: int = 5
    patches: float = 0.0
    strongest: float = STRONGEST

    def weight(self, turn: int) -> float:
        """Of a step's existence in a turn, counted over all levels."""
        return max(self.first / self.decay**turn, self.last)

    def predictor(self, plane: FloatArray, size: int) -> EdgePredictor:
        """Of the edges of a plane, for PSFs of at most `size` pixels."""
        sides = sum(plane.shape) / 2
        patch = max(round(self.patches * sides), SMALLEST_PATCH) if self.patches else 0
        return EdgePredictor.of(plane, size, patch)


SMALLEST_PATCH = 3  # pixels


def turning(
    blurred: Blurred, psf: FloatArray, size: int, schedule: Schedule, done: int, at: Progress
) -> Job[FloatArray]:
    """Long job: the turns of one level, after so many turns that were done before."""
    psf = cleaned(resized(psf, (size, size)), schedule.noise)
    predictor, measured = schedule.predictor(blurred.plane, size), blurred.gradient()
    for turn in range(done, done + schedule.steps):
        yield Progress(at.stage, at.done + turn, at.total)
        predicted = predictor.predict(psf, schedule.weight(turn), schedule.strongest)
        fit = KernelFit.of(blurred.kept(predicted), measured, size)
        psf = recentered(cleaned(fit.solve(schedule.smoothness), schedule.noise))
    return psf


def coarse_to_fine(
    blurred: Blurred, size: int, schedule: Schedule, at: Progress, widest: int | None = None
) -> Job[FloatArray]:
    """Long job: a PSF of `size` x `size` pixels, that starts from hardly any blur.

    Each level sees all of the picture, or the square of `widest` pixels that tells most.
    """
    psf = FIRST_GUESS
    for number, level in enumerate(level_sizes(size)):
        small = blurred.scaled(level / size)
        if widest is not None:
            small = small.within(widest, level)
        psf = yield from turning(small, psf, level, schedule, number * schedule.steps, at)
    return psf
