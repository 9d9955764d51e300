"""Richardson-Lucy deconvolution: maximum likelihood for photon noise."""

from dataclasses import dataclass

import numpy as np

from .._typing import FloatArray
from ..boundary import periodic_shape
from ..fourier import ComplexArray, convolving, correlating, otf, row_blocks
from ..progress import Job, Progress
from .base import Deconvolver

LEAST_SEEN = 1e-3  # share of a scene pixel's light that must reach the frame


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
        total = 2 + 2 * self.iterations
        reports = (Progress("Richardson-Lucy", done, total) for done in range(total + 1))
        yield next(reports)
        transfer = otf(psf, periodic_shape(plane.shape, psf.shape), plane.dtype)
        yield (at := next(reports))
        seen, sharp = yield from _starting(plane, psf, transfer, at)
        yield (at := next(reports))
        for _ in range(self.iterations):
            ratio = yield from convolving(sharp, transfer, at)
            _divide(plane, ratio)
            yield (at := next(reports))
            correction = yield from correlating(ratio, transfer, at)
            del ratio  # the memory of one plane
            _multiply(sharp, correction, seen)
            yield (at := next(reports))
        return sharp[: plane.shape[0], : plane.shape[1]].copy()


def _starting(
    plane: FloatArray, psf: FloatArray, transfer: ComplexArray, at: Progress
) -> Job[tuple[FloatArray, FloatArray]]:
    """Job: share of the light of every scene pixel that falls into the frame; a flat scene."""
    mask = np.zeros(periodic_shape(plane.shape, psf.shape), dtype=plane.dtype)
    mask[: plane.shape[0], : plane.shape[1]] = 1
    seen = yield from correlating(mask, transfer, at)
    mask[...] = max(float(plane.mean(dtype=np.float64)), float(np.finfo(plane.dtype).tiny))
    return seen, mask


def _divide(plane: FloatArray, predicted: FloatArray) -> None:
    """Replace the prediction by ``m y / prediction``, 0 outside the frame."""
    rows, columns = plane.shape
    # dark pixels, where rounding could make the prediction zero or negative
    floor = max(1e-6 * float(predicted.mean()), float(np.finfo(plane.dtype).tiny))
    for block in row_blocks(plane.shape):
        part = predicted[block, :columns]
        np.maximum(part, floor, out=part)
        np.divide(np.maximum(plane[block], 0), part, out=part)
    predicted[rows:] = 0
    predicted[:, columns:] = 0


def _multiply(sharp: FloatArray, correction: FloatArray, seen: FloatArray) -> None:
    """``x <- x correction / seen``, in place; scene pixels that are hardly seen stay."""
    for block in row_blocks(sharp.shape):
        part = correction[block]
        np.maximum(part, 0, out=part)  # rounding can make it negative
        part /= np.maximum(seen[block], LEAST_SEEN)
        part[seen[block] < LEAST_SEEN] = 1
        sharp[block] *= part
