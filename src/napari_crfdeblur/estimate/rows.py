"""Profiles of a group as a polynomial response sees them: rows of a matrix."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .._typing import FloatArray
from ..profiles.base import ProfileGroup
from .polynomial import powers

# Below this range in linear light a row says nothing and would divide by zero.
SMALLEST_RANGE = 1e-4


@dataclass(frozen=True)
class Rows:
    """Powers of the profiles of one group, so that all else is linear in the coefficients.

    Row j is ``g(I_j(m)) - l_j``, its range ``w_j = g(far side) - g(near side)``, negative for
    an edge that falls along the normal (Kim et al. 2012, Eq. 6).
    """

    group: ProfileGroup
    degree: int

    @cached_property
    def profile_powers(self) -> FloatArray:
        """``dr_jm / da_k``, shape (J, M, n + 1); the constant drops out with ``l_j``."""
        near = powers(self.group.sides[:, 0], self.degree)
        return powers(self.group.intensity, self.degree) - near[:, None, :]

    @cached_property
    def range_powers(self) -> FloatArray:
        """``dw_j / da_k``, shape (J, n + 1)."""
        sides = powers(self.group.sides, self.degree)
        return np.asarray(sides[:, 1] - sides[:, 0])

    def ranges(self, coefficients: FloatArray) -> FloatArray:
        """Signed ranges `w_j` in linear light, shape (J,), kept away from zero."""
        sign = np.where(self.group.sides[:, 1] >= self.group.sides[:, 0], 1.0, -1.0)
        return sign * np.maximum(sign * (self.range_powers @ coefficients), SMALLEST_RANGE)

    def offsets(self, coefficients: FloatArray) -> FloatArray:
        """Irradiance of the near side `l_j`, shape (J,)."""
        return powers(self.group.sides[:, 0], self.degree) @ coefficients

    def raw(self, coefficients: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Rows ``g(I_j) - l_j``, (J, M), and their derivatives, (J, M, n + 1)."""
        return self.profile_powers @ coefficients, self.profile_powers

    def scaled(self, coefficients: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Rows divided by their range, (J, M), and their derivatives, (J, M, n + 1)."""
        ranges = self.ranges(coefficients)[:, None]
        rows = (self.profile_powers @ coefficients) / ranges
        change = self.range_powers[:, None, :] * rows[..., None]
        return rows, (self.profile_powers - change) / ranges[..., None]
