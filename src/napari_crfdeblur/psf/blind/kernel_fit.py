"""The PSF between two gradients: the fast least-squares fit, and its sparse refinement."""

from dataclasses import dataclass

import numpy as np
from scipy import fft

from ..._typing import BoolArray, FloatArray
from ...fourier import ComplexArray, convolve, fast_shape, forward

STEPS = 30  # of conjugate gradients at most
NEGLIGIBLE = 1e-8  # share of the initial energy at which conjugate gradients stop
SPARSE_STEPS = 3  # reweightings for each support, and supports: the paper's loops
LEAST = 1e-3  # of the peak: keeps the weight 1 / |k| finite


@dataclass(frozen=True, slots=True, eq=False)
class KernelFit:
    """Minimize ``1/2 |k * s - b|^2 + g/2 |k|^2`` over PSFs `k` of a few pixels.

    Xu & Jia (2010), Sec. 3.1, where `s` are predicted gradients of the sharp picture and `b`
    those of the blurred one. All that the pictures have to say is in the autocorrelation of
    `s` and its correlation with `b`, as far as the PSF reaches: two transforms of each
    picture, and then a small convolution for every step of conjugate gradients. Unlike the
    paper's quotient of transforms, this fits within the support and not around it.

    Parameters
    ----------
    transfer : ndarray
        Half spectrum of the autocorrelation ``a`` of `s`, on a small grid.
    correlation : ndarray, shape (S, S)
        ``sum_x s(x) b(x + u)``, with the shift 0 at the center pixel.
    energy : float
        ``|b|^2``.
    """

    transfer: ComplexArray
    correlation: FloatArray
    energy: float

    @classmethod
    def of(cls, sharp: FloatArray, blurred: FloatArray, size: int) -> "KernelFit":
        """Fit between gradients of shape (2, M, N), for PSFs of `size` pixels."""
        padded = fast_shape((sharp.shape[1] + size, sharp.shape[2] + size))
        edges, measured = fft.rfft2(sharp, padded), fft.rfft2(blurred, padded)
        own = fft.irfft2((np.square(edges.real) + np.square(edges.imag)).sum(axis=0), padded)
        cross = fft.irfft2((np.conj(edges) * measured).sum(axis=0), padded)
        small = fast_shape((3 * size, 3 * size))
        grid = np.zeros(small)
        grid[: 2 * size - 1, : 2 * size - 1] = around_origin(own, size - 1)
        grid = np.roll(grid, (1 - size, 1 - size), axis=(0, 1))
        energy = float(np.square(blurred, dtype=np.float64).sum())
        return cls(forward(grid), around_origin(cross, size // 2).astype(np.float64), energy)

    def blurred_twice(self, psf: FloatArray) -> FloatArray:
        """``a * k``, the gradient of the quadratic term, within the support."""
        rows, columns = psf.shape
        plane = np.zeros(fast_shape((3 * rows, 3 * columns)))
        plane[:rows, :columns] = psf
        return convolve(plane, self.transfer)[:rows, :columns]

    def residual(self, psf: FloatArray) -> float:
        """``|k * s - b|^2 / |b|^2``: the share of the blurred gradient left unexplained."""
        fitted = np.vdot(psf, self.blurred_twice(psf)) - 2 * np.vdot(psf, self.correlation)
        return float(1 + fitted / self.energy)

    def solve(self, weight: FloatArray | float, start: FloatArray | None = None) -> FloatArray:
        """Minimum for the weight `g`, which can differ between pixels; can be negative."""
        psf = np.zeros_like(self.correlation) if start is None else start.copy()
        residual = self.correlation - self.blurred_twice(psf) - weight * psf
        direction, left = residual.copy(), float(np.vdot(residual, residual))
        enough = NEGLIGIBLE * float(np.vdot(self.correlation, self.correlation))
        for _ in range(STEPS):
            if left <= enough:
                break
            image = self.blurred_twice(direction) + weight * direction
            step = left / float(np.vdot(direction, image))
            psf += step * direction
            residual -= step * image
            before, left = left, float(np.vdot(residual, residual))
            direction = residual + (left / before) * direction
        return psf

    def refine(self, psf: FloatArray, weight: float) -> FloatArray:
        """Second phase: sparse where the PSF is faint, free on its detected support.

        Iterative support detection, Xu & Jia (2010), Algorithm 2: minimizes
        ``1/2 |k * s - b|^2 + g sum |k|`` over the pixels outside the support, by reweighted
        least squares.
        """
        for _ in range(SPARSE_STEPS):
            outside = ~support(psf)
            for _ in range(SPARSE_STEPS):
                peak = psf.max()
                sparse = peak / np.maximum(psf, LEAST * peak)
                psf = np.maximum(self.solve(weight * (outside * sparse + LEAST), psf), 0)
        return psf


def support(psf: FloatArray) -> BoolArray:
    """Pixels above the first significant jump of the sorted values: Xu & Jia (2010), Sec. 3.2."""
    values = np.sort(psf, axis=None)
    jumps = np.flatnonzero(np.diff(values) > psf.max() / (2 * len(psf)))
    return psf > (values[jumps[0]] if jumps.size else 0)


def around_origin(periodic: FloatArray, reach: int) -> FloatArray:
    """The values up to `reach` pixels around the origin of a periodic plane."""
    rows, columns = (np.arange(-reach, reach + 1) % side for side in periodic.shape)
    return periodic[np.ix_(rows, columns)]
