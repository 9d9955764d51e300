"""How much noise there is in the gradient of a blurred picture."""

import numpy as np
from scipy import ndimage

from .blurred import Blurred

SECOND = np.array([1.0, -2.0, 1.0])  # difference
NORMAL_MEDIAN = 0.6745  # of the magnitude of normal noise of deviation 1


def noise_of_gradients(blurred: Blurred) -> float:
    """Standard deviation of the noise in differences between neighboring pixels.

    By the median of what is neither plane nor straight edge, as Immerkaer (1996, Fast noise
    variance estimation, CVIU 64) filters it; a blurred picture has hardly anything else there.
    """
    rest = ndimage.convolve1d(ndimage.convolve1d(blurred.plane, SECOND, axis=0), SECOND, axis=1)
    seen = rest if blurred.usable is None else rest[blurred.usable > 0]
    deviation = np.median(np.abs(seen)) / (NORMAL_MEDIAN * np.sum(np.square(SECOND)))
    return float(np.sqrt(2) * deviation)
