"""Exact inversion of a strictly increasing map of [0, 1] onto itself."""

from collections.abc import Callable

import numpy as np

from .._typing import FloatArray

# Of x: Newton's error after a step is about the square of the step, far below rounding.
LAST_STEP = 1e-10


def invert(
    map_: Callable[[FloatArray], FloatArray],
    derivative: Callable[[FloatArray], FloatArray],
    values: FloatArray,
) -> FloatArray:
    """Solve ``map_(x) = values`` by Newton's method kept inside a shrinking bracket.

    The steps are those of the logarithm of the map as a function of the logarithm of `x`,
    where curves like a gamma are nearly straight, however close to 0.

    Parameters
    ----------
    map_, derivative : callable
        A strictly increasing map of [0, 1] onto [0, 1] and its derivative, elementwise.
    values : ndarray
        In [0, 1].

    Returns
    -------
    ndarray
        `x` in [0, 1], the shape of `values`, exact to rounding.
    """
    solution = np.array(values).reshape(-1)
    # the ends are their own solution
    active = np.flatnonzero((solution > 0) & (solution < 1))
    x = target = solution[active]
    low, high = np.zeros_like(x), np.ones_like(x)
    # 60 halvings of the bracket exhaust float64; Newton usually ends within 6 steps.
    for _ in range(60):
        if not active.size:
            break
        reached = map_(x)
        low, high = np.where(reached < target, x, low), np.where(reached > target, x, high)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            step = np.log(reached / target) * reached / (x * derivative(x))
            newton = np.clip(x * np.exp(-step), low, high)
        # A last step may well end on the bracket: what is left of it there is rounding.
        last = (np.abs(step) <= LAST_STEP) | (reached == target)
        inside = (newton > low) & (newton < high)
        x = np.where(reached == target, x, np.where(inside | last, newton, (low + high) / 2))
        solution[active] = x
        active, x, target, low, high = (each[~last] for each in (active, x, target, low, high))
    return solution.reshape(np.shape(values))
