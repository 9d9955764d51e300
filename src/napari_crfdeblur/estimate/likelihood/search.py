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
from .model import ModelState, initial
from .noise_model import NoiseModel
from .problem import NormalEquations, Problem, Shift

# Starts: the mean of the prior, and both ways along its two main directions.
CORNERS = ((0.0, 0.0), *product((-1.5, 1.5), (-1.0, 1.0)))
FIRST_STEPS = 2, 3  # rounds of reweighting, and steps in each, before the best are followed
MORE_STEPS = 3, 8
FOLLOWED = 2
COMPARED = 96  # edges by which starts are compared
MOST_OF_GROUP = 32  # of these from one group
ROUNDS = 3  # of reweighting
# Gain of a step, as a share of what is minimized, below which weights are worth more than steps.
ROUGH = 3e-3


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """The most probable response and what led to it.

    Parameters
    ----------
    problem : Problem
        As it was at last, with its weights.
    state : ModelState
        Its minimum.
    normal : NormalEquations
        Normal equations there.
    evidence : float
        Share of the samples that count, in (0, 1].
    misfit : float
        Root mean square of the residuals of a typical edge at the minimum, in standard deviations
        of its noise.
    settled : bool
        Whether the search came to an end.
    """

    problem: Problem
    state: ModelState
    normal: NormalEquations
    evidence: float
    misfit: float
    settled: bool


def maximizing(
    prior: ResponsePrior,
    groups: Sequence[EdgeGroup],
    noise: NoiseModel,
    shift: Shift,
    psf: FloatArray | None = None,
) -> Job[Solution]:
    """Long job: the most probable response given profiles, and the PSF if it is known."""
    problem = Problem(prior, groups, noise.weights(groups), shift, [None] * len(groups))
    if psf is not None:
        first = initial(groups, Family(prior, np.zeros(prior.size)))
        problem = replace(problem, expected=expected_shapes(psf, groups, first))
    best = yield from _starting(problem, noise)
    evidence = 1.0
    trust: list[FloatArray] = []
    for number in range(ROUNDS):
        yield Progress("response", number, ROUNDS)
        plain = plain_misfits(problem, noise, best.state)
        trust = [noise.trust(g, misfit) for g, misfit in zip(groups, plain, strict=True)]
        if psf is not None:
            problem = replace(problem, expected=expected_shapes(psf, groups, best.state))
        problem = weighted(problem, noise, trust, evidence)
        best = descend(problem, best.state, rough=ROUGH)
        evidence = evidence / overconfidence(best.normal)
        evidence = float(np.clip(evidence, LEAST_EVIDENCE, 1.0))
    evidence = max(evidence / shared_misfit(problem, best.state), LEAST_EVIDENCE)
    problem = weighted(problem, noise, trust, evidence)
    best = descend(problem, best.state)
    misfit = typical_misfit(groups, plain_misfits(problem, noise, best.state))
    return Solution(problem, best.state, best.normal, evidence, misfit, best.settled)


def plain_misfits(problem: Problem, noise: NoiseModel, state: ModelState) -> list[FloatArray]:
    """Sum of squared residuals of each edge over their variances, whatever its weight."""
    return replace(problem, weights=noise.weights(problem.groups)).misfits(state)


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


def _starting(problem: Problem, noise: NoiseModel) -> Job[Descent]:
    """Long job: the best end of several starts, compared by some of the edges."""
    rough = []
    some = _some(problem)
    for number, corner in enumerate(CORNERS):
        yield Progress("response", number, len(CORNERS))
        coefficients = np.zeros(problem.prior.size)
        coefficients[: len(corner)] = corner[: problem.prior.size]
        start = initial(some.groups, Family(problem.prior, coefficients))
        rough.append(_tempering(some, noise, start, *FIRST_STEPS))
    rough.sort(key=lambda end: end[0])
    ends = [_tempering(some, noise, state, *MORE_STEPS) for _, state in rough[:FOLLOWED]]
    _, best = min(ends, key=lambda end: end[0])
    start = initial(problem.groups, Family(problem.prior, best.coefficients))
    return descend(_tempered(problem, noise, start)[0], start, rough=ROUGH)


def _tempering(
    problem: Problem, noise: NoiseModel, state: ModelState, rounds: int, steps: int
) -> tuple[float, ModelState]:
    """Where a few steps lead, with weights that follow the misfits; and how unlikely that is."""
    for _ in range(rounds):
        own, _ = _tempered(problem, noise, state)
        state = descend(own, state, steps, rough=ROUGH).state
    return _tempered(problem, noise, state)[1], state


def _tempered(problem: Problem, noise: NoiseModel, state: ModelState) -> tuple[Problem, float]:
    """The problem as if noise were what the typical edge misses; and how unlikely the state is.

    Far from the minimum all edges fit badly: against their noise, those that happen to fit a
    wrong response would count alone. Bad edges, on the other hand, would lead all others
    astray if they counted in full.
    """
    plain = plain_misfits(problem, noise, state)
    scale = max(typical_misfit(problem.groups, plain) ** 2, 1.0)
    trust, unlikely = [], float(state.coefficients @ state.coefficients)
    for group, misfit in zip(problem.groups, plain, strict=True):
        trust.append(own := noise.trust(group, misfit / scale))
        # Student's distribution, up to a constant.
        unlikely += float(group.samples @ (np.log(scale) - (noise.freedom + 1) * np.log(own)))
    return weighted(problem, noise, trust, 1 / scale), unlikely / 2


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
