"""Transforms, blur and its adjoint: on planes and volumes of any shape, at either precision."""

import array_api_strict as strict
import numpy as np
import pytest
from adjoints import (
    AT,
    PRECISIONS,
    ROUNDING,
    SHAPES,
    dot_test,
    linearity_test,
    uneven_psf,
    vector,
)

from napari_crfdeblur import arrays, fourier
from napari_crfdeblur.progress import drain

# A PSF for every shape: odd and even sides, as large as the picture, one pixel.
SIDES = {2: [(5, 3), (4, 7), (1, 6), (1, 1)], 3: [(3, 5, 2), (1, 1, 3), (4, 3, 3)]}
CASES = [
    (shape, tuple(min(pair) for pair in zip(shape, sides, strict=True)))
    for shape in SHAPES
    for sides in SIDES[len(shape)]
]


def rolled(plane, psf, sign=1):
    """Circular convolution (or correlation) by its definition: a sum of shifted pictures."""
    total = np.zeros_like(plane, dtype=np.float64)
    for tap in np.ndindex(psf.shape):
        shift = [sign * (t - side // 2) for t, side in zip(tap, psf.shape, strict=True)]
        total += psf[tap] * np.roll(plane, shift, axis=range(plane.ndim))
    return total


@pytest.fixture(params=[1 << 16, 1], ids=["at once", "row by row"])
def blocked(request, monkeypatch):
    monkeypatch.setattr(arrays, "BLOCK", request.param)


@pytest.mark.parametrize("dtype", PRECISIONS)
@pytest.mark.parametrize(("shape", "sides"), CASES)
@pytest.mark.usefixtures("blocked")
def test_correlation_is_the_adjoint_of_convolution(shape, sides, dtype):
    transfer = fourier.otf(uneven_psf(sides), shape, dtype)
    dot_test(
        lambda x: fourier.convolve(x, transfer),
        lambda y: fourier.correlate(y, transfer),
        shape,
        shape,
        dtype,
    )


@pytest.mark.parametrize(("shape", "sides"), CASES)
def test_convolution_and_correlation_are_sums_of_shifted_pictures(shape, sides):
    plane, psf = vector(shape, 3), uneven_psf(sides)
    transfer = fourier.otf(psf, shape, plane)
    np.testing.assert_allclose(fourier.convolve(plane, transfer), rolled(plane, psf), atol=1e-13)
    np.testing.assert_allclose(
        fourier.correlate(plane, transfer), rolled(plane, psf, -1), atol=1e-13
    )


@pytest.mark.parametrize("dtype", PRECISIONS)
@pytest.mark.parametrize(("shape", "sides"), CASES)
def test_blur_is_linear_and_keeps_light_kind_and_picture(shape, sides, dtype):
    plane, transfer = vector(shape, 4, dtype), fourier.otf(uneven_psf(sides), shape, dtype)
    linearity_test(lambda x: fourier.convolve(x, transfer), shape, dtype)
    before = plane.copy()
    blurred = fourier.convolve(plane, transfer)
    assert blurred.dtype == dtype
    np.testing.assert_array_equal(plane, before)
    limit = ROUNDING[dtype] * plane.size * 10
    assert blurred.sum() == pytest.approx(float(plane.sum()), abs=limit)


@pytest.mark.parametrize(("shape", "sides"), CASES)
def test_blur_commutes_with_shifts_and_with_blur(shape, sides):
    plane, shift = vector(shape, 5), tuple(range(1, len(shape) + 1))
    first, second = (fourier.otf(uneven_psf(sides, seed), shape, plane) for seed in (0, 1))
    axes = range(plane.ndim)
    np.testing.assert_allclose(
        fourier.convolve(np.roll(plane, shift, axes), first),
        np.roll(fourier.convolve(plane, first), shift, axes),
        atol=1e-13,
    )
    one, other = (
        fourier.convolve(fourier.convolve(plane, a), b)
        for a, b in ((first, second), (second, first))
    )
    np.testing.assert_allclose(one, other, atol=1e-13)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_point_at_its_origin_leaves_the_picture(shape):
    plane = vector(shape, 6)
    for sides in SIDES[len(shape)]:
        point = np.zeros(tuple(min(pair) for pair in zip(shape, sides, strict=True)))
        point[tuple(side // 2 for side in point.shape)] = 1
        transfer = fourier.otf(point, shape, plane)
        np.testing.assert_allclose(fourier.convolve(plane, transfer), plane, atol=1e-14)


@pytest.mark.parametrize(("shape", "sides"), CASES)
def test_the_jobs_are_the_verbs(shape, sides):
    plane, transfer = vector(shape, 7), fourier.otf(uneven_psf(sides), shape, np.float64)
    for job, verb in (
        (fourier.convolving, fourier.convolve),
        (fourier.correlating, fourier.correlate),
    ):
        np.testing.assert_array_equal(drain(job(plane, transfer, AT)), verb(plane, transfer))


@pytest.mark.parametrize("dtype", PRECISIONS)
@pytest.mark.parametrize("shape", SHAPES)
def test_the_inverse_undoes_the_forward_transform(shape, dtype):
    plane = vector(shape, 8, dtype)
    spectrum = fourier.forward(plane)
    assert spectrum.shape == (*shape[:-1], shape[-1] // 2 + 1)
    assert spectrum.real.dtype == dtype
    limit = 10 * ROUNDING[dtype]
    np.testing.assert_allclose(fourier.inverse(spectrum.copy(), shape), plane, rtol=0, atol=limit)
    np.testing.assert_allclose(
        spectrum, np.fft.rfftn(plane), rtol=0, atol=limit * np.abs(spectrum).max()
    )


def whole(spectrum, columns):
    """Weights that make of sums over a half spectrum those over the whole one."""
    weights = np.full(spectrum.shape, 2.0)
    weights[..., 0] = 1
    if columns % 2 == 0:
        weights[..., -1] = 1
    return weights


@pytest.mark.parametrize("shape", SHAPES)
def test_transforms_keep_scalar_products(shape):
    x, y = vector(shape, 9), vector(shape, 10)
    one, other = fourier.forward(x), fourier.forward(y)
    product = (whole(one, shape[-1]) * (one * other.conj()).real).sum() / x.size
    assert product == pytest.approx(np.vdot(x, y), abs=1e-12)
    energy = (whole(one, shape[-1]) * fourier.power(one)).sum() / x.size
    assert energy == pytest.approx(np.vdot(x, x), rel=1e-13)


@pytest.mark.parametrize("shape", SHAPES)
def test_multiplying_by_the_conjugate_is_the_adjoint_of_multiplying(shape):
    transfer = fourier.forward(vector(shape, 13))
    one, other = fourier.forward(vector(shape, 14)), fourier.forward(vector(shape, 15))
    back = other.copy()
    fourier.multiply_conjugate(back, transfer)
    weights = whole(one, shape[-1])
    pairs = (transfer * one, other), (one, back)
    forth, home = ((weights * (a * b.conj()).real).sum() for a, b in pairs)
    assert forth == pytest.approx(home, rel=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_fast_shape_holds_the_shape(shape):
    fast = fourier.fast_shape(shape)
    assert all(large >= side for large, side in zip(fast, shape, strict=True))
    assert fourier.fast_shape(fast) == fast


@pytest.mark.parametrize("dtype", PRECISIONS)
@pytest.mark.parametrize("shape", [(17, 24), (6, 7, 10)])
def test_on_arrays_of_other_libraries_correlation_is_the_adjoint_too(shape, dtype):
    kind = strict.zeros(1, dtype=getattr(strict, dtype.__name__))
    transfer = fourier.otf(uneven_psf(SIDES[len(shape)][0]), shape, kind)

    def on_others(operator):
        return lambda x: np.asarray(operator(strict.asarray(x), transfer))

    dot_test(on_others(fourier.convolve), on_others(fourier.correlate), shape, shape, dtype)
