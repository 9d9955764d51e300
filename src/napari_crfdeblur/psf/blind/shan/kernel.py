"""The PSF between two pictures, from derivatives of two orders, not negative and sparse."""

import numpy as np

from ...._typing import FloatArray
from ..blurred import Blurred
from ..edge_prediction import gradient
from ..kernel_fit import KernelFit
from .latent import PRECISION

STEPS = 100  # of the accelerated descent


def sparse_kernel(
    sharp: FloatArray, blurred: Blurred, start: FloatArray, sparsity: float
) -> FloatArray:
    """Minimize ``sum_d w_d |f * d L - d I|^2 + g sum f`` over ``f >= 0``.

    Shan, Jia & Agarwala (2008), Sec. 4.2, with the derivatives `d` of first and second order. The
    paper's interior point method is replaced by a projected gradient with momentum (Beck &
    Teboulle 2009), whose steps are small convolutions.

    Parameters
    ----------
    sharp : ndarray, shape (M, N)
        `L`.
    blurred : Blurred
        `I`.
    start : ndarray, shape (S, S)
        Where the search starts.
    sparsity : float
        `g`, as a share of the greatest value that leaves any pixel.
    """
    edges, measured = derivatives(sharp, blurred), derivatives(blurred.plane, blurred)
    fit = KernelFit.of(edges, measured, len(start))
    pull = fit.correlation - sparsity * max(float(fit.correlation.max()), 0.0)
    length = 1 / float(np.abs(fit.transfer).max())
    psf, ahead, momentum = start, start, 1.0
    for _ in range(STEPS):
        before = psf
        psf = np.maximum(ahead + length * (pull - fit.blurred_twice(ahead)), 0)
        momentum, last = (1 + np.sqrt(1 + 4 * momentum**2)) / 2, momentum
        ahead = psf + (last - 1) / momentum * (psf - before)
    return psf


def derivatives(picture: FloatArray, blurred: Blurred) -> FloatArray:
    """First and second differences, scaled by the deviation of their noise, shape (5, M, N)."""
    first = gradient(picture)
    down, across = gradient(first[0]), gradient(first[1])
    second = np.stack([down[0], down[1], across[1]])
    stack = np.concatenate([first * np.sqrt(PRECISION / 2), second * np.sqrt(PRECISION / 4)])
    return blurred.kept(np.asarray(stack, np.float32))
