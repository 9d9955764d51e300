"""Profiles of a group as a polynomial response sees them: rows of a matrix."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..._typing import FloatArray
from ...profiles.base import ProfileGroup
from .polynomial import powers

# Below this range in linear light a row says nothing and would divide by zero.
SMALLEST_RANGE = 1e-4


@dataclass(frozen=True)
class PolynomialRows:
    """Powers of the profiles of one group, so that all else is linear in the coefficients.

    Row j is ``g(I_j(m)) - l_j``, its range ``w_j = g(far side) - g(near side)``, negative for
    an edge that falls along the normal (Kim et al. 2012, Eq. 6).
    """

    group: ProfileGroup
    degree: int

    @cached_property
    def profile_powers(self) -> FloatArray:
        """``dr_jm / da_k``, shape (n + 1, J M); the constant drops out with ``l_j``."""
        near = powers(self.group.sides[:, 0], self.degree)
        change = powers(self.group.intensity, self.degree) - near[:, None, :]
        return np.ascontiguousarray(change.reshape(-1, self.degree + 1).T)

    @cached_property
    def range_powers(self) -> FloatArray:
        """``dw_j / da_k``, shape (J, n + 1)."""
        sides = powers(self.group.sides, self.degree)
        return np.asarray(sides[:, 1] - sides[:, 0])

    @cached_property
    def _signs(self) -> FloatArray:
        return np.where(self.group.sides[:, 1] >= self.group.sides[:, 0], 1.0, -1.0)

    def ranges(self, coefficients: FloatArray) -> FloatArray:
        """Signed ranges `w_j` in linear light, shape (J,), kept away from zero."""
        sizes = self._signs * (self.range_powers @ coefficients)
        return np.asarray(self._signs * np.maximum(sizes, SMALLEST_RANGE))

    def offsets(self, coefficients: FloatArray) -> FloatArray:
        """Irradiance of the near side `l_j`, shape (J,)."""
        return powers(self.group.sides[:, 0], self.degree) @ coefficients

    def raw(self, coefficients: FloatArray) -> FloatArray:
        """Rows ``g(I_j) - l_j``, shape (J, M)."""
        rows: FloatArray = coefficients @ self.profile_powers
        return rows.reshape(self.group.intensity.shape)

    def raw_slope(self, change: FloatArray) -> FloatArray:
        """Gradient over the coefficients of what has the gradient `change` over raw rows."""
        return np.asarray(self.profile_powers @ change.ravel())

    def scaled(self, coefficients: FloatArray) -> FloatArray:
        """Rows divided by their range, shape (J, M)."""
        return np.asarray(self.raw(coefficients) / self.ranges(coefficients)[:, None])

    def scaled_slope(self, coefficients: FloatArray, change: FloatArray) -> FloatArray:
        """Gradient over the coefficients of what has the gradient `change` over scaled rows."""
        ranges = self.ranges(coefficients)
        change = change / ranges[:, None]
        stretch = np.einsum("jm,jm->j", change, self.raw(coefficients)) / ranges
        return np.asarray(self.raw_slope(change) - stretch @ self.range_powers)
