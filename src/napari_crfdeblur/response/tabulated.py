"""Responses given by samples, joined by straight lines so that they invert exactly."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments
from .._typing import FloatArray
from .base import ResponseCurve


@dataclass(frozen=True, slots=True, eq=False)
class Tabulated(ResponseCurve):
    """Piecewise-linear response through the points ``(irradiance, intensity)``.

    Parameters
    ----------
    irradiance, intensity : ndarray, shape (N,)
        Both strictly increasing from exactly 0 to exactly 1, N at least 2.
    """

    irradiance: FloatArray
    intensity: FloatArray

    def __post_init__(self) -> None:
        for name in ("irradiance", "intensity"):
            values = arguments.kept(getattr(self, name), f"samples of {name}", axes=(1,))
            object.__setattr__(self, name, values)
            if values.size < 2:
                raise ValueError(f"expected at least 2 samples of {name}, got {values.shape}")
            if values[0] != 0 or values[-1] != 1:
                raise ValueError(f"expected {name} from 0 to 1, got {values[0]} to {values[-1]}")
            if np.any(np.diff(values) <= 0):
                raise ValueError(f"expected strictly increasing {name}")
        if self.irradiance.size != self.intensity.size:
            raise ValueError(
                f"expected as many intensities as irradiances, got {self.intensity.size} "
                f"and {self.irradiance.size}"
            )

    def _forward(self, irradiance: FloatArray) -> FloatArray:
        return np.interp(irradiance, self.irradiance, self.intensity)

    def _inverse(self, intensity: FloatArray) -> FloatArray:
        return np.interp(intensity, self.intensity, self.irradiance)

    def _slope(self, irradiance: FloatArray) -> FloatArray:
        gains = np.diff(self.intensity) / np.diff(self.irradiance)
        piece = np.searchsorted(self.irradiance, irradiance, side="right") - 1
        return gains[np.minimum(piece, gains.size - 1)]


def monotone(intensity: ArrayLike, irradiance: ArrayLike) -> Tabulated:
    """Nearest strictly increasing curve to samples that need not be increasing.

    The samples are scaled to run from 0 to 1, made non-decreasing by isotonic regression
    and given a smallest slope, a thousandth of the mean, so that the curve has an inverse.

    Parameters
    ----------
    intensity : array_like, shape (N,)
        Strictly increasing from 0 to 1.
    irradiance : array_like, shape (N,)
        Finite; its last sample is above its first.
    """
    from scipy.optimize import isotonic_regression

    intensity = arguments.kept(intensity, "samples of intensity", axes=(1,))
    raw = arguments.kept(irradiance, "samples of irradiance", axes=(1,))
    if raw.size < 2 or raw.shape != intensity.shape:
        raise ValueError(
            f"expected as many irradiances as intensities, at least 2, "
            f"got {raw.shape} and {intensity.shape}"
        )
    if not 0 < raw[-1] - raw[0] < np.inf:
        raise ValueError("expected irradiance that rises from its first sample to its last")
    inner = np.clip((raw - raw[0]) / (raw[-1] - raw[0]), 0, 1)
    rising = isotonic_regression(inner).x
    rising = (rising + 1e-3 * intensity) / (rising[-1] + 1e-3)
    rising[0], rising[-1] = 0.0, 1.0
    return Tabulated(irradiance=rising, intensity=intensity)
