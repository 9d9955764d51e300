"""Unknown PSF, by rank: undone, the profiles of a group are multiples of one (Eq. 6-10)."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from scipy.linalg import eigh

from .._typing import FloatArray
from ..profiles.base import ProfileGroup
from ..progress import Job
from .base import ResponseEstimate, ResponseFit
from .fitting import PolynomialFit, fitting
from .identifiability import comparable
from .rows import Rows
from .search import Terms


class Tail(Enum):
    """Which singular values beyond the first measure the distance from rank 1."""

    SECOND = "sigma_2 / sigma_1 (Eq. 9)"
    ALL = "(sigma_2 + sigma_3 + ...) / sigma_1 (Eq. 8)"


class RowScale(Enum):
    """How the rows of a group are scaled before their rank is measured."""

    RAW = "as they are: rows of large range weigh most"
    BY_RANGE = "divided by their range: all rows weigh the same"


@dataclass(frozen=True, slots=True)
class RankMinimization(ResponseFit):
    """Rank minimization: ``min over g of sum_i w_i sigma_2(G_i) / sigma_1(G_i) + penalties``.

    Kim et al. 2012, Eq. 10: `G_i` has the rows ``g(I_j) - l_j`` of group i (Eq. 6), weighted
    by its share of the profiles; the penalties keep ``g(0) = 0``, ``g(1) = 1`` and `g`
    rising. The search starts from the DoRF mean.

    Parameters
    ----------
    tail : Tail
        ``sigma_2`` alone (Eq. 9) or all singular values beyond the first (Eq. 8).
    scale : RowScale
        Raw rows as in the paper, or divided by their range.
    polynomial : PolynomialFit
        Degree, weights of the penalties (lambda_1, lambda_2), resamples of the band.
    """

    tail: Tail = Tail.SECOND
    scale: RowScale = RowScale.RAW
    polynomial: PolynomialFit = field(default_factory=PolynomialFit)

    def run(self, groups: Sequence[ProfileGroup]) -> Job[ResponseEstimate]:
        """Long job: see :class:`ResponseFit`."""
        usable = comparable(groups)
        terms = Terms(self._distance, *self.polynomial.weights)
        return (yield from fitting(usable, terms, self.polynomial))

    def _distance(self, rows: Rows, coefficients: FloatArray) -> tuple[float, FloatArray]:
        matrix, slopes = (
            rows.scaled(coefficients) if self.scale is RowScale.BY_RANGE else rows.raw(coefficients)
        )
        if self.tail is Tail.SECOND:
            return _second_over_first(matrix, slopes)
        return _rest_over_first(matrix, slopes)


def _second_over_first(matrix: FloatArray, slopes: FloatArray) -> tuple[float, FloatArray]:
    """``sigma_2 / sigma_1`` and its gradient: ``d sigma_i = u_i' dA v_i``."""
    tall = matrix.shape[0] >= matrix.shape[1]
    # The two largest eigenpairs of the smaller Gram matrix; the ratio is seldom below 1e-4,
    # its square far above rounding.
    gram = matrix.T @ matrix if tall else matrix @ matrix.T
    size = len(gram)
    squares, vectors = eigh(gram, subset_by_index=(size - 2, size - 1), check_finite=False)
    second, first = np.sqrt(np.maximum(squares, np.finfo(float).tiny))
    other = (matrix @ vectors if tall else matrix.T @ vectors) / (second, first)
    left, right = (other, vectors) if tall else (vectors, other)
    change = np.einsum("ji,jmk,mi->ik", left, slopes, right, optimize=True)
    ratio = second / first
    return float(ratio), (change[0] - ratio * change[1]) / first


def _rest_over_first(matrix: FloatArray, slopes: FloatArray) -> tuple[float, FloatArray]:
    """``sum_(j >= 2) sigma_j / sigma_1`` and its gradient."""
    left, values, right = np.linalg.svd(matrix, full_matrices=False)
    first = values[0]
    ratio = values[1:].sum() / first
    rest = np.einsum("jm,jmk->k", left[:, 1:] @ right[1:], slopes)
    leading = np.einsum("j,jmk,m->k", left[:, 0], slopes, right[0], optimize=True)
    return float(ratio), (rest - ratio * leading) / first
