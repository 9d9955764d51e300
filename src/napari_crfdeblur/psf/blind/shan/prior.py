"""How likely gradients of a sharp picture are, and the likeliest one near a rough one."""

import numpy as np

from ...._typing import FloatArray

# Sec. 3.2 of the paper, for 256 levels of gray; here full contrast is 1.
LEVELS = 255.0
SLOPE = 2.7 * LEVELS
CURVATURE = 6.1e-4 * LEVELS**2
OFFSET = 5.0
# Where both pieces meet, ``SLOPE x = CURVATURE x^2 + OFFSET``.
KNEE = (SLOPE - np.sqrt(SLOPE**2 - 4 * CURVATURE * OFFSET)) / (2 * CURVATURE)


def penalty(gradient: FloatArray) -> FloatArray:
    """Negative logarithm of the density of a gradient, less what is constant.

    ``2.7 |x|`` up to the knee, ``6.1e-4 x^2 + 5`` beyond it, `x` in 256 levels: the two pieces that
    Shan et al. (2008), Sec. 3.2, fitted to the gradients of natural pictures.

    Parameters
    ----------
    gradient : ndarray
        For a picture of contrast 1.
    """
    size = np.abs(gradient)
    far = np.float32(CURVATURE) * np.square(size) + np.float32(OFFSET)
    return np.where(size <= KNEE, np.float32(SLOPE) * size, far)


def most_likely(
    rough: FloatArray, coupling: float, blurred: FloatArray, local: FloatArray, weight: float
) -> FloatArray:
    """Minimize ``w penalty(p) + m (p - b)^2 + c (p - r)^2`` for each gradient `p`.

    Both pieces of the penalty have their minimum in closed form; the lower one is taken. Shan et
    al. (2008), Sec. 4.1.

    Parameters
    ----------
    rough, blurred : ndarray, shape (2, M, N)
        `r`, gradient of the picture at hand, and `b`, that of the blurred one.
    coupling : float
        `c`.
    local : ndarray, shape (M, N)
        `m`: how much a smooth place must stay as smooth as it is.
    weight : float
        `w`.
    """
    total = local + np.float32(coupling)
    pulled = (local * blurred + np.float32(coupling) * rough) / total
    size, sign = np.abs(pulled), np.sign(pulled)
    near = np.clip(size - np.float32(weight * SLOPE / 2) / total, 0, np.float32(KNEE))
    curved = np.float32(weight * CURVATURE)
    far = np.maximum(total * size / (total + curved), np.float32(KNEE))
    cost_near = np.float32(weight * SLOPE) * near + total * np.square(near - size)
    cost_far = curved * np.square(far) + np.float32(weight * OFFSET)
    cost_far += total * np.square(far - size)
    return np.asarray(sign * np.where(cost_near <= cost_far, near, far), rough.dtype)
