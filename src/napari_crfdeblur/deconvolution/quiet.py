"""The quietest places of a picture, which show its noise where texture does not hide it."""

from collections.abc import Iterator
from math import ceil, prod

import numpy as np

from .. import arrays
from .._typing import FloatArray
from .light_noise import SAMPLES, LightNoise, bent_and_mean

SIDE = 16  # pixels of a block: enough for 15 % of its noise variance
FEWEST = 100  # blocks in which there is a quiet one
LEVELS = 6  # of light, equally many blocks in each
QUIETEST = 0.01  # of the blocks of a level
# Which of the levels counts: not the quietest, where noise may only grow otherwise than in a line.
LEVEL = 0.25
# What these quantiles are at least of blocks of nothing but white noise, over its variance: .69 on
# average, and hardly ever less than this, so that noise alone is never taken for less.
OF_NOISE = 0.62
DETAILED = 0.5  # share of a block's pixels that have some detail; saturated ones have none


def quiet_share(plane: FloatArray, model: LightNoise) -> float:
    """Share of a modelled noise variance that the quietest places of a plane have, at most 1.

    The finest details of a sharp picture are texture, which no median leaves out when it is
    everywhere. But hardly any picture is textured in all of its parts (Liu, Tanaka & Okutomi 2013,
    Single-image noise level estimation for blind denoising, look for those of weak texture).

    Parameters
    ----------
    plane : ndarray, shape (M, N) or (Z, M, N)
        In the unit of the model. Of large planes only some rows are used.
    model : LightNoise
        Noise as it seems from all places.
    """
    if model.mean <= 0:
        return 1.0
    found = [_blocks(band, model) for band in _bands(plane)]
    if not found:
        return 1.0
    light, energy = (np.concatenate(each) for each in zip(*found, strict=True))
    if len(energy) < FEWEST:
        return 1.0
    levels = np.array_split(np.argsort(light), LEVELS)
    quiet = [np.quantile(energy[level], QUIETEST) for level in levels]
    return float(min(np.quantile(quiet, LEVEL) / OF_NOISE, 1.0))


def _bands(plane: FloatArray) -> Iterator[FloatArray]:
    """Rows as many as a block and its border have, spread evenly over every slice."""
    rows, columns = plane.shape[-2:]
    if min(rows, columns) < SIDE + 2:
        return
    every = SIDE * ceil(prod(plane.shape) / (4 * SAMPLES))
    for index in np.ndindex(*plane.shape[:-2]):
        for start in range(0, rows - SIDE - 1, every):
            yield arrays.to_numpy(plane[(*index, slice(start, start + SIDE + 2), ...)])


def _blocks(band: FloatArray, model: LightNoise) -> tuple[FloatArray, FloatArray]:
    """Light and noise variance over the modelled one of the blocks of a band that have detail."""
    bent, mean = bent_and_mean(*(band[start : start + SIDE] for start in range(3)))
    share = _cut((bent / 6) ** 2 / model.variance(mean))
    detailed = (share > 0).mean(axis=(0, 2)) > DETAILED
    return _cut(mean).mean(axis=(0, 2))[detailed], share.mean(axis=(0, 2))[detailed]


def _cut(rows: FloatArray) -> FloatArray:
    """Blocks side by side, shape (SIDE, B, SIDE)."""
    return rows[:, : rows.shape[1] // SIDE * SIDE].reshape(SIDE, -1, SIDE)
