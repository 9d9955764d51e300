"""The most probable response: several starts, whole edges reweighted, evidence calibrated."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..._typing import FloatArray
from ...progress import Job, Progress
from ...response.prior import ResponsePrior
from .descent import Descent, descend
from .evidence import EdgeGroup
from .family import Family
from .known import expected_shapes
from .model import State, initial, predict
from .noise import NoiseModel
from .problem import Normal, Problem, Shift

# Starts: the mean of the prior, and both ways along its two main directions.
CORNERS = ((0.0, 0.0), *product((-1.5, 1.5), (-1.0, 1.0)))
FIRST_STEPS = 5  # of each start, before the best are followed
FOLLOWED = 2
COMPARED = 96  # edges by which starts are compared
MOST_OF_GROUP = 32  # of these from one group
ROUNDS = 3  # of reweighting
LEAST_EVIDENCE = 1e-4
# How much of what the samples of an edge miss together is common to all edges of a photo, which
# no scatter between them shows: all on photos of few edges, hardly any on those of many.
COMMON = 0.5
NEIGHBORS = 5  # samples that are summed: an eighth of a transition


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
        problem = _weighted(problem, noise, trust, evidence)
        best = descend(problem, best.state)
        evidence = evidence / overconfidence(best.normal)
        evidence = float(np.clip(evidence, LEAST_EVIDENCE, 1.0))
    shared = 1 + COMMON * (dependence(problem, best.state) - 1)
    evidence = max(evidence / shared, LEAST_EVIDENCE)
    problem = _weighted(problem, noise, trust, evidence)
    best = descend(problem, best.state)
    samples = np.concatenate([group.samples for group in groups])
    misfit = float(np.sqrt(np.median(np.concatenate(plain) / samples)))
    return Found(problem, best.state, best.normal, evidence, misfit, best.settled)


def _weighted(
    problem: Problem, noise: NoiseModel, trust: Sequence[FloatArray], evidence: float
) -> Problem:
    weights = noise.weights(problem.groups, evidence)
    return replace(
        problem,
        weights=[w * t[:, np.newaxis, np.newaxis] for w, t in zip(weights, trust, strict=True)],
    )


def overconfidence(normal: Normal) -> float:
    """How much more the edges scatter about the model than it expects; 1 if it is right.

    Edges are independent, samples of one edge are not: neighbors, channels and what is wrong
    with an edge go together. The scatter of the edges' own scores tells how much evidence
    there really is (the sandwich of Huber 1967, as one factor).
    """
    scores = normal.scores
    inverse = np.linalg.inv(normal.hessian)
    data = normal.hessian - np.eye(len(inverse))
    effective = float(np.trace(inverse @ data))
    scatter = float(np.einsum("ei,ij,ej->", scores, inverse, scores))
    spare = max(len(scores) - effective, 1.0)
    # Without a spread of the prior nothing is to be found out, and any factor does.
    return max(scatter / max(effective, 1e-9) * len(scores) / spare, LEAST_EVIDENCE)


def dependence(problem: Problem, state: State) -> float:
    """How many samples, and channels, of a profile miss the model together; 1 if each by itself.

    Where noise is all that is left, residuals are independent. Where they go together, the
    model is wrong, in a way that edges may have in common: then the scatter between edges does
    not tell all. Measured by sums over neighbors and channels: the ratio of their variance to
    that of independent residuals.
    """
    family = problem.family(state)
    together, apart = 0.0, 0.0
    for group, weight, own in zip(problem.groups, problem.weights, state.groups, strict=True):
        recorded = family.record(predict(group, own).light)
        residual = (np.sqrt(weight) * (group.intensity - recorded))[..., :-2]
        rising = residual * np.sign(own.light[..., 1:])
        width = min(NEIGHBORS, rising.shape[2])
        sums = sliding_window_view(rising.sum(axis=1), width, axis=1).sum(axis=-1)
        squares = sliding_window_view((rising**2).sum(axis=1), width, axis=1).sum(axis=-1)
        together, apart = together + float((sums**2).sum()), apart + float(squares.sum())
    return max(together / max(apart, 1e-12), 1.0)


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
