"""Wiener deconvolution: linear, in one step."""

from dataclasses import dataclass

import numpy as np

from .._typing import FloatArray
from ..boundary import extending
from ..fourier import (
    ComplexArray,
    Shape,
    forward,
    gradient_power,
    inverse,
    otf,
    power,
    row_blocks,
)
from ..progress import Job, Progress
from .base import Deconvolver
from .noise import LEAST_NOISE, check_weight, relative_noise

WEIGHT_OF_NOISE = 60.0  # best on average over pictures, PSFs and noise of .002 to .03


@dataclass(frozen=True, slots=True)
class Wiener(Deconvolver):
    """Linear deconvolution, ``X = conj(K) Y / (|K|^2 + w |D|^2)``.

    The filter of Wiener (1949) for white noise and the power spectrum of natural pictures,
    which falls as ``1 / |D|^2`` with the frequency (Field 1987); `D` is the difference of
    neighboring pixels. Commutes with shifts and with affine changes of the plane.

    Parameters
    ----------
    weight : float, optional
        `w`, noise-to-signal ratio at one radian per pixel. By default it follows from the
        noise level of the plane.
    model_error : float
        Least noise that is reckoned with, as a share of the contrast: it stands for the errors
        of the PSF and the response, rounding and compression. With an estimated PSF give .01.
    """

    weight: float | None = None
    model_error: float = LEAST_NOISE

    def __post_init__(self) -> None:
        check_weight(self.weight, self.model_error)

    def run(self, plane: FloatArray, psf: FloatArray) -> Job[FloatArray]:
        """Long job: deconvolve a plane of shape (M, N) with a checked PSF."""
        reports = (Progress("Wiener filter", done, 4) for done in range(5))
        yield (start := next(reports))
        extended = yield from extending(plane, psf, start)
        yield next(reports)
        weight = self.weight or WEIGHT_OF_NOISE * relative_noise(plane, self.model_error) ** 2
        transfer = otf(psf, extended.shape, plane.dtype)
        yield next(reports)
        spectrum = forward(extended)
        _filter(spectrum, transfer, extended.shape, weight)
        yield next(reports)
        sharp = inverse(spectrum, extended.shape)[: plane.shape[0], : plane.shape[1]]
        yield next(reports)
        return np.ascontiguousarray(sharp)


def _filter(spectrum: ComplexArray, transfer: ComplexArray, shape: Shape, weight: float) -> None:
    """Multiply by ``conj(K) / (|K|^2 + w |D|^2)``, in place."""
    rows, columns = gradient_power(shape, transfer.real.dtype)
    for block in row_blocks(spectrum.shape):
        part = np.conj(transfer[block])
        part *= 1 / (power(part) + weight * (rows[block, None] + columns))
        spectrum[block] *= part
