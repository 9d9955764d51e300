"""Noise of pictures full of texture, and slight blur, which leaves the texture there."""

import numpy as np
import pytest
from leaves import leaves, recorded
from scipy import ndimage

from napari_crfdeblur.deconvolution import LightNoise, deconvolve, fit_noise, measure
from napari_crfdeblur.deconvolution.quiet import quiet_share
from napari_crfdeblur.pipeline import DEFAULT_METHOD
from napari_crfdeblur.psf import as_psf, gaussian, line
from napari_crfdeblur.psf.misfit import misfit


def grass(shape=(230, 290), seed=1):
    """Fine texture almost everywhere, finest and strongest at the right; and some soft sky."""
    rng = np.random.default_rng(seed)
    strength = np.linspace(0.02, 0.12, shape[1]) * np.ones((shape[0], 1))
    strength[:60, :120] = 0
    soft = ndimage.gaussian_filter(rng.normal(size=shape), 20)
    leaves = ndimage.gaussian_filter(rng.normal(size=shape), 0.6)
    return (0.5 + soft + strength * leaves / leaves.std()).clip(0.02, 0.98)


@pytest.mark.parametrize("noise", [0.002, 0.01])
def test_texture_is_no_noise(noise):
    plane = recorded(grass(), as_psf(gaussian(0.3)), noise, seed=2)
    assert fit_noise(plane).level > 1.5 * noise  # most pixels show more
    assert measure(plane).noise == pytest.approx(noise, rel=0.3)


@pytest.mark.parametrize("shape", [(200, 230), (512, 384), (3, 190, 180)])
@pytest.mark.parametrize("gain", [0.0, 1e-4])
def test_noise_alone_is_all_noise(shape, gain):
    rng = np.random.default_rng(3)
    light = 0.1 + 0.9 * np.linspace(0, 1, shape[-1]) * np.ones(shape)
    plane = light + rng.normal(size=shape) * np.sqrt(1e-4 + gain * light)
    share = quiet_share(plane, fit_noise(plane))
    assert 0.88 <= share <= 1


def test_scaling_scales_all_variances():
    model = LightNoise(1e-3, -1e-5, 1e-6, 3e-4)
    light = np.linspace(0, 1, 7)
    half = model.scaled(0.5)
    np.testing.assert_allclose(half.variance(light), model.variance(light) / 2)
    assert half.mean == model.mean / 2


@pytest.mark.parametrize(
    "plane", [np.ones((90, 90)), np.zeros((4, 500)), np.eye(40), np.zeros((200, 200)) + np.eye(200)]
)
def test_without_enough_blocks_of_detail_all_counts(plane):
    assert quiet_share(plane, LightNoise(0, 1e-4, 0, 1e-4)) == 1


def test_affine_changes_do_not_matter():
    plane = recorded(grass(), as_psf(gaussian(0.4)), 0.005, seed=2)
    here, there = measure(plane), measure(30 * plane - 4)
    assert there.noise == pytest.approx(30 * here.noise)


@pytest.mark.parametrize(("psf", "told"), [(gaussian(0.5), False), (line(6.0, 0.3), True)])
def test_only_a_psf_that_blocks_something_tells_its_misfit(psf, told):
    found = misfit([recorded(grass(), as_psf(psf), 0.005, seed=2)], as_psf(psf))
    assert (found is not None) is told


@pytest.mark.parametrize("noise", [0.001, 0.005, 0.02])
@pytest.mark.parametrize("width", [0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1.0])
def test_undoing_a_slight_blur_does_no_harm(width, noise):
    sharp, psf = (
        leaves((190, 230), count=1500, smallest=1, lights=(0.1, 0.9)),
        as_psf(gaussian(width)),
    )
    plane = recorded(sharp, psf, noise, seed=2)
    restored = deconvolve(plane, psf, DEFAULT_METHOD)
    inside = (slice(9, -9),) * 2
    errors = [np.mean((each - sharp)[inside] ** 2) for each in (restored, plane)]
    assert errors[0] < errors[1]
