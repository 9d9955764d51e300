"""What a blurred gradient says of the sharp one and of the PSF together, step by step."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import fft

from ...._typing import BoolArray, FloatArray
from ....fourier import ComplexArray, Shape, fast_shape, otf, power
from ..blurred import Blurred
from ..edge_prediction import gradient
from ..kernel_fit import around_origin
from .kernel_posterior import KernelPosterior
from .priors import ExponentialMixture, GaussianMixture

STEPS = 3  # of conjugate gradients in each update; the next one goes on from there


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredGradient:
    """Gradient of a blurred picture on a torus that is larger by the PSF.

    Parameters
    ----------
    values : ndarray, shape (2, P, Q)
        Differences along rows and along columns, float32; 0 where not known.
    known : ndarray of bool, shape (2, P, Q)
        Where they were measured: within the picture, away from clipped pixels.
    """

    values: FloatArray
    known: BoolArray

    @classmethod
    def of(cls, blurred: Blurred, size: int) -> "MeasuredGradient":
        """For PSFs of `size` x `size` pixels."""
        rows, columns = blurred.plane.shape
        shape = fast_shape((rows + size - 1, columns + size - 1))
        known = np.zeros((2, *shape), dtype=bool)
        known[0, : rows - 1, :columns] = known[1, :rows, : columns - 1] = True
        if blurred.usable is not None:
            known[:, :rows, :columns] &= blurred.usable >= 1
        values = np.zeros(known.shape, np.float32)
        values[:, :rows, :columns] = gradient(blurred.plane)
        values[~known] = 0
        return cls(values, known)

    @property
    def shape(self) -> Shape:
        """(P, Q)."""
        return self.values.shape[1], self.values.shape[2]

    @property
    def count(self) -> float:
        """How many values were measured."""
        return float(self.known.sum())

    @property
    def energy(self) -> float:
        """Mean of their squares."""
        return _energy(self.values) / self.count


@dataclass(frozen=True, slots=True, eq=False)
class Ensemble:
    """``q(x) q(k) q(y)``: sharp gradient, PSF and the gradient that was not measured.

    Fergus, Singh, Hertzmann, Roweis & Freeman (2006, Removing camera shake from a single
    photograph, SIGGRAPH), Sec. 4.1, after Miskin & MacKay (2000): of ::

        y = k * x + n

    the blurred gradient `y` is known, the sharp one `x` is drawn from a mixture of Gaussians, the
    PSF `k` from one of exponentials, the noise `n` from a Gaussian of unknown variance `v`. The
    posterior is approached by a product over all pixels, of least free energy
    ``<log q - log p>``; one factor after the other is improved while the others rest::

        q(x_i) = N(m_i, s_i),   1 / s_i = w_i + sum_j <k_j^2> / v,
        (K' K / v + sum_j var(k_j) / v + w) m = K' <y> / v,   K the convolution with <k>,
        q(k_j) ~ exp(-a k_j^2 / 2 + b_j k_j), k_j >= 0,   a = sum_i <x_i^2> / v,
        b_j = sum_i m_i (<y> - sum_(l != j) <k_l> m)_(i + j) / v - l_j,
        v = <|y - k * x|^2> / number of measured values,

    where ``w_i`` and ``l_j`` are what the mixtures say of a value as large
    (:mod:`~.priors`). What was not measured, beyond the borders and where the camera clipped, is
    unknown like the rest, with ``<y> = K m`` there; so every sum goes over a torus and is a
    product of transforms.

    Parameters
    ----------
    mean, variance : ndarray, shape (2, P, Q)
        ``m``, ``s``.
    filled : ndarray, shape (2, P, Q)
        ``<y>``.
    kernel : KernelPosterior
    noise : float
        `v`.
    """

    mean: FloatArray
    variance: FloatArray
    filled: FloatArray
    kernel: KernelPosterior
    noise: float

    @classmethod
    def start(cls, measured: MeasuredGradient, psf: FloatArray, noise: float) -> "Ensemble":
        """Nothing known of the sharp gradient, the PSF given."""
        empty = np.zeros_like(measured.values)
        kernel = KernelPosterior.known(psf)
        return cls(empty, np.full_like(empty, noise), measured.values, kernel, noise)

    def sharpened(self, measured: MeasuredGradient, prior: GaussianMixture) -> "Ensemble":
        """The sharp gradient updated, and what was not measured."""
        precision, _ = prior.precision(np.square(self.mean) + self.variance)
        transfer = otf(self.kernel.mean, measured.shape)
        certain = float(self.kernel.variance.sum()) / self.noise
        system = System(transfer, power(transfer) / np.float32(self.noise), precision + certain)
        diagonal = precision + np.float32(self.kernel.power / self.noise)
        spectrum = fft.rfft2(self.filled) * np.conj(transfer) / np.float32(self.noise)
        mean = system.solve(fft.irfft2(spectrum, measured.shape), self.mean, diagonal)
        predicted = fft.irfft2(fft.rfft2(mean) * transfer, measured.shape)
        filled = np.where(measured.known, measured.values, predicted)
        return replace(self, mean=mean, variance=1 / diagonal, filled=filled)

    def with_noise(self, measured: MeasuredGradient, least: float = 0.0) -> "Ensemble":
        """The variance of the noise updated, to no less than `least` times what it was."""
        best = self.misfit(measured) / measured.count
        return replace(self, noise=max(best, least * self.noise))

    def misfit(self, measured: MeasuredGradient) -> float:
        """``<|y - k * x|^2>``."""
        transfer = otf(self.kernel.mean, measured.shape)
        predicted = fft.irfft2(fft.rfft2(self.mean) * transfer, measured.shape)
        squares, spread = _energy(self.mean), float(self.variance.sum(dtype=np.float64))
        doubt = float(self.kernel.variance.sum()) * (squares + spread)
        certain = float(np.square(self.kernel.mean).sum())
        return _energy(self.filled - predicted) + certain * spread + doubt

    def fitted(self, prior: ExponentialMixture) -> "Ensemble":
        """The PSF updated."""
        size = len(self.kernel.mean)
        spectrum, filled = fft.rfft2(self.mean), fft.rfft2(self.filled)
        own = fft.irfft2(power(spectrum).sum(axis=0), self.mean.shape[1:])
        cross = fft.irfft2((np.conj(spectrum) * filled).sum(axis=0), self.mean.shape[1:])
        spread = float(self.variance.sum(dtype=np.float64))
        kernel = self.kernel.updated(
            around_origin(own, size - 1).astype(np.float64),
            around_origin(cross, size // 2).astype(np.float64),
            spread,
            self.noise,
            prior,
        )
        return replace(self, kernel=kernel)

    def free_energy(
        self, measured: MeasuredGradient, gradients: GaussianMixture, kernels: ExponentialMixture
    ) -> float:
        """``<log q - log p>``, less what is constant; each update lowers it."""
        fit = self.misfit(measured) / (2 * self.noise)
        noise = fit + measured.count / 2 * float(np.log(self.noise))
        squares = np.square(self.mean) + self.variance
        entropy = 0.5 * float(np.log(self.variance).sum(dtype=np.float64))
        sharp = -gradients.precision(squares)[1] - entropy
        return noise + sharp + self.kernel.energy - kernels.rate(self.kernel.mean)[1]


@dataclass(frozen=True, slots=True, eq=False)
class System:
    """``(K' K / v + w) m`` and the equations with it.

    Parameters
    ----------
    transfer : ndarray, shape (P, Q // 2 + 1)
    gain : ndarray, shape (P, Q // 2 + 1)
        ``|K|^2 / v``.
    precision : ndarray, shape (2, P, Q)
        `w`.
    """

    transfer: ComplexArray
    gain: FloatArray
    precision: FloatArray

    def product(self, values: FloatArray) -> FloatArray:
        """The left side."""
        spectrum = fft.rfft2(values)
        spectrum *= self.gain
        image: FloatArray = fft.irfft2(spectrum, values.shape[1:], overwrite_x=True)
        image += self.precision * values
        return image

    def solve(self, right: FloatArray, start: FloatArray, diagonal: FloatArray) -> FloatArray:
        """A few steps of conjugate gradients, preconditioned by the diagonal.

        Every step lowers ``1/2 m' A m - b' m``, so that a few are enough in each update.
        """
        values, residual = start.copy(), right - self.product(start)
        scaled = residual / diagonal
        direction, left = scaled.copy(), _dot(residual, scaled)
        for _ in range(STEPS):
            image = self.product(direction)
            step = np.float32(left / max(_dot(direction, image), TINY))
            values += step * direction
            residual -= step * image
            scaled = residual / diagonal
            before, left = left, _dot(residual, scaled)
            direction = scaled + np.float32(left / max(before, TINY)) * direction
        return values


TINY = float(np.finfo(np.float32).tiny)


def _dot(first: FloatArray, second: FloatArray) -> float:
    return float(np.vdot(first, second))


def _energy(values: FloatArray) -> float:
    return _dot(values, values)
