"""The half of splitting methods that knows the blur: least squares by one pair of transforms.

Prior and blur are split: `v` is what the prior makes of the details ``D x``, pixel by pixel, and
`x` the picture that fits `v` and the blurred one.
"""

from collections.abc import Callable
from typing import TypeAlias

from .. import arrays
from .._typing import FloatArray
from ..fourier import forward, inverse
from ..progress import Job, Progress
from .recorded import Recorded

Power: TypeAlias = Callable[[slice], FloatArray]
"""Rows of ``sum_j |D_j|^2`` on the half spectrum, as an array that can be overwritten."""


def solving(
    data: Recorded,
    pull: FloatArray,
    coupling: float,
    filters: Power,
    at: tuple[Progress, Progress],
) -> Job[FloatArray]:
    """Job: ``x = argmin 1/2 |k * x - y|^2 + c/2 sum_j |D_j x - v_j|^2``.

    Parameters
    ----------
    data : Recorded
        `y` and the blur.
    pull : ndarray
        ``sum_j D_j' v_j``; overwritten.
    coupling : float
        `c`, above 0.
    filters : callable
        ``sum_j |D_j|^2``.
    at : tuple of Progress
        What is reported before the inverse transform, again and again, and after it.
    """
    yield from data.completing(pull, 1 / coupling, at[0])
    spectrum = forward(pull)
    yield at[0]
    for block in arrays.blocks(spectrum):
        part, denominator = spectrum[block, ...], filters(block)
        denominator *= coupling
        denominator += data.gain[block, ...]
        part *= coupling
        part += data.correlated[block, ...]
        part /= denominator
    sharp = inverse(spectrum, pull.shape)
    yield at[1]
    return sharp
