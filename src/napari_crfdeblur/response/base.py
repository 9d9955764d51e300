"""What a camera response is: a strictly increasing map of [0, 1] onto [0, 1]."""

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments
from .._typing import FloatArray


class ResponseCurve(ABC):
    """Camera response `f`: intensity ``I = f(E)``, irradiance ``E = g(I)``, ``g = f^-1``.

    Irradiance and intensity are relative, both in [0, 1]; values outside are clipped to it.
    Every curve is strictly increasing, with ``f(0) = 0`` and ``f(1) = 1``, and its two
    directions undo each other to rounding.
    """

    __slots__ = ()

    @abstractmethod
    def _forward(self, irradiance: FloatArray) -> FloatArray: ...

    @abstractmethod
    def _inverse(self, intensity: FloatArray) -> FloatArray: ...

    @abstractmethod
    def _slope(self, irradiance: FloatArray) -> FloatArray: ...

    def to_intensity(self, irradiance: ArrayLike) -> FloatArray:
        """Record light: ``I = f(E)``, as float64 of the same shape."""
        return self._forward(_unit(irradiance))

    def to_irradiance(self, intensity: ArrayLike) -> FloatArray:
        """Undo the response: ``E = g(I)``, as float64 of the same shape."""
        return self._inverse(_unit(intensity))

    def slope(self, irradiance: ArrayLike) -> FloatArray:
        """Gain of the camera: ``dI / dE`` at the given irradiance (can be infinite at 0)."""
        return self._slope(_unit(irradiance))


def _unit(values: ArrayLike) -> FloatArray:
    given = np.asarray(arguments.array(values, "real numbers"), dtype=np.float64)
    if np.isnan(given).any():
        raise ValueError("expected real numbers, got some that are NaN")
    return np.clip(given, 0.0, 1.0)
