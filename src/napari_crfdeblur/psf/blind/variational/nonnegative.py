"""A non-negative PSF between two periodic gradients."""

from dataclasses import dataclass

import numpy as np
from scipy import fft

from ...._typing import FloatArray
from ....fourier import ComplexArray, Shape, fast_shape, forward, inverse, power
from ..kernel_fit import around_origin

ROUNDS = 4  # in which values that would be negative are taken out of the fit
STEPS = 24  # of conjugate gradients in each, at most
NEGLIGIBLE = 1e-6  # share of the first residual at which conjugate gradients stop


@dataclass(frozen=True, slots=True, eq=False)
class NonnegativeFit:
    """Minimize ``|k * s - b|^2 + g |k|^2`` over PSFs ``k >= 0`` of a few pixels.

    As :class:`~..kernel_fit.KernelFit`, of the autocorrelation of `s` and its correlation with `b`
    alone; but for gradients that are periodic, and with the bound.

    Parameters
    ----------
    gain : ndarray
        Spectrum of the autocorrelation of `s`, real since that is symmetric, on a grid of at least
        twice the PSF's sides.
    correlation : ndarray, shape (S, S)
        ``sum_x s(x) b(x + u)``, with the shift 0 at the center pixel.
    """

    gain: FloatArray
    correlation: FloatArray

    @classmethod
    def of(
        cls, sharp: ComplexArray, blurred: ComplexArray, shape: Shape, size: int
    ) -> "NonnegativeFit":
        """Fit between the half spectra of `s` and `b`, shape (2, P, Q // 2 + 1), of PSFs S x S."""
        own = fft.irfft2(power(sharp).sum(axis=0), shape)
        cross = fft.irfft2((np.conj(sharp) * blurred).sum(axis=0), shape)
        grid = np.zeros(fast_shape((2 * size, 2 * size)), dtype=own.dtype)
        grid[: 2 * size - 1, : 2 * size - 1] = around_origin(own, size - 1)
        gain = forward(np.roll(grid, (1 - size, 1 - size), axis=(0, 1))).real
        return cls(np.ascontiguousarray(gain), around_origin(cross, size // 2))

    def solve(self, weight: float, start: FloatArray) -> FloatArray:
        """Minimum for the weight `g`: conjugate gradients among the values that are free.

        Those are free that are positive, or would become so.
        """
        psf = start.astype(self.correlation.dtype)
        free = np.ones_like(psf)
        for _ in range(ROUNDS):
            psf = np.maximum(self._among(free, weight, psf), 0)
            free = ((psf > 0) | (self._pull(psf, weight) > 0)).astype(psf.dtype)
        return psf

    def _among(self, free: FloatArray, weight: float, psf: FloatArray) -> FloatArray:
        """Minimum over the values where `free` is 1; the others stay."""
        residual = free * self._pull(psf, weight)
        direction, left = residual, float(np.vdot(residual, residual))
        enough = NEGLIGIBLE * left
        for _ in range(STEPS):
            if left <= enough:
                break
            image = free * self._image(direction, weight)
            step = left / float(np.vdot(direction, image))
            psf = psf + step * direction
            residual = residual - step * image
            before, left = left, float(np.vdot(residual, residual))
            direction = residual + (left / before) * direction
        return psf

    def _pull(self, psf: FloatArray, weight: float) -> FloatArray:
        """Half of the negative gradient."""
        return self.correlation - self._image(psf, weight)

    def _image(self, psf: FloatArray, weight: float) -> FloatArray:
        size = len(psf)
        shape = fast_shape((2 * size, 2 * size))
        plane = np.zeros(shape, dtype=psf.dtype)
        plane[:size, :size] = psf
        spectrum = forward(plane)
        spectrum *= self.gain
        return inverse(spectrum, shape)[:size, :size] + weight * psf
