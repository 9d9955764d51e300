"""The band of an estimate: what resampled edges say, and the prior where no edge speaks."""

from collections.abc import Sequence

import numpy as np

from .._typing import FloatArray
from ..profiles.base import ProfileGroup
from ..response import dorf_mean, emor_table
from ..response.prior import DORF_DEVIATIONS

BAND_SAMPLES = 257  # intensities at which a band is kept
TWO_SIDED_95 = 1.96  # standard deviations of a normal distribution


def covered_range(groups: Sequence[ProfileGroup]) -> tuple[float, float]:
    """Range of intensity that profiles cover: 1st to 99th percentile of their samples."""
    samples = np.concatenate([g.intensity.ravel() for g in groups])
    low, high = np.percentile(samples, [1, 99])
    return float(low), float(high)


def band(
    intensity: FloatArray, curves: FloatArray, center: FloatArray, covered: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    """95 % band of the irradiance around an estimate.

    Parameters
    ----------
    intensity : ndarray, shape (N,)
        Where the band is wanted.
    curves : ndarray, shape (R, N)
        Inverse responses found from resampled edges.
    center : ndarray, shape (N,)
        The estimate.
    covered : (float, float)
        Outside this range of intensity the band also spans the prior's.

    Returns
    -------
    lower, upper : ndarray, shape (N,)
    """
    deviation = np.sqrt(np.mean((curves - center) ** 2, axis=0)) if len(curves) else 0 * center
    lower, upper = center - TWO_SIDED_95 * deviation, center + TWO_SIDED_95 * deviation
    outside = (intensity < covered[0]) | (intensity > covered[1])
    prior_lower, prior_upper = prior_band(intensity)
    lower = np.where(outside, np.minimum(lower, prior_lower), lower)
    upper = np.where(outside, np.maximum(upper, prior_upper), upper)
    return np.clip(lower, 0, 1), np.clip(upper, 0, 1)


def prior_band(intensity: FloatArray) -> tuple[FloatArray, FloatArray]:
    """95 % band of the irradiance over the cameras of DoRF, to first order."""
    mean = dorf_mean()
    irradiance = mean.to_irradiance(intensity)
    basis = emor_table()[1 : 1 + len(DORF_DEVIATIONS)]
    spread = np.sqrt(np.square(DORF_DEVIATIONS) @ np.square(basis))
    of_intensity = np.interp(irradiance, np.linspace(0, 1, spread.size), spread)
    deviation = TWO_SIDED_95 * of_intensity / mean.slope(irradiance)
    return irradiance - deviation, irradiance + deviation


def share_of_prior(intensity: FloatArray, width: FloatArray, covered: tuple[float, float]) -> float:
    """Width of a band over the covered range, as a share of the prior's; 1 without a range.

    Parameters
    ----------
    intensity, width : ndarray, shape (N,)
        Where the band is sampled, and how wide it is there.
    covered : (float, float)
        Range of intensity that counts.
    """
    inside = (intensity >= covered[0]) & (intensity <= covered[1])
    lower, upper = prior_band(intensity[inside])
    known = float((upper - lower).sum())
    return float(width[inside].sum()) / known if known > 0 else 1.0
