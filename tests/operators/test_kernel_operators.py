"""The normal equations of PSFs between two pictures, against convolutions by their definition."""

import numpy as np
import pytest
from adjoints import dot_test, linearity_test, uneven_psf, vector
from scipy import fft, signal

from napari_crfdeblur import fourier
from napari_crfdeblur.psf.blind import pyramid
from napari_crfdeblur.psf.blind.fergus import kernel_posterior
from napari_crfdeblur.psf.blind.fergus.ensemble import System
from napari_crfdeblur.psf.blind.kernel_fit import KernelFit, around_origin
from napari_crfdeblur.psf.blind.variational.nonnegative import NonnegativeFit
from napari_crfdeblur.psf.field.poses import Poses, rendering
from napari_crfdeblur.psf.shapes import render
from napari_crfdeblur.simulate import CameraMotion

SIZES = [1, 3, 7]
every_size = pytest.mark.parametrize("size", SIZES)


def blurred_by(psf, gradients):
    """Whole convolution of each gradient with a PSF, the PSF's middle its origin."""
    return np.stack([signal.convolve(each, psf, method="direct") for each in gradients])


def in_frame(wide, size, shape):
    """The part of a whole convolution that lies in the frame of the pictures."""
    half = size // 2
    return wide[:, half : half + shape[0], half : half + shape[1]]


@every_size
@pytest.mark.parametrize("shape", [(23, 34), (30, 17)])
def test_the_fit_of_a_psf_is_that_of_whole_convolutions(size, shape):
    sharp, blurred = vector((2, *shape), 1), vector((2, *shape), 2)
    fit, pixels = KernelFit.of(sharp, blurred, size), (size, size)
    dot_test(fit.blurred_twice, fit.blurred_twice, pixels, pixels)
    linearity_test(fit.blurred_twice, pixels)
    for seed in range(3):
        psf, other = vector(pixels, 3 + seed), vector(pixels, 6 + seed)
        wide = blurred_by(psf, sharp)
        assert np.vdot(fit.blurred_twice(psf), other) == pytest.approx(
            np.vdot(wide, blurred_by(other, sharp)), rel=1e-9, abs=1e-9
        )
        # the correlation is the adjoint of blurring the sharp gradient, applied to the blurred
        assert np.vdot(fit.correlation, psf) == pytest.approx(
            np.vdot(blurred, in_frame(wide, size, shape)), rel=1e-9, abs=1e-9
        )
        misses = wide.copy()
        in_frame(misses, size, shape)[...] -= blurred
        left = np.square(misses).sum() / np.square(blurred).sum()
        assert fit.residual(psf) == pytest.approx(left, rel=1e-9)


def periodic(psf, gradients):
    """Circular convolution of each gradient with a PSF."""
    transfer = fourier.otf(psf, gradients.shape[1:], np.float64)
    return np.stack([fourier.convolve(each, transfer) for each in gradients])


