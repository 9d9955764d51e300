"""What is known of sharp gradients and of PSFs before a picture is seen: two mixtures."""

from dataclasses import dataclass

import numpy as np

from ...._typing import FloatArray

# Gaussians fitted to the gradients of 12 photos in linear light, their contrast scaled to 1, at
# full, half and quarter size; gradients look much the same at all of these.
SHARES = 0.22, 0.38, 0.29, 0.11
DEVIATIONS = 0.0025, 0.0125, 0.054, 0.22
# Exponentials, for PSFs of S x S pixels and sum 1: simulated shakes of 7 to 31 pixels cover some
# 3 S pixels, with values of mean 1 / (3 S); elsewhere they are nearly zero.
COVERED = 3.0
FAINT = 0.03  # mean of the rest, as a share of that of the covered


@dataclass(frozen=True, slots=True)
class GaussianMixture:
    """``p(x) = sum_c p_c N(x | 0, v_c)``: most gradients are small, a few large.

    Fergus et al. (2006), Sec. 4.1.

    Parameters
    ----------
    shares : tuple of float
        ``p_c``, sum 1.
    deviations : tuple of float
        ``sqrt(v_c)``, for a picture of contrast 1.
    """

    shares: tuple[float, ...] = SHARES
    deviations: tuple[float, ...] = DEVIATIONS

    def precision(self, square: FloatArray) -> tuple[FloatArray, float]:
        """Mean of ``1 / v_c`` over the Gaussians that may have made each value, and the bound.

        Parameters
        ----------
        square : ndarray
            ``<x^2>``, expected squares.

        Returns
        -------
        precision : ndarray
            ``sum_c r_c / v_c`` with responsibilities ``r_c ~ p_c v_c^(-1/2) exp(-<x^2> / 2 v_c)``.
        bound : float
            ``sum log sum_c p_c (2 pi v_c)^(-1/2) exp(-<x^2> / 2 v_c)``, at most ``<log p(x)>``.
        """
        total, weighted = np.zeros_like(square), np.zeros_like(square)
        for share, deviation in zip(self.shares, self.deviations, strict=True):
            likely = square * np.float32(-0.5 / deviation**2)
            np.exp(likely, out=likely)
            likely *= share / (np.sqrt(2 * np.pi) * deviation)
            total += likely
            likely /= deviation**2
            weighted += likely
        # Far beyond all Gaussians every term underflows; then the widest alone counts.
        np.maximum(total, np.finfo(square.dtype).tiny, out=total)
        np.maximum(weighted, total / max(self.deviations) ** 2, out=weighted)
        return weighted / total, float(np.log(total).sum(dtype=np.float64))


@dataclass(frozen=True, slots=True)
class ExponentialMixture:
    """``p(k) = sum_d p_d l_d exp(-l_d k)`` for ``k >= 0``: most of a PSF is empty.

    Fergus et al. (2006), Sec. 4.1.

    Parameters
    ----------
    shares : tuple of float
        ``p_d``, sum 1.
    means : tuple of float
        ``1 / l_d``.
    """

    shares: tuple[float, ...]
    means: tuple[float, ...]

    @classmethod
    def for_size(cls, size: int) -> "ExponentialMixture":
        """Prior for PSFs of `size` x `size` pixels and sum about 1."""
        covered = min(COVERED / size, 0.5)
        bright = 1 / (size * size * covered)
        return cls((covered, 1 - covered), (bright, FAINT * bright))

    def rate(self, mean: FloatArray) -> tuple[FloatArray, float]:
        """Mean of ``l_d`` over the exponentials that may have made each value, and the bound.

        Parameters
        ----------
        mean : ndarray
            ``<k>``, expected values.

        Returns
        -------
        rate : ndarray
            ``sum_d r_d l_d`` with responsibilities ``r_d ~ p_d l_d exp(-l_d <k>)``.
        bound : float
            ``sum log sum_d p_d l_d exp(-l_d <k>)``, at most ``<log p(k)>``.
        """
        rates = 1 / np.array(self.means)
        logs = np.log(self.shares * rates) - rates * mean[..., np.newaxis]
        largest = logs.max(axis=-1, keepdims=True)
        likely = np.exp(logs - largest)
        total = likely.sum(axis=-1)
        bound = float((np.log(total) + largest[..., 0]).sum())
        return np.asarray((likely @ rates) / total), bound
