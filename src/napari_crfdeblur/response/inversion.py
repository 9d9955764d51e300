"""Exact inversion of a strictly increasing map of [0, 1] onto itself."""

from collections.abc import Callable

import numpy as np

from .._typing import FloatArray


def invert(
    map_: Callable[[FloatArray], FloatArray],
    derivative: Callable[[FloatArray], FloatArray],
    values: FloatArray,
) -> FloatArray:
    """Solve ``map_(x) = values`` by Newton's method kept inside a shrinking bracket.

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
    low, high = np.zeros_like(values), np.ones_like(values)
    x = values.copy()
    # 60 halvings of the bracket exhaust float64; Newton usually ends within 10 steps.
    for _ in range(60):
        error = map_(x) - values
        low, high = np.where(error < 0, x, low), np.where(error > 0, x, high)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = x - error / derivative(x)
        inside = (step > low) & (step < high)
        following = np.where(error == 0, x, np.where(inside, step, (low + high) / 2))
        # One ulp near 1, relative towards 0, where gamma-like curves need it.
        if np.all(np.abs(following - x) <= 2.3e-16 * np.maximum(x, 1e-300)):
            return following
        x = following
    return x
