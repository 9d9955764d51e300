"""Unknown PSF, by distance: undone, the profiles of a group are near their mean (Eq. 5)."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf

import numpy as np

from ... import arguments
from ..._typing import FloatArray
from ...profiles.base import ProfileGroup
from ...progress import Job
from ..base import ResponseEstimate, ResponseFit
from ..identifiability import comparable
from .by_edge import by_edge
from .fitting import PolynomialFit, fitting
from .rows import PolynomialRows
from .search import Terms


@dataclass(frozen=True, slots=True)
class MeanProfile(ResponseFit):
    """Distance to the mean: ``min over g of sum_j |w_j| sum_m (p_j(m) - mean(m))^2 / sum_j |w_j|``.

    Kim et al. 2012, Eq. 5: ``p_j = (g(I_j) - l_j) / w_j``, and the mean is weighted by
    ``|w_j|``; with the penalties of Eq. 4. The search starts from the DoRF mean.

    Parameters
    ----------
    polynomial : PolynomialFit
        Degree, weights of the penalties (lambda_1, lambda_2), resamples of the band.
    """

    polynomial: PolynomialFit = field(default_factory=PolynomialFit)

    def __post_init__(self) -> None:
        arguments.instance(self.polynomial, PolynomialFit, "a PolynomialFit")

    def arranged(self, groups: Sequence[ProfileGroup]) -> tuple[ProfileGroup, ...]:
        """See :func:`~.by_edge.by_edge`."""
        return by_edge(groups)

    def run(self, groups: Sequence[ProfileGroup]) -> Job[ResponseEstimate]:
        """Long job: see :class:`ResponseFit`."""
        usable = comparable(groups)
        terms = Terms(_distance_to_mean, *self.polynomial.weights)
        return (yield from fitting(usable, terms, self.polynomial))


def _distance_to_mean(rows: PolynomialRows, coefficients: FloatArray) -> tuple[float, FloatArray]:
    profiles = rows.scaled(coefficients)
    # The mean is where the sum is smallest, so that its own change does not count.
    mean = np.average(profiles, axis=0, weights=np.abs(rows.ranges(coefficients)))
    return distance_to(mean, rows, coefficients)


def distance_to(
    spread: FloatArray, rows: PolynomialRows, coefficients: FloatArray, scale: float = inf
) -> tuple[float, FloatArray]:
    """Mean of ``(p_j(m) - s(m))^2`` weighted by ``|w_j|``, and its gradient at a fixed `s`.

    The sum that is printed is divided by that of the weights, which depend on the response:
    it would be least where all ranges are squeezed to nothing. A finite scale `c` bounds what
    each profile adds, the mean square ``d_j`` of what is left of it, to ``d_j / (1 + d_j / c^2)``
    (Geman & McClure 1987).

    Parameters
    ----------
    spread : ndarray, shape (M,) or (J, M)
        The edge spread `s`, common or one for each profile.
    rows : PolynomialRows
        Profiles of one group.
    coefficients : ndarray, shape (n + 1,)
        Of the polynomial inverse response.
    scale : float
        `c`, as a share of the contrast.
    """
    profiles = rows.scaled(coefficients)
    ranges = rows.ranges(coefficients)
    weights, signs = np.abs(ranges), np.sign(ranges)
    residual = profiles - spread
    each = np.einsum("jm,jm->j", residual, residual) / profiles.shape[1]
    trust = 1 / (1 + each / scale**2)
    total, bounded = weights.sum(), trust * each
    mean = float(weights @ bounded) / total
    pull = 2 / profiles.shape[1] * weights * trust**2
    bend = rows.scaled_slope(coefficients, pull[:, None] * residual)
    stretch = (signs * (bounded - mean)) @ rows.range_powers
    return mean, (bend + stretch) / total
