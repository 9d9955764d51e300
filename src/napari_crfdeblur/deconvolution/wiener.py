"""Wiener deconvolution: linear, in one step."""

from dataclasses import dataclass

from .. import arrays
from .._typing import BoolArray, FloatArray
from ..boundary import extending, frame
from ..fourier import (
    ComplexArray,
    forward,
    gradient_power,
    inverse,
    kept_otf,
    laplacian_power,
    power,
)
from ..progress import Job, Progress
from .highlights import filling
from .noise import PlaneStatistics
from .recorded import Missing
from .regularized import Regularized

FILLINGS = 4  # of pixels that are worth less, as many as a splitting method has stages, less two


@dataclass(frozen=True, slots=True)
class Wiener(Regularized):
    """Linear deconvolution, ``X = conj(K) Y / (|K|^2 + w |D|^2)``.

    The filter of Wiener (1949) for white noise and the power spectrum of natural pictures,
    which falls as ``1 / |D|^2`` with the frequency (Field 1987); `D` is the difference of
    neighboring pixels. Commutes with shifts and with affine changes of the plane.

    Parameters
    ----------
    weight : float, optional
        `w`, noise-to-signal ratio at one radian per pixel. By default it follows from the
        noise level and the errors of the plane.
    model_error : float, optional
        Least noise that is reckoned with, as a share of the contrast; by default measured.
    """

    FACTOR = 60.0  # best on average over pictures, PSFs and noise of .002 to .03

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
        reports = (Progress("Wiener filter", done, 4) for done in range(5))
        yield (start := next(reports))
        _, weight = self.judge(plane, psf, clipped, statistics)
        filled = yield from filling(plane, psf, clipped, start)
        extended = yield from extending(filled.plane, psf, start)
        yield next(reports)
        transfer = kept_otf(psf, extended.shape, plane)
        yield next(reports)
        sharp = _filtered(extended, transfer, weight)
        yield (at := next(reports))
        if weights is not None:
            missing = Missing(extended, transfer, weights)
            for _ in range(FILLINGS):
                yield from missing.filling(sharp, at)
                sharp = _filtered(missing.light, transfer, weight)
                yield at
        yield next(reports)
        result: FloatArray = arrays.contiguous(sharp[frame(plane.shape)])
        return result


def _filtered(extended: FloatArray, transfer: ComplexArray, weight: float) -> FloatArray:
    spectrum = forward(extended)
    _filter(spectrum, transfer, extended.shape, weight)
    return inverse(spectrum, extended.shape)


def _filter(
    spectrum: ComplexArray, transfer: ComplexArray, shape: tuple[int, ...], weight: float
) -> None:
    """Multiply by ``conj(K) / (|K|^2 + w |D|^2)``, in place."""
    xp = arrays.namespace(spectrum)
    powers = gradient_power(shape, xp.real(spectrum))
    for block in arrays.blocks(spectrum):
        part = xp.conj(transfer[block, ...])
        part *= 1 / (power(part) + weight * laplacian_power(powers, block))
        spectrum[block, ...] *= part
