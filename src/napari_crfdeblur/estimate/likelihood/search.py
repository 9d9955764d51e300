"""The most probable response: several starts, whole edges reweighted, evidence calibrated."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ..._typing import FloatArray
from ...progress import Job, Progress
from ...response.prior import ResponsePrior
from .calibration import LEAST_EVIDENCE, overconfidence, shared_misfit
from .descent import Descent, descend
from .evidence import EdgeGroup
from .family import Family
from .known import expected_shapes
from .model import State, initial
from .noise import NoiseModel
from .problem import Normal, Problem, Shift

# Starts: the mean of the prior, and both ways along its two main directions.
CORNERS = ((0.0, 0.0), *product((-1.5, 1.5), (-1.0, 1.0)))
FIRST_STEPS = 5  # of each start, before the best are followed
FOLLOWED = 2
COMPARED = 96  # edges by which starts are compared
MOST_OF_GROUP = 32  # of these from one group
ROUNDS = 3  # of reweighting


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """The most probable response and what led to it.

    Parameters
    ----------
    problem : Problem
        As it was at last, with its weights.
    state : State
        Its minimum.
    normal : Normal
        Normal equations there.
    evidence : float
        Share of the samples that count, in (0, 1].
    misfit : float
        Root mean square of the residuals of a typical edge, in standard deviations of its noise.
    settled : bool
        Whether the search came to an end.
    """

    problem: Problem
    state: State
    normal: Normal
    evidence: float
    misfit: float
    settled: bool


def searching(
    prior: ResponsePrior,
    groups: Sequence[EdgeGroup],
    noise: NoiseModel,
    shift: Shift,
    psf: FloatArray | None = None,
) -> Job[Found]:
    """Long job: the most probable response given profiles, and the PSF if it is known."""
    problem = Problem(prior, groups, noise.weights(groups), shift, [None] * len(groups))
    if psf is not None:
        first = initial(groups, Family(prior, np.zeros(prior.size)))
        problem = replace(problem, expected=expected_shapes(psf, groups, first))
    best = yield from _starting(problem)
    evidence = 1.0
    trust: list[FloatArray] = []
    for number in range(ROUNDS):
        yield Progress("response", number, ROUNDS)
        plain = replace(problem, weights=noise.weights(groups)).misfits(best.state)
        trust = [noise.trust(g, misfit) for g, misfit in zip(groups, plain, strict=True)]
        if psf is not None:
            problem = replace(problem, expected=expected_shapes(psf, groups, best.state))
        problem = weighted(problem, noise, trust, evidence)
        best = descend(problem, best.state)
        evidence = evidence / overconfidence(best.normal)
        evidence = float(np.clip(evidence, LEAST_EVIDENCE, 1.0))
    evidence = max(evidence / shared_misfit(problem, best.state), LEAST_EVIDENCE)
    problem = weighted(problem, noise, trust, evidence)
    best = descend(problem, best.state)
    misfit = typical_misfit(groups, plain)
    return Found(problem, best.state, best.normal, evidence, misfit, best.settled)


def typical_misfit(groups: Sequence[EdgeGroup], misfits: Sequence[FloatArray]) -> float:
    """Root mean square of the residuals of a typical edge, given the sums of their squares."""
    samples = np.concatenate([group.samples for group in groups])
    return float(np.sqrt(np.median(np.concatenate(misfits) / samples)))


def weighted(
    problem: Problem, noise: NoiseModel, trust: Sequence[FloatArray], evidence: float
) -> Problem:
    """The problem with weights that allow for bad edges and for how much evidence there is."""
    weights = noise.weights(problem.groups, evidence)
    return replace(
        problem,
        weights=[w * t[:, np.newaxis, np.newaxis] for w, t in zip(weights, trust, strict=True)],
    )


def _starting(problem: Problem) -> Job[Descent]:
    """Long job: the lowest end of several starts, compared by some of the edges."""
    rough = []
    some = _some(problem)
    for number, corner in enumerate(CORNERS):
        yield Progress("response", number, len(CORNERS))
        coefficients = np.zeros(problem.prior.size)
        coefficients[: len(corner)] = corner[: problem.prior.size]
        start = initial(some.groups, Family(problem.prior, coefficients))
        rough.append(descend(some, start, FIRST_STEPS))
    rough.sort(key=lambda end: end.value)
    ends = [descend(some, end.state) for end in rough[:FOLLOWED]]
    best = min(ends, key=lambda end: end.value)
    family = Family(problem.prior, best.state.coefficients)
    return descend(problem, initial(problem.groups, family))


def _some(problem: Problem) -> Problem:
    """The problem with only so many edges as suffice to compare starts, of the largest groups."""
    order = np.argsort([-len(group.edges) for group in problem.groups], kind="stable")
    sizes = [min(len(problem.groups[i].edges), MOST_OF_GROUP) for i in order]
    used = order[: int(np.searchsorted(np.cumsum(sizes), COMPARED)) + 1]
    chosen = {
        int(i): np.unique(np.linspace(0, n - 1, min(n, MOST_OF_GROUP)).astype(int))
        for i in used
        if (n := len(problem.groups[i].edges))
    }
    return replace(
        problem,
        groups=[problem.groups[i].select(rows) for i, rows in chosen.items()],
        weights=[problem.weights[i][rows] for i, rows in chosen.items()],
        expected=[problem.expected[i] for i in chosen],
    )
