"""Edge-spread function: how a PSF blurs a straight step edge of any orientation."""

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments
from .._typing import FloatArray

# Narrowest side of a projected pixel; the closed form divides by it. An edge along the grid
# is thereby smeared by a millionth of a pixel.
NARROWEST = 1e-6


def project(psf: FloatArray, angle: float, positions: ArrayLike) -> FloatArray:
    """Profile of a unit step edge blurred by a PSF: ``s(m)`` of Kim et al. 2012, 4.1.

    The edge has the normal ``n = (sin angle, cos angle)`` in (row, column) and is 1 on the
    side that `n` points to. Its convolution with the PSF `k`, at signed distance `x`, is ::

        s(x) = sum_q k(q) P(x - n . q)

    with `P` the cumulated projection on `n` of a unit square. Seen as the cumulated marginal
    of the PSF, the square is the PSF's pixel; seen as a digital image, it is the image's
    pixel, over which the sharp step is averaged before the discrete convolution with `k`.
    Both give this `s`. It rises from 0 to 1, and ``angle + pi`` gives the opposite polarity,
    ``1 - s(-x)``.

    Parameters
    ----------
    psf : ndarray, shape (H, W)
        Non-negative, sum 1, both sides odd; the center pixel is the origin.
    angle : float
        Of the normal, in radians from the column axis towards the row axis.
    positions : array_like
        Signed distances `x` from the edge along the normal, in pixels, any shape.

    Returns
    -------
    ndarray
        ``s(x)``, the shape of `positions`.
    """
    psf = arguments.array(arguments.addable(psf, "a PSF"), "a PSF (H, W)", axes=(2,), finite=True)
    angle = float(arguments.number(angle, "an angle in radians"))
    positions = arguments.array(positions, "positions", finite=True)
    normal = np.array([np.sin(angle), np.cos(angle)])
    rows, columns = np.nonzero(psf)
    center = np.array(psf.shape) // 2
    offsets = normal @ (np.stack([rows, columns]) - center[:, None])
    order = np.argsort(offsets)
    return _cumulated(offsets[order], psf[rows, columns][order], positions, normal)


def _cumulated(
    offsets: FloatArray, weights: FloatArray, positions: ArrayLike, normal: FloatArray
) -> FloatArray:
    """Sum of all projected pixels, sorted by their offsets, at each position.

    At any position, all pixels but those in a narrow strip lie wholly on one side.
    """
    places = np.asarray(positions, dtype=np.float64)
    reach = np.abs(normal).sum() / 2 + NARROWEST
    first = np.searchsorted(offsets, places - reach)
    widest = np.max(np.searchsorted(offsets, places + reach) - first, initial=0)
    strip = first[..., np.newaxis] + np.arange(widest)
    distances = places[..., np.newaxis] - np.append(offsets, np.full(widest, np.inf))[strip]
    own = np.append(weights, np.zeros(widest))[strip]
    passed = np.append(0.0, np.cumsum(weights))[first]
    return np.asarray(passed + np.einsum("...p,...p", project_pixel(distances, normal), own))


def project_pixel(distances: FloatArray, normal: FloatArray) -> FloatArray:
    """Area of a unit square on one side of a line: the cumulated sum of two uniforms.

    ``P(x) = (R(x+a+b) - R(x+a-b) - R(x-a+b) + R(x-a-b)) / 4ab``, ``R(t) = max(t, 0)^2 / 2``,
    where `a` and `b` are half the projections of the square's sides.
    """
    a, b = np.maximum(np.abs(normal), NARROWEST) / 2
    x = np.clip(distances, -a - b, a + b)
    total = np.zeros_like(x)
    for shift, sign in ((a + b, 1), (a - b, -1), (b - a, -1), (-a - b, 1)):
        total += sign * np.maximum(x + shift, 0.0) ** 2
    return np.asarray(np.clip(total / (8 * a * b), 0.0, 1.0))