@every_size
@pytest.mark.parametrize("shape", [(24, 35), (30, 18)])
def test_the_bounded_fit_of_a_psf_is_that_of_circular_convolutions(size, shape):
    sharp, blurred = vector((2, *shape), 4), vector((2, *shape), 5)
    pixels = (size, size)
    fit = NonnegativeFit.of(fft.rfft2(sharp), fft.rfft2(blurred), shape, size)
    dot_test(lambda k: fit._image(k, 0.7), lambda k: fit._image(k, 0.7), pixels, pixels)
    for seed in range(3):
        psf, other = vector(pixels, 6 + seed), vector(pixels, 9 + seed)
        product = np.vdot(periodic(psf, sharp), periodic(other, sharp)) + 0.7 * np.vdot(psf, other)
        assert np.vdot(fit._image(psf, 0.7), other) == pytest.approx(product, rel=1e-9, abs=1e-9)
        correlated = np.vdot(blurred, periodic(psf, sharp))
        assert np.vdot(fit.correlation, psf) == pytest.approx(correlated, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("shape", [(24, 35), (9, 16)])
def test_the_system_of_the_ensemble_is_its_own_adjoint_and_positive(shape):
    transfer = fourier.otf(uneven_psf((5, 3)), shape, np.float64)
    precision = np.abs(vector((2, *shape), 6))
    system, both = System(transfer, fourier.power(transfer) / 0.3, precision), (2, *shape)
    dot_test(system.product, system.product, both, both)
    x = vector(both, 7)
    energy = np.square(periodic(uneven_psf((5, 3)), x)).sum() / 0.3 + (precision * x**2).sum()
    assert np.vdot(x, system.product(x)) == pytest.approx(energy, rel=1e-12)


@every_size
def test_the_product_with_an_autocorrelation_is_its_own_adjoint(size):
    own = signal.correlate(*[vector((11, 14), 8)] * 2, method="direct")
    middle = np.array(own.shape) // 2
    own = own[tuple(slice(m - size + 1, m + size) for m in middle)]
    pixels = (size, size)

    def product(values):
        return kernel_posterior._product(own, values)

    dot_test(product, product, pixels, pixels)
    values = vector(pixels, 9)
    expected = signal.convolve(own, values, method="direct")
    inside = (slice(size - 1, 2 * size - 1),) * 2
    np.testing.assert_allclose(product(values), expected[inside], atol=1e-10)


@pytest.mark.parametrize("reach", [0, 1, 3])
@pytest.mark.parametrize("shape", [(9, 14), (4, 5)])
def test_around_the_origin_shifts_count_both_ways(shape, reach):
    plane = vector(shape, 10)
    found = around_origin(plane, reach)
    for down, right in np.ndindex(found.shape):
        assert found[down, right] == plane[(down - reach) % shape[0], (right - reach) % shape[1]]


@pytest.mark.parametrize("target", [(10, 14), (33, 50), (21, 34)])
def test_resampling_is_linear_and_keeps_what_is_even(target):
    linearity_test(lambda x: pyramid.resized(x, target), (21, 34), tolerance=50)
    np.testing.assert_allclose(pyramid.resized(np.full((21, 34), 0.6), target), 0.6, rtol=1e-12)


TURNS = np.array([-0.03, 0.0, 0.05])


@pytest.mark.parametrize("size", [5, 9])
@pytest.mark.parametrize("offset", [(0.0, 0.0), (12.0, -31.0), (-7.5, 20.25)])
def test_the_psf_of_poses_is_linear_in_their_times_and_loses_no_light_inside(size, offset):
    matrix, count = rendering(TURNS, offset, size), size * size
    assert matrix.shape == (count, len(TURNS) * count)
    dot_test(lambda times: matrix @ times, lambda psf: matrix.T @ psf, (3 * count,), (count,))
    kept = np.asarray(matrix.sum(axis=0)).reshape(len(TURNS), size, size)
    for turn, part in zip(TURNS, kept, strict=True):
        shift = np.array([turn * offset[1], -turn * offset[0]])
        places = np.indices((size, size)) + shift[:, None, None]
        inside = ((places >= 0) & (places <= size - 1)).all(axis=0)
        np.testing.assert_allclose(part[inside], 1, rtol=1e-12)
        assert part.max() <= 1 + 1e-12
    still = np.zeros((len(TURNS), size, size))
    still[1] = uneven_psf((size, size))
    np.testing.assert_allclose(Poses(TURNS, still).psf_at(offset), still[1], atol=1e-15)


def test_small_turns_of_poses_are_those_of_a_camera():
    offset, turns = (40.0, -55.0), np.array([-0.01, 0.0, 0.02])
    times = np.zeros((3, 9, 9))
    times[:, 4, 4] = 1 / 3
    found = Poses(turns, times).psf_at(offset)
    motion = CameraMotion(np.zeros((3, 2)), turns)
    places = np.indices((9, 9)) - 4
    mean = (places * found).sum(axis=(1, 2))
    # of first order in the turn: what is left of a turn by .02 is a fiftieth of a pixel
    np.testing.assert_allclose(mean, motion.path(offset).mean(axis=0), atol=0.02)


def test_drawing_a_path_is_linear_in_the_time_of_its_points():
    path = np.random.default_rng(11).uniform(-3, 3, (12, 2))
    path = np.concatenate([path, -path])  # whatever the weights of pairs, in the middle

    def drawn(times):
        return render(path, np.concatenate([times, times]), 9) * 2 * times.sum()

    one, other = np.random.default_rng(12).random((2, 12))
    np.testing.assert_allclose(drawn(one + 2 * other), drawn(one) + 2 * drawn(other), atol=1e-12)
