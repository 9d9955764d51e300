"""Deconvolution with a hyper-Laplacian prior: few transforms, edges kept sharp."""

from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np

from .. import arguments, arrays
from .._typing import BoolArray, FloatArray
from ..boundary import frame
from ..fourier import gradient_power, laplacian_power
from ..progress import Job, Progress
from . import loops
from .differences import add_adjoint, difference, subtract_behind
from .noise import PlaneStatistics
from .recorded import recording
from .regularized import Regularized
from .splitting import solving

GROWTH = 2 * 2**0.5  # of the coupling from stage to stage, as in the paper
MOST_STAGES = 30  # after which no gradient is shrunk, and the coupling is still a float
TABLE_SIZE = 1 << 13
TABLE_SPAN = 32  # thresholds: above it shrinkage takes less than half a percent


@dataclass(frozen=True, slots=True)
class HyperLaplacian(Regularized):
    """Minimize ``1/2 |k * x - y|^2 + w sum |D x|^alpha`` by half-quadratic splitting.

    Krishnan & Fergus (2009, Fast image deconvolution using hyper-Laplacian priors), Eq. 2:
    with ``v = D x`` relaxed to ``beta/2 |D x - v|^2``, it alternates between `v`, pixel by
    pixel (Eq. 5), and `x`, by one pair of transforms (Eq. 4), while `beta` grows by
    ``2 sqrt 2`` from 1 to 256. The plane is scaled to contrast 1 meanwhile, so that
    affine changes of the plane change the result alike.

    Parameters
    ----------
    weight : float, optional
        `w`, for a plane of contrast 1 (four standard deviations). By default it follows from
        the noise level and the errors of the plane.
    model_error : float, optional
        Least noise that is reckoned with, as a share of the contrast; by default measured.
    exponent : float
        `alpha`, between 0 and 1; 2/3 suits natural pictures.
    stages : int
        Values of `beta`; 6 end at 181.
    steps : int
        Alternations for every `beta`.
    """

    FACTOR = 4.0  # best on average over pictures, PSFs and noise of .002 to .03

    exponent: float = 2 / 3
    stages: int = 6
    steps: int = 1

    def __post_init__(self) -> None:
        Regularized.__post_init__(self)
        arguments.number(self.exponent, "an exponent", above=0, below=1)
        arguments.step_count(self.stages, "a number of stages", most=MOST_STAGES)
        most = arguments.MOST_STEPS // self.stages
        arguments.step_count(self.steps, "a number of steps", most=most)

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
        total = 3 + 2 * self.stages * self.steps
        reports = (Progress("hyper-Laplacian", done, total) for done in range(total + 1))
        yield (at := next(reports))
        found, weight = self.judge(plane, psf, clipped, statistics)
        sharp, data = yield from recording(plane, psf, clipped, found.contrast, at, weights)
        for _ in range(3):
            yield (at := next(reports))
        filters = partial(laplacian_power, gradient_power(sharp.shape, sharp))
        for step in range(self.stages * self.steps):
            beta = GROWTH ** (step // self.steps)
            if step > 0:
                yield from data.filling(sharp, at)
            shrink_gradient(sharp, beta, self.exponent)
            coupling, middle, at = weight * beta, next(reports), next(reports)
            sharp = yield from solving(data, sharp, coupling, filters, (middle, at))
        return sharp[frame(plane.shape)] * found.contrast


def shrink_gradient(plane: FloatArray, beta: float, exponent: float) -> None:
    """Replace a periodic plane `x` by ``D^T v``, `v` its shrunk gradient, block by block."""
    if fused := loops.compiled(loops.shrink_gradient, plane):
        cells, table = _cells(beta, exponent), _shares(exponent, arrays.dtype_name(plane))
        work = np.empty((2, plane.shape[1]), dtype=plane.dtype)
        fused(plane, table, plane.dtype.type(cells), work[0], work[1])
        return
    first = arrays.copy(plane[:1, ...])
    above = _shrunk(first - plane[-1:, ...], beta, exponent)
    for block in arrays.blocks(plane):
        part = plane[block, ...]
        below = plane[block.stop : block.stop + 1, ...] if block.stop < plane.shape[0] else first
        down = _shrunk(difference(part, 0, below), beta, exponent)
        across = [_shrunk(difference(part, axis), beta, exponent) for axis in range(1, plane.ndim)]
        subtract_behind(part, down, above)
        for axis, each in enumerate(across, start=1):
            add_adjoint(part, each, axis)
        above = down[-1:, ...]


def _shrunk(values: FloatArray, beta: float, exponent: float) -> FloatArray:
    """``argmin_v |v|^alpha + beta/2 (v - values)^2``, Eq. 5, in place."""
    position = abs(values)
    position *= _cells(beta, exponent)
    values *= arrays.look_up(_shares(exponent, arrays.dtype_name(values)), position)
    return values


def _cells(beta: float, exponent: float) -> float:
    """Cells of the table of shrinkage for a unit of the plane."""
    return TABLE_SIZE / (TABLE_SPAN * _threshold(beta, exponent))


def _threshold(beta: float, exponent: float) -> float:
    """Largest value that shrinks to zero, where both minima of Eq. 5 are equally deep."""
    smallest: float = (2 * (1 - exponent) / beta) ** (1 / (2 - exponent))
    return smallest * (2 - exponent) / (2 * (1 - exponent))


@lru_cache(maxsize=8)
def _shares(exponent: float, dtype: str) -> FloatArray:
    """Share of a value that shrinkage leaves, at the centers of equal steps of the value.

    In units of the threshold it is the same for every `beta`. Its inverse is explicit: `v`
    comes from ``v + alpha/beta v^(alpha - 1)``, so that one interpolation makes the table.
    """
    beta = 2 * (1 - exponent) * ((2 - exponent) / (2 * (1 - exponent))) ** (2 - exponent)
    smallest = 2 * (1 - exponent) / (2 - exponent)
    after = np.geomspace(smallest, TABLE_SPAN, 1 << 14)
    before = after + exponent / beta * after ** (exponent - 1)
    values = (np.arange(TABLE_SIZE) + 0.5) * TABLE_SPAN / TABLE_SIZE
    shares = np.where(values > 1, np.interp(values, before, after) / values, 0)
    shares[-1] = 1  # stands for all larger values
    return shares.astype(dtype)
