"""What is known of the PSF: a rectified Gaussian for each of its pixels."""

from dataclasses import dataclass

import numpy as np
from scipy.special import erfcx, log_ndtr

from ...._typing import FloatArray
from ....fourier import convolve, fast_shape, forward
from .priors import ExponentialMixture

SWEEPS = 4  # over all pixels in each update
FAR = 100.0  # deviations beyond which a rectified Gaussian is an exponential, to 1e-7


@dataclass(frozen=True, slots=True, eq=False)
class KernelPosterior:
    """``q(k_j) ~ exp(-a k_j^2 / 2 + b_j k_j)`` for ``k_j >= 0``, independent pixels.

    Miskin & MacKay (2000, Ensemble learning for blind image separation and deconvolution).

    Parameters
    ----------
    precision : float
        `a`, the same for all pixels.
    slope : ndarray, shape (S, S)
        ``b_j``.
    mean, variance : ndarray, shape (S, S)
        Of the rectified Gaussians.
    """

    precision: float
    slope: FloatArray
    mean: FloatArray
    variance: FloatArray

    @classmethod
    def known(cls, psf: FloatArray) -> "KernelPosterior":
        """A PSF to start with, in which there is no doubt."""
        return cls(np.inf, np.zeros_like(psf), psf, np.zeros_like(psf))

    @property
    def power(self) -> float:
        """``sum_j <k_j^2>``."""
        return float(np.square(self.mean).sum() + self.variance.sum())

    @property
    def energy(self) -> float:
        """``sum_j <log q(k_j)>``, the entropy with its sign turned."""
        a, b = self.precision, self.slope
        t = -b / np.sqrt(a)
        volume = 0.5 * np.log(2 * np.pi / a) + 0.5 * t * t + log_ndtr(-t)
        second = np.square(self.mean) + self.variance
        return float((b * self.mean - 0.5 * a * second - volume).sum())

    def updated(
        self,
        own: FloatArray,
        cross: FloatArray,
        spread: float,
        noise: float,
        prior: ExponentialMixture,
    ) -> "KernelPosterior":
        """Each pixel in turn at its best, the others as they are.

        Parameters
        ----------
        own : ndarray, shape (2 S - 1, 2 S - 1)
            Autocorrelation of the mean gradients of the sharp picture, shift 0 in the middle.
        cross : ndarray, shape (S, S)
            Their correlation with the blurred gradients, shift 0 in the middle.
        spread : float
            Sum of the variances of the sharp gradients.
        noise : float
            Variance of the noise.
        prior : ExponentialMixture
        """
        size = len(self.mean)
        middle = own[size - 1, size - 1]
        precision = (middle + spread) / noise
        mean = self.mean.copy()
        # ``cross - own * mean``, kept up to date while the pixels change
        left = cross - _product(own, mean)
        slope = np.empty_like(mean)
        deviation = 1 / np.sqrt(precision)
        for _ in range(SWEEPS):
            rate, _ = prior.rate(mean)
            for row, column in np.ndindex(size, size):
                before = mean[row, column]
                b = (left[row, column] + middle * before) / noise - rate[row, column]
                after = _mean(-b * deviation) * deviation
                slope[row, column] = b
                mean[row, column] = after
                window = own[
                    size - 1 - row : 2 * size - 1 - row, size - 1 - column : 2 * size - 1 - column
                ]
                left -= (after - before) * window
        variance = _variance(-slope * deviation) * deviation**2
        return KernelPosterior(float(precision), slope, mean, variance)


def _mean(t: float) -> float:
    """Mean of a Gaussian of deviation 1 and mode `-t`, cut at 0."""
    if t > FAR:
        return (1 - 2 / t**2) / t
    return float(np.sqrt(2 / np.pi) / erfcx(t / np.sqrt(2))) - t


def _variance(t: FloatArray) -> FloatArray:
    """Variance of the same."""
    hazard = np.sqrt(2 / np.pi) / erfcx(np.minimum(t, FAR) / np.sqrt(2))
    near = 1 + t * hazard - hazard**2
    # The difference would lose all digits.
    far = np.maximum(t, 1.0)
    return np.asarray(np.where(t > FAR, (1 - 6 / far**2) / far**2, near))


def _product(own: FloatArray, values: FloatArray) -> FloatArray:
    """``sum_l own(j - l) values(l)`` for every pixel `j` of a PSF."""
    size = len(values)
    planes = np.zeros((2, *fast_shape((3 * size, 3 * size))))
    planes[0, : 2 * size - 1, : 2 * size - 1] = own
    planes[1, :size, :size] = values
    inside = slice(size - 1, 2 * size - 1)
    return convolve(planes[1], forward(planes[0]))[inside, inside]
