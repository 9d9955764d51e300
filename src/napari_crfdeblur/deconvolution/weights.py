"""What the pixels of a picture are worth: weights, and a first guess where they are none."""

import numpy as np
from scipy import ndimage

from .. import arguments, arrays
from .._typing import FloatArray
from ..errors import CrfDeblurError

WORTHLESS = 0.1  # weight below which a pixel is guessed from its neighbors at first
SCALES = (1, 2, 4, 8, 16, 32)  # pixels: standard deviations of the neighborhoods, the next wider
SEEN = 1e-3  # weight that a neighborhood must hold to tell anything


def checked_weights(weights: FloatArray | None, linear: FloatArray) -> FloatArray | None:
    """Weights as methods take them, at most 1, of the kind of the image; None if all are alike.

    Raises
    ------
    ValueError
        Of another shape, negative, or not finite.
    CrfDeblurError
        All of them are zero.
    """
    if weights is None:
        return None
    what = f"finite weights of shape {tuple(linear.shape)}, 0 or more"
    found = arguments.array(weights, what, kinds=("float", "int", "uint", "bool"), finite=True)
    if tuple(found.shape) != tuple(linear.shape):
        raise arguments.refusal(what, found)
    values = np.asarray(arrays.to_numpy(found), dtype=np.float64)
    if values.size and values.min() < 0:
        raise arguments.refusal(what, found)
    most = float(values.max()) if values.size else 0.0
    if most == 0:
        raise CrfDeblurError("all weights are zero: no pixel was recorded; give weights above 0")
    if values.min() == most:
        return None
    relative: FloatArray = arrays.contiguous(arrays.like(values / most, linear))
    return relative


def of_plane(weights: FloatArray) -> FloatArray | None:
    """The weights of one plane of several; None if they are alike there."""
    xp = arrays.namespace(weights)
    if float(xp.min(weights)) == float(xp.max(weights)):
        return None
    own: FloatArray = arrays.contiguous(weights)
    return own


def guessed(plane: FloatArray, weights: FloatArray) -> FloatArray:
    """A plane in which pixels without worth hold the mean of those around them that have some.

    Whatever they held would ring in a first step that takes all pixels alike.

    Parameters
    ----------
    plane, weights : ndarray, shape (M, N) or (Z, M, N)
    """
    light = np.asarray(arrays.to_numpy(plane), dtype=np.float64)
    worth = np.asarray(arrays.to_numpy(weights), dtype=np.float64)
    guess = np.full(light.shape, np.average(light, weights=worth))
    for scale in reversed(SCALES):
        near = ndimage.gaussian_filter(worth, scale)
        mean = ndimage.gaussian_filter(worth * light, scale) / np.maximum(near, SEEN)
        guess = np.where(near > SEEN, mean, guess)
    share = np.minimum(worth / WORTHLESS, 1)
    result: FloatArray = arrays.like(guess + share * (light - guess), plane)
    return result
