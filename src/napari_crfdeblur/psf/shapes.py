"""Point spread functions given by a formula: motion, defocus, Gaussian, camera shake.

Every function returns a PSF as an array, shape (H, W): float64, non-negative, sum 1, both
sides odd, centroid on the center pixel. Lengths are in pixels; angles are in radians from the
column axis towards the row axis.
"""

import numpy as np

from .. import arguments
from .._typing import FloatArray
from .base import as_psf

# Points for each pixel of a path; a kink is then misplaced by less than a hundredth of a pixel.
DENSITY = 64
LARGEST = 1001  # side in pixels: beyond any blur that can be undone, and arrays still fit


def delta() -> FloatArray:
    """No blur: ``k = [[1]]``."""
    return np.ones((1, 1))


def line(length: float, angle: float) -> FloatArray:
    """Uniform straight motion over `length` pixels.

    ``k(u) = 1 / length`` for ``u = t (sin angle, cos angle)``, ``|t| <= length / 2``.
    """
    arguments.number(length, "a length in pixels", least=0, most=LARGEST)
    angle = float(arguments.number(angle, "an angle in radians"))
    path = length * np.outer(_middles(length) - 0.5, [np.sin(angle), np.cos(angle)])
    return render(path, np.ones(len(path)))


def disk(radius: float) -> FloatArray:
    """Defocus of an ideal lens: each pixel holds the area of the disk that it covers."""
    arguments.number(radius, "a radius in pixels", least=1 / DENSITY, most=LARGEST / 2)
    half = int(np.ceil(radius - 0.5))
    # Exact along columns; the rows are cut into strips.
    rows = (np.arange((2 * half + 1) * DENSITY) + 0.5) / DENSITY - half - 0.5
    chord = np.sqrt(np.maximum(radius**2 - rows**2, 0.0))[:, None]
    edges = np.arange(2 * half + 2) - half - 0.5
    covered = np.diff(np.clip(edges, -chord, chord), axis=1)
    return as_psf(covered.reshape(2 * half + 1, DENSITY, -1).sum(axis=1))


def gaussian(sigma: float) -> FloatArray:
    """Gaussian of standard deviation `sigma`, integrated over pixels, cut at 4 `sigma`."""
    arguments.number(sigma, "a sigma in pixels", least=1 / DENSITY, most=LARGEST / 8)
    from scipy.special import erf  # loads in a sixth of a second

    half = int(np.ceil(4 * sigma))
    marginal = np.diff(erf((np.arange(2 * half + 2) - half - 0.5) / (np.sqrt(2) * sigma)))
    return as_psf(np.outer(marginal, marginal))


def kernel_a() -> FloatArray:
    """Motion of constant speed along 15 px, as kernel A of Kim et al. 2012, Fig. 1."""
    return line(15.0, np.pi / 12)


def kernel_b() -> FloatArray:
    """Motion of varying speed along a bend of 17 px, as kernel B of Kim et al. 2012, Fig. 1.

    The paper prints A and B as pictures only; these are of the same kind and size. Slow at
    the start and quick at the end, so that B differs from its mirror image in any direction.
    """
    time = _middles(17.0)
    path = np.stack([4.0 * time**2, 17.0 * time], axis=1)
    return render(path, np.where(time < 0.3, 4.0, np.where(time < 0.6, 1.0, 2.0)))


def camera_shake(size: int, seed: int) -> FloatArray:
    """Shake of a hand-held camera: a random walk with inertia, rendered with sub-pixels.

    The velocity follows ``v_(t+1) = (1 - c) v_t + noise``: smooth, of varying speed, hence
    unevenly bright. The path is scaled to touch the border of the `size` x `size` array.

    Parameters
    ----------
    size : int
        Side of the array, odd, at least 3.
    seed : int
        Of the random walk; the same seed gives the same PSF.
    """
    arguments.odd(size, "size", most=LARGEST)
    arguments.whole(seed, "a seed", least=0)
    points = len(_middles(4.0 * size))
    return render(shake_path(size, seed, points), np.ones(points), size)


def shake_path(size: int, seed: int, count: int) -> FloatArray:
    """Path of :func:`camera_shake`: `count` points at equal times, (row, column), mean 0."""
    random = np.random.default_rng(seed)
    velocity = np.zeros((48, 2))
    for step in range(1, len(velocity)):
        velocity[step] = 0.9 * velocity[step - 1] + random.normal(size=2)
    knots = np.cumsum(velocity, axis=0)
    time = (np.arange(count) + 0.5) / count * (len(knots) - 1)
    path = np.stack([np.interp(time, range(len(knots)), axis) for axis in knots.T], axis=1)
    path -= path.mean(axis=0)
    return np.asarray(path * (size // 2 / np.abs(path).max()))


def render(path: FloatArray, weights: FloatArray, size: int = 1) -> FloatArray:
    """Draw a path, shared bilinearly by the four nearest pixels, which keeps its centroid.

    Parameters
    ----------
    path : ndarray, shape (N, 2)
        Points in (row, column), pixels; their centroid comes to lie on the center pixel.
    weights : ndarray, shape (N,)
        Time spent at each point, non-negative.
    size : int
        Smallest side of the array; it grows to hold the path.
    """
    path = path - np.average(path, axis=0, weights=weights)
    # The tolerance keeps a path that ends on a pixel's center from needing one pixel more.
    half = np.maximum(np.ceil(np.abs(path).max(axis=0) - 1e-9).astype(int), size // 2)
    rows, columns = (2 * half + 1).tolist()
    psf = np.zeros((rows, columns))
    corner = np.clip(np.floor(path).astype(int), -half, np.maximum(half - 1, -half))
    across = np.clip(path - corner, 0.0, 1.0)
    for down, right in np.ndindex(2, 2):
        share = np.prod(np.abs([1 - down, 1 - right] - across), axis=1) * weights
        index = corner + half + [down, right]
        np.add.at(psf, (index[:, 0] % rows, index[:, 1] % columns), share)
    return as_psf(psf)


def _middles(length: float) -> FloatArray:
    """Middles of equal intervals of [0, 1], `DENSITY` for each pixel of `length`."""
    count = max(int(np.ceil(length * DENSITY)), 1)
    return (np.arange(count) + 0.5) / count
