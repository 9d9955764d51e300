"""Responses given by a formula: identity, gamma, sRGB, polynomial, generalized gamma."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import polynomial

from .. import arguments
from .._typing import FloatArray
from .base import ResponseCurve
from .inversion import invert

# Where a formula is checked for strict monotonicity: four times finer than 8 bit, and
# denser towards 0, where responses bend most.
CHECKED = np.linspace(0.0, 1.0, 1025) ** 2
# Gamma or coefficient: far beyond those of any camera, and powers of light keep within floats.
LARGEST = 1e6


def _coefficients(values: Sequence[float]) -> tuple[float, ...]:
    """Of a polynomial, as floats."""
    own = arguments.numbers(values, "coefficients", least=-LARGEST, most=LARGEST)
    if not own:
        raise arguments.refusal("coefficients", values)
    return tuple(map(float, own))


@dataclass(frozen=True, slots=True)
class Identity(ResponseCurve):
    """A linear camera: ``I = E``."""

    def _forward(self, irradiance: FloatArray) -> FloatArray:
        return irradiance

    def _inverse(self, intensity: FloatArray) -> FloatArray:
        return intensity

    def _slope(self, irradiance: FloatArray) -> FloatArray:
        return np.ones_like(irradiance)


@dataclass(frozen=True, slots=True)
class Gamma(ResponseCurve):
    """A power law: ``I = E^(1 / exponent)``.

    Parameters
    ----------
    exponent : float
        Gamma, positive and finite; 2.2 for most displays' inverse.
    """

    exponent: float = 2.2

    def __post_init__(self) -> None:
        arguments.number(
            self.exponent, "a positive gamma exponent", least=1 / LARGEST, most=LARGEST
        )

    def _forward(self, irradiance: FloatArray) -> FloatArray:
        return irradiance ** (1 / self.exponent)

    def _inverse(self, intensity: FloatArray) -> FloatArray:
        return intensity**self.exponent

    def _slope(self, irradiance: FloatArray) -> FloatArray:
        with np.errstate(divide="ignore"):
            return irradiance ** (1 / self.exponent - 1) / self.exponent


@dataclass(frozen=True, slots=True)
class SRGB(ResponseCurve):
    """The sRGB transfer function (IEC 61966-2-1): linear near black, a power 1/2.4 above.

    The joint is placed where the two pieces meet exactly, so that the curve is continuous.
    """

    def _forward(self, irradiance: FloatArray) -> FloatArray:
        # 1.055 x - 0.055, written so that 1 is met exactly.
        power = 1 + 1.055 * (np.maximum(irradiance, SRGB_JOINT) ** (1 / 2.4) - 1)
        return np.where(irradiance <= SRGB_JOINT, 12.92 * irradiance, power)

    def _inverse(self, intensity: FloatArray) -> FloatArray:
        power = (1 + (np.maximum(intensity, 12.92 * SRGB_JOINT) - 1) / 1.055) ** 2.4
        return np.where(intensity <= 12.92 * SRGB_JOINT, intensity / 12.92, power)

    def _slope(self, irradiance: FloatArray) -> FloatArray:
        power = 1.055 / 2.4 * np.maximum(irradiance, SRGB_JOINT) ** (1 / 2.4 - 1)
        return np.where(irradiance <= SRGB_JOINT, 12.92, power)


# Root of 12.92 E = 1.055 E^(1/2.4) - 0.055; the standard prints it rounded, 0.0031308.
SRGB_JOINT = 0.0031306684425005883


@dataclass(frozen=True, slots=True)
class Polynomial(ResponseCurve):
    """Inverse response as a polynomial: ``g(I) = a_1 I + ... + a_n I^n``.

    The form of Kim et al. 2012, Eq. 4, with n = 5 and both ends fixed.

    Parameters
    ----------
    coefficients : tuple of float
        ``a_1 .. a_n``; they sum to 1, and `g` is strictly increasing on [0, 1].
    """

    coefficients: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficients", _coefficients(self.coefficients))
        if abs(sum(self.coefficients) - 1) > 1e-9:  # rounding of a normalized sum
            raise ValueError(f"expected coefficients that sum to 1, got {sum(self.coefficients)}")
        if np.any(np.diff(self._inverse(CHECKED)) <= 0):
            raise ValueError("expected coefficients of a strictly increasing polynomial")

    def _inverse(self, intensity: FloatArray) -> FloatArray:
        return polynomial.polyval(intensity, (0.0, *self.coefficients))

    def _derivative(self, intensity: FloatArray) -> FloatArray:
        return polynomial.polyval(intensity, polynomial.polyder((0.0, *self.coefficients)))

    def _forward(self, irradiance: FloatArray) -> FloatArray:
        return invert(self._inverse, self._derivative, irradiance)

    def _slope(self, irradiance: FloatArray) -> FloatArray:
        with np.errstate(divide="ignore"):
            return 1 / self._derivative(self._forward(irradiance))


@dataclass(frozen=True, slots=True)
class GeneralizedGamma(ResponseCurve):
    """Generalized gamma: ``g(I) = I^(1 / P(I))``, ``P(I) = p_0 + p_1 I + ... + p_n I^n``.

    The g-form of Ng, Chang & Tsui, CVPR 2007; one coefficient is a plain gamma.

    Parameters
    ----------
    coefficients : tuple of float
        ``p_0 .. p_n``; `P` is positive and `g` strictly increasing on [0, 1].
    """

    coefficients: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficients", _coefficients(self.coefficients))
        if np.any(polynomial.polyval(CHECKED, self.coefficients) <= 0):
            raise ValueError("expected coefficients of a polynomial that is positive on [0, 1]")
        if np.any(np.diff(self._inverse(CHECKED)) <= 0):
            raise ValueError("expected coefficients of a strictly increasing curve")

    def _inverse(self, intensity: FloatArray) -> FloatArray:
        return intensity ** (1 / polynomial.polyval(intensity, self.coefficients))

    def _derivative(self, intensity: FloatArray) -> FloatArray:
        # d log g / d log I = 1/P - I log(I) P'/P^2
        p = polynomial.polyval(intensity, self.coefficients)
        dp = polynomial.polyval(intensity, polynomial.polyder(self.coefficients))
        safe = np.maximum(intensity, np.finfo(float).tiny)
        return safe ** (1 / p - 1) * (1 / p - safe * np.log(safe) * dp / p**2)

    def _forward(self, irradiance: FloatArray) -> FloatArray:
        return invert(self._inverse, self._derivative, irradiance)

    def _slope(self, irradiance: FloatArray) -> FloatArray:
        with np.errstate(divide="ignore"):
            return 1 / self._derivative(self._forward(irradiance))
