"""EMoR, the empirical model of response: a mean curve plus a few basis curves."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files

import numpy as np

from .. import arguments
from .._typing import FloatArray
from .base import ResponseCurve
from .tabulated import Tabulated

LARGEST = 1e6  # coefficient: far beyond any that leaves a curve increasing


@cache
def emor_table() -> FloatArray:
    """Forward EMoR table, shape (26, 1024): mean response, then 25 orthonormal curves.

    Samples of intensity at 1024 equal steps of irradiance from 0 to 1 (Grossberg & Nayar,
    TPAMI 2004).
    """
    with (files(__package__) / "data" / "emor.npy").open("rb") as file:
        table: FloatArray = np.load(file).astype(np.float64)
    table[0, [0, -1]] = 0.0, 1.0
    table[1:, [0, -1]] = 0.0
    table.setflags(write=False)
    return table


def emor_sum(weights: Sequence[float]) -> FloatArray:
    """Samples of ``w_0 f0(E) + w_1 h_1(E) + ... + w_n h_n(E)``, shape (1024,)."""
    table = emor_table()
    if len(weights) > len(table):
        raise ValueError(f"expected at most 25 coefficients, got {len(weights) - 1}")
    return np.asarray(np.asarray(weights) @ table[: len(weights)])


@dataclass(frozen=True, slots=True)
class Emor(ResponseCurve):
    """EMoR response: ``f(E) = f0(E) + c_1 h_1(E) + ... + c_n h_n(E)``, n at most 25.

    Piecewise linear between the 1024 samples of the table. No coefficients give `f0`, the
    mean of the 201 measured responses of DoRF (Grossberg & Nayar, TPAMI 2004, Eq. 9).

    Parameters
    ----------
    coefficients : tuple of float
        ``c_1 .. c_n``; the curve they give must be strictly increasing.
    """

    coefficients: tuple[float, ...] = ()
    _table: Tabulated = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        own = arguments.numbers(self.coefficients, "coefficients", least=-LARGEST, most=LARGEST)
        object.__setattr__(self, "coefficients", tuple(map(float, own)))
        samples = emor_sum((1.0, *self.coefficients))
        if np.any(np.diff(samples) <= 0):
            raise ValueError("expected coefficients of a strictly increasing curve")
        irradiance = np.linspace(0.0, 1.0, samples.size)
        object.__setattr__(self, "_table", Tabulated(irradiance, samples))

    def _forward(self, irradiance: FloatArray) -> FloatArray:
        return self._table.to_intensity(irradiance)

    def _inverse(self, intensity: FloatArray) -> FloatArray:
        return self._table.to_irradiance(intensity)

    def _slope(self, irradiance: FloatArray) -> FloatArray:
        return self._table.slope(irradiance)


@cache
def dorf_mean() -> ResponseCurve:
    """Mean of the DoRF curves: what to assume of a camera when nothing is known."""
    return Emor()
