"""The strong edges of the sharp picture, predicted from its blurred one and a rough PSF."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
DARK = 0.1  # of the contrast: what is below is dark, where it is the darkest of its patch
DARKEST = 0.001  # share of the plane that is below what counts as no light


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
    patch : int
        Sides in pixels of the patches whose darkest pixels are taken for black; 0 for none.
        Wen et al. (2021, A simple local minimal intensity prior and an improved algorithm for
        blind image deblurring, IEEE TCSVT 31): blur mixes the darkest pixel of each patch with
        brighter ones, so that a picture whose patches hold none is a blurred one.
    """

    periodic: FloatArray
    shape: Shape
    patch: int = 0

    @classmethod
    def of(cls, plane: FloatArray, size: int, patch: int = 0) -> "EdgePredictor":
        """Predictor for a blurred plane and PSFs of at most `size` pixels."""
        if patch:  # black is where the plane has least light, whatever light lies over all of it
            plane = plane - np.quantile(plane, DARKEST).astype(plane.dtype)
        return cls(continued(plane, size), plane.shape, patch)

    def predict(self, psf: FloatArray, weight: float, strongest: float = STRONGEST) -> FloatArray:
        """Gradient of the sharp picture where it has steps, 0 elsewhere.

        Parameters
        ----------
        psf : ndarray, shape (H, W)
            The PSF as far as it is known.
        weight : float
            `w`, for a plane of contrast 1: about the square of the weakest step that is kept.
        strongest : float
            Coupling of the gradient to its steps at which the splitting ends.

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
        while coupling < strongest:
            black = _blackened(sharp, self.patch) if self.patch else sharp
            spectrum = forward(divergence(*_steps(black, weight / coupling)))
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


def continued(plane: FloatArray, size: int) -> FloatArray:
    """A plane with two PSFs of `size` pixels more, so that it can be repeated without a step."""
    rows, columns = fast_shape((plane.shape[0] + 2 * size, plane.shape[1] + 2 * size))
    return _closed(_closed(plane, rows).T, columns).T


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


def _blackened(plane: FloatArray, patch: int) -> FloatArray:
    """A plane whose patches' darkest pixels are black, where they are dark."""
    rows, columns = _darkest(plane, patch)
    darkest = plane[rows, columns]
    black = plane.copy()
    black[rows, columns] = np.where(darkest < DARK, 0, darkest)
    return black


def _darkest(plane: FloatArray, patch: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns of the darkest pixel of each whole patch."""
    down, across = plane.shape[0] // patch, plane.shape[1] // patch
    whole = plane[: down * patch, : across * patch]
    patches = whole.reshape(down, patch, across, patch).swapaxes(1, 2)
    place = patches.reshape(down, across, patch * patch).argmin(axis=2)
    rows, columns = np.divmod(place, patch)
    return (
        rows + patch * np.arange(down)[:, None],
        columns + patch * np.arange(across),
    )


def divergence(down: FloatArray, across: FloatArray) -> FloatArray:
    """Adjoint of the periodic gradient, ``D^T v``."""
    return np.roll(down, 1, axis=0) - down + np.roll(across, 1, axis=1) - across
