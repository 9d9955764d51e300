"""The one plane of a color photo in which its blur is seen best."""

import numpy as np

from ..._typing import BoolArray, FloatArray

SAMPLES = 1 << 18  # pixels, about, that decide: more do not change the weights
STRONG = 0.9  # share of the gradients that are weaker than those that decide


def gray_of(
    linear: FloatArray, clipped: BoolArray | None = None
) -> tuple[FloatArray, BoolArray | None]:
    """The plane of a photo in which its edges show best, and its clipped pixels.

    Any weighted sum of the channels is blurred by the same PSF. The weights are those of the
    greatest contrast: the first principal component of the strongest gradients. An edge between
    colors of equal brightness, which the mean of the channels does not have, counts too.

    Parameters
    ----------
    linear : ndarray, shape (M, N) or (M, N, 3)
        Relative irradiance.
    clipped : ndarray of bool, the shape of `linear`, optional
        Pixels that the camera saturated.

    Returns
    -------
    ndarray, shape (M, N), and ndarray of bool, shape (M, N), or None
        float32, of weights whose magnitudes are 1 in sum; clipped where any channel is.
    """
    if linear.ndim == 2:
        return np.asarray(linear, np.float32), clipped
    gray = np.asarray(linear @ channel_weights(linear), dtype=np.float32)
    return gray, None if clipped is None else np.asarray(clipped.any(axis=2))


def channel_weights(linear: FloatArray) -> FloatArray:
    """Weights of the channels, float32, shape (C,), that give the strongest edges."""
    every = 1 + linear.shape[0] * linear.shape[1] // SAMPLES
    rows = np.asarray(linear[::every], dtype=np.float64)
    down = np.asarray(linear[1::every], dtype=np.float64) - rows[: len(linear[1::every])]
    steps = np.concatenate([x.reshape(-1, x.shape[2]) for x in (np.diff(rows, axis=1), down)])
    strength = np.square(steps).sum(axis=1)
    strong = steps[strength >= np.quantile(strength, STRONG)] if len(steps) else steps
    direction = np.linalg.eigh(strong.T @ strong)[1][:, -1]
    weights = direction / np.abs(direction).sum()
    return np.asarray(weights if weights.sum() >= 0 else -weights, dtype=np.float32)
