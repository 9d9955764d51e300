"""The half of splitting methods that knows the blur: least squares by one pair of transforms.

Prior and blur are split: `v` is what the prior makes of the details ``D x``, pixel by pixel, and
`x` the picture that fits `v` and the blurred one.
"""

from collections.abc import Callable
from typing import TypeAlias

from .. import arrays
from .._typing import FloatArray
from ..fourier import ComplexArray, forward, inverse
from ..progress import Job, Progress
from . import loops
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
    _solve(spectrum, data, coupling, filters)
    sharp = inverse(spectrum, pull.shape)
    yield at[1]
    return sharp


def _solve(spectrum: ComplexArray, data: Recorded, coupling: float, filters: Power) -> None:
    """``X = (conj(K) Y + c V) / (|K|^2 + c sum_j |D_j|^2)``, in place of `V`, block by block.

    `V` is the half spectrum of ``sum_j D_j' v_j``, the rest as in :func:`solving`.
    """
    fused, real = loops.compiled(loops.solve, data.gain), data.gain.dtype
    for block in arrays.blocks(spectrum):
        part, correlated = spectrum[block, ...], data.correlated[block, ...]
        gain, power = data.gain[block, ...], filters(block)
        if fused:
            fused(part.view(real), correlated.view(real), gain, power, real.type(coupling))
            continue
        power *= coupling
        power += gain
        part *= coupling
        part += correlated
        part *= 1 / power  # faster than a division of complex numbers
