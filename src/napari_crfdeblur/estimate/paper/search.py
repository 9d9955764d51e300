"""The search for the coefficients of a polynomial response, shared by the paper's methods."""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..._typing import FloatArray
from ...profiles.base import ProfileGroup
from ...progress import Progress
from . import polynomial
from .rows import PolynomialRows

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

Objective = Callable[[FloatArray], tuple[float, FloatArray]]
GroupObjective = Callable[[PolynomialRows, FloatArray], tuple[float, FloatArray]]

MOST_STEPS = 500  # of BFGS; from the DoRF mean it needs 20 to 60
GRADIENT_TOLERANCE = 1e-8
OUT_OF_STEPS = 1  # the only status of BFGS that is not a minimum, to rounding
# The search also ends once so many steps have lowered the objective by less than this share
# of it. Where sigma_2 meets sigma_3 the objective has a crease, and its minimum often lies
# there: no gradient vanishes, and BFGS would take hundreds of ever shorter steps.
PATIENCE = 6
LEAST_GAIN = 1e-4
ROUGH_GAIN = 0.3  # while starts are compared


@dataclass(frozen=True, slots=True)
class Minimum:
    """End of a search: the coefficients `a`, the value of the objective, whether it ended."""

    coefficients: FloatArray
    value: float
    converged: bool


@dataclass(frozen=True, slots=True)
class Terms:
    """Eq. 10 of Kim et al. 2012: a data term over groups, a boundary and a monotone term."""

    data: GroupObjective
    boundary_weight: float
    monotone_weight: float

    def objective(self, rows: Sequence[PolynomialRows]) -> Objective:
        """The sum of the terms and its gradient, a function of the coefficients.

        The groups count by their number of profiles.
        """
        shares = np.array([len(r.group) for r in rows], dtype=float)
        shares /= shares.sum()

        def value_and_gradient(coefficients: FloatArray) -> tuple[float, FloatArray]:
            ends, ends_slope = polynomial.boundary(coefficients)
            falls, falls_slope = polynomial.falling_steps(coefficients)
            total = self.boundary_weight * ends + self.monotone_weight * falls
            slope = self.boundary_weight * ends_slope + self.monotone_weight * falls_slope
            for share, group in zip(shares, rows, strict=True):
                data, data_slope = self.data(group, coefficients)
                total += share * data
                slope = slope + share * data_slope
            return total, slope

        return value_and_gradient


def search(objective: Objective, *starts: FloatArray) -> Minimum:
    """Minimize an objective of the coefficients by BFGS.

    Several starts are each followed a short way, the lowest to its end.
    """
    if len(starts) == 1:
        return _descend(objective, starts[0], LEAST_GAIN)
    ways = [_descend(objective, start, ROUGH_GAIN) for start in starts]
    return _descend(objective, min(ways, key=lambda w: w.value).coefficients, LEAST_GAIN)


def _descend(objective: Objective, start: FloatArray, least_gain: float) -> Minimum:
    from scipy.optimize import minimize  # loads in a third of a second

    change = polynomial.well_scaled(start.size - 1)

    def changed(c: FloatArray) -> tuple[float, FloatArray]:
        value, slope = objective(change @ c)
        return value, slope @ change

    end = minimize(
        changed,
        np.linalg.solve(change, start),
        jac=True,
        method="BFGS",
        callback=_stop_when_settled(least_gain),
        options={"maxiter": MOST_STEPS, "gtol": GRADIENT_TOLERANCE},
    )
    coefficients = change @ end.x
    ended = end.status != OUT_OF_STEPS and polynomial.rises(coefficients)
    return Minimum(coefficients, float(end.fun), ended)


def _stop_when_settled(least_gain: float) -> Callable[["OptimizeResult"], None]:
    values: list[float] = []

    def after_step(intermediate_result: "OptimizeResult") -> None:
        values.append(intermediate_result.fun)
        if len(values) > PATIENCE and values[-1] > (1 - least_gain) * values[-1 - PATIENCE]:
            raise StopIteration

    return after_step


def resampling(
    terms: Terms, groups: Sequence[ProfileGroup], found: Minimum, resamples: int
) -> Generator[Progress, None, FloatArray]:
    """Coefficients found again from edges drawn with replacement, shape (R, n + 1).

    The bootstrap of Efron (1979) over all edges; the seed is fixed, so that the same profiles
    give the same band. Draws that leave no group, and searches that end nowhere, are left out.
    """
    random = np.random.default_rng(0)
    degree = found.coefficients.size - 1
    again = []
    for number in range(resamples):
        yield Progress("band of the response", number, resamples)
        drawn = [PolynomialRows(group, degree) for group in _redraw(groups, random)]
        one = search(terms.objective(drawn), found.coefficients) if drawn else None
        if one is not None and one.converged:
            again.append(one.coefficients)
    return np.array(again).reshape(len(again), degree + 1)


def _redraw(groups: Sequence[ProfileGroup], random: np.random.Generator) -> list[ProfileGroup]:
    """As many edges drawn with replacement; the channels of an edge stay together.

    A group keeps as many copies of its profiles as their edge was drawn; left with one where
    it had more, it has nothing to compare and drops out.
    """
    edges = [(source.image, source.edge) for group in groups for source in group.sources]
    distinct, number = np.unique(edges, axis=0, return_inverse=True)
    times = np.bincount(random.integers(len(distinct), size=len(distinct)), minlength=len(distinct))
    ends = np.cumsum([len(group) for group in groups])
    copies = np.split(times[number.ravel()], ends[:-1])
    drawn = [g.select(np.repeat(np.arange(len(g)), c)) for g, c in zip(groups, copies, strict=True)]
    return [d for d, g in zip(drawn, groups, strict=True) if len(d) >= min(2, len(g))]
