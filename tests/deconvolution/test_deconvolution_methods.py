"""What is particular to one method, against its formula or another implementation."""

import numpy as np
import pytest
from scipy import ndimage
from skimage import restoration

from napari_crfdeblur import arrays, fourier
from napari_crfdeblur.deconvolution import (
    HyperLaplacian,
    RichardsonLucy,
    SparseIrls,
    Wiener,
    deconvolve,
    noise_level,
)
from napari_crfdeblur.deconvolution import hyper_laplacian as hl


def smooth(shape: tuple[int, int], seed: int) -> np.ndarray:
    picture = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=shape), 2)
    return 0.5 + 0.15 * picture / picture.std()


def hook() -> np.ndarray:
    psf = np.zeros((7, 5))
    psf[1:6, 1], psf[5, 1:] = 1, 2
    return psf / psf.sum()


@pytest.mark.parametrize("exponent", [0.5, 2 / 3, 0.8])
@pytest.mark.parametrize("beta", [1.0, 8.0, 181.0])
def test_shrinkage_minimizes_its_objective(exponent, beta):
    threshold = hl._threshold(beta, exponent)
    values = threshold * np.array([-20, -3, -1.1, -1.02, -0.98, -0.5, 0, 0.3, 0.97, 1.05, 7])
    found = hl._shrunk(values.copy(), beta, exponent)
    grid = np.linspace(-21, 21, 420001) * threshold
    for value, shrunk in zip(values, found, strict=True):
        objective = np.abs(grid) ** exponent + beta / 2 * (grid - value) ** 2
        # a table cell is 1/256 of the threshold, over which the slope is at most 3 or so
        assert shrunk == pytest.approx(grid[objective.argmin()], abs=0.01 * threshold)


def test_large_differences_are_hardly_shrunk():
    values = np.array([1e3, -1e6, 1e12])
    np.testing.assert_allclose(hl._shrunk(values.copy(), 8.0, 2 / 3), values)


def test_the_blocked_gradient_is_the_plain_one(monkeypatch):
    plane = np.random.default_rng(2).normal(size=(23, 17))
    down, across = (hl._shrunk(np.roll(plane, -1, axis) - plane, 8.0, 2 / 3) for axis in (0, 1))
    expected = np.roll(down, 1, 0) - down + np.roll(across, 1, 1) - across
    monkeypatch.setattr(arrays, "BLOCK", 5 * 17)
    hl.shrink_gradient(plane, 8.0, 2 / 3)
    np.testing.assert_allclose(plane, expected, atol=1e-12)


@pytest.mark.parametrize("method", [HyperLaplacian, SparseIrls])
def test_more_work_lowers_the_objective(method):
    sharp, psf = (smooth((60, 70), 3) > 0.5).astype(float), hook()
    blurred = ndimage.convolve(sharp, psf, mode="wrap")
    blurred += np.random.default_rng(4).normal(0, 0.01, blurred.shape)

    def objective(x: np.ndarray) -> float:
        inner = np.s_[8:-8, 8:-8]  # where the border has no say
        misfit = (ndimage.convolve(x, psf, mode="wrap") - blurred)[inner]
        differences = [np.diff(x[inner], axis=axis) for axis in (0, 1)]
        # contrast of this picture is 1 to within a factor of 2
        return float((misfit**2).sum() / 2 + 1e-3 * sum(np.abs(d).sum() for d in differences))

    rough, fine = (
        (method(1e-3, stages=2), method(1e-3))
        if method is HyperLaplacian
        else (method(1e-3, iterations=1, steps=1), method(1e-3))
    )
    assert objective(deconvolve(blurred, psf, fine)) < objective(deconvolve(blurred, psf, rough))


def test_wiener_is_its_formula_far_from_the_border():
    plane, psf, weight = smooth((90, 100), 5), hook(), 0.02
    rows, columns = fourier.gradient_power(plane.shape, float)
    transfer = fourier.otf(psf, plane.shape, float)
    gain = np.conj(transfer) / (abs(transfer) ** 2 + weight * (rows[:, None] + columns))
    expected = fourier.inverse(gain * fourier.forward(plane), plane.shape)
    # the influence of the border falls off as that of the filter, to 1e-4 at 40 pixels
    np.testing.assert_allclose(
        deconvolve(plane, psf, Wiener(weight))[40:-40, 40:-40],
        expected[40:-40, 40:-40],
        atol=1e-3,
    )


def test_richardson_lucy_agrees_with_scikit_image_far_from_the_border():
    plane, psf = ndimage.convolve(smooth((90, 100), 6), hook()), hook()
    # scikit-image's PSF is centered like ours for odd sides; 5 steps reach 5 * 2 * 3 pixels
    # at most, and it starts from .5 everywhere, as we do from a mean of .5
    plane += 0.5 - plane.mean()
    expected = restoration.richardson_lucy(plane, psf, num_iter=5, clip=False)
    np.testing.assert_allclose(
        deconvolve(plane, psf, RichardsonLucy(5))[36:-36, 36:-36],
        expected[36:-36, 36:-36],
        rtol=1e-5,  # at dark corners scikit-image divides by 1e-12, which its FFT spreads
    )


def test_richardson_lucy_keeps_the_light():
    points = np.zeros((50, 60))
    points[20:32:4, 22:40:5] = 1
    blurred = ndimage.convolve(points, hook(), mode="constant")
    restored = deconvolve(blurred, hook(), RichardsonLucy(50))
    # every step preserves the sum of the data that the frame holds
    assert restored.sum() == pytest.approx(blurred.sum(), rel=1e-3)
    assert restored[20, 22] > 0.8 > 3 * blurred.max()


@pytest.mark.parametrize("sigma", [0.002, 0.01, 0.05])
def test_the_noise_level_is_that_of_the_noise(sigma):
    noise = np.random.default_rng(7).normal(0, sigma, (200, 210))
    plane = ndimage.gaussian_filter(smooth((200, 210), 8), 3) + noise
    # 4e4 correlated samples: 1 % of statistical error
    assert noise_level(plane) == pytest.approx(sigma, rel=0.05)


def test_the_noise_level_of_a_large_plane_comes_from_some_of_its_rows(monkeypatch):
    plane = np.random.default_rng(9).normal(0, 0.02, (300, 310))
    monkeypatch.setattr("napari_crfdeblur.deconvolution.noise.SAMPLES", 10000)
    assert noise_level(plane) == pytest.approx(0.02, rel=0.05)


def test_saturated_areas_do_not_hide_the_noise():
    plane = 0.5 + np.random.default_rng(10).normal(0, 0.02, (100, 110))
    plane[:70] = 1
    # the two rows where both meet count too
    assert noise_level(plane) == pytest.approx(0.02, rel=0.15)


@pytest.mark.parametrize("plane", [np.full((5, 5), 0.3), np.zeros((2, 9)), np.ones((1, 1))])
def test_a_plane_without_detail_has_no_noise(plane):
    assert noise_level(plane) == 0


@pytest.mark.parametrize("method", [Wiener, SparseIrls, HyperLaplacian])
def test_a_larger_weight_is_smoother(method):
    plane = smooth((60, 70), 11) + np.random.default_rng(12).normal(0, 0.02, (60, 70))
    rough, even = (deconvolve(plane, hook(), method(weight=w)) for w in (1e-4, 1e-2))
    assert np.abs(np.diff(even)).sum() < np.abs(np.diff(rough)).sum()
