"""Differences, filters and their transposes, whole and block by block, along every axis."""

import numpy as np
import pytest
from adjoints import PRECISIONS, SHAPES, dot_test, linearity_test, uneven_psf, vector

from napari_crfdeblur import arrays, fourier
from napari_crfdeblur.boundary import frame
from napari_crfdeblur.deconvolution import irls, local_shrinkage, loops, recorded
from napari_crfdeblur.deconvolution.differences import add_adjoint, difference, subtract_behind
from napari_crfdeblur.progress import drain
from napari_crfdeblur.psf.blind import edge_prediction
from napari_crfdeblur.psf.blind.blurred import Blurred
from napari_crfdeblur.psf.blind.shan import kernel, latent
from napari_crfdeblur.psf.radon.method import roughness

AXES = [(shape, axis) for shape in SHAPES for axis in range(len(shape))]
PLANES = [shape for shape in SHAPES if len(shape) == 2]


def across(values, axis):
    """The adjoint along an axis but the first."""
    part = np.zeros_like(values)
    add_adjoint(part, values, axis)
    return part


def behind(values):
    """The adjoint along the first axis, of a whole picture."""
    part = np.empty_like(values)
    subtract_behind(part, values, values[-1:])
    return part


@pytest.mark.parametrize("dtype", PRECISIONS)
@pytest.mark.parametrize(("shape", "axis"), AXES)
def test_differences_have_their_adjoint_along_every_axis(shape, axis, dtype):
    adjoint = (lambda y: across(y, axis)) if axis else behind
    dot_test(lambda x: difference(x, axis), adjoint, shape, shape, dtype)
    dot_test(lambda x: difference(x, axis), lambda y: across(y, axis), shape, shape, dtype)


@pytest.mark.parametrize(("shape", "axis"), AXES)
def test_differences_are_forward_and_periodic(shape, axis):
    plane = vector(shape, 1)
    np.testing.assert_array_equal(difference(plane, axis), np.roll(plane, -1, axis=axis) - plane)


@pytest.mark.parametrize("height", [1, 3, 5])
@pytest.mark.parametrize("shape", SHAPES)
def test_blocks_of_differences_and_of_their_adjoint_are_those_of_the_whole(shape, height):
    plane, values = vector(shape, 2), vector(shape, 3)
    for start in range(0, shape[0], height):
        block = slice(start, min(start + height, shape[0]))
        following = plane[block.stop % shape[0]][None]
        np.testing.assert_array_equal(
            difference(plane[block], 0, following), difference(plane, 0)[block]
        )
        part = np.empty_like(values[block])
        subtract_behind(part, values[block], values[start - 1][None])
        np.testing.assert_array_equal(part, behind(values)[block])


@pytest.mark.parametrize("shape", SHAPES)
def test_the_power_of_differences_is_that_of_their_spectrum(shape):
    plane = vector(shape, 4)
    powers = fourier.gradient_power(shape, plane)
    normal = sum(across(difference(plane, axis), axis) for axis in range(len(shape)))
    laplacian = fourier.laplacian_power(powers)
    found = fourier.inverse(fourier.forward(plane) * laplacian, shape)
    np.testing.assert_allclose(found, normal, atol=1e-13)
    rows = [fourier.laplacian_power(powers, slice(row, row + 2)) for row in range(0, shape[0], 2)]
    np.testing.assert_array_equal(np.concatenate(rows), laplacian)


@pytest.mark.parametrize("dtype", PRECISIONS)
@pytest.mark.parametrize("axes", [2, 3])
def test_derivatives_of_all_orders_have_their_adjoint(axes, dtype):
    orders = list(irls._derivatives(axes))
    assert len(set(orders)) == len(orders) == 2 * axes + axes * (axes - 1) // 2
    for each in orders:
        dot_test(
            lambda x, each=each: irls._derivative(x, each),
            lambda y, each=each: irls._adjoint(y, each),
            SHAPES[0] if axes == 2 else SHAPES[4],
            SHAPES[0] if axes == 2 else SHAPES[4],
            dtype,
        )


@pytest.mark.parametrize("dtype", PRECISIONS)
@pytest.mark.parametrize("block", [1, 1 << 16])
@pytest.mark.parametrize("shape", [(17, 24), (16, 9), (6, 7, 10)])
def test_the_system_of_reweighted_least_squares_is_its_own_adjoint(
    shape, block, dtype, monkeypatch
):
    monkeypatch.setattr(arrays, "BLOCK", block)
    psf = uneven_psf((3, 5, 3)[: len(shape)])
    plane = np.zeros(tuple(side - 3 for side in shape), dtype)
    transfer = fourier.otf(psf, shape, dtype)
    clipped = vector(plane.shape, 5) > 1
    blur = recorded.MaskedBlur(transfer, np.zeros(shape, dtype), plane, clipped)
    orders = list(irls._derivatives(len(shape)))
    weights = [np.abs(vector(shape, seed, dtype)) for seed, _ in enumerate(orders)]
    system = irls._System(blur, weights)
    at = irls.Progress("system", 0, 1)

    def applied(x):
        return drain(system.applying(x, at))

    dot_test(applied, applied, shape, shape, dtype)
    dot_test(*[lambda x: drain(system.preconditioning(x, at))] * 2, shape, shape, dtype)
    x = vector(shape, 6, dtype)
    mask = np.zeros(shape)
    mask[frame(plane.shape)] = ~clipped
    energy = np.vdot(mask * fourier.convolve(x, transfer) ** 2, np.ones(shape)) + sum(
        np.vdot(weight, irls._derivative(x, each) ** 2)
        for weight, each in zip(weights, orders, strict=True)
    )
    assert np.vdot(x, applied(x)) == pytest.approx(energy, rel=1e-5)


