"""Deconvolution with a hyper-Laplacian prior: few transforms, edges kept sharp."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from .._typing import FloatArray
from ..boundary import extending
from ..fourier import ComplexArray, forward, gradient_power, inverse, otf, power, row_blocks
from ..progress import Job, Progress
from .base import Deconvolver
from .noise import LEAST_NOISE, check_weight, contrast, relative_noise

WEIGHT_OF_NOISE = 4.0  # best on average over pictures, PSFs and noise of .002 to .03
GROWTH = 2 * 2**0.5  # of the coupling from stage to stage, as in the paper
TABLE_SIZE = 1 << 13
TABLE_SPAN = 32  # thresholds: above it shrinkage takes less than half a percent


@dataclass(frozen=True, slots=True)
class HyperLaplacian(Deconvolver):
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
        the noise level of the plane.
    model_error : float
        Least noise that is reckoned with, as a share of the contrast: it stands for the errors
        of the PSF and the response, rounding and compression. With an estimated PSF give .01.
    exponent : float
        `alpha`, between 0 and 1; 2/3 suits natural pictures.
    stages : int
        Values of `beta`; 6 end at 181.
    steps : int
        Alternations for every `beta`.
    """

    weight: float | None = None
    model_error: float = LEAST_NOISE
    exponent: float = 2 / 3
    stages: int = 6
    steps: int = 1

    def __post_init__(self) -> None:
        check_weight(self.weight, self.model_error)
        if not 0 < self.exponent < 1:
            raise ValueError(f"expected an exponent between 0 and 1, got {self.exponent}")
        if self.stages < 1 or self.steps < 1:
            raise ValueError(
                f"expected at least 1 stage of 1 step, got {self.stages} of {self.steps}"
            )

    def run(self, plane: FloatArray, psf: FloatArray) -> Job[FloatArray]:
        """Long job: deconvolve a plane of shape (M, N) with a checked PSF."""
        total = 3 + 2 * self.stages * self.steps
        reports = (Progress("hyper-Laplacian", done, total) for done in range(total + 1))
        yield (start := next(reports))
        weight = self.weight or WEIGHT_OF_NOISE * relative_noise(plane, self.model_error) ** 2
        scale = contrast(plane)
        sharp = yield from extending(plane, psf, start)
        yield next(reports)
        sharp /= scale
        shape = sharp.shape
        transfer = otf(psf, shape, plane.dtype)
        gain = power(transfer)
        yield next(reports)
        blurred = _correlated(sharp, transfer)
        del transfer  # three planes are all that is kept
        yield next(reports)
        for step in range(self.stages * self.steps):
            beta = GROWTH ** (step // self.steps)
            _shrink_gradient(sharp, beta, self.exponent)
            spectrum = forward(sharp)
            yield next(reports)
            _solve(spectrum, blurred, gain, shape[1], weight * beta)
            sharp = inverse(spectrum, shape)
            yield next(reports)
        return sharp[: plane.shape[0], : plane.shape[1]] * plane.dtype.type(scale)


def _correlated(plane: FloatArray, transfer: ComplexArray) -> ComplexArray:
    """Spectrum ``conj(K) Y``; the transfer function is conjugated in place."""
    spectrum = forward(plane)
    spectrum *= np.conj(transfer, out=transfer)
    return spectrum


def _solve(
    spectrum: ComplexArray, blurred: ComplexArray, gain: FloatArray, width: int, coupling: float
) -> None:
    """``X = (conj(K) Y + c V) / (|K|^2 + c |D|^2)``, Eq. 4, in place of `V`.

    `V` is the spectrum of ``D^T v`` and `c` is ``w beta``; `width` that of the plane.
    """
    rows, columns = gradient_power((gain.shape[0], width), gain.dtype)
    for block in row_blocks(gain.shape):
        inverse_gain = coupling * (rows[block, None] + columns)
        inverse_gain += gain[block]
        np.reciprocal(inverse_gain, out=inverse_gain)
        part = spectrum[block]
        part *= coupling
        part += blurred[block]
        part *= inverse_gain


def _shrink_gradient(plane: FloatArray, beta: float, exponent: float) -> None:
    """Replace a periodic plane `x` by ``D^T v``, `v` its shrunk gradient, block by block."""
    first = plane[:1].copy()
    above = _shrunk(first - plane[-1:], beta, exponent)
    for block in row_blocks(plane.shape):
        part = plane[block]
        below = plane[block.stop] if block.stop < len(plane) else first[0]
        across, down = (_shrunk(d, beta, exponent) for d in _differences(part, below))
        np.add(across, down, out=part)
        np.negative(part, out=part)
        part[:, 1:] += across[:, :-1]
        part[:, 0] += across[:, -1]
        part[1:] += down[:-1]
        part[0] += above[0]
        above = down[-1:]


def _differences(part: FloatArray, below: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Forward differences along rows, periodic, and along columns, with the next row below."""
    across, down = np.empty_like(part), np.empty_like(part)
    np.subtract(part[:, 1:], part[:, :-1], out=across[:, :-1])
    np.subtract(part[:, 0], part[:, -1], out=across[:, -1])
    np.subtract(part[1:], part[:-1], out=down[:-1])
    np.subtract(below, part[-1], out=down[-1])
    return across, down


def _shrunk(values: FloatArray, beta: float, exponent: float) -> FloatArray:
    """``argmin_v |v|^alpha + beta/2 (v - values)^2``, Eq. 5, in place."""
    threshold = _threshold(beta, exponent)
    position = np.abs(values)
    position *= TABLE_SIZE / (TABLE_SPAN * threshold)
    shares = _shares(exponent, values.dtype.str).take(position.astype(np.intp), mode="clip")
    values *= shares
    return values


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
