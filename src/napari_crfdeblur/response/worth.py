"""What a pixel is worth once the response is undone: little where that is steep."""

import numpy as np

from .. import arguments
from .._typing import FloatArray
from .base import ResponseCurve

LEVELS = 1024  # of light, at which the slope of an inverse response is known
# Slope of an inverse response from which a pixel is worth less; it is 1 on average. Those of usual
# curves stay below, and the noise that grows with the light is measured besides.
STEEP = 2.5
LEAST = 0.5  # weight that the least pixel must fall below, for weights to be of any use


def pixel_worth(linear: FloatArray, curve: ResponseCurve) -> FloatArray | None:
    """What each pixel of a plane is worth, from the slope of the inverse response.

    Noise, quantization and compression have a standard deviation in what was recorded, and the
    slope of the inverse response times it in linear light. What the light says of its noise, a
    straight line, is measured on the picture; a shoulder, where the light of a tenth of the range
    is in the last few codes, is far steeper than that. There a pixel is worth
    ``(2.5 / s)^2``, `s` the slope there.

    Parameters
    ----------
    linear : ndarray
        Relative irradiance, any shape.
    curve : ResponseCurve
        The response.

    Returns
    -------
    ndarray, the shape of `linear`, optional
        0 to 1, float32; None if no pixel is worth much less than the others.
    """
    arguments.instance(curve, ResponseCurve, "a response curve")
    linear = arguments.array(linear, "light as an array", kinds=("float",), finite=True)
    if linear.size == 0:
        return None
    light = np.linspace(1 / LEVELS, 1, LEVELS)
    table = np.minimum(1, np.square(STEEP * curve.slope(light))).astype(np.float32)
    codes = (np.clip(linear, 0, 1) * (LEVELS - 1) + 0.5).astype(np.int32)
    lowest, highest = int(codes.min()), int(codes.max())
    if table[lowest : highest + 1].min() > LEAST:
        return None
    worth: FloatArray = table[codes]
    return worth
