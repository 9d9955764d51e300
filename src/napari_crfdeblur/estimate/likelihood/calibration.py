"""How much evidence there really is: samples of one edge, and edges of one photo, err together."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from .model import ModelState, predict
from .problem import NormalEquations, Problem

LEAST_EVIDENCE = 1e-4
# Share of what the samples of an edge miss together that is common to all edges of a photo,
# which no scatter between them shows: on pictures more would be right, on scenes of many clean
# edges less.
COMMON = 0.5
NEIGHBORS = 5  # samples that are summed: an eighth of a transition


def shared_misfit(problem: Problem, state: ModelState) -> float:
    """Factor by which what all edges of a photo miss together lessens the evidence, at least 1."""
    return 1 + COMMON * (dependence(problem, state) - 1)


def overconfidence(normal: NormalEquations) -> float:
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


def dependence(problem: Problem, state: ModelState) -> float:
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