@pytest.mark.parametrize("dtype", PRECISIONS)
@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize(("shape", "axis"), [((9, 6), 0), ((9, 6), 1), ((4, 5, 7), 1)])
def test_filters_of_local_shrinkage_have_their_adjoint(shape, axis, order, dtype):
    inside = tuple(side - 2 * (own == axis) for own, side in enumerate(shape))

    def back(y):
        wide = np.pad(y, [(2 * (own == axis),) * 2 for own in range(len(shape))])
        return local_shrinkage._filtered_back(wide, axis, order)

    dot_test(lambda x: dict(local_shrinkage._filtered(x, axis))[order], back, shape, inside, dtype)


@pytest.mark.parametrize("dtype", PRECISIONS)
@pytest.mark.parametrize("shape", [*SHAPES, (1, 6, 7)])
def test_without_a_threshold_local_shrinkage_is_its_own_adjoint(shape, dtype):
    def kept(x):
        return local_shrinkage.shrink(x, 0.0)

    dot_test(kept, kept, shape, shape, dtype)


@pytest.mark.parametrize("dtype", PRECISIONS)
@pytest.mark.parametrize("shape", [(9, 6), (6, 11), (5, 5)])
def test_the_loops_are_linear_where_nothing_is_shrunk(shape, dtype):
    work = np.empty((2, shape[1]), dtype)

    def kept(x):
        pull = np.empty_like(x)
        shares = (1 / np.outer(local_shrinkage.NORMS, local_shrinkage.NORMS)).ravel().astype(dtype)
        none, nothing = np.empty((0, 0), dtype), dtype(local_shrinkage.NOTHING)
        loops.shrink_details(x, none, dtype(0), shares, nothing, pull)
        return pull

    def laplacian(x):
        loops.shrink_gradient(x, np.ones(2, dtype), dtype(1), work[0], work[1])
        return x

    for operator in (kept, laplacian):
        dot_test(operator, operator, shape, shape, dtype)
    plane = vector(shape, 7, dtype)
    limit = 1e-12 if dtype is np.float64 else 1e-4
    np.testing.assert_allclose(kept(plane), local_shrinkage.shrink(plane, 0.0), atol=limit)
    normal = sum(across(difference(plane, axis), axis) for axis in (0, 1))
    np.testing.assert_allclose(laplacian(plane.copy()), normal, atol=limit)


@pytest.mark.parametrize("dtype", PRECISIONS)
@pytest.mark.parametrize("shape", PLANES)
def test_the_divergence_of_edge_prediction_is_the_adjoint_of_its_gradient(shape, dtype):
    dot_test(
        lambda x: np.stack(edge_prediction._steps(x, 0.0)),
        lambda y: edge_prediction.divergence(*y),
        shape,
        (2, *shape),
        dtype,
    )


@pytest.mark.parametrize("shape", PLANES)
def test_gradients_of_either_border_agree_inside(shape):
    plane = vector(shape, 8)
    periodic = np.stack(edge_prediction._steps(plane, 0.0))
    ending = edge_prediction.gradient(plane)
    np.testing.assert_array_equal(ending[0, :-1], periodic[0, :-1])
    np.testing.assert_array_equal(ending[1, :, :-1], periodic[1, :, :-1])
    assert not ending[0, -1].any()
    assert not ending[1, :, -1].any()
    linearity_test(edge_prediction.gradient, shape)


@pytest.mark.parametrize("shape", PLANES)
def test_transforms_of_differences_give_the_gradient_and_its_adjoint(shape):
    steps = latent.differences(shape)
    plane, values = vector(shape, 9, np.float32), vector((2, *shape), 10, np.float32)
    np.testing.assert_allclose(
        latent.gradient_of(fourier.forward(plane), steps, shape),
        np.stack(edge_prediction._steps(plane, 0.0)),
        atol=1e-5,
    )
    pulled = sum(np.conj(s) * fourier.forward(v) for s, v in zip(steps, values, strict=True))
    np.testing.assert_allclose(
        fourier.inverse(pulled, shape), edge_prediction.divergence(*values), atol=1e-5
    )


def test_derivatives_that_model_noise_are_linear():
    blurred = Blurred(vector((12, 17), 11, np.float32))
    linearity_test(lambda x: kernel.derivatives(x, blurred), (12, 17), np.float32)


@pytest.mark.parametrize("size", [1, 2, 5])
def test_roughness_is_the_energy_of_differences_with_zeros_around(size):
    psf, matrix = vector((size, size), 12), roughness(size)
    wide = np.pad(psf, 1)
    energy = sum(np.square(np.diff(wide, axis=axis)).sum() for axis in (0, 1))
    assert psf.ravel() @ matrix @ psf.ravel() == pytest.approx(energy, rel=1e-12)
    np.testing.assert_array_equal(matrix, matrix.T)
