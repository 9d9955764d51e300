"""Shrinkage by the neighborhood: its filters, its thresholds, and what it is better at."""

from functools import partial

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import fft, ndimage

from napari_crfdeblur import fourier
from napari_crfdeblur.deconvolution import HyperLaplacian, deconvolve, loops, measure
from napari_crfdeblur.deconvolution import local_shrinkage as ls
from napari_crfdeblur.deconvolution.light_noise import LightNoise
from napari_crfdeblur.deconvolution.local_shrinkage import LocalShrinkage
from napari_crfdeblur.deconvolution.noise import PlaneStatistics
from napari_crfdeblur.progress import drain


def hook() -> NDArray[np.float64]:
    psf = np.zeros((7, 5))
    psf[1:6, 1], psf[5, 1:] = 1, 2
    return psf / psf.sum()


def weave(shape: tuple[int, int]) -> NDArray[np.float64]:
    """Fine texture on the left, smooth light on the right."""
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    texture = 0.12 * np.sin(1.2 * rows + 0.36 * columns) * np.sin(columns - 0.45 * rows)
    return 0.5 + np.where(columns < shape[1] // 2, texture, 0) + 0.2 * np.sin(columns / 30)


def plain_shrinkage(plane, threshold):
    """The same filters and neighborhoods by other functions, one filter at a time."""
    basis = fft.dct(np.eye(3), axis=0, norm="ortho")
    total = np.zeros_like(plane)
    for orders in np.ndindex((3,) * plane.ndim):
        if not any(orders):
            continue
        mask = np.ones((1,) * plane.ndim)
        for axis, order in enumerate(orders):
            mask = mask * np.expand_dims(basis[order], [a for a in range(plane.ndim) if a != axis])
        details = ndimage.correlate(plane, mask, mode="wrap")
        energy = ndimage.uniform_filter(details**2, 5, mode="wrap")
        shrunk = details * np.maximum(0, 1 - threshold / energy)
        total += ndimage.convolve(shrunk, mask, mode="wrap")
    return total


@pytest.mark.parametrize("shape", [(23, 17), (6, 7, 9), (31,)])
def test_blocks_of_filters_are_the_plain_ones(shape, monkeypatch):
    plane = np.random.default_rng(2).normal(size=shape)
    monkeypatch.setattr(ls, "BLOCK", 1)  # the least height
    # blocks of 16 rows: two of them in the first case
    np.testing.assert_allclose(ls.shrink(plane, 0.7), plain_shrinkage(plane, 0.7), atol=1e-12)


@pytest.mark.parametrize("shape", [(23, 17), (5, 4), (2, 3)])
@pytest.mark.parametrize("scaled", [False, True])
@pytest.mark.parametrize(("dtype", "tolerance"), [(np.float32, 1e-5), (np.float64, 1e-13)])
def test_the_compiled_loop_is_the_plain_one(shape, scaled, dtype, tolerance, monkeypatch):
    pytest.importorskip("numba")
    rng = np.random.default_rng(9)
    plane = rng.normal(size=shape).astype(dtype)
    before = plane.copy()
    factors = rng.uniform(1, 3, shape).astype(dtype) if scaled else None
    plain = ls.shrink(plane, 0.7, factors)
    monkeypatch.setattr(loops, "LEAST_SIZE", 0)
    # rounding of sums of some 20 terms, in another order
    np.testing.assert_allclose(ls.shrink(plane, 0.7, factors), plain, rtol=0, atol=tolerance)
    np.testing.assert_array_equal(plane, before)


def test_without_a_threshold_the_filters_keep_what_their_power_says():
    plane = np.random.default_rng(3).normal(size=(18, 25))
    power = partial(ls._power, fourier.gradient_power(plane.shape, float))(slice(None))
    expected = fourier.inverse(power * fourier.forward(plane), plane.shape)
    np.testing.assert_allclose(ls.shrink(plane, 0.0), expected, atol=1e-12)


def test_factors_of_the_threshold_count_where_they_are():
    plane = np.random.default_rng(4).normal(size=(40, 60))
    factors = np.where(np.arange(60) < 30, 1.0, 3.0) * np.ones((40, 1))
    found = ls.shrink(plane, 0.5, factors)
    # three columns from the step, no filter reaches across it
    np.testing.assert_allclose(found[:, 3:27], ls.shrink(plane, 0.5)[:, 3:27], atol=1e-12)
    np.testing.assert_allclose(found[:, 33:57], ls.shrink(plane, 1.5)[:, 33:57], atol=1e-12)


def test_a_faint_detail_remains_only_among_others():
    lone, many = np.zeros((41, 41)), np.zeros((41, 41))
    lone[20, 20] = many[20, 20] = 0.5
    many[(np.indices(many.shape).sum(axis=0) % 2 == 0) & (many == 0)] = 0.5
    power = ls.shrink(lone, 0.0)[20, 20]
    assert abs(ls.shrink(lone, 0.02)[20, 20]) < 0.2 * abs(power)
    assert abs(ls.shrink(many, 0.02)[20, 20]) > 0.8 * abs(ls.shrink(many, 0.0)[20, 20])


def test_texture_and_smooth_light_are_restored_better_than_by_one_weight():
    sharp, psf = weave((130, 150)), hook()
    blurred = ndimage.convolve(sharp, psf, mode="wrap")
    blurred += np.random.default_rng(5).normal(0, 0.01, blurred.shape)

    def error(method, part):
        inner = np.s_[8:-8, part]
        return np.mean((deconvolve(blurred, psf, method)[inner] - sharp[inner]) ** 2)

    texture, smooth = slice(8, 67), slice(83, 142)
    # measured: .92 and .42 of the squared error
    assert error(LocalShrinkage(), texture) < error(HyperLaplacian(), texture)
    assert error(LocalShrinkage(), smooth) < 0.6 * error(HyperLaplacian(), smooth)


def test_noise_that_grows_with_the_light_is_removed_in_the_light():
    rng = np.random.default_rng(6)
    light = np.where(np.arange(160) < 80, 0.02, 0.9) * np.ones((120, 1))
    light += 0.1 * light * (ndimage.gaussian_filter(rng.normal(size=light.shape), 1) > 0)
    blurred = ndimage.convolve(light, hook(), mode="wrap")
    blurred += rng.normal(size=light.shape) * np.sqrt(1e-3 * blurred)
    found = measure(blurred)
    level = PlaneStatistics(found.noise, found.contrast)

    def error(statistics):
        job = LocalShrinkage().run(blurred, hook(), statistics=statistics)
        restored = drain(job)
        inner = np.s_[8:-8, 8:-8]
        return np.mean((np.sqrt(np.maximum(restored, 0)) - np.sqrt(light))[inner] ** 2)

    # measured: .84 of the squared error
    assert error(found) < 0.95 * error(level)


def test_a_model_without_slope_changes_nothing():
    plane = weave((50, 60)) + np.random.default_rng(7).normal(0, 0.02, (50, 60))
    flat = PlaneStatistics(0.02, 1.0, LightNoise(0.0, 4e-4, 1e-5, 4e-4))
    assert ls._noisiness(plane, flat) is None


@pytest.mark.parametrize("options", [{"stages": 1}, {"weight": 0.0}, {"model_error": 1.0}])
def test_bad_parameters_are_refused(options):
    with pytest.raises(ValueError, match="expected"):
        LocalShrinkage(**options)


def test_a_larger_weight_is_smoother():
    plane = weave((60, 70)) + np.random.default_rng(8).normal(0, 0.02, (60, 70))
    rough, even = (deconvolve(plane, hook(), LocalShrinkage(weight=w)) for w in (1e-6, 1e-4))
    assert np.abs(np.diff(even)).sum() < np.abs(np.diff(rough)).sum()
