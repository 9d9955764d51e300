"""Strength: none is the photo, 1 the method itself, more is sharper, for every method alike."""

import numpy as np
import pytest
from leaves import leaves, recorded

from napari_crfdeblur.deconvolution import (
    HyperLaplacian,
    LocalShrinkage,
    PlaneStatistics,
    RichardsonLucy,
    SparseIrls,
    Strengthened,
    Tiled,
    TotalVariation,
    Wiener,
    deconvolve,
)
from napari_crfdeblur.psf import as_psf, kernel_a

METHODS = [
    LocalShrinkage(),
    HyperLaplacian(),
    HyperLaplacian(weight=1e-3),
    Wiener(),
    Wiener(model_error=0.01),
    TotalVariation(),
    SparseIrls(iterations=2),
    RichardsonLucy(8),
    Tiled(Wiener(), side=140),
]
PSF = as_psf(kernel_a())


@pytest.fixture(scope="module")
def plane():
    sharp = leaves((110, 140), count=400, smallest=3, lights=(0.05, 0.9))
    return recorded(sharp, PSF, 0.01, seed=3).astype(np.float32)


def detail(picture):
    """Energy of the differences."""
    return float(sum(np.square(np.diff(picture, axis=axis)).sum() for axis in (0, 1)))


@pytest.mark.parametrize("method", METHODS, ids=repr)
def test_at_0_it_is_the_photo_and_at_1_the_method(method, plane):
    np.testing.assert_array_equal(deconvolve(plane, PSF, Strengthened(method, 0)), plane)
    once = deconvolve(plane, PSF, Strengthened(method, 1))
    np.testing.assert_array_equal(once, deconvolve(plane, PSF, method))


@pytest.mark.parametrize("method", METHODS, ids=repr)
def test_the_more_of_it_the_more_detail(method, plane):
    found = [deconvolve(plane, PSF, Strengthened(method, s)) for s in (0, 0.5, 1, 1.5, 2)]
    details = [detail(each) for each in found]
    assert sorted(set(details)) == details


def test_below_1_it_is_in_proportion(plane):
    whole, part = (deconvolve(plane, PSF, Strengthened(Wiener(), s)) for s in (1, 0.3))
    np.testing.assert_allclose(part - plane, 0.3 * (whole - plane), atol=1e-6)


def test_a_given_weight_falls_by_the_square(plane):
    found = deconvolve(plane, PSF, Strengthened(Wiener(weight=1e-2), 2))
    np.testing.assert_allclose(found, deconvolve(plane, PSF, Wiener(weight=3.6e-3)), atol=1e-5)


def test_richardson_lucy_takes_more_steps(plane):
    found = deconvolve(plane, PSF, Strengthened(RichardsonLucy(6), 2))
    np.testing.assert_array_equal(found, deconvolve(plane, PSF, RichardsonLucy(10)))


def test_tiles_need_not_know(plane):
    inside, outside = (
        deconvolve(plane, PSF, method)
        for method in (
            Tiled(Strengthened(LocalShrinkage(), 1.6), side=150, overlap=20),
            Strengthened(Tiled(LocalShrinkage(), side=150, overlap=20), 1.6),
        )
    )
    weak = deconvolve(plane, PSF, Tiled(LocalShrinkage(), side=150, overlap=20))
    np.testing.assert_array_equal(inside, outside)
    assert detail(outside) > detail(weak)


def test_colors_and_volumes_are_strengthened_too():
    rng = np.random.default_rng(3)
    colors, volume = (rng.random(shape, np.float32) for shape in ((40, 50, 3), (12, 30, 28)))
    for picture, psf in ((colors, PSF), (volume, as_psf(rng.random((3, 5, 5))))):
        less, once, more = (
            deconvolve(picture, psf, Strengthened(Wiener(), s)) for s in (0.4, 1, 1.7)
        )
        np.testing.assert_allclose(less - picture, 0.4 * (once - picture), atol=1e-5)
        assert detail(more) > detail(once)


@pytest.mark.parametrize("strength", [-0.1, 2.1, float("nan"), "1", None])
def test_other_strengths_are_refused(strength):
    with pytest.raises(ValueError, match="strength"):
        Strengthened(Wiener(), strength)


def test_what_is_no_method_or_strengthened_already_is_refused():
    with pytest.raises(ValueError, match="method of deconvolution"):
        Strengthened(3, 1.0)
    with pytest.raises(ValueError, match="so already"):
        Strengthened(Strengthened(Wiener()))
    with pytest.raises(ValueError, match="share of errors"):
        PlaneStatistics(0.01, 1.0, reckoned=0)
