"""Minimum of a quadratic function over what is not negative."""

import numpy as np
from scipy import linalg

from ..._typing import FloatArray

STEPS = 12  # at most: what uses it starts again where it ended
CLOSE = 1e-4  # change, as a share of the largest value, at which the search ends
SUFFICIENT = 1e-4  # share of the decrease that the slope promises: Armijo's rule
SHORTEST = 1e-6  # step of the line search


def nonnegative_minimum(matrix: FloatArray, vector: FloatArray, start: FloatArray) -> FloatArray:
    """Minimize ``1/2 x' A x - b' x`` over ``x >= 0``.

    Newton's method on the values that are free to move, projected onto what is not negative
    (Bertsekas 1982, Projected Newton methods for optimization problems with simple
    constraints, SIAM J. Control Optim. 20).

    Parameters
    ----------
    matrix : ndarray, shape (N, N)
        `A`, symmetric, positive definite.
    vector : ndarray, shape (N,)
        `b`.
    start : ndarray, shape (N,)
        Where the search starts, not negative.
    """
    x = start
    slope = matrix @ x - vector
    for _ in range(STEPS):
        free = np.flatnonzero((x > 0) | (slope < 0))
        step = np.zeros_like(x)
        if free.size:
            factor = linalg.cho_factor(matrix[np.ix_(free, free)], check_finite=False)
            step[free] = -linalg.cho_solve(factor, slope[free], check_finite=False)
        value, length = x @ (slope - vector) / 2, 1.0
        while True:
            moved = np.maximum(x + length * step, 0.0)
            after = matrix @ moved - vector
            decrease = value - moved @ (after - vector) / 2
            if decrease >= SUFFICIENT * (slope @ (x - moved)) or length < SHORTEST:
                break
            length /= 2
        change = np.abs(moved - x).max()
        x, slope = moved, after
        if change <= CLOSE * x.max():
            break
    return x
