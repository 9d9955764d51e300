"""Several pictures of one PSF, laid on each other to a fraction of a pixel, and their mean."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import fft, ndimage

from ..._typing import FloatArray
from .cutout import SMOOTHING, Cutout

ROUNDS = 5  # of aligning to the mean: each halves what is left, and a tenth of a pixel is enough
STEP = 1.0  # pixel: the most by which a thing is moved in a round
FITTING = 20  # rounds of the fit to all pictures; more would fit their noise
PAD = 2  # pixels of the common array beside the largest picture, for shifts
MOST_SIGNAL = 100.0  # beyond that, lamps differ by more than their noise
COARSE = 96  # pixels of a side of the pictures that are compared, each with each
TINY = 1e-12  # of the peak: keeps quotients finite where there is no light


@dataclass(frozen=True, slots=True, eq=False)
class Aligned:
    """Pictures of one thing in one frame.

    Parameters
    ----------
    light : ndarray, shape (n, H, W)
        As they were seen, each moved by whole pixels so that its center of mass is near the
        center pixel.
    offsets : ndarray, shape (n, 2)
        Row and column by which each has still to be moved.
    weights : ndarray, shape (n,)
        What each is worth: the square of its signal to noise, as far as that tells.
    """

    light: FloatArray
    offsets: FloatArray
    weights: FloatArray

    @classmethod
    def of(cls, things: Sequence[Cutout]) -> "Aligned":
        """In a square frame that holds all of them."""
        half = max(max(_reach(thing.light)) for thing in things) + PAD
        placed = [_placed(thing.light, half) for thing in things]
        # A bright lamp is not worth a hundred faint ones: what tells lamps apart is no noise.
        weights = np.minimum([thing.signal for thing in things], MOST_SIGNAL) ** 2
        light = np.stack([each for each, _ in placed])
        return cls(light, np.stack([offset for _, offset in placed]), weights)

    def chosen(self, which: Sequence[int]) -> "Aligned":
        """Some of them."""
        index = list(which)
        return Aligned(self.light[index], self.offsets[index], self.weights[index])

    def moved(self, offsets: FloatArray) -> "Aligned":
        """All of them, with other offsets."""
        return Aligned(self.light, offsets, self.weights)

    def smooth(self) -> FloatArray:
        """All of them smoothed, moved and of norm 1, shape (n, H, W)."""
        return _shifted(_coefficients(self.light), self.offsets)

    def likeness_to(self, one: int) -> tuple[FloatArray, FloatArray]:
        """How alike each is to one of them at best, shape (n,), and how it lies then, (n, 2).

        The second has the rows and columns by which each has to be moved to lie on that one.
        """
        factor = -(-self.light.shape[1] // COARSE)
        flat = ndimage.gaussian_filter(self.light, (0, SMOOTHING, SMOOTHING), mode="constant")
        small = flat[:, ::factor, ::factor]
        small = small / np.linalg.norm(small, axis=(1, 2), keepdims=True)
        side = fft.next_fast_len(2 * small.shape[1], real=True)
        spectra = fft.rfft2(small, (side, side))
        pairs = fft.irfft2(spectra[one] * np.conj(spectra), (side, side)).reshape(len(small), -1)
        best = np.stack(np.unravel_index(pairs.argmax(axis=1), (side, side)), axis=1)
        return pairs.max(axis=1), factor * ((best + side // 2) % side - side // 2)

    def refined(self) -> "Aligned":
        """Each moved so that it fits the mean of all best (Gauss-Newton on the squares)."""
        offsets, coefficients = self.offsets.copy(), _coefficients(self.light)
        for _ in range(ROUNDS):
            pictures = _shifted(coefficients, offsets)
            mean = np.tensordot(self.weights / self.weights.sum(), pictures, 1)
            mean /= np.linalg.norm(mean)
            slopes = np.stack([slope.ravel() for slope in np.gradient(mean)])
            design = np.concatenate([slopes, mean.reshape(1, -1)])
            steps = np.linalg.lstsq(
                design @ design.T,
                design @ (pictures - mean).reshape(len(offsets), -1).T,
                rcond=None,
            )[0][:2].T
            offsets = offsets + np.clip(steps, -STEP, STEP)
        return Aligned(self.light, offsets, self.weights)

    def agreement(self) -> FloatArray:
        """Normalised correlation of each picture with the mean of the others, shape (n,)."""
        pictures = self.smooth()
        total = np.tensordot(self.weights, pictures, 1)
        own = self.weights[:, np.newaxis, np.newaxis] * pictures
        others = total - own if len(pictures) > 1 else own
        norms = np.maximum(np.linalg.norm(others, axis=(1, 2)), TINY)
        return np.asarray((pictures * others).sum(axis=(1, 2)) / norms)

    def _off_center(self) -> FloatArray:
        """Rows and columns by which their mean has to be moved to be centered."""
        mean = np.tensordot(self.weights, np.maximum(self.smooth(), 0), 1)
        return np.asarray(np.array(mean.shape) // 2 - np.array(ndimage.center_of_mass(mean)))

    def psf(self) -> FloatArray:
        """The PSF that explains all pictures, its center of mass on the center pixel.

        Non-negative least distance in the sense of Richardson and Lucy: ``light_i = a_i S_i k``,
        where `S_i` moves `k` by a part of a pixel, linearly between its pixels. A plain mean of
        what was moved would be blurred once more.
        """
        offsets = self.offsets + self._off_center()
        gains = self.light.sum(axis=(1, 2))
        share = self.weights / self.weights.sum()
        # Nothing may be moved out of the frame, where no quotient could bring it back.
        room = int(np.ceil(np.abs(offsets).max())) + 1
        padded = np.pad(self.light, [(0, 0), (room, room), (room, room)])
        pictures = padded / gains[:, np.newaxis, np.newaxis]
        psf: FloatArray = np.zeros(pictures.shape[1:])
        for w, each, by in zip(share, pictures, offsets, strict=True):
            psf += w * _linear(each, by)
        for _ in range(FITTING):
            back = np.zeros_like(psf)
            for w, each, by in zip(share, pictures, offsets, strict=True):
                model = _linear(psf, -by)
                back += w * _linear(each / np.maximum(model, TINY + 1e-6 * psf.max()), by)
            psf = psf * back
            psf /= psf.sum()
        return psf


def _reach(light: FloatArray) -> list[int]:
    """Rows and columns to either side of the center of mass that hold all of the light."""
    center = np.rint(ndimage.center_of_mass(light))
    places = np.argwhere(light > 0)
    return [int(r) for r in np.abs(places - center).max(axis=0)]


def _placed(light: FloatArray, half: int) -> tuple[FloatArray, FloatArray]:
    """Light in a square array with its center of mass next to the middle, and what is left."""
    center = np.array(ndimage.center_of_mass(light))
    whole = np.rint(center).astype(int)
    padded = np.pad(light, half)
    rows, columns = (slice(int(c), int(c) + 2 * half + 1) for c in whole)
    return padded[rows, columns], whole - center


def _coefficients(light: FloatArray) -> FloatArray:
    """Splines through smoothed pictures, shape (n, H, W)."""
    smooth = ndimage.gaussian_filter(light, (0, SMOOTHING, SMOOTHING), mode="constant")
    return np.stack([ndimage.spline_filter(each, order=3, mode="mirror") for each in smooth])


def _shifted(coefficients: FloatArray, offsets: FloatArray) -> FloatArray:
    """Splines, each moved, as pictures of norm 1."""
    moved = np.stack(
        [
            ndimage.shift(each, by, order=3, mode="constant", prefilter=False)
            for each, by in zip(coefficients, offsets, strict=True)
        ]
    )
    return np.asarray(moved / np.linalg.norm(moved, axis=(1, 2), keepdims=True))


def _linear(light: FloatArray, by: FloatArray) -> FloatArray:
    moved: FloatArray = ndimage.shift(light, by, order=1, mode="constant")
    return moved
