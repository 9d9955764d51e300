"""The strong edges of the sharp picture, predicted from its blurred one and a rough PSF."""

from dataclasses import dataclass

import numpy as np

from ..._typing import FloatArray
from ...fourier import (
    Shape,
    correlate,
    fast_shape,
    forward,
    gradient_power,
    inverse,
    otf,
    power,
)

GROWTH = 2.0  # of the coupling from step to step, as in the paper
STRONGEST = 1e3  # coupling at which gradients are kept to a thirtieth of the contrast or less


@dataclass(frozen=True, slots=True, eq=False)
class EdgePredictor:
    """Minimize ``|k * x - y|^2 + w |D x|_0`` by half-quadratic splitting.

    The picture `x` of fewest steps that explains the blurred one: Xu, Zheng & Jia (2013,
    Unnatural L0 sparse representation for natural image deblurring, CVPR), with the splitting
    of Xu, Lu, Xu & Jia (2011, Image smoothing via L0 gradient minimization). It
    stands in for the shock filter of Xu & Jia (2010): both turn soft edges into steps and
    drop what is weak, but it knows the PSF, and so finds steps that the blur has merged.

    Parameters
    ----------
    periodic : ndarray, shape (M + P, N + Q)
        The blurred plane, continued so that it can be repeated; see :meth:`of`.
    shape : (M, N)
        Of the plane itself.
    """

    periodic: FloatArray
    shape: Shape

    @classmethod
    def of(cls, plane: FloatArray, size: int) -> "EdgePredictor":
        """Predictor for a blurred plane and PSFs of at most `size` pixels."""
        rows, columns = fast_shape((plane.shape[0] + 2 * size, plane.shape[1] + 2 * size))
        return cls(_closed(_closed(plane, rows).T, columns).T, plane.shape)

    def predict(self, psf: FloatArray, weight: float) -> FloatArray:
        """Gradient of the sharp picture where it has steps, 0 elsewhere.

        Parameters
        ----------
        psf : ndarray, shape (H, W)
            The PSF as far as it is known.
        weight : float
            `w`, for a plane of contrast 1: about the square of the weakest step that is kept.

        Returns
        -------
        ndarray, shape (2, M, N)
            Forward differences along the row axis and along the column axis.
        """
        sharp, shape = self.periodic, self.periodic.shape
        transfer = otf(psf, shape, sharp.dtype)
        blurred, gain = forward(correlate(sharp, transfer)), power(transfer)
        rows, columns = gradient_power(shape, sharp.dtype)
        smoothing = rows[:, None] + columns
        coupling = 2 * weight
        while coupling < STRONGEST:
            spectrum = forward(_divergence(*_steps(sharp, weight / coupling)))
            spectrum *= coupling
            spectrum += blurred
            spectrum /= gain + coupling * smoothing
            sharp = inverse(spectrum, shape)
            coupling *= GROWTH
        return gradient(sharp[: self.shape[0], : self.shape[1]])


def gradient(plane: FloatArray) -> FloatArray:
    """Forward differences along rows and columns, shape (2, M, N); 0 at the far borders."""
    differences = np.zeros((2, *plane.shape), dtype=plane.dtype)
    np.subtract(plane[1:], plane[:-1], out=differences[0, :-1])
    np.subtract(plane[:, 1:], plane[:, :-1], out=differences[1, :, :-1])
    return differences


def _closed(plane: FloatArray, rows: int) -> FloatArray:
    """Append rows that lead smoothly from the last row back to the first, by reflections."""
    gap = rows - len(plane)
    reflected = np.pad(plane, [(gap, gap), (0, 0)], mode="symmetric")
    share = np.cos(np.pi * (np.arange(gap, dtype=plane.dtype) + 0.5) / (2 * gap))[:, None] ** 2
    bridge = share * reflected[-gap:] + (1 - share) * reflected[:gap]
    return np.concatenate([plane, bridge.astype(plane.dtype)])


def _steps(plane: FloatArray, least: float) -> tuple[FloatArray, FloatArray]:
    """Periodic gradient of a plane, where its square is at least `least`."""
    down, across = np.roll(plane, -1, axis=0) - plane, np.roll(plane, -1, axis=1) - plane
    kept = down * down + across * across >= least
    down *= kept
    across *= kept
    return down, across


def _divergence(down: FloatArray, across: FloatArray) -> FloatArray:
    """Adjoint of the periodic gradient, ``D^T v``."""
    return np.roll(down, 1, axis=0) - down + np.roll(across, 1, axis=1) - across
