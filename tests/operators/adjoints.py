"""What the tests of operators share: random vectors, the dot test, PSFs of no symmetry."""

from collections.abc import Callable

import numpy as np

from napari_crfdeblur._typing import FloatArray
from napari_crfdeblur.progress import Progress

AT = Progress("operator", 0, 1)
Operator = Callable[[FloatArray], FloatArray]

# Of the product of the norms: what rounding adds to a scalar product, transforms included. Ten
# times what was measured.
ROUNDING = {np.float32: 2e-6, np.float64: 4e-15}
PRECISIONS = list(ROUNDING)
# Rows, columns, planes: odd and even, not square, and narrower than a PSF.
SHAPES = [(17, 24), (16, 9), (1, 30), (33, 2), (6, 7, 10), (5, 8, 3)]


def vector(shape: tuple[int, ...], seed: int, dtype: type = np.float64) -> FloatArray:
    """Normal random numbers."""
    return np.random.default_rng(seed).standard_normal(shape).astype(dtype)


def uneven_psf(sides: tuple[int, ...], seed: int = 0) -> FloatArray:
    """Positive values, sum 1, unlike any of their mirror images."""
    psf = np.random.default_rng([seed, *sides]).random(sides) + 0.01
    psf.flat[1 % psf.size] += 2
    return psf / psf.sum()


def dot_test(
    forward: Operator,
    adjoint: Operator,
    source: tuple[int, ...],
    target: tuple[int, ...],
    dtype: type = np.float64,
    seeds: range = range(3),
) -> None:
    """``<K x, y> = <x, K' y>`` for random `x` of shape `source` and `y` of shape `target`."""
    for seed in seeds:
        x, y = vector(source, 2 * seed, dtype), vector(target, 2 * seed + 1, dtype)
        image, back = forward(x.copy()), adjoint(y.copy())
        assert image.shape == y.shape
        assert back.shape == x.shape
        assert image.dtype == back.dtype == dtype
        # added up in double precision, so that the operators alone are judged
        one, other = _dot(image, y), _dot(x, back)
        size = np.sqrt(_dot(image, image) * _dot(y, y)) + np.sqrt(_dot(x, x) * _dot(back, back))
        assert abs(one - other) <= ROUNDING[dtype] * size
        assert size > 0 or 1 in source  # along an axis of one pixel nothing differs


def linearity_test(
    forward: Operator, source: tuple[int, ...], dtype: type = np.float64, tolerance: float = 10.0
) -> None:
    """``K (a x + b z) = a K x + b K z``, but for `tolerance` times the rounding."""
    x, z = vector(source, 11, dtype), vector(source, 12, dtype)
    a, b = dtype(0.7), dtype(-1.6)
    parts = a * forward(x.copy()) + b * forward(z.copy())
    whole = forward(a * x + b * z)
    limit = tolerance * ROUNDING[dtype] * np.abs(parts).max()
    np.testing.assert_allclose(whole, parts, rtol=0, atol=limit)
    assert limit > 0


def _dot(first: FloatArray, second: FloatArray) -> float:
    return float(np.vdot(first.astype(np.float64), second.astype(np.float64)))
