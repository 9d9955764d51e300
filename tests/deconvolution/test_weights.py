"""What a pixel is worth: nothing depends on those that are worth nothing, and less on others."""

import numpy as np
import pytest
from leaves import leaves, recorded

from napari_crfdeblur.deconvolution import (
    HyperLaplacian,
    LocalShrinkage,
    RichardsonLucy,
    SparseIrls,
    Strengthened,
    Tiled,
    TotalVariation,
    Wiener,
    deconvolve,
    deconvolve_slices,
    deconvolve_varying,
)
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.psf import PsfField, PsfStatus, as_psf, kernel_a
from napari_crfdeblur.response import SRGB, Gamma, Tabulated, pixel_worth

METHODS = [
    LocalShrinkage(),
    HyperLaplacian(),
    TotalVariation(iterations=12),
    SparseIrls(),
    RichardsonLucy(12),
    Wiener(),
    Strengthened(Wiener(), 1.5),
    Tiled(LocalShrinkage(), side=140),
]
PSF = as_psf(kernel_a())
INSIDE = (slice(10, -10),) * 2


@pytest.fixture(scope="module")
def sharp():
    return leaves((110, 140), count=400, smallest=3, lights=(0.05, 0.9))


@pytest.fixture(scope="module")
def plane(sharp):
    return recorded(sharp, PSF, 0.005, seed=3).astype(np.float32)


@pytest.fixture(scope="module")
def dust(plane):
    """Where nothing was recorded: single pixels, and two spots."""
    lost = np.random.default_rng(5).random(plane.shape) < 0.01
    lost[40:45, 60:66] = lost[80:84, 20:23] = True
    return lost


def error(found, sharp):
    return float(np.sqrt(np.mean((found - sharp)[INSIDE] ** 2)))


@pytest.mark.parametrize("method", METHODS, ids=repr)
def test_weights_that_are_alike_change_nothing(method, plane):
    free = deconvolve(plane, PSF, method)
    found = deconvolve(plane, PSF, method, weights=np.full(plane.shape, 3.0))
    np.testing.assert_array_equal(found, free)


@pytest.mark.parametrize("method", METHODS, ids=repr)
def test_what_pixels_without_worth_hold_does_not_matter(method, plane, dust):
    weights = (~dust).astype(float)
    black, white = (
        deconvolve(np.where(dust, np.float32(light), plane), PSF, method, weights=weights)
        for light in (0.0, 1.0)
    )
    np.testing.assert_array_equal(black, white)


@pytest.mark.parametrize("method", METHODS, ids=repr)
def test_dust_is_filled_in(method, plane, dust, sharp):
    dusty = np.where(dust, np.float32(0), plane)
    whole = error(deconvolve(plane, PSF, method), sharp)
    told = error(deconvolve(dusty, PSF, method, weights=~dust), sharp)
    untold = error(deconvolve(dusty, PSF, method), sharp)
    assert told < 1.3 * whole
    assert untold > 1.1 * told


@pytest.mark.parametrize("method", METHODS[:6], ids=repr)
def test_pixels_that_are_noisier_count_less(method, plane, sharp):
    noisy = np.zeros(plane.shape, dtype=bool)
    noisy[50:58, 30:110] = True
    noise = np.random.default_rng(6).normal(0, 0.2, plane.shape)
    taken = (plane + noisy * noise).astype(np.float32)
    weights = np.where(noisy, (0.005 / 0.2) ** 2, 1)
    told = error(deconvolve(taken, PSF, method, weights=weights), sharp)
    assert told < 0.98 * error(deconvolve(taken, PSF, method), sharp)


def test_only_ratios_count(plane, dust):
    weights = np.where(dust, 0.2, 1.0)
    one, other = (deconvolve(plane, PSF, Wiener(), weights=unit * weights) for unit in (1, 40))
    np.testing.assert_allclose(one, other, atol=1e-6)


def test_each_channel_and_each_slice_has_its_own(plane, dust):
    weights = np.stack([~dust, np.ones_like(dust), ~dust[::-1]], axis=-1)
    colors = np.stack([plane, plane[::-1], plane], axis=-1)
    found = deconvolve(colors, PSF, Wiener(), weights=weights)
    for channel in range(3):
        alone = deconvolve(colors[..., channel], PSF, Wiener(), weights=weights[..., channel])
        np.testing.assert_array_equal(found[..., channel], alone)
    stack, worth = np.moveaxis(colors, -1, 0), np.moveaxis(weights, -1, 0)
    slices = deconvolve_slices(stack, PSF, Wiener(), weights=worth)
    np.testing.assert_array_equal(slices, np.moveaxis(found, -1, 0))


def test_volumes_have_weights_too():
    rng = np.random.default_rng(2)
    volume, psf = rng.random((12, 30, 28), np.float32), as_psf(rng.random((3, 5, 5)))
    lost = rng.random(volume.shape) < 0.02
    black, white = (
        deconvolve(np.where(lost, np.float32(light), volume), psf, Wiener(), weights=~lost)
        for light in (0, 1)
    )
    np.testing.assert_array_equal(black, white)


def test_blur_that_varies_has_weights_too(plane, dust, sharp):
    statuses = ((PsfStatus.GOOD, PsfStatus.GOOD),)
    field = PsfField(np.stack([PSF, PSF])[None], statuses, plane.shape)
    dusty = np.where(dust, np.float32(0), plane)
    told, untold = (
        error(deconvolve_varying(dusty, field, Wiener(), weights=weights), sharp)
        for weights in (~dust, None)
    )
    assert told < 0.7 * untold


@pytest.mark.parametrize("wrong", [-1.0, np.nan, np.inf])
def test_weights_that_are_none_are_refused(plane, wrong):
    weights = np.ones(plane.shape)
    weights[3, 4] = wrong
    with pytest.raises(ValueError, match="finite weights"):
        deconvolve(plane, PSF, Wiener(), weights=weights)


def test_weights_of_another_shape_or_all_zero_are_refused(plane):
    with pytest.raises(ValueError, match="finite weights of shape"):
        deconvolve(plane, PSF, Wiener(), weights=np.ones((3, 4)))
    with pytest.raises(CrfDeblurError, match="all weights are zero"):
        deconvolve(plane, PSF, Wiener(), weights=np.zeros(plane.shape))


def shoulder():
    """A response with a tenth of the light in its last five codes."""
    light = np.linspace(0, 1, 401)
    below = 250 / 255 * SRGB().to_intensity(np.minimum(light / 0.9, 1))
    return Tabulated(light, np.where(light < 0.9, below, 1 - (1 - light) / 0.1 * 5 / 255))


def test_on_a_shoulder_pixels_are_worth_little_and_elsewhere_the_same():
    light = np.linspace(0, 0.99, 200, dtype=np.float32).reshape(10, 20)
    worth = pixel_worth(light, shoulder())
    assert worth.shape == light.shape
    assert worth[light > 0.92].max() < 0.3
    assert worth[(light > 0.05) & (light < 0.6)].min() == 1


@pytest.mark.parametrize("curve", [SRGB(), Gamma(2.2), Gamma(1.0)], ids=repr)
def test_usual_responses_need_no_weights(curve):
    light = np.random.default_rng(2).uniform(0.02, 1, (30, 40)).astype(np.float32)
    assert pixel_worth(light, curve) is None
