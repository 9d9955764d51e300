"""Unknown PSF, by rank: undone, the profiles of a group are multiples of one (Eq. 6-10)."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from ... import arguments
from ..._typing import FloatArray
from ...profiles.base import ProfileGroup
from ...progress import Job
from ..base import ResponseEstimate, ResponseFit
from ..identifiability import comparable
from . import polynomial
from .by_edge import by_edge
from .fitting import PolynomialFit, fitting
from .rows import PolynomialRows
from .search import Terms

# Powers of the DoRF mean from which the search for rows of equal weight starts. Raw rows keep
# to the mean, as in the paper: they have low minima far from the truth, where one row is all.
STARTS = (0.7, 1.0, 1.5)


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
    rising. The search starts from the DoRF mean, for rows of equal weight also near it.

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

    def __post_init__(self) -> None:
        arguments.instance(self.tail, Tail, "a member of Tail")
        arguments.instance(self.scale, RowScale, "a member of RowScale")
        arguments.instance(self.polynomial, PolynomialFit, "a PolynomialFit")

    def arranged(self, groups: Sequence[ProfileGroup]) -> tuple[ProfileGroup, ...]:
        """See :func:`~.by_edge.by_edge`."""
        return by_edge(groups)

    def run(self, groups: Sequence[ProfileGroup]) -> Job[ResponseEstimate]:
        """Long job: see :class:`ResponseFit`."""
        usable = comparable(groups)
        terms = Terms(self._distance, *self.polynomial.weights)
        powers = (1.0,) if self.scale is RowScale.RAW else STARTS
        starts = [polynomial.dorf_mean_coefficients(self.polynomial.degree, p) for p in powers]
        return (yield from fitting(usable, terms, self.polynomial, starts=starts))

    def _distance(self, rows: PolynomialRows, coefficients: FloatArray) -> tuple[float, FloatArray]:
        ratio = _second_over_first if self.tail is Tail.SECOND else _rest_over_first
        if self.scale is RowScale.RAW:
            value, change = ratio(rows.raw(coefficients))
            return value, rows.raw_slope(change)
        value, change = ratio(rows.scaled(coefficients))
        return value, rows.scaled_slope(coefficients, change)


def _second_over_first(matrix: FloatArray) -> tuple[float, FloatArray]:
    """``sigma_2 / sigma_1`` and its gradient: ``d sigma_i = u_i' dA v_i``."""
    from scipy.linalg.lapack import dsyevr  # loads in a sixth of a second

    tall = matrix.shape[0] >= matrix.shape[1]
    # The two largest eigenpairs of the smaller Gram matrix, by LAPACK itself: most matrices
    # are small. The ratio is seldom below 1e-4, its square far above rounding.
    gram = matrix.T @ matrix if tall else matrix @ matrix.T
    size = len(gram)
    squares, vectors, *_ = dsyevr(gram, range="I", il=size - 1, iu=size)
    second, first = np.sqrt(np.maximum(squares[:2], np.finfo(float).eps * squares[1]))
    other = (matrix @ vectors if tall else matrix.T @ vectors) / (second, first)
    left, right = (other, vectors) if tall else (vectors, other)
    ratio = second / first
    return float(ratio), (left / (first, -first / ratio)) @ right.T


def _rest_over_first(matrix: FloatArray) -> tuple[float, FloatArray]:
    """``sum_(j >= 2) sigma_j / sigma_1`` and its gradient."""
    left, values, right = np.linalg.svd(matrix, full_matrices=False)
    ratio = values[1:].sum() / values[0]
    signs = np.ones(values.size)
    signs[0] = -ratio
    return float(ratio), (left * signs / values[0]) @ right
