"""Richardson-Lucy deconvolution: maximum likelihood for photon noise."""

from dataclasses import dataclass

import numpy as np

from .._typing import FloatArray
from ..boundary import periodic_shape
from ..fourier import ComplexArray, forward, inverse, otf
from ..progress import Job, Progress
from .base import Deconvolver


@dataclass(frozen=True, slots=True)
class RichardsonLucy(Deconvolver):
    """Multiplicative steps, ``x <- x / (k' * m) (k' * (m y / (k * x)))``.

    Richardson (1972) and Lucy (1974); `k'` is the mirrored PSF. The mask `m` is 1 inside the
    frame and 0 outside, where the scene is unknown and estimated along (Bertero & Boccacci
    2005), so that nothing is assumed beyond the border. Non-negative; changes of scale
    commute with it. Noise grows with the number of steps.

    Parameters
    ----------
    iterations : int
        Number of steps: more are sharper and noisier.
    """

    iterations: int = 30

    def __post_init__(self) -> None:
        if self.iterations < 1:
            raise ValueError(f"expected at least 1 iteration, got {self.iterations}")

    def run(self, plane: FloatArray, psf: FloatArray) -> Job[FloatArray]:
        """Long job: deconvolve a plane of shape (M, N) with a checked PSF.

        Negative values of the plane count as zero.
        """
        yield Progress("Richardson-Lucy", 0, self.iterations)
        shape = periodic_shape(plane.shape, psf.shape)
        frame = np.s_[: plane.shape[0], : plane.shape[1]]
        transfer = otf(psf, shape, plane.dtype)
        mirrored = np.conj(transfer)
        blurred = np.maximum(plane, 0)
        level = float(blurred.mean())
        seen = _seen(shape, plane, mirrored)
        sharp = np.full(shape, level, dtype=plane.dtype)
        for done in range(self.iterations):
            predicted = _convolve(sharp, transfer)
            ratio = np.zeros(shape, dtype=plane.dtype)
            floor = max(1e-6 * level, float(np.finfo(plane.dtype).tiny))
            np.divide(blurred, np.maximum(predicted[frame], floor), out=ratio[frame])
            correction = _convolve(ratio, mirrored)
            correction /= seen
            sharp *= np.maximum(correction, 0, out=correction)
            yield Progress("Richardson-Lucy", done + 1, self.iterations)
        return sharp[frame].copy()


def _seen(shape: tuple[int, int], plane: FloatArray, mirrored: ComplexArray) -> FloatArray:
    """Share of the light of every scene pixel that falls into the frame."""
    mask = np.zeros(shape, dtype=plane.dtype)
    mask[: plane.shape[0], : plane.shape[1]] = 1
    # hardly seen pixels would only amplify the rounding of the transforms
    return np.maximum(_convolve(mask, mirrored), 1e-3)


def _convolve(plane: FloatArray, transfer: ComplexArray) -> FloatArray:
    spectrum = forward(plane)
    spectrum *= transfer
    return inverse(spectrum, plane.shape)
