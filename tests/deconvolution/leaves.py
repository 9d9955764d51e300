"""Pictures of opaque leaves of all sizes, one over the other, and what a camera records of them."""

import numpy as np
from scipy.signal import fftconvolve

BORDER = 20  # pixels of light beyond the frame: more than the PSFs of the tests reach


def leaves(shape, *, count, smallest, lights, seed=4):
    """Rectangles of 60 pixels and less, down to the smallest, of lights from a range."""
    rng = np.random.default_rng(seed)
    sharp = np.full(shape, 0.5)
    for side in 60 / np.arange(1.0, count) ** 0.5:
        row, column = (rng.integers(-int(side), whole) for whole in shape)
        height, width = (smallest + rng.integers(0, 1 + int(side)) for _ in range(2))
        sharp[max(row, 0) : row + height, max(column, 0) : column + width] = rng.uniform(*lights)
    return sharp


def recorded(sharp, psf, noise, seed):
    """A blurred picture whose light beyond the frame is that within, mirrored; with noise."""
    wide = np.pad(sharp, BORDER, mode="reflect")
    inside = (slice(BORDER, -BORDER),) * 2
    light = fftconvolve(wide, psf, mode="same")[inside]
    return light + np.random.default_rng(seed).normal(0, noise, light.shape)
