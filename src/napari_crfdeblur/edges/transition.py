"""What an edge looks like across: its flat sides, what lies between them, its noise."""

from dataclasses import dataclass
from functools import cache
from math import copysign, sqrt

import numpy as np
from scipy import ndimage

from .._typing import BoolArray, FloatArray
from .locate import slopes
from .strip import Strip

# An 8-bit step, uniformly rounded: the least noise that is assumed of a photo.
ROUNDING = 0.29 / 255


@dataclass(frozen=True, slots=True, eq=False)
class Transition:
    """The mean profile of a strip and where it is flat.

    Parameters
    ----------
    profile : ndarray, shape (D, C)
        Mean along the edge, in each channel.
    first, last : int
        Samples between which the profile changes.
    flat : int
        Number of samples of each flat side.
    sides : ndarray, shape (2, C)
        Mean of the flat sides, before and after.
    noise : float
        Standard deviation of one sample of the strip.
    """

    profile: FloatArray
    first: int
    last: int
    flat: int
    sides: FloatArray
    noise: float

    @property
    def difference(self) -> FloatArray:
        """Difference of the sides in each channel, shape (C,)."""
        return np.asarray(self.sides[1] - self.sides[0])

    @property
    def contrast(self) -> float:
        """Largest difference of the sides among the channels."""
        return float(np.abs(self.difference).max())

    @property
    def polarity(self) -> int:
        """+1 if the strongest channel rises along the normal, else -1."""
        return int(copysign(1, self.difference[np.abs(self.difference).argmax()]))

    @property
    def weights(self) -> FloatArray:
        """Weights of the channels under which the profile rises with the most contrast."""
        return self.difference / max(float(np.abs(self.difference).sum()), 1e-12)

    @property
    def window(self) -> slice:
        """Samples of the transition with both its flat sides."""
        return slice(self.first - self.flat, self.last + self.flat + 1)

    @property
    def before(self) -> slice:
        """Samples of the flat side before the transition."""
        return slice(self.first - self.flat, self.first + 1)

    @property
    def after(self) -> slice:
        """Samples of the flat side after the transition."""
        return slice(self.last, self.last + self.flat + 1)

    def rising(self) -> FloatArray:
        """The profile projected on the color difference, from 0 to 1, shape (D,)."""
        start, end = self.sides @ self.weights
        scaled: FloatArray = (self.profile @ self.weights - start) / max(end - start, 1e-12)
        return scaled


def flat_samples(blur_extent: float) -> int:
    """Samples (pixels) that must be flat beside an edge: a fifth of the blur, at least 3."""
    return max(3, round(0.2 * blur_extent))


def find_transition(strip: Strip, blur_extent: float) -> Transition | None:
    """The transition next to the middle of a strip; None if a side is nowhere flat.

    From the steepest place outwards, a side starts where the mean profile changes, over the
    flat length, by no more than a few percent of the contrast and the noise of its slope.
    """
    mean, noise = strip.weights @ strip.profile, row_noise(strip.signal)
    flat = flat_samples(blur_extent)
    peak = steepest_sample(mean, strip.across, blur_extent)
    if peak is None:
        return None
    ramp = (np.arange(flat + 1) - flat / 2) / (flat * (flat + 1) * (flat + 2) / 12)
    slope = np.abs(np.correlate(mean, ramp, mode="valid"))  # NaN outside the image
    limit = slope_limit(mean, peak, flat, blur_extent)
    limit += 4 * noise / np.sqrt(len(strip.along)) * float(np.linalg.norm(ramp))
    found = level_around(slope <= limit, peak, flat)
    if found is None:
        return None
    first, last = found
    profile = strip.profile.T
    sides = [profile[first - flat : first + 1], profile[last : last + flat + 1]]
    means = np.stack([side.mean(axis=0) for side in sides])
    return Transition(profile, first, last, flat, means, noise)


def level_around(level: BoolArray, peak: int, flat: int) -> tuple[int, int] | None:
    """Last sample of the nearest flat side before the peak, and first of that after it.

    `level` tells of each sample whether the profile is flat from there over `flat` samples.
    """
    after = np.flatnonzero(level[peak:])
    before = np.flatnonzero(level[: max(peak - flat + 1, 0)][::-1])
    if len(after) == 0 or len(before) == 0:
        return None
    return max(peak - int(before[0]), flat), peak + int(after[0])


def steepest_sample(mean: FloatArray, across: FloatArray, blur_extent: float) -> int | None:
    """Sample of the largest slope, smoothed over the blur, within half of it from the middle."""
    near = np.flatnonzero((np.abs(across) <= blur_extent / 2) & np.isfinite(mean))
    if len(near) < 3:
        return None
    slope = np.abs(ndimage.correlate1d(mean[near], smooth_slope(max(blur_extent / 10, 0.7))))
    return int(near[slope.argmax()])


@cache
def smooth_slope(sigma: float) -> FloatArray:
    """Weights that tell the slope of what is smoothed by a Gaussian, shape (odd,)."""
    radius = int(4 * sigma + 0.5)
    x = np.arange(-radius, radius + 1)
    gaussian = np.exp(-0.5 * (x / sigma) ** 2)
    weights: FloatArray = x / sigma**2 * gaussian / gaussian.sum()
    return weights


def slope_limit(mean: FloatArray, peak: int, flat: int, blur_extent: float) -> float:
    """Largest slope that counts as flat: 5 % of the steepest, 2 % of contrast over the side.

    The first alone would cut off the long weak tail of a PSF with a sharp peak.
    """
    half = int(np.ceil(blur_extent / 2))
    near = mean[max(peak - half, 0) : peak + half + 1]
    near = near[np.isfinite(near)]
    steepest = float(np.abs(slopes(near)).max())
    return min(0.05 * steepest, 0.02 * float(np.ptp(near)) / flat)


def row_noise(signal: FloatArray) -> float:
    """Standard deviation of a sample, from the differences of neighboring rows."""
    few = signal[:, ::2]  # half of them are plenty
    apart = np.abs(few[1:] - few[:-1]).ravel()
    if np.isnan(apart.sum()):
        apart = apart[np.isfinite(apart)]
    if apart.size == 0:
        return ROUNDING
    median = np.partition(apart, apart.size // 2)[apart.size // 2]
    # 1.4826 turns a median deviation into a standard one, sqrt(2) a difference into a value.
    return max(float(median) * 1.4826 / sqrt(2), ROUNDING)
