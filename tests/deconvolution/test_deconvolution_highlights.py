"""Saturated pixels: known is only that the blurred light is not less."""

import numpy as np
import pytest
from scipy import ndimage
from scipy.signal import fftconvolve

from napari_crfdeblur.deconvolution import (
    HyperLaplacian,
    LocalShrinkage,
    RichardsonLucy,
    SparseIrls,
    TotalVariation,
    Wiener,
    deconvolve,
)
from napari_crfdeblur.deconvolution.highlights import _boxes

METHODS = [
    Wiener(),
    RichardsonLucy(),
    SparseIrls(),
    HyperLaplacian(),
    LocalShrinkage(),
    TotalVariation(),
]
every_method = pytest.mark.parametrize("method", METHODS, ids=lambda m: type(m).__name__)


def shake():
    psf = np.zeros((11, 9))
    psf[1:10, 2] = np.linspace(0.3, 1, 9)
    psf[9, 2:8] = np.linspace(1, 2, 6)
    return psf / psf.sum()


@pytest.fixture(scope="module")
def night():
    """Sharp and blurred picture with lamps, and where the camera saturated."""
    rng = np.random.default_rng(0)
    rows, columns = np.mgrid[:150, :190]
    scene = 0.1 + 0.2 * (ndimage.gaussian_filter(rng.normal(size=(150, 190)), 4) > 0)
    for row, column, radius, light in ((40, 50, 3, 20), (100, 140, 2, 8), (110, 40, 5, 5)):
        scene[(rows - row) ** 2 + (columns - column) ** 2 < radius**2] = light
    psf = shake()
    blurred = fftconvolve(scene, psf, mode="valid")
    sharp = scene[5 : 5 + blurred.shape[0], 4 : 4 + blurred.shape[1]]
    blurred += rng.normal(0, 0.003, blurred.shape)
    clipped = blurred >= 1
    return sharp, np.minimum(blurred, 1).astype(np.float32), clipped, psf


def error_around(sharp, restored, clipped):
    """Rms error of what the photo can show, near highlights and outside of lamps."""
    near = ndimage.binary_dilation(clipped, iterations=11) & (sharp < 1)
    return float(np.sqrt(np.mean((np.clip(restored, 0, 1) - sharp)[near] ** 2)))


@every_method
def test_highlights_ring_much_less_when_they_are_known(method, night):
    sharp, blurred, clipped, psf = night
    plain = error_around(sharp, deconvolve(blurred, psf, method), clipped)
    known = error_around(sharp, deconvolve(blurred, psf, method, clipped=clipped), clipped)
    # measured .30 (SparseIrls) to .75 (Wiener) of the error
    assert known < 0.85 * plain


@every_method
def test_what_is_far_from_highlights_is_as_good_as_without(method, night):
    sharp, blurred, clipped, psf = night
    far = ~ndimage.binary_dilation(clipped, iterations=45)
    plain, known = (
        np.sqrt(np.mean((deconvolve(blurred, psf, method, clipped=c) - sharp)[far] ** 2))
        for c in (None, clipped)
    )
    assert known < 1.05 * plain


@every_method
def test_no_clipped_pixels_change_nothing(method, night):
    _, blurred, clipped, psf = night
    np.testing.assert_array_equal(
        deconvolve(blurred, psf, method, clipped=np.zeros_like(clipped)),
        deconvolve(blurred, psf, method),
    )


@every_method
def test_a_picture_saturated_throughout_stays_bright(method):
    plane = np.ones((40, 51), dtype=np.float32)
    restored = deconvolve(plane, shake(), method, clipped=np.ones((40, 51), dtype=bool))
    assert np.isfinite(restored).all()
    assert restored.mean() > 0.9


def test_each_channel_has_its_own_highlights(night):
    _, blurred, clipped, psf = night
    image = np.stack([blurred, 0.5 * blurred], axis=-1)
    masks = np.stack([clipped, np.zeros_like(clipped)], axis=-1)
    restored = deconvolve(image, psf, HyperLaplacian(), clipped=masks)
    alone = deconvolve(blurred, psf, HyperLaplacian(), clipped=clipped)
    np.testing.assert_array_equal(restored[..., 0], alone)


def test_clipped_pixels_of_another_shape_or_kind_are_refused():
    plane, psf = np.ones((20, 30)), np.ones((3, 5))
    for wrong in (np.ones((20, 31), dtype=bool), np.ones((20, 30), dtype=np.uint8)):
        with pytest.raises(ValueError, match="expected clipped pixels"):
            deconvolve(plane, psf, Wiener(), clipped=wrong)


def test_only_the_neighborhood_of_highlights_is_looked_at():
    clipped = np.zeros((200, 300), dtype=bool)
    clipped[30, 40] = clipped[35, 44] = clipped[150, 299] = True
    boxes = list(_boxes(clipped, (7, 5)))
    assert len(boxes) == 2
    seen = np.zeros_like(clipped)
    for box in boxes:
        seen[box] = True
    # two sides of the PSF around each, and all of a cell of one side
    margin = ndimage.binary_dilation(clipped, np.ones((29, 21)))
    assert seen[margin].all()
    assert seen.mean() < 0.1


def test_highlights_everywhere_are_looked_at_once():
    clipped = np.random.default_rng(1).random((60, 80)) > 0.9
    assert list(_boxes(clipped, (7, 5))) == [np.s_[:60, :80]]
