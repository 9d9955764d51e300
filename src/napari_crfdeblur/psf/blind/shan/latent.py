"""The sharp picture that a rough PSF leaves, with noise modeled on several derivatives."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ...._typing import FloatArray
from ....fourier import ComplexArray, Shape, correlate, forward, inverse, otf, power
from ..blurred import Blurred
from ..edge_prediction import EdgePredictor
from .prior import most_likely

PRECISION = 50.0  # of the noise, halved for each order of derivative: Sec. 3.1 and 5
COUPLINGS = 2.0 ** np.arange(1, 16)  # of the substitutes: doubled until they are the gradients
SMOOTH = 5 / 255  # deviation within a window as large as the PSF, below which a place is smooth


@dataclass(frozen=True, slots=True, eq=False)
class Latent:
    """Minimize a picture's energy for a known PSF `f` by splitting.

    Shan, Jia & Agarwala (2008), Sec. 4.1: with `L` the sharp and `I` the blurred picture ::

        sum_d w_d |f * d L - d I|^2 + l1 (F(dx L) + F(dy L)) + l2 M |D L - D I|^2

    over the derivatives `d` of order 0 to 2, ``w_d = 50 / 2^order``. `F` is the penalty of
    :mod:`~.prior`, `M` is 1 where the blurred picture is smooth over the extent of the PSF, and
    so the sharp one must be. The gradients are replaced by substitutes that are pulled to them
    ever more strongly: each has a minimum in closed form, and so has the picture, by transforms.

    Parameters
    ----------
    periodic : ndarray, shape (P, Q)
        The blurred plane, continued so that it can be repeated.
    shape : (M, N)
        Of the plane itself.
    smooth : ndarray, shape (P, Q)
        `M`, 0 or 1.
    """

    periodic: FloatArray
    shape: Shape
    smooth: FloatArray

    @classmethod
    def of(cls, blurred: Blurred, size: int) -> "Latent":
        """For PSFs of `size` x `size` pixels."""
        periodic = EdgePredictor.of(blurred.plane, size).periodic
        mean, square = (ndimage.uniform_filter(p, size) for p in (periodic, periodic**2))
        smooth = np.zeros_like(periodic)
        smooth[square - mean**2 < SMOOTH**2] = 1
        return cls(periodic, blurred.plane.shape, smooth)

    def predict(self, psf: FloatArray, sharpness: float, locality: float) -> FloatArray:
        """The sharp picture, shape (M, N), for the weights ``l1`` and ``l2``."""
        picture, shape = self.periodic, self.periodic.shape
        transfer, steps = otf(psf, shape), differences(shape)
        slopes = power(steps[0]) + power(steps[1])
        noise = PRECISION * (1 + slopes / 2 + np.square(slopes) / 4)
        blurred = noise * forward(correlate(self.periodic, transfer))
        gain = noise * power(transfer)
        measured, local = gradient_of(forward(self.periodic), steps, shape), locality * self.smooth
        for coupling in COUPLINGS.tolist():
            rough = gradient_of(forward(picture), steps, shape)
            substitutes = most_likely(rough, coupling, measured, local, sharpness)
            pulled = sum(np.conj(s) * forward(p) for s, p in zip(steps, substitutes, strict=True))
            picture = inverse((blurred + coupling * pulled) / (gain + coupling * slopes), shape)
        return picture[: self.shape[0], : self.shape[1]]


def differences(shape: Shape) -> tuple[ComplexArray, ComplexArray]:
    """Transforms of the forward differences along rows and along columns."""
    down, across = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    for step in (down, across):
        step[0, 0] = -1
    # of one row or column, which is its own neighbor, nothing remains
    down[-1, 0] += 1
    across[0, -1] += 1
    return forward(down), forward(across)


def gradient_of(
    spectrum: ComplexArray, steps: tuple[ComplexArray, ComplexArray], shape: Shape
) -> FloatArray:
    """Periodic gradient of a picture from its transform, shape (2, P, Q)."""
    return np.stack([inverse(spectrum * step, shape) for step in steps])
