"""From a data term to an estimate: search, band, status; the same for the paper's methods."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ... import arguments
from ..._typing import FloatArray
from ...errors import CrfDeblurError
from ...profiles.base import ProfileGroup
from ...progress import Job, Progress
from ..band import BAND_SAMPLES, band, covered_range, share_of_prior
from ..base import ResponseEstimate, ResponseStatus
from ..identifiability import LEAST_COLLINEARITY, LEAST_COVERED, collinearity
from . import polynomial
from .rows import PolynomialRows
from .search import Minimum, Terms, resampling, search

# Its band over that range, as a share of the prior's: edges that leave half of what is not
# known of any camera say little.
WIDEST_BAND = 0.5

LARGEST_DEGREE = 20  # beyond, powers of intensity can hardly be told apart in floats
LARGEST_WEIGHT = 1e9  # beside which no profile counts


@dataclass(frozen=True, slots=True)
class PolynomialFit:
    """How a polynomial inverse response is fitted (Kim et al. 2012, Eq. 4 and 10).

    Parameters
    ----------
    degree : int
        Degree n of the polynomial.
    boundary_weight : float
        lambda_1, of ``g(0)^2 + (g(1) - 1)^2``.
    monotone_weight : float
        lambda_2, of each step between 256 levels that falls.
    resamples : int
        Number of times that the edges are drawn again for the band; 0 for no band.
    """

    degree: int = 5
    boundary_weight: float = 100.0
    monotone_weight: float = 10.0
    resamples: int = 20

    def __post_init__(self) -> None:
        arguments.whole(self.degree, "a degree", least=1, most=LARGEST_DEGREE)
        for weight in self.weights:
            arguments.number(weight, "a weight", least=0, most=LARGEST_WEIGHT)
        most = arguments.MOST_STEPS
        arguments.whole(self.resamples, "a number of resamples", least=0, most=most)

    @property
    def weights(self) -> tuple[float, float]:
        """lambda_1 and lambda_2."""
        return self.boundary_weight, self.monotone_weight


def fitting(
    groups: Sequence[ProfileGroup],
    terms: Terms,
    fit: PolynomialFit,
    *,
    starts: Sequence[FloatArray] = (),
    least_apart: float = LEAST_COLLINEARITY,
) -> Job[ResponseEstimate]:
    """Long job: the response that minimizes the terms over groups of profiles.

    The search starts from given coefficients, or from those of the DoRF mean. Profiles whose
    collinearity is below `least_apart` leave the estimate in doubt.
    """
    yield Progress("response", 0, 1)
    rows = [PolynomialRows(g, fit.degree) for g in groups]
    mean = polynomial.dorf_mean_coefficients(fit.degree)
    found = search(terms.objective(rows), *(starts or [mean]))
    if not polynomial.rises(found.coefficients):
        raise CrfDeblurError(
            "the profiles lead to a response that falls; remove edges that are not straight "
            "steps between even areas, or give the response (gamma or sRGB)"
        )
    again = yield from resampling(terms, groups, found, fit.resamples)
    yield Progress("response", 1, 1)
    return _estimate(rows, found, again, least_apart)


def _estimate(
    rows: Sequence[PolynomialRows], found: Minimum, again: FloatArray, least_apart: float
) -> ResponseEstimate:
    groups = [r.group for r in rows]
    curve = polynomial.as_curve(found.coefficients)
    intensity = np.linspace(0, 1, BAND_SAMPLES)
    center = curve.to_irradiance(intensity)
    curves = np.array([polynomial.as_curve(a).to_irradiance(intensity) for a in again])
    covered = covered_range(groups)
    lower, upper = band(intensity, curves, center, covered)
    narrowed = share_of_prior(intensity, upper - lower, covered)
    apart = collinearity(
        [r.offsets(found.coefficients) for r in rows],
        [r.ranges(found.coefficients) for r in rows],
    )
    return ResponseEstimate(
        curve=curve,
        intensity=intensity,
        lower=lower,
        upper=upper,
        covered=covered,
        status=_status(found, apart >= least_apart, covered, narrowed),
        diagnostics={
            "objective": found.value,
            "collinearity": apart,
            "groups": len(groups),
            "profiles": sum(len(g) for g in groups),
            "band, share of the prior's": narrowed,
        },
    )


def _status(
    found: Minimum, able: bool, covered: tuple[float, float], narrowed: float
) -> ResponseStatus:
    if not found.converged:
        return ResponseStatus.NOT_CONVERGED
    if not able or covered[1] - covered[0] < LEAST_COVERED or narrowed > WIDEST_BAND:
        return ResponseStatus.DOUBTFUL
    return ResponseStatus.GOOD
