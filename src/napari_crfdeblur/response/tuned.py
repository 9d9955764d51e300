"""A response tuned by hand: another curve, moved along the EMoR basis and by a gamma."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from .. import arguments
from .._typing import FloatArray
from .base import ResponseCurve
from .basis import LARGEST, emor_sum
from .parametric import CHECKED, Gamma
from .tabulated import Tabulated

# Where the EMoR curves are sampled, and more densely towards 0, where the base may bend more
# than straight lines between 1024 equal steps of irradiance could follow.
STEPS = np.linspace(0.0, 1.0, 1024)
IRRADIANCE = np.union1d(STEPS, CHECKED)
# Share of the base's slope that :func:`tuned` leaves it everywhere.
LEAST_SLOPE = 0.01
# Stands for 0 where a slope is the product of two, of which one can be 0, the other infinite.
NEXT_TO_0 = 1e-30


@dataclass(frozen=True, slots=True)
class Tuned(ResponseCurve):
    """Another response, tuned: ``g(I) = g_o(I)^gamma``, ``f_o = f_base + sum_i o_i h_i``.

    `h_i` are the EMoR basis curves (Grossberg & Nayar, TPAMI 2004, Eq. 9) and `g_o` is the
    inverse of `f_o`, piecewise linear between samples at the 1024 of the EMoR table and
    denser ones towards 0. Without offsets, `f_o` is the base itself.

    Parameters
    ----------
    base : ResponseCurve
        The curve that is tuned, for example an estimate.
    offsets : tuple of float
        ``o_1 .. o_n``, n at most 25; `f_o` must be strictly increasing.
    gamma : float
        Positive; the irradiance is raised to it after the response was undone.
    """

    base: ResponseCurve
    offsets: tuple[float, ...] = ()
    gamma: float = 1.0
    _moved: ResponseCurve = field(init=False, repr=False, compare=False)
    _power: Gamma = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        arguments.instance(self.base, ResponseCurve, "a response curve to tune")
        offsets = arguments.numbers(self.offsets, "offsets", least=-LARGEST, most=LARGEST)
        object.__setattr__(self, "offsets", tuple(map(float, offsets)))
        object.__setattr__(self, "_power", Gamma(self.gamma))
        object.__setattr__(self, "gamma", float(self.gamma))
        object.__setattr__(self, "_moved", _moved(self.base, self.offsets))

    def _forward(self, irradiance: FloatArray) -> FloatArray:
        return self._moved.to_intensity(self._power.to_intensity(irradiance))

    def _inverse(self, intensity: FloatArray) -> FloatArray:
        return self._power.to_irradiance(self._moved.to_irradiance(intensity))

    def _slope(self, irradiance: FloatArray) -> FloatArray:
        if self.gamma == 1:
            return self._moved.slope(irradiance)
        irradiance = np.maximum(irradiance, NEXT_TO_0)
        outer = self._moved.slope(self._power.to_intensity(irradiance))
        return np.asarray(outer * self._power.slope(irradiance))


def tuned(base: ResponseCurve, offsets: Sequence[float] = (), gamma: float = 1.0) -> Tuned:
    """Tune a response by offsets of any size: what sliders need, which know no limits.

    The offsets are multiplied by the largest factor, at most 1, that leaves the curve
    everywhere at least a hundredth of the base's slope before `gamma`, so that it is strictly
    increasing.

    Parameters
    ----------
    base, offsets, gamma
        As of :class:`Tuned`, which keeps the offsets as they are after shrinking.
    """
    arguments.instance(base, ResponseCurve, "a response curve to tune")
    offsets = arguments.numbers(offsets, "offsets")
    spare = (1 - LEAST_SLOPE) * np.diff(base.to_intensity(IRRADIANCE))
    fall = -np.diff(_offset(offsets))
    falls = fall > 0
    factor = float(np.min(spare[falls] / np.maximum(fall, spare)[falls], initial=1.0))
    return Tuned(base, tuple(factor * o for o in offsets), gamma)


def _moved(base: ResponseCurve, offsets: Sequence[float]) -> ResponseCurve:
    """``f_base + sum_i o_i h_i``; the base itself where there is nothing to add."""
    added = _offset(offsets)
    if not any(offsets):
        return base
    samples = base.to_intensity(IRRADIANCE) + added
    if np.any(np.diff(samples) <= 0):
        raise ValueError("expected offsets that leave the curve strictly increasing")
    return Tabulated(IRRADIANCE, samples)


def _offset(offsets: Sequence[float]) -> FloatArray:
    """``sum_i o_i h_i`` where the curve is sampled."""
    return np.interp(IRRADIANCE, STEPS, emor_sum((0.0, *offsets)))
