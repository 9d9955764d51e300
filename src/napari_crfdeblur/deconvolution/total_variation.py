"""Deconvolution with the total variation as prior: a convex problem, solved by ADMM."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from .. import arguments, arrays
from .._typing import BoolArray, FloatArray
from ..boundary import frame
from ..fourier import gradient_power, laplacian_power
from ..progress import Job, Progress
from .differences import add_adjoint, difference, subtract_behind
from .noise import PlaneStatistics
from .recorded import recording
from .regularized import Regularized
from .splitting import solving

THRESHOLD = 0.1  # of the gradient, for contrast 1: sets how fast ADMM converges, not where to


@dataclass(frozen=True, slots=True)
class TotalVariation(Regularized):
    """Minimize ``1/2 |k * x - y|^2 + w sum |D x|``, `D x` the gradient of a pixel.

    The isotropic total variation of Rudin, Osher & Fatemi (1992, Nonlinear total variation based
    noise removal algorithms). The problem is convex, so that there is one answer. It is
    approached by the alternating direction method of multipliers in its scaled form (Boyd et
    al. 2011, Distributed optimization and statistical learning via ADMM, Eqs. 3.5 to 3.7) with
    ``v = D x``, which for total variation is the split Bregman method of Goldstein & Osher (2009):

        ``x = argmin 1/2 |k * x - y|^2 + r/2 |D x - v + u|^2``, by one pair of transforms,
        ``v = max(0, 1 - w / (r |D x + u|)) (D x + u)``, pixel by pixel, and
        ``u <- u + D x - v``.

    What lies beyond the border does not count. The plane is scaled to contrast 1 meanwhile, so
    that affine changes of the plane change the result alike.

    Parameters
    ----------
    weight : float, optional
        `w`, for a plane of contrast 1 (four standard deviations). By default it follows from
        the noise level and the errors of the plane.
    model_error : float, optional
        Least noise that is reckoned with, as a share of the contrast; by default measured.
    iterations : int
        Number of alternations.
    """

    FACTOR = 7.0  # best on average over pictures, PSFs and noise of .002 to .03

    iterations: int = 20

    def __post_init__(self) -> None:
        Regularized.__post_init__(self)
        arguments.step_count(self.iterations, "a number of iterations")

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
        total = 1 + 2 * self.iterations
        reports = [Progress("total variation", done, total) for done in range(total + 1)]
        yield reports[0]
        found, weight = self.judge(plane, psf, clipped, statistics)
        sharp, data = yield from recording(plane, psf, clipped, found.contrast, reports[0], weights)
        yield reports[1]
        filters = partial(laplacian_power, gradient_power(sharp.shape, sharp))
        multipliers, coupling = [0 * sharp for _ in sharp.shape], weight / THRESHOLD
        for step in range(self.iterations):
            before, middle, after = reports[1 + 2 * step : 4 + 2 * step]
            if step > 0:
                yield from data.filling(sharp, before)
            split(sharp, multipliers, THRESHOLD)
            yield middle
            sharp = yield from solving(data, sharp, coupling, filters, (middle, after))
        return sharp[frame(plane.shape)] * found.contrast


def split(plane: FloatArray, multipliers: Sequence[FloatArray], threshold: float) -> None:
    """Replace a periodic plane `x` by ``D' (v - u)``, block by block, and `u` by the next.

    With ``g = D x + u``, shrunk to ``v = s g``, the next `u` is ``(1 - s) g``.
    """
    first = arrays.copy(plane[:1, ...])
    above = _last_row(plane, first, multipliers, threshold)
    for block in arrays.blocks(plane):
        part = plane[block, ...]
        below = plane[block.stop : block.stop + 1, ...] if block.stop < plane.shape[0] else first
        rows = [each[block, ...] for each in multipliers]
        down, *across = _balanced(part, below, rows, threshold)
        subtract_behind(part, down, above)
        for axis, each in enumerate(across, start=1):
            add_adjoint(part, each, axis)
        above = down[-1:, ...]


def _last_row(
    plane: FloatArray, first: FloatArray, multipliers: Sequence[FloatArray], threshold: float
) -> FloatArray:
    """What belongs above the first row; the multipliers stay."""
    rows = [arrays.copy(each[-1:, ...]) for each in multipliers]
    return _balanced(plane[-1:, ...], first, rows, threshold)[0]


def _balanced(
    part: FloatArray, below: FloatArray, multipliers: Sequence[FloatArray], threshold: float
) -> list[FloatArray]:
    """``v - u`` along each axis; the multipliers become the next ones."""
    gradient = [difference(part, axis, below if axis == 0 else None) for axis in range(part.ndim)]
    size = 0 * part
    for each, multiplier in zip(gradient, multipliers, strict=True):
        each += multiplier
        size += each * each
    size **= 0.5
    arrays.raise_to(size, threshold)
    size = threshold / size  # what the multipliers keep: 1 - s
    for each, multiplier in zip(gradient, multipliers, strict=True):
        multiplier[...] = each * size
        each -= 2 * multiplier
    return gradient
