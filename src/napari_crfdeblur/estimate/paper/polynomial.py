"""The inverse response as a polynomial, and what the paper asks of it besides the data.

Kim et al. 2012, Eq. 4 and 10: ``g(I) = a_0 + a_1 I + ... + a_n I^n``, with a boundary term
``g(0)^2 + (g(1) - 1)^2`` and a count of the steps between 256 levels that do not rise.
"""

from functools import cache

import numpy as np

from ..._typing import FloatArray
from ...response import Tabulated, dorf_mean, monotone

LEVELS = 256  # as in the paper: the levels of an 8-bit photo
ENDS_WEIGHT = 100.0  # lambda_1 of the paper, against data terms of the order of 1
CURVE_SAMPLES = 1025  # straight lines between so many samples of g err by 1e-6


def powers(intensity: FloatArray, degree: int) -> FloatArray:
    """``I^0 .. I^n`` of intensities of any shape, in a new last axis of length n + 1."""
    base = np.asarray(intensity, dtype=np.float64)[..., None]
    factors = np.where(np.arange(degree + 1) == 0, 1.0, base)
    return np.multiply.accumulate(factors, axis=-1)  # many times faster than powers


@cache
def dorf_mean_coefficients(degree: int, power: float = 1.0) -> FloatArray:
    """Coefficients of the polynomial nearest to the DoRF mean, where the search starts.

    A power other than 1 gives the polynomial nearest to that power of the mean.
    """
    levels = np.linspace(0, 1, LEVELS)
    mean = dorf_mean().to_irradiance(levels) ** power
    fit: FloatArray = np.linalg.lstsq(powers(levels, degree), mean, rcond=None)[0]
    fit.setflags(write=False)
    return fit


@cache
def well_scaled(degree: int) -> FloatArray:
    """Change of variables ``a = T c`` for a search over `c` by the gradient.

    Powers are nearly dependent, and the boundary term is much steeper than the data. In `c`,
    the mean square of g plus ``ENDS_WEIGHT (g(0)^2 + g(1)^2)`` is the sum of squares.
    """
    samples = powers(np.linspace(0, 1, LEVELS), degree)
    ends = np.sqrt(ENDS_WEIGHT) * samples[[0, -1]]
    upper = np.linalg.qr(np.concatenate([samples / np.sqrt(LEVELS), ends]), mode="r")
    return np.linalg.inv(upper)


def boundary(coefficients: FloatArray) -> tuple[float, FloatArray]:
    """``g(0)^2 + (g(1) - 1)^2`` and its gradient."""
    low, high = coefficients[0], coefficients.sum() - 1
    gradient = np.full(coefficients.size, 2 * high)
    gradient[0] += 2 * low
    return float(low**2 + high**2), gradient


def falling_steps(coefficients: FloatArray) -> tuple[float, FloatArray]:
    """Smooth count of the steps of g that fall, and its gradient.

    A step that falls by as much as g rises on average counts as 1, lesser ones as the square
    of that share: the paper's count has no gradient to follow.
    """
    steps = _steps(coefficients.size - 1)
    fall = np.minimum(steps @ coefficients, 0)
    return float(fall @ fall), 2 * fall @ steps


@cache
def _steps(degree: int) -> FloatArray:
    """Rows that give the steps of g between 256 levels, in units of the average step."""
    levels = np.linspace(0, 1, LEVELS)
    return np.diff(powers(levels, degree), axis=0) * (LEVELS - 1)


def as_curve(coefficients: FloatArray) -> Tabulated:
    """The response of which the polynomial is the inverse, made strictly increasing."""
    intensity = np.linspace(0, 1, CURVE_SAMPLES)
    return monotone(intensity, powers(intensity, coefficients.size - 1) @ coefficients)


def rises(coefficients: FloatArray) -> bool:
    """Whether the polynomial ends above its start, so that a response can be made of it."""
    return bool(np.isfinite(coefficients).all() and coefficients[1:].sum() > 0)
