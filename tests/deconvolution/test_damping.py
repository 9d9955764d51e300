"""Richardson-Lucy held back: by total variation, and where the light is explained."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from napari_crfdeblur.deconvolution import (
    LightNoise,
    PlaneStatistics,
    RichardsonLucy,
    deconvolve,
)
from napari_crfdeblur.deconvolution.damping import smoothed, undamped


def hook() -> NDArray[np.float64]:
    psf = np.zeros((7, 5))
    psf[1:6, 1], psf[5, 1:] = 1, 2
    return psf / psf.sum()


def cells(noise: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Even disks on dark ground, blurred, with photon noise."""
    rows, columns = np.mgrid[:70, :90]
    scene = np.full((70, 90), 0.05)
    scene[(rows - 30) ** 2 + (columns - 35) ** 2 < 200] = 0.6
    scene[(rows - 45) ** 2 / 2 + (columns - 65) ** 2 < 90] = 1.0
    blurred = ndimage.convolve(scene, hook(), mode="nearest")
    blurred += np.random.default_rng(1).normal(size=scene.shape) * noise * np.sqrt(blurred)
    return scene, blurred


@pytest.mark.parametrize(
    "method", [RichardsonLucy(100, total_variation=0.01), RichardsonLucy(100, damping=3.0)]
)
def test_even_areas_stay_even(method):
    scene, blurred = cells(0.03)
    errors = [
        np.mean((deconvolve(blurred, hook(), each) - scene)[8:-8, 8:-8] ** 2)
        for each in (method, RichardsonLucy(100))
    ]
    # measured: a fifth and a third of the squared error
    assert errors[0] < 0.6 * errors[1]


@pytest.mark.parametrize("options", [{"total_variation": 0.01}, {"damping": 2.0}])
def test_changes_of_scale_commute_and_nothing_is_negative(options):
    blurred, method = cells(0.02)[1], RichardsonLucy(15, **options)
    restored = deconvolve(blurred, hook(), method)
    assert restored.min() >= 0
    np.testing.assert_allclose(deconvolve(40 * blurred, hook(), method), 40 * restored, rtol=1e-5)


def test_the_divergence_is_that_of_the_unit_gradient():
    rng = np.random.default_rng(2)
    scene, share = 1 + rng.random((9, 12)), rng.random((9, 12))
    down, right = (np.roll(scene, -1, axis) - scene for axis in (0, 1))
    down, right = down / np.hypot(down, right), right / np.hypot(down, right)
    divergence = down - np.roll(down, 1, 0) + right - np.roll(right, 1, 1)
    # the gradients of this scene are all above the one that has no direction
    np.testing.assert_allclose(
        smoothed(share, scene, 0.05), 1 / (1 / share - 0.05 * divergence), rtol=1e-9
    )


def test_an_even_scene_and_hidden_pixels_are_left_alone():
    share = np.array([[0.0, 1.0, 1.2]])
    np.testing.assert_array_equal(smoothed(share, np.full((1, 3), 0.4), 0.1), share)
    assert smoothed(share, np.array([[0.1, 0.9, 0.3]]), 0.1)[0, 0] == 0


def test_what_is_explained_is_not_followed():
    light = np.full(5, 0.5)
    statistics = PlaneStatistics(0.1, 1.0, LightNoise(0.02, 0.0, 1e-6, 0.01))
    recorded = light + np.array([0.0, 0.05, 0.1, 0.3, -0.3])  # noise .1 there
    kept = undamped(recorded, light, statistics, 2.0)
    assert kept[0] == 0
    assert kept[1] < 1e-6  # half a standard deviation
    assert kept[2] < 1e-3
    np.testing.assert_allclose(kept[3:], 1)  # three, where two are asked for


def test_without_a_model_noise_is_the_same_everywhere():
    recorded, light = np.array([0.1, 0.9]), np.array([0.15, 0.95])
    kept = undamped(recorded, light, PlaneStatistics(0.02, 1.0), 2.0)
    np.testing.assert_allclose(kept, 1)


@pytest.mark.parametrize(
    "options", [{"total_variation": -0.1}, {"total_variation": 0.2}, {"damping": -1.0}]
)
def test_bad_parameters_are_refused(options):
    with pytest.raises(ValueError, match="expected"):
        RichardsonLucy(**options)
