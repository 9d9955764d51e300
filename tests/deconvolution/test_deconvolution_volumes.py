"""Volumes with a PSF of three dimensions, and stacks slice by slice, on known truth."""

from functools import cache

import numpy as np
import pytest
from scipy.signal import fftconvolve

from napari_crfdeblur.deconvolution import (
    HyperLaplacian,
    LocalShrinkage,
    RichardsonLucy,
    SparseIrls,
    TotalVariation,
    Wiener,
    deconvolve,
    deconvolve_slices,
)
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.psf import as_psf

METHODS = [
    Wiener(),
    RichardsonLucy(),
    SparseIrls(),
    HyperLaplacian(),
    LocalShrinkage(),
    TotalVariation(),
]
every_method = pytest.mark.parametrize("method", METHODS, ids=lambda m: type(m).__name__)


def cells(shape, seed=0):
    """Boxes and balls of random brightness."""
    rng = np.random.default_rng(seed)
    grids = np.indices(shape).astype(float)
    scene = np.full(shape, 0.3)
    for _ in range(60):
        center, radii = rng.uniform(0, 1, 3) * shape, rng.uniform(2, 9, 3)
        away = [abs(g - c) / r for g, c, r in zip(grids, center, radii, strict=True)]
        ball = sum(each**2 for each in away) < 1
        scene[ball if rng.random() < 0.5 else np.max(away, axis=0) < 1] = rng.uniform(0.1, 0.9)
    return scene


def hook():
    """No symmetry at all: each axis another side, all flips and turns differ."""
    psf = np.zeros((5, 7, 9))
    psf[0, 1, 1:7], psf[1:5, 1, 6], psf[4, 2:6, 6] = 1, 2, np.arange(1, 5)
    return psf / psf.sum()


def recorded(scene, psf, noise=0.003):
    blurred = fftconvolve(scene, psf, mode="valid")
    sharp = scene[
        tuple(slice(s // 2, s // 2 + n) for s, n in zip(psf.shape, blurred.shape, strict=True))
    ]
    blurred += np.random.default_rng(1).normal(0, noise, blurred.shape)
    return sharp.astype(np.float32), blurred.astype(np.float32)


def decibels(truth, picture):
    return float(-10 * np.log10(np.mean((truth - picture) ** 2)))


@pytest.fixture(scope="module")
def case():
    psf = hook()
    return *recorded(cells((28, 44, 57)), psf), psf


@pytest.fixture(scope="module")
def restored_by(case):
    _, blurred, psf = case
    return cache(lambda method: deconvolve(blurred, psf, method))


@every_method
def test_a_volume_is_sharpened_up_to_its_borders(method, case, restored_by):
    sharp, blurred, _ = case
    restored = restored_by(method)
    assert restored.shape == blurred.shape
    assert restored.dtype == blurred.dtype
    # measured 7 (Richardson-Lucy) to 12 dB; 5 to 9 in the first and last planes
    assert decibels(sharp, restored) > decibels(sharp, blurred) + 5
    for ends in (np.s_[:2], np.s_[-2:]):
        assert decibels(sharp[ends], restored[ends]) > decibels(sharp[ends], blurred[ends]) + 3


@every_method
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_psf_is_not_flipped_along_any_axis(method, axis, case, restored_by):
    sharp, blurred, psf = case
    right = decibels(sharp, restored_by(method))
    wrong = decibels(sharp, deconvolve(blurred, np.flip(psf, axis), method))
    assert right > wrong + 3


@every_method
def test_turning_a_volume_turns_the_result(method, case):
    _, blurred, psf = case
    blurred = blurred.astype(np.float64)
    expected = deconvolve(blurred, psf, method).transpose(2, 0, 1)
    turned = deconvolve(
        np.ascontiguousarray(blurred.transpose(2, 0, 1)), psf.transpose(2, 0, 1), method
    )
    # the corners of the gap belong to the first axis, whichever that is
    assert np.sqrt(np.mean((turned - expected) ** 2)) < 3e-3


@every_method
def test_a_volume_of_one_plane_is_that_plane(method):
    rng = np.random.default_rng(2)
    plane, psf = rng.random((30, 41)), as_psf(rng.random((5, 7)))
    flat = deconvolve(plane, psf, method)
    found = deconvolve(plane[None], psf[None], method)[0]
    # along an axis of length 1 there are no differences; but they count in the mean weights
    # with which SparseIrls preconditions its 16 steps
    tolerance = 0.01 if isinstance(method, SparseIrls) else 1e-9
    assert np.sqrt(np.mean((found - flat) ** 2)) < tolerance


@every_method
def test_slices_are_restored_one_by_one(method):
    rng = np.random.default_rng(3)
    psf = rng.random((5, 3))
    for shape in ((3, 20, 31), (2, 20, 31, 3)):
        stack = rng.random(shape).astype(np.float32)
        restored = deconvolve_slices(stack, psf, method)
        assert restored.shape == stack.shape
        for z in range(shape[0]):
            np.testing.assert_array_equal(restored[z], deconvolve(stack[z], psf, method))


def test_channels_of_a_volume_are_restored_one_by_one(case):
    _, blurred, psf = case
    both = np.stack([blurred, blurred[::-1]], axis=-1)
    restored = deconvolve(both, psf, Wiener())
    np.testing.assert_array_equal(restored[..., 0], deconvolve(blurred, psf, Wiener()))


def test_what_does_not_fit_together_is_refused():
    psf, volume = np.ones((3, 3, 5)), np.ones((9, 20, 30))
    with pytest.raises(CrfDeblurError, match="3 dimensions"):
        deconvolve(volume[0], psf, Wiener())
    with pytest.raises(CrfDeblurError, match="larger than the image"):
        deconvolve(volume[:2], psf, Wiener())
    with pytest.raises(CrfDeblurError, match="grayscale"):
        deconvolve(volume, np.ones((7, 9, 3)), Wiener())
    for wrong in (volume[0], volume[:0], volume[None, None]):
        with pytest.raises(ValueError, match="expected a stack"):
            deconvolve_slices(wrong, np.ones((3, 3)), Wiener())


@pytest.mark.parametrize("shape", [(2, 3, 4), (4, 5, 7), (1, 6, 2)])
def test_even_sides_of_three_dimensions_are_padded_behind(shape):
    values = np.random.default_rng(4).random(shape)
    psf = as_psf(values)
    assert psf.shape == tuple(side | 1 for side in shape)
    inside = tuple(slice(side) for side in shape)
    np.testing.assert_allclose(psf[inside], values / values.sum())
    assert psf.sum() == pytest.approx(1)
