"""The noise of a picture as a line over its light, for noise that is known."""

import numpy as np
import pytest
from scipy import ndimage

from napari_crfdeblur.deconvolution import (
    LightNoise,
    LocalShrinkage,
    deconvolve,
    fit_noise,
    measure,
    noise_level,
)


def scene(shape=(200, 230), seed=1):
    """Soft light between .03 and 1, most of it dark, as in linear photos."""
    soft = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=shape), 6)
    soft = (soft - soft.min()) / np.ptp(soft)
    return 0.03 + 0.97 * soft**2.2


def textured(shape=(200, 230), seed=2):
    """Patches of strong texture, blurred by two pixels, on soft light."""
    rng = np.random.default_rng(seed)
    patches = ndimage.gaussian_filter(rng.normal(size=shape), 8) > 0.04
    light = scene(shape) * (1 + 0.5 * patches * rng.normal(size=shape))
    return ndimage.gaussian_filter(light, 2)


@pytest.mark.parametrize("light", [scene(), textured()], ids=["soft", "textured"])
@pytest.mark.parametrize(
    ("gain", "offset"), [(1e-3, 1e-6), (3e-4, 1e-5), (1e-4, 1e-4), (0.0, 1e-4), (1e-3, 0.0)]
)
def test_the_noise_is_that_of_the_picture(light, gain, offset):
    variance = gain * light + offset
    plane = light + np.random.default_rng(3).normal(size=light.shape) * np.sqrt(variance)
    found = fit_noise(plane)
    # 3000 pixels a level: 3 % of statistical error; texture adds to it
    assert found.level == pytest.approx(np.sqrt(variance.mean()), rel=0.08)
    levels = np.quantile(light, [0.1, 0.5, 0.95])
    expected = np.sqrt(gain * levels + offset)
    np.testing.assert_allclose(np.sqrt(found.variance(levels)), expected, rtol=0.15)


def test_the_mean_noise_is_more_than_the_median():
    light = scene() ** 2
    plane = light + np.random.default_rng(4).normal(size=light.shape) * 0.03 * np.sqrt(light)
    assert measure(plane).noise == pytest.approx(0.03 * np.sqrt(light.mean()), rel=0.05)
    assert noise_level(plane) < 0.9 * measure(plane).noise


def test_affine_changes_change_the_model_alike():
    plane = scene() + np.random.default_rng(5).normal(size=(200, 230)) * 0.02
    here, there = fit_noise(plane), fit_noise(30 * plane - 4)
    light = np.array([0.1, 0.5, 0.9])
    np.testing.assert_allclose(there.variance(30 * light - 4), 900 * here.variance(light))


def test_large_pictures_and_volumes_are_sampled(monkeypatch):
    plane = np.random.default_rng(6).normal(0.5, 0.02, (300, 310))
    monkeypatch.setattr("napari_crfdeblur.deconvolution.light_noise.SAMPLES", 3000)
    assert fit_noise(plane).level == pytest.approx(0.02, rel=0.06)
    assert fit_noise(plane.reshape(3, 100, 310)).level == pytest.approx(0.02, rel=0.06)


@pytest.mark.parametrize("plane", [np.full((9, 8), 0.3), np.zeros((2, 9)), np.ones((1, 1))])
def test_a_plane_without_detail_has_no_noise(plane):
    assert fit_noise(plane) == LightNoise(0.0, 0.0, 0.0, 0.0)


def test_few_pixels_have_one_level():
    plane = np.random.default_rng(7).normal(0.5, 0.02, (12, 13))
    found = fit_noise(plane)
    assert found.gain == 0
    assert found.level == pytest.approx(0.02, rel=0.3)  # of 110 correlated pixels


def test_the_noise_of_a_dark_picture_is_not_underrated():
    light = scene()
    blurred = ndimage.gaussian_filter(light, 1.5)
    blurred += np.random.default_rng(8).normal(size=light.shape) * 0.03 * np.sqrt(blurred)
    rows = np.exp(-((np.arange(-6, 7)) ** 2) / (2 * 1.5**2))
    psf = np.outer(rows, rows)
    restored = deconvolve(blurred, psf, LocalShrinkage())
    inner = np.s_[10:-10, 10:-10]
    noise = blurred - ndimage.gaussian_filter(light, 1.5)
    # a scene that is hardly blurred at all: what matters is that noise is not amplified
    assert np.std((restored - light)[inner]) < np.std(noise[inner])


@pytest.mark.parametrize(
    "values", [(-1.0, 0.0, 0.0, 0.0), (0.0, np.nan, 0.0, 0.0), (0.0, 0.0, -1.0, 0.0)]
)
def test_bad_parameters_are_refused(values):
    with pytest.raises(ValueError, match="expected"):
        LightNoise(*values)
